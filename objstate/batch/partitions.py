"""The tables over all logs: folders with a partition for each log, the result's own file."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path

from objstate.errors import StorageError
from objstate.outages import outage_of
from objstate.outputs import flush_folder, make_folder, remove_folder, whole
from objstate.recording.batches import PART, PARTITION, result_of
from objstate.recording.events import EVENTS
from objstate.recording.tables import ESTIMATES, SMOOTHED

TABLES = (ESTIMATES, SMOOTHED, EVENTS)


def link_tables(folder: Path, names: Iterable[str]) -> None:
    """Put the tables of some results among the combined ones, in the place of older ones.

    Results of earlier versions have estimates alone. Raises StorageError.
    """
    chosen = list(names)
    for table in TABLES:
        combined = folder / table
        if not combined.is_dir():
            make_folder(combined)
        try:
            for name in chosen:
                _place(result_of(folder, name) / table, combined / f"{PARTITION}{name}")
            if chosen:
                flush_folder(combined)
        except OSError as error:
            raise _unwritable(combined, error) from error


def unlink_tables(folder: Path, names: Iterable[str]) -> None:
    """Take the tables of some logs out of the combined ones. Raises StorageError."""
    for name in names:
        for table in TABLES:
            remove_folder(folder / table / f"{PARTITION}{name}")


def _place(source: Path, partition: Path) -> None:
    if not source.exists():
        remove_folder(partition)
        return
    with suppress(FileExistsError):
        partition.mkdir()
    with whole(partition / PART, overwrite=True) as new:
        try:
            os.link(source, new)
        except OSError:  # a file system that has no links
            shutil.copyfile(source, new)


def _unwritable(place: Path, error: OSError) -> StorageError:
    outage = outage_of(error)
    return StorageError(
        f"Can't write {place}: {error.strerror}.", outage is not None and outage.transient
    )
