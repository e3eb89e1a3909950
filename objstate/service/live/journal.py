"""A live drive's messages on disk, so that a crash loses nothing that was acknowledged."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from objstate.logs import Message, open_messages
from objstate.logs.definitions import IDL, MSG, ROS1, MessageType
from objstate.outputs import flush_folder

SCHEMAS = {MSG: "ros2msg", IDL: "ros2idl"}


class Journal:
    """An MCAP file that grows without chunks: what precedes a crash can be read.

    The messages keep their bytes, so that the file gives the same estimates as any other record of
    them.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._file: BinaryIO = path.open("xb")
        self._writer = _Writer(self._file, chunked=False)
        flush_folder(path.parent)

    def write(self, message: Message) -> None:
        """Append a message; it is safe after the next ``flush``."""
        self._writer.write(message)

    def flush(self) -> None:
        """Bring all to disk."""
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._writer.finish()
        self.flush()
        self._file.close()


def read_journal(path: Path) -> Iterator[Message]:
    """The messages of a journal, which may have been cut off. Raises LogError."""
    return iter(open_messages(path))


def pack(journal: Path, target: Path) -> int:
    """Write a journal as a compressed MCAP file; returns the number of messages. Raises LogError."""
    count = 0
    with target.open("wb") as file:
        writer = _Writer(file, chunked=True)
        for message in read_journal(journal):
            writer.write(message)
            count += 1
        writer.finish()
        file.flush()
        os.fsync(file.fileno())
    return count


class _Writer:
    """Writes messages, in the bytes and by the definitions with which they came."""

    def __init__(self, file: BinaryIO, *, chunked: bool) -> None:
        from mcap.writer import CompressionType, Writer

        self._writer = Writer(file, compression=CompressionType.ZSTD, use_chunking=chunked)
        self._writer.start(library="objstate")
        self._channels: dict[tuple[str, MessageType], int] = {}

    def write(self, message: Message) -> None:
        key = message.topic, message.message_type
        if key not in self._channels:
            self._channels[key] = self._add(*key)
        at = message.recorded_ns
        self._writer.add_message(self._channels[key], at, message.data, publish_time=at)

    def finish(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _add(self, topic: str, kind: MessageType) -> int:
        language = "ros1msg" if kind.wire == ROS1 else SCHEMAS[kind.language]
        text = kind.text or kind.definition
        schema = self._writer.register_schema(kind.name, language, text.encode())
        return self._writer.register_channel(topic, kind.wire, schema)
