"""The robots that are driving, and what becomes of their drives."""

from __future__ import annotations

import asyncio
import logging
import re
import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from objstate.errors import ObjstateError
from objstate.logs import Message
from objstate.outputs import make_folder, remove_file
from objstate.service.drives import Drive, Drives
from objstate.service.live.drive import LiveDrive
from objstate.service.live.journal import pack
from objstate.service.live.options import LiveContext, LiveLimits
from objstate.service.problems import Problem

NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}")
MOST_ROBOTS = 64
TICK_S = 0.5

logger = logging.getLogger(__name__)

News = Callable[[LiveDrive, str, Any], None]


class Robots:
    """One live drive for each robot that sends. A finished one is queued as any other drive."""

    def __init__(
        self,
        folder: Path,
        drives: Drives,
        context: LiveContext,
        limits: LiveLimits,
        news: News,
        on_queued: Callable[[Drive, str], None],
    ) -> None:
        self._folder, self._drives, self._context, self._limits = folder, drives, context, limits
        self._news, self._on_queued = news, on_queued
        self._lock = threading.Lock()
        self._driving: dict[str, LiveDrive] = {}
        make_folder(folder)

    def take(self, robot: str, messages: Sequence[Message], *, keep: bool = False) -> LiveDrive:
        """Take messages of a robot; on disk when it returns, with ``keep``. Raises Problem."""
        drive = self._drive(robot)
        drive.take(messages)
        if keep:
            drive.flush()
        return drive

    def finish(self, robot: str) -> Drive | None:
        """End a robot's drive, and queue it; None where nothing can be estimated of it."""
        with self._lock:
            drive = self._driving.pop(robot, None)
        if drive is None:
            raise Problem(404, f"The robot '{robot}' isn't driving.", "See GET /v1/robots.")
        drive.end()
        return self._queue(drive.journal, drive.id, robot)

    def driving(self) -> list[LiveDrive]:
        """The drives that go on, by the robots' names."""
        with self._lock:
            return [self._driving[name] for name in sorted(self._driving)]

    def recover(self) -> None:
        """Queue the drives that went on when an earlier service ended."""
        with self._lock:
            going_on = {drive.journal for drive in self._driving.values()}
            left = sorted(set(self._folder.glob("*.mcap")) - going_on)
        for journal in left:
            self._queue(journal, journal.stem, journal.stem.rpartition("-")[0])

    async def watch(self) -> None:
        """Bring drives to disk as they go on, and end those of robots that fell silent."""
        while True:
            await asyncio.sleep(TICK_S)
            await asyncio.to_thread(self._tick)

    def end(self) -> None:
        """The service ends: the drives so far are queued, for when it starts again."""
        for drive in self.driving():
            self.finish(drive.robot)

    def _tick(self) -> None:
        for drive in self.driving():
            try:
                drive.tick()
                if drive.is_over:
                    self.finish(drive.robot)
            except Problem:
                logger.debug("the robot %s has just finished", drive.robot)
            except (ObjstateError, OSError) as error:
                logger.warning("live drive %s: %s", drive.id, error)
            except Exception:  # a fault in one drive must not stop the others
                logger.exception("live drive %s", drive.id)

    def _drive(self, robot: str) -> LiveDrive:
        if not NAME.fullmatch(robot):
            detail = f"'{robot}' is no robot's name."
            raise Problem(422, detail, "Use up to 64 letters, digits, '_', '-' and '.'.")
        with self._lock:
            if robot not in self._driving:
                if len(self._driving) >= MOST_ROBOTS:
                    detail = f"{MOST_ROBOTS} robots are driving."
                    raise Problem(429, detail, "Finish drives of others first.")
                self._driving[robot] = LiveDrive(
                    robot, self._folder, self._context, self._limits, self._news
                )
            return self._driving[robot]

    def _queue(self, journal: Path, identity: str, robot: str) -> Drive | None:
        packed = self._drives.place()
        try:
            count = pack(journal, packed)
            drive = self._drives.adopt(packed, robot=robot) if count else None
        except ObjstateError as error:
            logger.warning(
                "live drive %s can't be read: %s; it stays at %s", identity, error, journal
            )
            return None
        finally:
            packed.unlink(missing_ok=True)
        remove_file(journal)
        if drive is not None:
            self._on_queued(drive, identity)
        return drive
