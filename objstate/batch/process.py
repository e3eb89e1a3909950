"""A worker process, seen from its parent: it can hang or die without harm to anybody else."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from multiprocessing import Pipe
from typing import Any, Generic, Literal, TypeVar

Context = TypeVar("Context")
Job = TypeVar("Job")

Report = Callable[[float, float], None]  # share of the log done, seconds of it done
Work = Callable[[Context, Job, Report], None]  # must be importable by name

# One log, one core: threads of libraries would only fight over it.
SINGLE_THREADED = dict.fromkeys(
    (
        "POLARS_MAX_THREADS",
        "NUMBA_NUM_THREADS",
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)


@dataclass(frozen=True)
class Verdict:
    """What became of one job in a worker process.

    The job has no part in it that it was *prevented*, as by a full disk, or *interrupted*, as by
    a network that may be back in a moment.
    """

    status: Literal["done", "failed", "timed out", "died", "prevented", "interrupted"]
    reason: str | None = None
    peak_memory_mb: float | None = None


class WorkerProcess(Generic[Context, Job]):
    """A process that does jobs one after the other; its context is sent to it once."""

    def __init__(self, work: Work[Context, Job], context: Context) -> None:
        ours, theirs = Pipe()
        command = [sys.executable, "-P", "-m", "objstate.batch.worker", str(theirs.fileno())]
        self._process = subprocess.Popen(
            command,
            env=os.environ | SINGLE_THREADED,
            pass_fds=[theirs.fileno()],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # Ctrl-C is for the parent
        )
        theirs.close()
        self._connection = ours
        self._greeting: Any = (work, context)

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def run(self, job: Job, time_limit: float | None, report: Report) -> Verdict:
        """Do one job, within ``time_limit`` seconds; the process is gone unless it answered.

        The time that a new process takes to start isn't the job's.
        """
        deadline = None
        try:
            self._send(job)
            while self._connection.poll(_left(deadline)):
                match self._connection.recv():
                    case ("began",):
                        deadline = None if time_limit is None else time.monotonic() + time_limit
                    case "progress", share, seconds:
                        report(share, seconds)
                    case status, reason, memory:
                        return Verdict(status, reason, memory)
        except (EOFError, OSError):
            return Verdict("died", self._death())
        self.end()
        return Verdict("timed out", f"It took longer than the time limit of {time_limit:g} s.")

    def end(self) -> None:
        """Stop the process, whatever it is doing."""
        self._process.kill()
        self._process.wait()

    def _send(self, job: Job) -> None:
        if self._greeting is not None:
            self._connection.send(self._greeting)
            self._greeting = None
        self._connection.send(job)

    def _death(self) -> str:
        code = self._process.wait()
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"


def _left(deadline: float | None) -> float | None:
    return None if deadline is None else max(0.0, deadline - time.monotonic())
