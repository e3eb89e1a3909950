"""Watched places: folders and addresses where a recorder drops logs."""

from __future__ import annotations

import logging
import shutil
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from glob import has_magic
from pathlib import Path
from typing import Any

from sqlalchemy import insert, select

from objstate.archives import zip_folder
from objstate.batch.addresses import fetched, logs_at, size_of
from objstate.errors import LogError, ObjstateError
from objstate.logs import open_messages
from objstate.service.drives import Drive, Drives
from objstate.service.problems import Problem
from objstate.service.tables import TAKEN
from objstate.storage import is_remote
from objstate.world.database import Database

SHOWN = 100  # logs that were taken
LOOKED_EVERY_S = 5.0  # a log whose size is the same at two looks is finished

logger = logging.getLogger(__name__)


class Watch:
    """Takes each log of some places once, in the order of their names."""

    def __init__(
        self,
        places: Sequence[str],
        database: Database,
        drives: Drives,
        on_queued: Callable[[Drive], None],
        every_s: float = LOOKED_EVERY_S,
    ) -> None:
        self._places, self._database, self._drives = places, database, drives
        self._on_queued, self._every_s = on_queued, every_s
        self._sizes: dict[str, int] = {}  # at the last look
        self._told: dict[str, str] = {}  # by place: why it can't be looked at
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._work, name="watched places", daemon=True)

    def start(self) -> None:
        if self._places:
            self._thread.start()

    def end(self) -> None:
        """Stop; a log that is being fetched is fetched again at the next start."""
        self._ended.set()

    def look(self) -> None:
        """Look at all places once, and take what is finished."""
        for place in self._places:
            try:
                for address in _logs_in(place):
                    if self._ended.is_set():
                        return
                    self._look_at(address)
            except ObjstateError as error:
                if self._told.get(place) != str(error):
                    logger.warning("the watched place %s: %s", place, error)
                    self._told[place] = str(error)

    def words(self) -> dict[str, Any]:
        """The places, and what was found there last, the newest first."""
        c = TAKEN.c
        query = select(c.address, c.size, c.drive, c.reason, c.taken_ns)
        with self._database.reading() as connection:
            rows = connection.execute(query.order_by(c.taken_ns.desc()).limit(SHOWN)).all()
        return {"places": list(self._places), "taken": [dict(row._mapping) for row in rows]}

    def _work(self) -> None:
        while not self._ended.is_set():
            self.look()
            self._ended.wait(self._every_s)

    def _look_at(self, address: str) -> None:
        size = size_of(address)
        is_finished = self._sizes.get(address) == size
        self._sizes[address] = size
        if not is_finished or self._is_taken(address, size):
            return
        drive, reason = None, None
        try:
            with tempfile.TemporaryDirectory() as folder:
                drive = self._drives.adopt(self._fetched(address, Path(folder)))
        except Problem as problem:
            reason = problem.detail
        except ObjstateError as error:
            reason = str(error)
        if reason is not None:
            logger.warning("%s is set aside: %s", address, reason)
        row = {"address": address, "size": size, "reason": reason, "taken_ns": time.time_ns()}
        with self._database.writing() as connection:
            identity = None if drive is None else drive.id
            connection.execute(insert(TAKEN).values(drive=identity, **row))
        if drive is not None:
            logger.info("%s is the drive %s", address, drive.id)
            self._on_queued(drive)

    def _is_taken(self, address: str, size: int) -> bool:
        query = select(TAKEN.c.address).where(TAKEN.c.address == address, TAKEN.c.size == size)
        with self._database.reading() as connection:
            return connection.execute(query).first() is not None

    def _fetched(self, address: str, folder: Path) -> Path:
        """A copy of a log in the data folder; a bag of several files in an archive. Raises LogError."""
        source = fetched(address, folder) if is_remote(address) else Path(address)
        target = self._drives.place()
        if source.is_dir():
            zip_folder(source, target)
        else:
            open_messages(source)  # what is no log at all is set aside
            shutil.copyfile(source, target)
        return target


def _logs_in(place: str) -> list[str]:
    """The logs of a place, where none may have been dropped yet. Raises LogError, OutageError."""
    found = logs_at(place)
    if not found and not (is_remote(place) or has_magic(place) or Path(place).exists()):
        raise LogError(f"There is no folder {place}; make it, or watch another.")
    return found
