"""Decompression that gives what there is when the data is cut off."""

from __future__ import annotations

import bz2
from collections.abc import Callable
from typing import Any

from objstate.errors import LogError

ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"

# bytes fed at a time: so much compressed data before a damaged place may be lost
STEP = 4096


def decompress(method: str, data: bytes) -> tuple[bytes, str]:
    """The readable beginning of compressed ``data``, and what ended it early (empty: nothing did).

    ``method`` is ``""`` or ``"none"``, ``"bz2"``, ``"lz4"`` or ``"zstd"``. Raises LogError
    for any other.
    """
    if method in ("", "none"):
        return data, ""
    if method not in DECOMPRESSORS:
        known = ", ".join(sorted(DECOMPRESSORS))
        raise LogError(f"Compression '{method}' is unknown; rewrite the log with one of {known}.")
    feed = DECOMPRESSORS[method]()
    out: list[bytes] = []
    try:
        for start in range(0, len(data), STEP):
            out.append(feed(data[start : start + STEP]))
    except Exception as error:  # each library has its own exception types
        return b"".join(out), f"damaged {method} data ({error})"
    return b"".join(out), ""


def unpack_message(data: bytes) -> bytes:
    """A message that rosbag2 may have compressed on its own; its readable beginning if damaged.

    CDR begins with a zero, so the two can't be mistaken for each other.
    """
    return decompress("zstd", data)[0] if data.startswith(ZSTD_MAGIC) else data


def _bz2() -> Callable[[bytes], bytes]:
    return bz2.BZ2Decompressor().decompress


def _lz4() -> Callable[[bytes], bytes]:
    import lz4.frame

    decompressor: Any = lz4.frame.LZ4FrameDecompressor()
    return lambda data: bytes(decompressor.decompress(data))


def _zstd() -> Callable[[bytes], bytes]:
    import zstandard

    return zstandard.ZstdDecompressor().decompressobj().decompress


DECOMPRESSORS: dict[str, Callable[[], Callable[[bytes], bytes]]] = {
    "bz2": _bz2,
    "lz4": _lz4,
    "zstd": _zstd,
}
