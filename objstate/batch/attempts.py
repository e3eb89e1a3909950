"""Running a log until it ends one way or the other, but not for ever."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Generic

from objstate.batch.process import Context, Job, Report, Work, WorkerProcess
from objstate.errors import OutageError
from objstate.recording.batches import Outcome

MOST_ATTEMPTS = 3  # a log that has killed so many workers is set aside
PAUSE = (
    3.0  # s before a log is begun again that the network interrupted; the second time twice that
)

KILLED = (
    f"Its worker process was killed {MOST_ATTEMPTS} times, as when memory runs out or native code "
    "crashes; try it alone with `objstate estimate`, then --retry-failed."
)


class Runner(Generic[Context, Job]):
    """Runs logs in a worker process, and starts a new one where that has gone."""

    def __init__(
        self, work: Work[Context, Job], context: Context, time_limit: float | None
    ) -> None:
        self._work = work
        self._context = context
        self._time_limit = time_limit
        self._worker: WorkerProcess[Context, Job] | None = None
        self._ended = threading.Event()

    def run(self, name: str, job: Job, begin: Callable[[str], int], report: Report) -> Outcome:
        """Run one log; ``begin`` counts how often it was begun, this time included.

        Raises OutageError where it can't be run for a cause outside the log.
        """
        while (attempt := begin(name)) <= MOST_ATTEMPTS:
            verdict = self._living().run(job, self._time_limit, report)
            if verdict.status == "prevented":
                raise OutageError(str(verdict.reason))
            if verdict.status == "interrupted":
                if attempt == MOST_ATTEMPTS:
                    raise OutageError(str(verdict.reason))
                self._ended.wait(PAUSE * attempt)
            elif verdict.status != "died":
                return Outcome(
                    name, verdict.status, verdict.reason, attempt, verdict.peak_memory_mb
                )
        return Outcome(name, "killed", KILLED, MOST_ATTEMPTS)

    def end(self) -> None:
        """Stop the process, whatever it is doing."""
        self._ended.set()
        if self._worker is not None:
            self._worker.end()

    def _living(self) -> WorkerProcess[Context, Job]:
        if self._worker is None or not self._worker.alive:
            self._worker = WorkerProcess(self._work, self._context)
        return self._worker
