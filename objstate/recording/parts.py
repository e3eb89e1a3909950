"""What is kept of each log's result, so that what is asked of a whole batch needn't read results.

Each part is made once, from one result, and kept in the index under its kind, with a stamp of what
it was made from. Where the worker that ran the log has made it already, it lies beside the result.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from objstate.errors import WorldError
from objstate.packing import pack, unpack
from objstate.recording.batches import BatchLog
from objstate.recording.index import BatchIndex
from objstate.recording.tables import ESTIMATES, SMOOTHED

BESIDE = "parts.bin"  # in a result folder: the parts that its worker made
AT_ONCE = 100  # parts that are kept in one transaction
FOOTER = 4096  # bytes at the end of a table by which a change is noticed

OnLog = Callable[[int, int], None]  # logs done, of how many


@dataclass(frozen=True)
class Part:
    """What is to be had of one log: from where, and as which version."""

    name: str  # of the log
    result: Path
    stamp: str  # of what it is made from


def parts(
    index: BatchIndex | None,
    kind: str,
    wanted: Mapping[str, Part],
    make: Callable[[str], bytes],
    on_log: OnLog | None = None,
) -> Iterator[tuple[str, bytes]]:
    """The part of each log that is wanted, by name: the kept ones first, then those that are made now.

    Without an index all are made.
    """
    missing, done = dict(wanted), 0
    index_is_mirror = index is not None and index.is_mirror  # what lies elsewhere isn't looked at
    only = next(iter(wanted)) if len(wanted) == 1 else None
    for name, stamp, content in () if index is None else index.parts(kind, only):
        if name in missing and (missing[name].stamp == stamp or index_is_mirror):
            del missing[name]
            yield name, content
            done += 1
            if on_log is not None and done % AT_ONCE == 0:
                on_log(done, len(wanted))
    fresh: list[tuple[str, str, bytes]] = []
    for name, part in missing.items():
        content = _beside(part, kind) or make(name)
        fresh.append((name, part.stamp, content))
        yield name, content
        done += 1
        if on_log is not None:
            on_log(done, len(wanted))
        if index is not None and len(fresh) == AT_ONCE:
            index.keep(kind, fresh)
            fresh = []
    if index is not None and fresh:
        index.keep(kind, fresh)


def write_beside(result: Path, made: Mapping[str, tuple[str, bytes]]) -> None:
    """Write parts, by kind with their stamps, into a result folder that is being made."""
    stamps = {kind: stamp for kind, (stamp, _) in made.items()}
    arrays = {kind: np.frombuffer(content, np.uint8) for kind, (_, content) in made.items()}
    (result / BESIDE).write_bytes(pack(stamps, arrays))


def _beside(part: Part, kind: str) -> bytes | None:
    """The part that lies beside the result, if it is of the same version."""
    try:
        stamps, arrays = unpack((part.result / BESIDE).read_bytes(), BESIDE)
    except (OSError, WorldError):
        return None
    return arrays[kind].tobytes() if stamps.get(kind) == part.stamp else None


def states_state(result: Path, filtered: bool) -> list[object]:
    """What changes when the states of a result do."""
    smoothed = result / SMOOTHED
    return _table_state(result / ESTIMATES if filtered or not smoothed.exists() else smoothed)


def _table_state(path: Path) -> list[object]:
    """A file's state and a checksum of its end, where Parquet keeps the bounds of each column."""
    state = file_state(path)
    if len(state) == 1:
        return state
    with path.open("rb") as file:
        file.seek(max(file.seek(0, os.SEEK_END) - FOOTER, 0))
        return [*state, zlib.crc32(file.read())]


def file_state(path: str | Path) -> list[object]:
    """A file's name and size; its name alone where there is none."""
    try:
        return [os.path.basename(path), os.stat(path).st_size]
    except OSError:
        return [os.path.basename(path)]


def truth_state(log: BatchLog) -> list[object] | None:
    """What changes when the truth of a log does: which files, how large, of when."""
    if log.truth is None and log.path is None:
        return None
    return [None if file is None else _dated(file) for file in (log.truth, log.path)]


def _dated(file: str) -> list[object]:
    try:
        state = os.stat(file)
    except OSError:
        return [file]
    return [file, state.st_size, state.st_mtime_ns]
