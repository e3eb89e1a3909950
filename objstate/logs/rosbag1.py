"""rosbag format 2.0, the bags of ROS 1; http://wiki.ros.org/Bags/Format/2.0.

Read from front to back without the index: a bag that was never closed, or is cut
short, has none.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from objstate.logs.decompression import decompress
from objstate.logs.definitions import ROS1, MessageType
from objstate.logs.messages import Message
from objstate.logs.notices import Notices

MAGIC = b"#ROSBAG V2.0\n"

MESSAGE, BAG_HEADER, INDEX, CHUNK, CHUNK_INFO, CONNECTION = 2, 3, 4, 5, 6, 7

UINT32 = struct.Struct("<I")
COUNT = struct.Struct("<II")  # connection, messages
TIME = struct.Struct("<II")  # seconds, nanoseconds

# bytes; a longer record is a damaged length, not data
LONGEST_RECORD = 2**31

Header = dict[bytes, bytes]


class Rosbag1File:
    """A bag of ROS 1; chunks plain, bz2 or lz4."""

    def __init__(self, path: Path, notices: Notices) -> None:
        self.path = path
        self._notices = notices
        self._size = max(path.stat().st_size, 1)
        self._position = 0
        self._connections: dict[bytes, tuple[str, MessageType]] = {}
        self._speaking: set[bytes] | None = (
            None  # connections with messages, where the index is whole
        )

    @property
    def share(self) -> float:
        """How much of the file the latest iteration has read, 0..1."""
        return min(self._position / self._size, 1.0)

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic: from the index, or by reading the bag through if that lacks some."""
        count = self._learn_from_index()
        if len(self._connections) < max(count, 1):
            silent = Rosbag1File(self.path, Notices())
            for _ in silent.messages(topics=()):
                pass
            self._connections |= silent._connections
        return dict(self._connections.values())

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """Those of some topics that hold messages by the index; all without a whole one."""
        self._learn_from_index()
        if self._speaking is None:
            return topics
        speaking = {
            self._connections[each][0] for each in self._speaking & self._connections.keys()
        }
        return speaking.intersection(topics)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Messages in the bag's order, all or those of some topics."""
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            self._position = len(MAGIC)
            has_index = False
            for header, data, is_whole in _records(file):
                start, self._position = self._position, file.tell()
                end = self._position
                kind = _kind(header)
                has_index |= kind == CHUNK_INFO
                if kind == CHUNK:
                    for inner, part, done in self._chunk(header, data, is_whole):
                        self._position = start + round(done * (end - start))
                        yield from self._message(inner, part, topics)
                    self._position = end
                elif is_whole:
                    yield from self._message(header, data, topics)
        if not has_index or self._position < self._size:
            self._notices.add(
                f"{self.path.name} has no index or is cut off (read up to byte "
                f"{self._position} of {self._size}): what is there is used"
            )

    def _chunk(
        self, header: Header, data: bytes, is_whole: bool
    ) -> Iterator[tuple[Header, bytes, float]]:
        """The records in a chunk, each with the share of the chunk up to its end."""
        method = header.get(b"compression", b"none").decode(errors="replace")
        announced = int.from_bytes(header.get(b"size", b""), "little")
        plain, damage = decompress(method, data, announced)
        if damage and is_whole:
            self._notices.add(
                f"{self.path.name}: the chunk before byte {self._position} is damaged ({damage}): "
                "what precedes the damage is used"
            )
        yield from _records_within(plain)

    def _message(
        self, header: Header, data: bytes, topics: Collection[str] | None
    ) -> Iterator[Message]:
        kind = _kind(header)
        if kind == CONNECTION:
            self._learn(header, data)
        elif kind == MESSAGE and header.get(b"conn") in self._connections:
            topic, message_type = self._connections[header[b"conn"]]
            if (topics is None or topic in topics) and len(header.get(b"time", b"")) == TIME.size:
                seconds, nanoseconds = TIME.unpack(header[b"time"])
                yield Message(topic, message_type, seconds * 10**9 + nanoseconds, data)

    def _learn(self, header: Header, data: bytes) -> None:
        connection = _fields(data)
        if b"conn" not in header or not {b"type", b"message_definition"} <= connection.keys():
            self._notices.once(f"{self.path.name}: a damaged description of a topic was skipped")
            return
        topic = header.get(b"topic", connection.get(b"topic", b"")).decode(errors="replace")
        package, _, short = connection[b"type"].decode(errors="replace").partition("/")
        text = connection[b"message_definition"].decode(errors="replace")
        name = f"{package}/msg/{short}"
        self._connections[header[b"conn"]] = (topic, MessageType(name, ROS1, text))

    def _learn_from_index(self) -> int:
        """Learn the topics in the index, which may be cut off; how many there should be."""
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            header, _, _ = next(_records(file), ({}, b"", False))
            index = int.from_bytes(header.get(b"index_pos", b""), "little")
            if _kind(header) != BAG_HEADER or not 0 < index < self._size:
                return 0
            file.seek(index)
            chunks, speaking = 0, set[bytes]()
            for inner, data, is_whole in _records(file):
                if is_whole and _kind(inner) == CONNECTION:
                    self._learn(inner, data)
                elif is_whole and _kind(inner) == CHUNK_INFO:
                    chunks += 1
                    speaking |= _speaking(data)
            if chunks == int.from_bytes(header.get(b"chunk_count", b""), "little"):
                self._speaking = speaking
            return int.from_bytes(header.get(b"conn_count", b""), "little")


def _records(file: BinaryIO) -> Iterator[tuple[Header, bytes, bool]]:
    """Header and data of each record, and whether all of the data is there."""
    while (header := _block(file)) is not None and header[1]:
        data = _block(file)
        if data is None:
            return
        yield _fields(header[0]), *data


def _block(file: BinaryIO) -> tuple[bytes, bool] | None:
    """The next length and that many bytes, and whether all are there; None without a block."""
    size = file.read(UINT32.size)
    if len(size) < UINT32.size:
        return None
    (length,) = UINT32.unpack(size)
    if length > LONGEST_RECORD:
        return None
    left = os.fstat(file.fileno()).st_size - file.tell()
    return file.read(min(length, left)), length <= left


def _records_within(data: bytes) -> Iterator[tuple[Header, bytes, float]]:
    """The complete records in a chunk's data, each with the share of the data up to its end."""
    at = 0
    while at + UINT32.size <= len(data):
        (header_length,) = UINT32.unpack_from(data, at)
        if not header_length:
            return  # every record has a header
        start = at + UINT32.size + header_length
        if start + UINT32.size > len(data):
            return
        (length,) = UINT32.unpack_from(data, start)
        end = start + UINT32.size + length
        if end > len(data):
            return
        yield (
            _fields(data[at + UINT32.size : start]),
            data[start + UINT32.size : end],
            end / len(data),
        )
        at = end


def _fields(block: bytes) -> Header:
    """``name=value`` fields, each with its length before it; a damaged rest is left out."""
    fields: Header = {}
    at = 0
    while at + UINT32.size <= len(block):
        (length,) = UINT32.unpack_from(block, at)
        at += UINT32.size
        name, _, value = block[at : at + length].partition(b"=")
        fields[name] = value
        at += length
    return fields


def _speaking(counts: bytes) -> set[bytes]:
    """The connections with messages in a chunk, by what the index has of it."""
    whole = counts[: len(counts) // COUNT.size * COUNT.size]
    return {UINT32.pack(conn) for conn, messages in COUNT.iter_unpack(whole) if messages}


def _kind(header: Header) -> int:
    return int.from_bytes(header.get(b"op", b""), "little")
