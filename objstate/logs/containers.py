"""Opening recorded files: the reader is chosen by what a file holds, not by its name."""

from __future__ import annotations

import gzip
import heapq
import zlib
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from operator import attrgetter
from pathlib import Path

from objstate.errors import LogError
from objstate.kinds import LOG, instead
from objstate.logs.carmen import CarmenFile, is_carmen
from objstate.logs.decompression import ZSTD_MAGIC
from objstate.logs.definitions import MessageType
from objstate.logs.mcap import MAGIC as MCAP_MAGIC
from objstate.logs.mcap import McapFile
from objstate.logs.messages import Container, Message, OtherEncodingsError
from objstate.logs.notices import Notices
from objstate.logs.rosbag1 import MAGIC as ROSBAG1_MAGIC
from objstate.logs.rosbag1 import Rosbag1File
from objstate.logs.rosbag2 import ZstdFile, is_bag, storage_files
from objstate.logs.sqlite import MAGIC as SQLITE_MAGIC
from objstate.logs.sqlite import SqliteFile

GZIP_MAGIC = b"\x1f\x8b"

# bytes read to recognize a CARMEN log, which is text, by its lines
HEAD = 65536

READERS: dict[bytes, Callable[[Path, Notices], Container]] = {
    MCAP_MAGIC: McapFile,
    ROSBAG1_MAGIC: Rosbag1File,
    SQLITE_MAGIC: SqliteFile,
    ZSTD_MAGIC: lambda path, notices: ZstdFile(path, notices, _open_file),
}

# what unpacks a file that was packed as a whole, by the bytes that it begins with
UNPACKERS = {
    GZIP_MAGIC: "gunzip",
    b"BZh": "bunzip2",
    b"\xfd7zXZ\x00": "unxz",
    b"\x04\x22\x4d\x18": "unlz4",
    b"PK\x03\x04": "unzip",
    b"7z\xbc\xaf\x27\x1c": "7z x",
}
TAR_MAGIC, TAR_AT = b"ustar", 257

ENDINGS = (".mcap", ".bag", ".db3")  # files that are meant as logs, also where they are damaged

Paths = Path | str | Sequence[Path | str]


class Messages:
    """The messages of one drive, recorded in one part or several, in recorded order.

    Every iteration reads from the beginning.
    """

    def __init__(
        self, paths: Sequence[Path], topics: Collection[str] | None, notices: Notices
    ) -> None:
        self._notices = notices
        self._chosen = topics
        files = [file for path in paths for file in _files(path, notices)]
        _refuse_twice(files)
        self._parts = [_open_file(file, notices) for file in files]
        self._sizes = [file.stat().st_size for file in files]

    @property
    def warnings(self) -> list[str]:
        """What is wrong with the files, as far as they have been read."""
        return self._notices.listed()

    @property
    def share(self) -> float:
        """How much of the files the latest iteration has read, 0..1."""
        done = sum(part.share * size for part, size in zip(self._parts, self._sizes, strict=True))
        return done / max(sum(self._sizes), 1)

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic.

        Raises LogError where no part holds ROS messages, and one says why.
        """
        found: dict[str, MessageType] = {}
        others: OtherEncodingsError | None = None
        for part in self._parts:
            try:
                found |= part.topics()
            except OtherEncodingsError as error:
                others = error
        if others is not None and not found:
            raise others
        return {
            topic: message_type
            for topic, message_type in found.items()
            if self._chosen is None or topic in self._chosen
        }

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """Those of some topics to wait for in any part when looking ahead."""
        return {topic for part in self._parts for topic in part.awaited(topics)}

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """The messages, all or those of some topics."""
        wanted = self._chosen if topics is None else topics
        parts = [part.messages(wanted) for part in self._parts]
        return heapq.merge(*parts, key=attrgetter("recorded_ns"))

    def __iter__(self) -> Iterator[Message]:
        return self.messages()


def open_messages(
    paths: Paths, topics: Collection[str] | None = None, notices: Notices | None = None
) -> Messages:
    """Open recorded files or bag folders as one stream of undecoded messages.

    Raises LogError for a path that is missing, empty or of no known format.
    """
    return Messages(as_paths(paths), topics, notices or Notices())


def is_log(path: Path) -> bool:
    """Whether a file, by its content or its name, or a folder, by its files' names, is one log."""
    if path.is_dir():
        return is_bag(
            path.absolute().name, [each.name for each in path.iterdir() if each.is_file()]
        )
    if path.suffix in ENDINGS:
        return True
    if not path.is_file():
        return False  # a link that leads nowhere, a pipe that would never end
    head = _head(path)
    zipped = head.startswith(GZIP_MAGIC)
    return head.startswith(tuple(READERS)) or is_carmen(_unzipped_head(path) if zipped else head)


def as_paths(paths: Paths) -> list[Path]:
    """One path or several, as a list. Raises LogError for none, TypeError for what is no path."""
    if isinstance(paths, str | Path):
        return [Path(paths)]
    if not paths:
        raise LogError("No log was named; name a file or a bag's folder.")
    named = list(paths) if isinstance(paths, Iterable) else [paths]
    for path in named:
        if not isinstance(path, str | Path):
            raise TypeError(f"A {type(path).__name__} is no path of a log; give one, or a list.")
    return [Path(path) for path in named]


def _files(path: Path, notices: Notices) -> list[Path]:
    if not path.exists():
        raise LogError(f"There is no log at {path}; check the path.")
    if not path.is_file() and not path.is_dir():
        raise LogError(
            f"{path} is a pipe or a device, and a log is read several times; write it to a file, and "
            "name that."
        )
    return storage_files(path, notices) if path.is_dir() else [path]


def _refuse_twice(files: Sequence[Path]) -> None:
    """A part that is named twice would count twice as evidence. Raises LogError."""
    known: set[Path] = set()
    for file in files:
        if file.resolve() in known:
            raise LogError(f"{file} is named twice; name each part of a drive once.")
        known.add(file.resolve())


def _open_file(path: Path, notices: Notices) -> Container:
    head = _head(path)
    if not head:
        raise LogError(f"{path} is empty; the recording never began, or the copy failed.")
    for magic, reader in READERS.items():
        if head.startswith(magic):
            return reader(path, notices)
    if is_carmen(_unzipped_head(path) if head.startswith(GZIP_MAGIC) else head):
        return CarmenFile(path, notices)
    if head.startswith(b"#ROSBAG V"):
        version = head.split(b"\n")[0][8:].decode(errors="replace")
        raise LogError(f"{path} is a bag of version {version}; run `rosbag fix` to make it 2.0.")
    if unpacker := _unpacker(head):
        raise LogError(f"{path} is packed as a whole; unpack it with `{unpacker}`.")
    if told := instead(path, LOG):
        raise LogError(told)
    raise LogError(
        f"{path} is no log that objstate knows: neither MCAP, rosbag1, rosbag2 nor CARMEN. "
        "If it is another format, convert it to MCAP."
    )


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(HEAD)
    except OSError as error:
        raise LogError(f"{path} can't be read: {error.strerror}.") from error


def _unpacker(head: bytes) -> str | None:
    """The command that unpacks a file with this beginning, if it is packed."""
    if head[TAR_AT:].startswith(TAR_MAGIC):
        return "tar xf"
    return next((name for magic, name in UNPACKERS.items() if head.startswith(magic)), None)


def _unzipped_head(path: Path) -> bytes:
    """The first line or so of a gzip file; as much as there is if it is damaged."""
    try:
        with gzip.open(path, "rb") as file:
            return file.read1(HEAD)
    except (EOFError, zlib.error, gzip.BadGzipFile):
        return b""
