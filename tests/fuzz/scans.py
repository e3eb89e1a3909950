"""Plain scans of logs: how many messages a reader that does nothing special would find."""

from __future__ import annotations

import gzip
import sqlite3
import struct
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import lz4.frame
import zstandard

MOST = 2**22  # bytes that a chunk unpacks to here


def plain_count(path: Path) -> int:
    """Messages that a plain scan finds, of topics that it can name."""
    content = path.read_bytes()
    if content.startswith(b"\x89MCAP0\r\n"):
        return _mcap(content)
    if content.startswith(b"#ROSBAG V2.0\n"):
        return _bag1(content)
    if content.startswith(b"SQLite format 3\x00"):
        return _sqlite(path)
    return _carmen(content)


def _mcap(content: bytes) -> int:
    schemas: set[int] = set()
    channels: set[int] = set()
    count = 0
    with suppress(struct.error, UnicodeDecodeError):
        for opcode, body in _mcap_records(content, 8):
            records = _chunk_records(body) if opcode == 6 else [(opcode, body)]
            for kind, inner in records:
                if kind == 3 and _is_used_schema(inner):
                    schemas.add(struct.unpack_from("<H", inner)[0])
                elif kind == 4:
                    number, schema = struct.unpack_from("<HH", inner)
                    encoding = _text(inner, 4 + 4 + struct.unpack_from("<I", inner, 4)[0])
                    if encoding in (b"cdr", b"ros1") and schema in schemas:
                        channels.add(number)
                elif kind == 5 and len(inner) >= 22:
                    count += struct.unpack_from("<H", inner)[0] in channels
            if opcode in (0x0F, 0x02):
                break
    return count


def _is_used_schema(body: bytes) -> bool:
    name = _text(body, 2)
    language = _text(body, 6 + len(name))
    text = _text(body, 10 + len(name) + len(language))
    for each in (name, language, text):
        each.decode()
    return language in (b"ros2msg", b"ros1msg", b"ros2idl", b"") and b"/" in name


def _text(body: bytes, at: int) -> bytes:
    (length,) = struct.unpack_from("<I", body, at)
    if at + 4 + length > len(body):
        raise struct.error
    return body[at + 4 : at + 4 + length]


def _mcap_records(data: bytes, at: int) -> Iterator[tuple[int, bytes]]:
    while at + 9 <= len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        if not opcode or at + 9 + length > len(data):
            return
        yield opcode, data[at + 9 : at + 9 + length]
        at += 9 + length


def _chunk_records(body: bytes) -> Iterator[tuple[int, bytes]]:
    _, _, _, crc = struct.unpack_from("<QQQI", body)
    method = _text(body, 28)
    (length,) = struct.unpack_from("<Q", body, 32 + len(method))
    packed = body[40 + len(method) :][:length]
    plain = _unpacked(method, packed)
    if len(packed) == length and (not crc or zlib.crc32(plain) == crc):
        yield from _mcap_records(plain, 0)


def _unpacked(method: bytes, packed: bytes) -> bytes:
    try:
        if method == b"zstd":
            return zstandard.ZstdDecompressor().stream_reader(packed).read(MOST)
        if method == b"lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(packed, MOST))
    except (zstandard.ZstdError, RuntimeError, EOFError):
        return b""
    return packed if method in (b"", b"none") else b""


def _bag1(content: bytes) -> int:
    known: set[bytes] = set()
    count = 0
    for header, data in _bag1_records(content, 13):
        kind = header.get(b"op")
        records = [(header, data)]
        if kind == b"\5":
            plain = _unpacked(header.get(b"compression", b"none"), data)
            records = list(_bag1_records(plain, 0))
        for inner, part in records:
            if inner.get(b"op") == b"\7" and b"conn" in inner:
                fields = _fields(part)
                if b"type" in fields and b"message_definition" in fields:
                    known.add(inner[b"conn"])
            elif inner.get(b"op") == b"\2" and len(inner.get(b"time", b"")) == 8:
                count += inner.get(b"conn") in known
    return count


def _bag1_records(data: bytes, at: int) -> Iterator[tuple[dict[bytes, bytes], bytes]]:
    while at + 4 <= len(data):
        (length,) = struct.unpack_from("<I", data, at)
        if not length or at + 8 + length > len(data):
            return
        header = _fields(data[at + 4 : at + 4 + length])
        at += 4 + length
        (length,) = struct.unpack_from("<I", data, at)
        if at + 4 + length > len(data):
            return
        yield header, data[at + 4 : at + 4 + length]
        at += 4 + length


def _fields(block: bytes) -> dict[bytes, bytes]:
    fields, at = {}, 0
    while at + 4 <= len(block):
        (length,) = struct.unpack_from("<I", block, at)
        name, _, value = block[at + 4 : at + 4 + length].partition(b"=")
        fields[name] = value
        at += 4 + length
    return fields


def _sqlite(path: Path) -> int:
    """Rows in the order of the file, until something is wrong."""
    database = sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)
    database.text_factory = lambda raw: raw.decode(errors="replace")
    found: set[int] = set()
    try:
        topics = database.execute("SELECT id, name, type, serialization_format FROM topics")
        known = {n for n, name, kind, wire in topics if wire == "cdr" and _are_text(name, kind)}
        steps = iter(range(200))
        database.set_progress_handler(lambda: next(steps, None) is None, 100_000)
        for row in database.execute("SELECT id, topic_id, timestamp, data FROM messages"):
            number, topic, time, data = row
            if topic in known and isinstance(time, int) and isinstance(data, bytes):
                found.add(number)
    except (sqlite3.Error, OverflowError, UnicodeDecodeError, MemoryError):
        pass
    finally:
        database.close()
    return len(found)


def _are_text(*values: object) -> bool:
    return all(isinstance(value, str) for value in values)


def _carmen(content: bytes) -> int:
    """Lines of the old lasers that hold what they announce; each makes a scan and an odometry."""
    if content.startswith(b"\x1f\x8b"):
        try:
            content = gzip.decompress(content)
        except (OSError, EOFError, zlib.error):
            return 0
    return 2 * sum(_is_scan(line.decode("latin-1").split()) for line in content.split(b"\n"))


def _is_scan(words: list[str]) -> bool:
    try:
        count = int(words[1])
        numbers = [float(word) for word in words[2 : 2 + count + 6]]
        stamp = float(words[2 + count + 6])
        logged = float(words[2 + count + 8])
    except (ValueError, IndexError):
        return False
    is_whole = count >= 2 and len(numbers) == count + 6
    is_sane = all(abs(number) < 1e8 for number in numbers)
    return words[0] in ("FLASER", "RLASER") and is_whole and is_sane and 0 < stamp < 2e9 > logged
