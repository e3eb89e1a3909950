"""The tables over all logs of a batch: Parquet files of some dozen logs each, by the order of names.

Which logs share a part follows from the names of those that are done, and so does each part's
content. A part begins at a log whose name's checksum says so, or where the one before is full. So
a log that comes later changes the part that it falls into and no other, but for the next few of
a stretch of full ones.
"""

from __future__ import annotations

import hashlib
import tempfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.outputs import make_folder, remove_file, remove_folder, whole
from objstate.recording.batches import PART, result_of
from objstate.recording.events import EVENTS
from objstate.recording.index import BatchIndex, Entry
from objstate.recording.mirror import FETCHES, Mirror
from objstate.recording.tables import ESTIMATES, SMOOTHED
from objstate.storage import get, listed, put, remove

if TYPE_CHECKING:
    import polars as pl

TABLES = (ESTIMATES, SMOOTHED, EVENTS)
MEAN_LOGS = 64  # of a part
MOST_LOGS = 128  # of a part
MOST_BYTES = 2**30  # of a part's logs as recorded, if there are several


@dataclass(frozen=True)
class Piece:
    """Some logs that share a file in each table."""

    names: tuple[str, ...]
    stamp: str  # of their results

    @property
    def file(self) -> str:
        """Its name in each table's folder."""
        return PART.format(first=self.names[0])


def compact(index: BatchIndex, folder: Path, entries: Mapping[str, Entry]) -> None:
    """Bring the tables up to date with the logs that are done. Raises StorageError, OutageError.

    Parts that change are removed first, so that no log is ever in two of them.
    """
    wanted = {piece.file: piece for piece in pieces(entries)}
    known = index.pieces()
    place: _Here | _There = _Here(folder)
    if (mirror := Mirror.of(folder)) is not None:
        place = _There(mirror)
    if not known:  # of an earlier version, or of an index that was removed
        place.clear()
    stale = [
        name for name, stamp in known.items() if name not in wanted or wanted[name].stamp != stamp
    ]
    for name in stale:
        index.note_piece(name, None)
        place.drop(name)
    for name, piece in wanted.items():
        if known.get(name) != piece.stamp:
            place.write(piece)
            index.note_piece(name, piece.stamp)


def pieces(entries: Mapping[str, Entry]) -> Iterator[Piece]:
    """The logs that are done, cut into pieces."""
    names: list[str] = []
    made: list[str] = []
    size = 0
    for name in sorted(entries):
        making = entries[name].making
        if entries[name].outcome.status != "done" or making is None:
            continue
        is_full = len(names) == MOST_LOGS or size + making.bytes > MOST_BYTES
        if names and (is_full or zlib.crc32(name.encode()) % MEAN_LOGS == 0):
            yield _piece(names, made)
            names, made, size = [], [], 0
        names.append(name)
        made.append(f"{name}\n{making.made_ns}\n")
        size += making.bytes
    if names:
        yield _piece(names, made)


def _piece(names: Sequence[str], made: Sequence[str]) -> Piece:
    return Piece(tuple(names), hashlib.sha256("".join(made).encode()).hexdigest())


def _joined(results: Mapping[str, Path], table: str) -> pl.DataFrame | None:
    """One table of some logs, by name; None where no result has it."""
    import polars as pl

    frames = [
        pl.scan_parquet(result / table).with_columns(log=pl.lit(name))
        for name, result in results.items()
        if (result / table).is_file()
    ]
    return pl.concat(frames, how="diagonal").collect() if frames else None


class _Here:
    """Tables in a folder of this machine."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def clear(self) -> None:
        for table in TABLES:
            remove_folder(self._folder / table)

    def drop(self, name: str) -> None:
        for table in TABLES:
            remove_file(self._folder / table / name)

    def write(self, piece: Piece) -> None:
        results = {name: result_of(self._folder, name) for name in piece.names}
        for table in TABLES:
            if (rows := _joined(results, table)) is not None:
                make_folder(self._folder / table)
                with whole(self._folder / table / piece.file, overwrite=True) as new:
                    rows.write_parquet(new)


class _There:
    """Tables of a batch at a URL; what they are made of is brought here for a moment."""

    def __init__(self, mirror: Mirror) -> None:
        self._mirror = mirror

    def clear(self) -> None:
        """There is nothing of earlier versions, and what an index forgot is written again."""

    def drop(self, name: str) -> None:
        for table in TABLES:
            remove(f"{self._mirror.address}/{table}/{name}")

    def write(self, piece: Piece) -> None:
        with tempfile.TemporaryDirectory(prefix="objstate-piece-") as home:
            results = {name: Path(home) / name for name in piece.names}
            with ThreadPoolExecutor(FETCHES) as pool:
                list(pool.map(partial(self._fetch, Path(home)), piece.names))
            for table in TABLES:
                if (rows := _joined(results, table)) is not None:
                    rows.write_parquet(Path(home) / table)
                    put(Path(home) / table, f"{self._mirror.address}/{table}/{piece.file}")

    def _fetch(self, home: Path, name: str) -> None:
        (home / name).mkdir()
        address = self._mirror.address_of(name)
        for table in set(TABLES) & set(listed(address)):
            get(f"{address}/{table}", home / name / table)
