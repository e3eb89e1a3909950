"""Arrays and their description as one string of bytes with a checksum."""

from __future__ import annotations

import json
import math
import struct
import zlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from objstate.errors import WorldError

MAGIC = b"OST"
VERSION = 1
HEAD = struct.Struct("<3sBI")  # magic, version, CRC-32 of what follows
WORDS = struct.Struct("<I")  # length of the description
COMPRESSION = 6  # of zlib; higher levels cost time and save nothing on samples

Arrays = Mapping[str, np.ndarray]


def pack(words: Mapping[str, Any], arrays: Arrays) -> bytes:
    """Pack a JSON description, and arrays of any type and shape."""
    layout = {name: [a.dtype.str, list(a.shape)] for name, a in arrays.items()}
    text = json.dumps({"words": words, "arrays": layout}).encode()
    content = [WORDS.pack(len(text)), text, *(a.tobytes() for a in arrays.values())]
    body = zlib.compress(b"".join(content), COMPRESSION)
    return HEAD.pack(MAGIC, VERSION, zlib.crc32(body)) + body


def unpack(packed: bytes, what: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """The arguments of ``pack``. Raises WorldError for damage or a newer version.

    ``what`` is named in the message.
    """
    if len(packed) < HEAD.size:
        raise _damaged(what)
    magic, version, checksum = HEAD.unpack_from(packed)
    body = packed[HEAD.size :]
    if magic != MAGIC or (version <= VERSION and zlib.crc32(body) != checksum):
        raise _damaged(what)
    if version > VERSION:
        raise WorldError(
            f"{what} was written by a newer objstate (form {version}; this one reads up to "
            f"{VERSION}); update objstate."
        )
    return _split(zlib.decompress(body))


def _split(content: bytes) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    (length,) = WORDS.unpack_from(content)
    place = WORDS.size + length
    description = json.loads(content[WORDS.size : place])
    arrays = {}
    for name, (kind, shape) in description["arrays"].items():
        count = math.prod(shape)
        arrays[name] = np.frombuffer(content, kind, count, place).reshape(shape)
        place += arrays[name].nbytes
    return description["words"], arrays


def _damaged(what: str) -> WorldError:
    return WorldError(f"{what} is damaged: its checksum is wrong; restore the world from a copy.")
