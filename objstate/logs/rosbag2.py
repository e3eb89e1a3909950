"""rosbag2: a folder with ``metadata.yaml`` and one or more storage files.

The metadata is a convenience: where it is missing or names files that aren't there,
the storage files themselves are the log.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path

import yaml

from objstate.errors import LogError
from objstate.kinds import LOG, instead, kind_of
from objstate.logs.definitions import MessageType
from objstate.logs.messages import Container, Message
from objstate.logs.notices import Notices

METADATA = "metadata.yaml"
NAMES_SHOWN = 5  # so many names tell what the others are like
STORAGE_NAMES = (".db3", ".mcap", ".zstd")

OpenFile = Callable[[Path, Notices], Container]


def storage_files(folder: Path, notices: Notices) -> list[Path]:
    """The bag's storage files in order. Raises LogError where the folder holds none."""
    present = sorted(path for path in folder.iterdir() if path.suffix in STORAGE_NAMES)
    if not present:
        raise LogError(_what_it_holds(folder))
    metadata = folder / METADATA
    if not metadata.exists():
        notices.add(f"{folder.name} has no {METADATA}: all its storage files are read")
        return present
    listed = _listed_files(metadata, notices)
    if not listed:
        return present
    missing = [path for path in listed if not path.exists()]
    for path in missing:
        notices.add(f"{folder.name} lacks its part {path.name}: the others are used")
    return [path for path in listed if path.exists()] or present


def _what_it_holds(folder: Path) -> str:
    """What of a folder that is no bag may have been meant."""
    logs = sorted(path for path in folder.iterdir() if (kind_of(path) or "").startswith(LOG))
    if logs:
        names = ", ".join(path.name for path in logs[:NAMES_SHOWN])
        more = ", ..." if len(logs) > NAMES_SHOWN else ""
        return (
            f"{folder} is no bag of rosbag2, but a folder of {len(logs)} logs ({names}{more}); name one of "
            f"them, all of them if they are parts of one drive, or run each with "
            f"`objstate batch {folder}`."
        )
    return instead(folder, LOG) or (
        f"{folder} holds no bag (no .db3 or .mcap file); name the bag's folder or its file."
    )


def _listed_files(metadata: Path, notices: Notices) -> list[Path]:
    """What the metadata lists; a file compressed as a whole may be listed without its suffix."""
    try:
        content = yaml.safe_load(metadata.read_text(encoding="utf-8"))
        names = content["rosbag2_bagfile_information"]["relative_file_paths"]
        # Early releases wrote paths that begin with the bag's folder.
        paths = [metadata.parent / Path(name).name for name in names]
    except (OSError, UnicodeDecodeError, yaml.YAMLError, KeyError, TypeError) as error:
        notices.add(f"{metadata} can't be read ({error}): all storage files are read")
        return []
    return [_compressed(path) if not path.exists() else path for path in paths]


def _compressed(path: Path) -> Path:
    packed = path.with_name(path.name + ".zstd")
    return packed if packed.exists() else path


class ZstdFile:
    """A storage file that the recorder compressed as a whole; unpacked beside other temporary files."""

    def __init__(self, path: Path, notices: Notices, open_file: OpenFile) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="objstate-")
        plain = Path(self._folder.name) / path.stem
        self._unpack(path, plain, notices)
        self._container = open_file(plain, notices)

    @property
    def share(self) -> float:
        """How much of it the latest iteration has read, 0..1."""
        return self._container.share

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic."""
        return self._container.topics()

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Messages of the unpacked file."""
        return self._container.messages(topics)

    def _unpack(self, packed: Path, plain: Path, notices: Notices) -> None:
        import zstandard

        with packed.open("rb") as source, plain.open("wb") as sink:
            try:
                zstandard.ZstdDecompressor().copy_stream(source, sink)
            except zstandard.ZstdError as error:
                notices.add(f"{packed.name} is damaged ({error}): what precedes is used")
