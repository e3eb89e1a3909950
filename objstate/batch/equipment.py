"""The side of a Dask worker: what it is equipped with for a batch, and how it runs a log."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from typing import cast

from distributed import Worker, WorkerPlugin, get_client, get_worker

from objstate.batch.attempts import Runner
from objstate.batch.delivery import pack
from objstate.batch.jobs import Context, Job
from objstate.batch.process import Work
from objstate.errors import ObjstateError, OutageError
from objstate.recording.batches import Outcome
from objstate.storage import is_remote


class Equipment(WorkerPlugin):
    """What the logs of one batch share, and the processes that run them."""

    def __init__(
        self, name: str, work: Work[Context, Job], context: Context, time_limit: float | None
    ) -> None:
        self.name = name
        self._work = work
        self._context = context
        self._time_limit = time_limit
        self._runners: list[Runner[Context, Job]] = []
        self._idle: list[Runner[Context, Job]] = []
        self._over = False

    def teardown(self, worker: Worker) -> None:
        """The batch is over, or the worker closes: stop everything."""
        self._over = True
        for runner in self._runners:
            runner.end()

    def check(self) -> None:
        """Raise ObjstateError where the batch is over."""
        if self._over:
            raise ObjstateError("The batch was broken off.")

    @contextmanager
    def runner(self) -> Iterator[Runner[Context, Job]]:
        """A runner for one log at a time; its process serves the next log too."""
        runner = self._idle.pop() if self._idle else self._new()
        yield runner
        self._idle.append(runner)

    def _new(self) -> Runner[Context, Job]:
        runner = Runner(self._work, self._context, self._time_limit)
        self._runners.append(runner)
        return runner


def run_log(batch: str, job: Job, sent_by: str) -> tuple[Outcome, dict[str, bytes]]:
    """A task: run one log here; how it ended, and the files of its result.

    ``batch`` names the equipment, the topic on which progress is told, and the counters.
    Raises OutageError where this machine can't run logs, as by another version of objstate
    than the one that sent the task.
    """
    if version("objstate") != sent_by:
        raise OutageError(
            f"The worker has objstate {version('objstate')}, the batch was sent by {sent_by}; "
            "install the same version everywhere."
        )
    worker = get_worker()
    equipment = cast(Equipment, worker.plugins[batch])

    def report(share: float, seconds: float) -> None:
        worker.log_event(batch, [job.name, share, seconds])

    with tempfile.TemporaryDirectory() as here, equipment.runner() as runner:
        made = Path(here) / "result"
        begin = _counting(batch, worker, equipment)
        try:
            sent = is_remote(job.out)  # the worker itself writes it to the store
            own = job if sent else replace(job, out=str(made))
            outcome = runner.run(job.name, own, begin, report)
        except OutageError as error:
            raise OutageError(f"The worker {worker.address} can't run logs: {error}") from error
        return outcome, pack(made) if outcome.status == "done" and not sent else {}


def _counting(batch: str, worker: Worker, equipment: Equipment) -> Callable[[str], int]:
    """How often a log was begun, on any worker: the scheduler remembers."""
    client = get_client()

    def begin(name: str) -> int:
        equipment.check()
        worker.log_event(batch, [name, None, None])
        begun = int(client.get_metadata([batch, name], default=0)) + 1
        client.set_metadata([batch, name], begun)
        return begun

    return begin
