"""MCAP, with ROS 2 and ROS 1 messages; https://mcap.dev/spec.

Read from front to back without the index, so that a file that is cut off or has no
summary reads like any other, and damage costs no more than the chunk that it is in.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Collection, Iterator, Mapping
from os import SEEK_CUR
from pathlib import Path
from typing import BinaryIO

from objstate.logs.decompression import decompress, unpack_message
from objstate.logs.definitions import CDR, IDL, MSG, ROS1, MessageType
from objstate.logs.messages import Message, OtherEncodingsError
from objstate.logs.notices import Notices

MAGIC = b"\x89MCAP0\r\n"

FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = 0x02, 0x03, 0x04, 0x05, 0x06
STATISTICS, DATA_END = 0x0B, 0x0F
READ = (
    FOOTER,
    SCHEMA,
    CHANNEL,
    MESSAGE,
    CHUNK,
    STATISTICS,
    DATA_END,
)  # all else, such as attachments, is skipped

RECORD_HEADER = struct.Struct("<BQ")  # opcode, length
MESSAGE_HEADER = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
CHUNK_HEADER = struct.Struct("<QQQI")  # start time, end time, uncompressed size, CRC
# numbers of messages, schemas, channels, attachments, metadata and chunks; first and last log time;
# bytes of the numbers of messages by channel
STATISTICS_HEAD = struct.Struct("<QHIIIIQQI")
CHANNEL_COUNT = struct.Struct("<HQ")  # channel, messages
FOOTER_BODY = struct.Struct("<QQI")  # summary start, summary offset start, CRC

# bytes; a longer record is a damaged length, not data
LONGEST_RECORD = 4 * 2**30


class McapFile:
    """An MCAP file. Its other channels (JSON, protobuf, images) are left alone."""

    def __init__(self, path: Path, notices: Notices) -> None:
        self.path = path
        self._notices = notices
        self._size = max(path.stat().st_size, 1)
        self._position = 0
        self._languages: dict[int, tuple[str, str, str]] = {}  # schema: name, language, text
        self._channels: dict[int, tuple[str, MessageType]] = {}
        self._left_out: set[str] = set()  # encodings of channels without ROS messages
        self._speaking: set[int] | None = None  # channels with messages, where the summary has them

    @property
    def share(self) -> float:
        """How much of the file the latest iteration has read, 0..1."""
        return min(self._position / self._size, 1.0)

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic: from the summary, else by reading the file through.

        Raises OtherEncodingsError where it has channels, and none of them with ROS messages.
        """
        self._learn_from_summary()
        if not self._channels:
            notices = Notices()
            silent = McapFile(self.path, notices)
            for _ in silent.messages(topics=()):
                pass
            self._channels |= silent._channels
            self._left_out |= silent._left_out
            if not self._channels:
                for fact in notices.listed():  # what may be why nothing is found
                    self._notices.once(fact)
        if self._left_out and not self._channels:
            raise OtherEncodingsError(
                f"{self.path} holds no ROS messages: its channels are encoded as "
                f"{', '.join(sorted(self._left_out))}; record or convert them as {CDR} or {ROS1}."
            )
        return dict(self._channels.values())

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """Those of some topics that hold messages by the summary; all without one."""
        self._learn_from_summary()
        if self._speaking is None:
            return topics
        speaking = {self._channels[each][0] for each in self._speaking & self._channels.keys()}
        return speaking.intersection(topics)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Messages in the file's order, all or those of some topics."""
        with self.path.open("rb") as file:
            file.seek(len(MAGIC))
            self._position = start = len(MAGIC)
            for opcode, body in self._records(file):
                end = file.tell()
                if opcode == CHUNK:
                    for inner, part, done in self._chunk(body):
                        self._position = start + round(done * (end - start))
                        if message := self._message(inner, part, topics):
                            yield message
                elif opcode in (DATA_END, FOOTER):
                    self._position = self._size  # what follows is the index
                    return
                elif message := self._message(opcode, body, topics):
                    yield message
                self._position = start = end
        self._notices.add(
            f"{self.path.name} is cut off after {self._position} bytes: what precedes is used"
        )

    def _records(self, file: BinaryIO) -> Iterator[tuple[int, bytes]]:
        """Records of the file; the last may be a truncated chunk."""
        while len(header := file.read(RECORD_HEADER.size)) == RECORD_HEADER.size:
            opcode, length = RECORD_HEADER.unpack(header)
            if length > LONGEST_RECORD:
                return
            left = self._size - file.tell()
            if length > left and opcode != CHUNK:
                return
            if opcode in READ:
                yield opcode, file.read(min(length, left))
            else:
                file.seek(length, SEEK_CUR)

    def _chunk(self, body: bytes) -> Iterator[tuple[int, bytes, float]]:
        """The records in a chunk, each with the share of the chunk up to its end."""
        try:
            start, end, announced, crc = CHUNK_HEADER.unpack_from(body)
            method, at = _string(body, CHUNK_HEADER.size)
            (length,) = struct.unpack_from("<Q", body, at)
        except struct.error:
            return
        packed = body[at + 8 : at + 8 + length]
        is_whole = len(packed) == length
        data, damage = decompress(method, packed, announced)
        is_wrong = bool(crc) and zlib.crc32(data) != crc
        if is_whole and (damage or is_wrong):
            used = "skipped" if is_wrong else "what precedes the damage is used"
            self._notices.add(
                f"{self.path.name}: a chunk of {(end - start) / 1e9:.1f} s from "
                f"{start / 1e9:.3f} s on is damaged ({damage or 'wrong checksum'}): {used}"
            )
            if is_wrong:
                return
        yield from _records_within(data)

    def _message(self, opcode: int, body: bytes, topics: Collection[str] | None) -> Message | None:
        """The message that a record holds, if any, of the topics; other records are learnt from."""
        if opcode != MESSAGE or len(body) < MESSAGE_HEADER.size:
            self._learn(opcode, body)
            return None
        channel, _, log_time, _ = MESSAGE_HEADER.unpack_from(body)
        if channel not in self._channels:
            return None
        topic, message_type = self._channels[channel]
        if topics is not None and topic not in topics:
            return None
        data = unpack_message(body[MESSAGE_HEADER.size :])
        return Message(topic, message_type, log_time, data)

    def _learn(self, opcode: int, body: bytes) -> None:
        """Register a schema or a channel; channels without ROS messages are left out."""
        if opcode not in LEARNT:
            return
        try:
            LEARNT[opcode](self, body)
        except struct.error:
            self._notices.once(f"{self.path.name}: a damaged description of a channel was skipped")

    def _learn_schema(self, body: bytes) -> None:
        (number,) = struct.unpack_from("<H", body)
        name, at = _string(body, 2)
        language, at = _string(body, at)
        text, _ = _string(body, at)
        self._languages[number] = (name, language, text)

    def _learn_channel(self, body: bytes) -> None:
        number, schema = struct.unpack_from("<HH", body)
        topic, at = _string(body, 4)
        encoding, _ = _string(body, at)
        if encoding not in (CDR, ROS1):
            self._left_out.add(encoding)
            return
        if schema not in self._languages:
            return
        name, language, text = self._languages[schema]
        if language in LANGUAGES and "/" in name:
            message_type = MessageType(_ros2_name(name), encoding, text, LANGUAGES[language])
            self._channels[number] = (topic, message_type)

    def _learn_statistics(self, body: bytes) -> None:
        count, *_, length = STATISTICS_HEAD.unpack_from(body)
        at = STATISTICS_HEAD.size
        counts = body[at : at + length]
        if counts or not count:  # else the writer didn't count by channel
            self._speaking = {c for c, messages in CHANNEL_COUNT.iter_unpack(counts) if messages}

    def _learn_from_summary(self) -> None:
        tail = RECORD_HEADER.size + FOOTER_BODY.size + len(MAGIC)
        if self._size < tail + len(MAGIC):
            return
        with self.path.open("rb") as file:
            file.seek(-tail, 2)
            end = file.read()
            opcode, _ = RECORD_HEADER.unpack_from(end)
            start, _, _ = FOOTER_BODY.unpack_from(end, RECORD_HEADER.size)
            if not end.endswith(MAGIC) or opcode != FOOTER or not 0 < start < self._size:
                return
            file.seek(start)
            for opcode, body in self._records(file):
                self._learn(opcode, body)


LEARNT = {
    SCHEMA: McapFile._learn_schema,
    CHANNEL: McapFile._learn_channel,
    STATISTICS: McapFile._learn_statistics,
}

# MCAP's names of schema languages; a schema without one leaves it to the ROS distributions
LANGUAGES = {"ros2msg": MSG, "ros1msg": MSG, "ros2idl": IDL, "": MSG}


def _records_within(data: bytes) -> Iterator[tuple[int, bytes, float]]:
    """The complete records in a chunk's data, each with the share of the data up to its end."""
    at = 0
    while at + RECORD_HEADER.size <= len(data):
        opcode, length = RECORD_HEADER.unpack_from(data, at)
        at += RECORD_HEADER.size
        if opcode == 0 or at + length > len(data):  # no record has the opcode 0
            return
        at += length
        yield opcode, data[at - length : at], at / len(data)


def _string(body: bytes, at: int) -> tuple[str, int]:
    """A string with its length before it, and where it ends."""
    (length,) = struct.unpack_from("<I", body, at)
    return body[at + 4 : at + 4 + length].decode(errors="replace"), at + 4 + length


def _ros2_name(name: str) -> str:
    """``sensor_msgs/LaserScan`` as ROS 2 names it."""
    package, _, short = name.partition("/")
    return name if "/msg/" in name else f"{package}/msg/{short}"
