"""Workers on other machines, by Dask distributed.

Each Dask worker runs a log in a process of its own, as this machine's workers do, so that a
log that crashes or hangs leaves the Dask worker alive. What the logs share travels to each
Dask worker once, as a plugin. Where a Dask worker is lost, the scheduler gives its logs to
others. How often a log was begun is counted at the scheduler, across all workers.
"""

from __future__ import annotations

import json
import logging
import queue
import secrets
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

from objstate.batch.attempts import KILLED, MOST_ATTEMPTS
from objstate.batch.delivery import unpack
from objstate.batch.events import Began, Connected, Ended, Event, Progressed, Waiting
from objstate.batch.jobs import Context, Job
from objstate.batch.process import Work
from objstate.errors import OutageError, SettingsError
from objstate.interrupts import heed_interrupts
from objstate.recording.batches import Outcome
from objstate.storage import is_remote

if TYPE_CHECKING:
    from distributed import Client, Future

    News = queue.SimpleQueue[Event | Future[Any]]

PREFIX = "objstate-batch"  # how the names of plugins, topics and counters begin
POLL = 1.0  # s without news after which the scheduler and its workers are looked at
STRAGGLES = 2.0  # times as long as half of the logs took, after which a log is run once more
STRAGGLES_S = 5.0  # s, at least
CLOSING = 3.0  # s for taking leave of a scheduler


class SchedulerLostError(Exception):
    """The scheduler is gone, and with it the logs that it was given."""


def run_on_cluster(
    work: Work[Context, Job],
    context: Context,
    jobs: Sequence[Job],
    scheduler: str,
    time_limit: float | None,
) -> Generator[Event]:
    """Run all jobs on the workers of a Dask scheduler (address or scheduler file); what happens.

    Results are written here, as they arrive. Each log ends in one ``Ended``. A scheduler that
    goes away is looked for again, and given what is left. Closing the iterator stops the batch
    on the cluster. Raises SettingsError where there is no scheduler, or its workers can't take
    the batch, and OutageError where logs can't be run for a cause outside them.
    """
    left = {job.name: job for job in jobs}
    losses = 0  # of the scheduler, since a log ended
    heed_interrupts()
    while left:
        try:
            with _connected(scheduler) as client:
                jobs_left = list(left.values())
                with closing(_run_by(client, work, context, jobs_left, time_limit)) as events:
                    for event in events:
                        if isinstance(event, Ended):
                            del left[event.outcome.name]
                            losses = 0
                        yield event
        except SchedulerLostError as error:
            losses += 1
            if losses == MOST_ATTEMPTS:
                raise OutageError(_gone(scheduler)) from error
            yield Waiting(
                f"The Dask scheduler at {scheduler} is gone; waiting for it to come back."
            )
        except SettingsError as error:
            if losses:
                raise OutageError(_gone(scheduler)) from error
            raise


def _gone(scheduler: str) -> str:
    return f"The Dask scheduler at {scheduler} went away; start it again."


def _run_by(
    client: Client,
    work: Work[Context, Job],
    context: Context,
    jobs: Sequence[Job],
    time_limit: float | None,
) -> Generator[Event]:
    """Run jobs by one client. Raises SchedulerLostError and OutageError."""
    batch = f"{PREFIX}-{secrets.token_hex(4)}"
    news: News = queue.SimpleQueue()
    if client.dashboard_link:
        yield Connected(client.dashboard_link)
    with _equipped(client, batch, work, context, time_limit):
        client.subscribe_topic(batch, lambda event: news.put(_told(*event[1])))
        tasks = Tasks(client, batch, news)
        for job in jobs:
            tasks.submit(job)
        try:
            yield from _as_it_comes(client, news, tasks)
        finally:
            _leave(client, tasks.cancel, lambda: client.unsubscribe_topic(batch))


def _as_it_comes(client: Client, news: News, tasks: Tasks) -> Iterator[Event]:
    """What happens until every job has ended. Raises SchedulerLostError and OutageError."""
    had_workers = True
    while tasks.waiting:
        heed_interrupts()
        try:
            event = news.get(timeout=POLL)
        except queue.Empty:
            threads = _threads(client)
            if had_workers and not threads:
                yield Waiting("Waiting for workers; start some with `dask worker`.")
            had_workers = threads > 0
            tasks.repeat_stragglers(threads)
            continue
        if isinstance(event, Event):
            if isinstance(event, Began):
                tasks.began(event.name)
            yield event
        elif (outcome := tasks.ended(event)) is not None:
            yield Ended(outcome)


def _threads(client: Client) -> int:
    """How many logs its workers run at a time. Raises SchedulerLostError where it doesn't answer."""
    if client.status != "running":
        raise SchedulerLostError
    try:
        return sum(each["nthreads"] for each in client.scheduler_info(-1)["workers"].values())
    except Exception as error:  # whatever the wire has
        raise SchedulerLostError from error


class Tasks:
    """The tasks of a batch at the scheduler, one for each log, and a second one of stragglers.

    Of two tasks of one log, the first that is done counts. A straggler runs longer than others
    took, while workers have nothing to do.
    """

    def __init__(self, client: Client, batch: str, news: News) -> None:
        self._client, self._batch, self._news = client, batch, news
        self.waiting: dict[Future[Any], Job] = {}
        self._futures: dict[str, list[Future[Any]]] = {}  # of each log that hasn't ended
        self._since: dict[str, float] = {}  # when its first task began, s
        self._took: list[float] = []  # s, by logs that have ended

    def submit(self, job: Job) -> None:
        """Submit a task of a log, which goes to the news when it ends."""
        from objstate.batch.equipment import run_log

        own = self._futures.setdefault(job.name, [])
        key = f"{self._batch}-{job.name}-{len(own)}"
        future = self._client.submit(
            run_log, self._batch, job, version("objstate"), key=key, pure=False
        )
        self.waiting[future] = job
        own.append(future)
        future.add_done_callback(self._news.put)

    def began(self, name: str) -> None:
        """A worker took up a log."""
        self._since.setdefault(name, time.monotonic())

    def ended(self, future: Future[Any]) -> Outcome | None:
        """How a log ended, with one of its tasks; None where another task of it may do better."""
        job = self.waiting.pop(future, None)
        if job is None:  # the other task of a log that is done
            return None
        outcome = _received(future, job)
        own = self._futures[job.name]
        own.remove(future)
        if own and outcome.status != "done":
            return None
        for other in own:
            del self.waiting[other]
        _leave(self._client, lambda: self._client.cancel(own, force=True))
        del self._futures[job.name]
        since = self._since.pop(job.name, None)
        if since is not None:
            self._took.append(time.monotonic() - since)
        return outcome

    def repeat_stragglers(self, threads: int) -> None:
        """Submit logs once more that take long, to as many threads of workers as have nothing to do.

        A log that its worker writes to a store itself isn't among them, as two would write at once.
        """
        idle, now = threads - len(self.waiting), time.monotonic()
        if idle <= 0 or not self._took:
            return
        long = max(STRAGGLES * median(self._took), STRAGGLES_S)
        for job in list(self.waiting.values()):
            since = self._since.get(job.name, now)
            is_long = now - since > long and not is_remote(job.out)
            if idle > 0 and is_long and len(self._futures[job.name]) == 1:
                self.submit(job)
                idle -= 1

    def cancel(self) -> None:
        """Give all up that haven't ended."""
        self._client.cancel(list(self.waiting), force=True)


@contextmanager
def _connected(scheduler: str) -> Iterator[Client]:
    try:
        from distributed import Client
    except ImportError as error:
        raise SettingsError(
            f"--scheduler needs Dask ({error}); pip install 'objstate[cluster]'."
        ) from error
    try:
        client = Client(_address(scheduler), set_as_default=False)
    except (OSError, ValueError) as error:
        raise SettingsError(
            f"No Dask scheduler answers at {scheduler}: {error}; start one with `dask scheduler`."
        ) from error
    # instead of tracebacks of its attempts to connect again, errors and events tell what is the
    # matter
    with _silenced(logging.getLogger("distributed.client")):
        try:
            yield client
        finally:
            with suppress(Exception):  # it may not answer any more
                client.close(timeout=CLOSING)


@contextmanager
def _silenced(logger: logging.Logger) -> Iterator[None]:
    level = logger.level
    logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        logger.setLevel(level)


def _address(scheduler: str) -> str:
    """The address itself, or the one in a scheduler file. Raises OSError, ValueError."""
    if "://" in scheduler:
        return scheduler
    content = json.loads(Path(scheduler).read_text(encoding="utf-8"))
    if not isinstance(content, dict) or "address" not in content:
        raise ValueError("it is no scheduler file")
    return str(content["address"])


@contextmanager
def _equipped(
    client: Client, batch: str, work: Work[Context, Job], context: Context, time_limit: float | None
) -> Iterator[None]:
    """Every worker, and each that joins later, has what the logs share."""
    from objstate.batch.equipment import Equipment

    try:
        client.register_plugin(Equipment(batch, work, context, time_limit), name=batch)
    except Exception as error:  # whatever the workers answer
        if client.status != "running":
            raise SchedulerLostError from error
        raise SettingsError(
            f"The workers can't take the batch: {type(error).__name__}: {error}; install the same "
            "objstate there as here."
        ) from error
    try:
        yield
    finally:
        _leave(client, lambda: client.unregister_worker_plugin(batch))


def _leave(client: Client, *steps: Callable[[], object]) -> None:
    """Tidy up at the scheduler, if it answers; why it is left counts for more."""
    if client.status == "running":
        with suppress(Exception):
            for step in steps:
                step()


def _told(name: str, share: float | None, seconds: float | None) -> Event:
    """What a worker says of a log."""
    if share is None or seconds is None:
        return Began(name)
    return Progressed(name, share, seconds)


def _received(future: Future[Any], job: Job) -> Outcome:
    """How a task ended; the result that it brought is written.

    Logs run in processes of their own, so that an error of the task itself is not the log's.
    Raises SchedulerLostError and OutageError.
    """
    from distributed import KilledWorker
    from distributed.comm.core import CommClosedError

    if future.cancelled():
        raise SchedulerLostError
    outcome: Outcome
    try:
        outcome, files = future.result()
    except KilledWorker:
        return Outcome(job.name, "killed", KILLED, MOST_ATTEMPTS)
    except OutageError:
        raise
    except CommClosedError as error:  # the result was fetched as the scheduler went
        raise SchedulerLostError from error
    except Exception as error:  # whatever comes from there
        raise OutageError(
            f"The workers can't run logs: {type(error).__name__}: {error}; install the same "
            "objstate there as here."
        ) from error
    finally:
        future.release()
    if outcome.status == "done" and not is_remote(job.out):
        unpack(files, Path(job.out))
    return outcome
