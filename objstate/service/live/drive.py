"""One robot's drive that goes on."""

from __future__ import annotations

import logging
import struct
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from objstate.logs import Message
from objstate.logs.definitions import LASER_SCAN, ODOMETRY, TF, USED_TYPES, MessageType
from objstate.service.live.journal import Journal, read_journal
from objstate.service.live.options import LiveContext, LiveLimits
from objstate.service.live.process import LiveProcess

SPOKEN_S = 1.0  # after the first message, in which other topics are waited for
REMEMBERED = 100  # scans whose coming in is remembered
MOST_STARTS = 3  # of the process of one drive

logger = logging.getLogger(__name__)

News = Callable[["LiveDrive", str, Any], None]  # kind, what


def header_stamp(message: Message) -> int | None:
    """The stamp of a message that begins with a header, without decoding the rest."""
    begin = 4  # after the mark of CDR, or the number that ROS 1 counts messages by
    if len(message.data) < begin + 8:
        return None
    seconds, nanoseconds = struct.unpack_from("<II", message.data, begin)
    return int(seconds * 10**9 + nanoseconds)


class LiveDrive:
    """Its journal, and the process that estimates it. Messages may come from any thread."""

    def __init__(
        self,
        robot: str,
        folder: Path,
        context: LiveContext,
        limits: LiveLimits,
        news: News,
    ) -> None:
        self.robot, self.id = robot, f"{robot}-{time.time_ns()}"
        self.begun_s = self.heard_s = time.monotonic()
        self.state = "waiting for scans and odometry"
        self.pose: list[float] | None = None  # x m, y m, yaw rad
        self.is_lost = False
        self.messages = 0
        self.warnings: list[str] = []  # of the log and the estimator, so far
        self._context, self._limits, self._news = context, limits, news
        self._lock = threading.RLock()
        self._came_s: dict[int, float] = {}  # by stamp of a scan: when it came in
        self._types: dict[str, MessageType] = {}
        self._journal = Journal(folder / f"{self.id}.mcap")
        self._flushed_s = time.monotonic()
        self._process: LiveProcess | None = None
        self._starts = 0
        self.is_ended = self._is_over = False

    def words(self) -> dict[str, Any]:
        """The drive as JSON has it."""
        return {
            "robot": self.robot,
            "drive": self.id,
            "state": self.state,
            "pose": self.pose,
            "lost": self.is_lost,
            "messages": self.messages,
            "silent_s": round(time.monotonic() - self.heard_s, 1),
            "warnings": list(self.warnings),
        }

    @property
    def journal(self) -> Path:
        """Where its messages are."""
        return self._journal.path

    def take(self, messages: Sequence[Message]) -> None:
        """Write messages to the journal, and estimate by them."""
        with self._lock:
            if self.is_ended:
                return
            self.heard_s = time.monotonic()
            for message in messages:
                self._take(message)

    def delay_of(self, stamp_ns: int) -> float | None:
        """Seconds since the scan of a stamp came in; None for one that is long gone."""
        came_s = self._came_s.get(stamp_ns)
        return None if came_s is None else time.monotonic() - came_s

    def tick(self) -> None:
        """Bring to disk what is due, and begin to estimate where enough topics have spoken."""
        with self._lock:
            if self.is_ended:
                return
            now = time.monotonic()
            if now - self._flushed_s >= self._limits.checkpoint_s:
                self.flush()
            if self._process is None and self._is_enough and now - self.begun_s >= SPOKEN_S:
                self._begin()

    def flush(self) -> None:
        """Bring all messages so far to disk."""
        with self._lock:
            self._journal.flush()
            self._flushed_s = time.monotonic()

    @property
    def is_over(self) -> bool:
        """Whether the robot fell silent, or the drive is long enough."""
        now = time.monotonic()
        is_silent = now - self.heard_s >= self._limits.silent_s
        return self._is_over or is_silent or now - self.begun_s >= self._limits.longest_s

    def end(self) -> None:
        """Close the journal; nothing is taken any more."""
        with self._lock:
            self.is_ended = True
            self._journal.close()
            process, self._process = self._process, None
        if process is not None:
            process.end()

    @property
    def _is_enough(self) -> bool:
        kinds = {kind.name for kind in self._types.values()}
        return LASER_SCAN in kinds and not kinds.isdisjoint((ODOMETRY, *TF))

    def _take(self, message: Message) -> None:
        if message.type not in USED_TYPES:
            return
        is_new = message.topic not in self._types
        self._types.setdefault(message.topic, message.message_type)
        self._journal.write(message)
        self.messages += 1
        if message.type == LASER_SCAN and (stamp_ns := header_stamp(message)) is not None:
            self._came_s[stamp_ns] = self.heard_s
            if len(self._came_s) > REMEMBERED:
                del self._came_s[next(iter(self._came_s))]
        if self._process is None:
            return
        if is_new:  # topics are chosen when a drive begins, so it is estimated from its beginning
            self._begin()
        else:
            self._process.put(message)

    def _begin(self) -> None:
        if self._process is not None:
            self._process.end()
        if self._starts >= MOST_STARTS:
            self._process = None
            return
        self._starts += 1
        self.warnings = []  # the drive is estimated from its beginning
        self._journal.flush()
        self._process = LiveProcess(self._context, self._types, self.id, self._said)
        for message in read_journal(self._journal.path):
            self._process.put(message)

    def _said(self, kind: str, what: Any) -> None:
        if self.is_ended:
            return
        if kind == "state":
            self.state = what
        elif kind == "warnings":
            self.warnings = what
        elif kind == "over":
            self.state, self._is_over = what, True
        elif kind == "failed":
            logger.warning("live drive %s: %s", self.id, what)
            self.state = f"not estimated while it goes on: {what}"
        self._news(self, kind, what)
