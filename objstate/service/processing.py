"""The drives that wait are estimated one after the other, in a process of their own."""

from __future__ import annotations

import json
import logging
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from objstate.batch.process import WorkerProcess
from objstate.recording.summary import SUMMARY
from objstate.service.drives import DONE, FAILED, MOST_ATTEMPTS, Drive, Drives
from objstate.service.estimating import Context, Job, estimate

OUTAGES = ("interrupted", "prevented")  # verdicts in which the log has no part, as of a full disk
OUTAGE_S = 10.0  # before a drive is tried again after one
LOOKED_AFTER_S = 1.0  # another process of the service may have queued a drive
TOLD = ("objects", "counts", "warnings", "success", "failures", "lost_share", "begin_ns", "timings")

logger = logging.getLogger(__name__)


class Processing:
    """A thread that takes the drives. It may be killed at any time: drives wait in the database."""

    def __init__(
        self,
        drives: Drives,
        context: Context,
        time_limit_s: float,
        on_change: Callable[[Drive], None],
        on_taught: Callable[[], None],
    ) -> None:
        self._drives, self._context, self._time_limit_s = drives, context, time_limit_s
        self._on_change, self._on_taught = on_change, on_taught
        self._wake, self._ended = threading.Event(), threading.Event()
        self._worker: WorkerProcess[Context, Job] | None = None
        self._running: tuple[str, float] | None = None
        self._thread = threading.Thread(target=self._work, name="drives", daemon=True)

    def start(self) -> None:
        """Begin, with the drives that an earlier start left."""
        self._drives.put_back()
        self._thread.start()

    def wake(self) -> None:
        """A drive has come."""
        self._wake.set()

    def end(self) -> None:
        """Stop; a drive that is being estimated waits for the next start."""
        self._ended.set()
        self._wake.set()
        if self._worker is not None:
            self._worker.end()
        self._thread.join()

    def progress(self, identity: str) -> float | None:
        """The share of a drive that is done; None for one that isn't running."""
        running = self._running
        return running[1] if running is not None and running[0] == identity else None

    def _work(self) -> None:
        while not self._ended.is_set():
            self._wake.clear()
            drive = self._drives.next()
            if drive is None:
                self._wake.wait(LOOKED_AFTER_S)
                continue
            self._on_change(drive)
            self._estimate(drive)
            self._running = None
            if not self._ended.is_set():
                self._on_change(self._drives.get(drive.id))

    def _estimate(self, drive: Drive) -> None:
        def report(share: float, _: float) -> None:
            self._running = drive.id, share

        result = self._drives.result(drive)
        if self._worker is None or not self._worker.alive:
            self._worker = WorkerProcess(estimate, self._context)
        report(0.0, 0.0)
        verdict = self._worker.run(Job(self._drives.log(drive), result), self._time_limit_s, report)
        if self._ended.is_set():
            return
        if verdict.status == "done":
            self._on_taught()  # before anybody hears that it is done
            self._end_estimated(drive, summary_of(result))
            return
        reason = verdict.reason or f"The process of the drive {verdict.status}."
        logger.warning("drive %s %s: %s", drive.id, verdict.status, reason)
        if verdict.status in OUTAGES:
            self._drives.again(drive, reason, counts=False)
            self._ended.wait(OUTAGE_S)
        elif verdict.status == "died" and drive.attempts < MOST_ATTEMPTS:
            self._drives.again(drive, reason, counts=True)
        else:
            self._drives.end(drive, FAILED, reason=reason)

    def _end_estimated(self, drive: Drive, summary: Mapping[str, Any]) -> None:
        """End a drive that has a result, which failed where the run is no success."""
        failures = " ".join(summary["failures"])
        if failures:
            logger.warning("drive %s failed: %s", drive.id, failures)
        known = {"summary": json.dumps(summary), "reason": failures or None}
        self._drives.end(drive, FAILED if failures else DONE, **known)


def summary_of(result: Path) -> dict[str, Any]:
    """What a finished drive's result says of it."""
    told = json.loads((result / SUMMARY).read_text(encoding="utf-8"))
    return {name: told.get(name) for name in TOLD}
