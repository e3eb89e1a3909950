"""Decompression that returns what is readable of truncated data, with bounded output."""

from __future__ import annotations

import bz2
import io
from collections.abc import Callable
from typing import Any

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"

# bytes that a chunk or message may unpack to. Recorders close a chunk at some megabytes (rosbag
# 0.75, rosbag2 0.75, Foxglove 4) or after the message that passes this; the longest messages,
# pictures and point clouds, have some tens of megabytes. Compressed zeros unpack to 30,000 times
# their length.
MOST_UNPACKED = 128 * 2**20
# bytes; a chunk whose header announces less may unpack to this much: the header may be damaged
USUAL_CHUNK = 4 * 2**20

# a whole file may unpack to this multiple of its length, and always to this many bytes: recorded
# data
# compress to between a half and a thirtieth
MOST_RATIO = 100
LEAST_BOUND = 256 * 2**20

# bytes of compressed data, and of plain data, at a time: the loss before a damaged place
STEP = 4096
PIECE = 2**18


def decompress(method: str, data: bytes, announced: int = MOST_UNPACKED) -> tuple[bytes, str]:
    """The readable beginning of compressed ``data``, and what ended it early (empty: nothing did).

    ``method`` is ``""`` or ``"none"``, ``"bz2"``, ``"lz4"`` or ``"zstd"``. No more is unpacked than
    ``announced``, by the chunk's header, and never more than ``MOST_UNPACKED`` bytes.
    """
    if method in ("", "none"):
        return data, ""
    if method not in DECOMPRESSORS:
        known = ", ".join(sorted(DECOMPRESSORS))
        return b"", f"compression '{method}' is unknown; rewrite the log with one of {known}"
    most = min(max(announced, USUAL_CHUNK), MOST_UNPACKED)
    read = DECOMPRESSORS[method](data)
    out = bytearray()
    try:
        while piece := read(min(PIECE, most + 1 - len(out))):
            out += piece
            if len(out) > most:
                del out[most:]
                return bytes(out), f"more than {most} bytes of {method} data"
    except Exception as error:  # each library has its own exception types
        return bytes(out), f"damaged {method} data ({error})"
    return bytes(out), ""


def unpack_message(data: bytes) -> bytes:
    """A message that rosbag2 may have compressed on its own; its readable beginning if damaged.

    CDR begins with a zero, so the two can't be mistaken for each other.
    """
    return decompress("zstd", data)[0] if data.startswith(ZSTD_MAGIC) else data


def most_unpacked(packed: int) -> int:
    """Bytes that a file of ``packed`` bytes may unpack to."""
    return max(MOST_RATIO * packed, LEAST_BOUND)


# returns the next plain bytes, up to a limit; none at the end
Read = Callable[[int], bytes]


def _fed(decompressor: Any, data: bytes) -> Read:
    """Reads from a decompressor that takes compressed bytes and a limit to what it gives."""
    position = 0

    def read(most: int) -> bytes:
        nonlocal position
        while not decompressor.eof:
            fresh = b""
            if decompressor.needs_input:
                fresh = data[position : position + STEP]
                if not fresh:
                    return b""
                position += len(fresh)
            if piece := bytes(decompressor.decompress(fresh, most)):
                return piece
        return b""

    return read


def _bz2(data: bytes) -> Read:
    return _fed(bz2.BZ2Decompressor(), data)


def _lz4(data: bytes) -> Read:
    import lz4.frame

    return _fed(lz4.frame.LZ4FrameDecompressor(), data)


def _zstd(data: bytes) -> Read:
    import zstandard

    reader = zstandard.ZstdDecompressor().stream_reader(io.BytesIO(data), read_size=STEP)
    return lambda most: reader.read(min(most, STEP))


DECOMPRESSORS: dict[str, Callable[[bytes], Read]] = {"bz2": _bz2, "lz4": _lz4, "zstd": _zstd}
