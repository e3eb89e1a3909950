"""rosbag2: a folder with ``metadata.yaml`` and one or more storage files.

The metadata is a convenience: where it is missing or names files that aren't there,
the storage files themselves are the log.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from objstate.errors import LogError
from objstate.kinds import LOG, instead, kind_of
from objstate.logs.decompression import MOST_RATIO, most_unpacked
from objstate.logs.definitions import MessageType
from objstate.logs.messages import Container, Message
from objstate.logs.notices import Notices
from objstate.yaml_files import YamlError, read_yaml

METADATA = "metadata.yaml"
NAMES_SHOWN = 5  # most names in a list
STORAGE_NAMES = (".db3", ".mcap", ".zstd")

OpenFile = Callable[[Path, Notices], Container]


def is_bag(folder: str, names: Collection[str]) -> bool:
    """Whether a folder of this name that holds files of these names is one bag.

    A recorder that is killed leaves no metadata, but the parts of ``drive`` are still called
    ``drive_0.mcap``, ``drive_1.mcap``.
    """
    parts = [name for name in names if name.endswith(STORAGE_NAMES)]
    part = re.compile(re.escape(folder) + r"_\d+\.(db3|mcap)(\.zstd)?")
    return METADATA in names or (bool(parts) and all(map(part.fullmatch, parts)))


def storage_files(folder: Path, notices: Notices) -> list[Path]:
    """The bag's storage files in order.

    Raises LogError where the folder holds none, or several that are no parts of one bag.
    """
    inner = sorted(folder.iterdir())
    present = [path for path in inner if path.suffix in STORAGE_NAMES and path.is_file()]
    is_one = len(present) == 1 or is_bag(folder.absolute().name, [path.name for path in inner])
    if not present or not is_one:
        raise LogError(_what_it_holds(folder, present))
    metadata = folder / METADATA
    if not metadata.exists():
        notices.add(f"{folder.name} has no {METADATA}: all its storage files are read")
        return present
    try:
        names = _relative_file_paths(read_yaml(metadata))
    except (OSError, YamlError) as error:
        notices.add(f"{metadata} can't be read ({error}): all storage files are read")
        return present
    return _listed(names, present, folder, notices)


def _what_it_holds(folder: Path, present: Sequence[Path]) -> str:
    """What of a folder that is no bag may have been meant."""
    others = (path for path in folder.iterdir() if (kind_of(path) or "").startswith(LOG))
    logs = sorted({*present, *others})
    if logs:
        names = ", ".join(path.name for path in logs[:NAMES_SHOWN])
        more = ", ..." if len(logs) > NAMES_SHOWN else ""
        return (
            f"{folder} is no bag of rosbag2, but a folder of {len(logs)} logs ({names}{more}); "
            "name one of them, all of them if they are parts of one drive, or run each with "
            f"`objstate batch {folder}`."
        )
    return instead(folder, LOG) or (
        f"{folder} holds no bag (no .db3 or .mcap file); name the bag's folder or its file."
    )


def _listed(names: list[str], present: list[Path], folder: Path, notices: Notices) -> list[Path]:
    """Of the present files those that the metadata lists; all if it lists none of them.

    A file that was compressed as a whole may be listed without its suffix.
    """
    known = {path.name.removesuffix(".zstd"): path for path in present}
    known |= {path.name: path for path in present}
    found: dict[Path, None] = {}
    for name in dict.fromkeys(names):
        if name in known:
            found[known[name]] = None
        else:
            notices.add(f"{folder.name} lacks its part {name}: the others are used")
    return list(found) or present


def _relative_file_paths(content: Any) -> list[str]:
    """The names that the metadata lists. Raises YamlError where it has no such list."""
    try:
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
    except (LookupError, TypeError) as error:
        raise YamlError("it has no rosbag2_bagfile_information: relative_file_paths") from error
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise YamlError("relative_file_paths is no list of names")
    return [Path(name).name for name in names]  # early releases put the bag's folder before them


class ZstdFile:
    """A storage file that was compressed as a whole, unpacked to a temporary file."""

    def __init__(self, path: Path, notices: Notices, open_file: OpenFile) -> None:
        self.path = path
        self._folder = tempfile.TemporaryDirectory(prefix="objstate-")
        self._plain = Path(self._folder.name) / path.name
        self._unpack(notices)
        with self._named():
            self._container = open_file(self._plain, notices)

    @property
    def share(self) -> float:
        """How much of it the latest iteration has read, 0..1."""
        return self._container.share

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic."""
        with self._named():
            return self._container.topics()

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """Those of some topics that may hold messages."""
        with self._named():
            return self._container.awaited(topics)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Messages of the unpacked file."""
        with self._named():
            yield from self._container.messages(topics)

    @contextmanager
    def _named(self) -> Iterator[None]:
        """Errors name the file that the user gave."""
        try:
            yield
        except LogError as error:
            raise LogError(
                str(error).replace(str(self._plain), f"{self.path}, unpacked,")
            ) from error

    def _unpack(self, notices: Notices) -> None:
        import zstandard

        name = self.path.name
        left = most_unpacked(self.path.stat().st_size)
        with self.path.open("rb") as source, self._plain.open("wb") as sink:
            pieces = zstandard.ZstdDecompressor().read_to_iter(source)
            try:
                for piece in pieces:
                    sink.write(piece[:left])
                    left -= len(piece)
                    if left < 0:
                        notices.add(
                            f"{name} unpacks to more than {MOST_RATIO} times its size, which no "
                            "recording does: what precedes is used; unpack it with `zstd -d` if it "
                            "is right"
                        )
                        return
            except zstandard.ZstdError as error:
                notices.add(f"{name} is damaged ({error}): what precedes is used")
