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
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.batch.attempts import KILLED, MOST_ATTEMPTS
from objstate.batch.delivery import unpack
from objstate.batch.events import Began, Ended, Event, Progressed, Waiting
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
    with _equipped(client, batch, work, context, time_limit):
        client.subscribe_topic(batch, lambda event: news.put(_told(*event[1])))
        waiting = _submit(client, batch, jobs, news)
        try:
            yield from _as_it_comes(client, news, waiting)
        finally:
            _leave(
                client,
                lambda: client.cancel(list(waiting), force=True),
                lambda: client.unsubscribe_topic(batch),
            )


def _as_it_comes(client: Client, news: News, waiting: dict[Future[Any], Job]) -> Iterator[Event]:
    """What happens until every job has ended. Raises SchedulerLostError and OutageError."""
    had_workers = True
    while waiting:
        heed_interrupts()
        try:
            event = news.get(timeout=POLL)
        except queue.Empty:
            has_workers = _has_workers(client)
            if had_workers and not has_workers:
                yield Waiting("Waiting for workers; start some with `dask worker`.")
            had_workers = has_workers
            continue
        if isinstance(event, Began | Progressed | Ended | Waiting):
            yield event
        else:
            yield Ended(_received(event, waiting.pop(event)))


def _has_workers(client: Client) -> bool:
    """Raises SchedulerLostError where the scheduler doesn't answer."""
    if client.status != "running":
        raise SchedulerLostError
    try:
        return bool(client.scheduler_info()["workers"])
    except Exception as error:  # whatever the wire has
        raise SchedulerLostError from error


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


def _submit(client: Client, batch: str, jobs: Sequence[Job], news: News) -> dict[Future[Any], Job]:
    """Every job as a task of its own, which goes to the news when it ends."""
    from objstate.batch.equipment import run_log

    waiting: dict[Future[Any], Job] = {}
    for job in jobs:
        key = f"{batch}-{job.name}"
        future = client.submit(run_log, batch, job, version("objstate"), key=key, pure=False)
        waiting[future] = job
    for future in waiting:
        future.add_done_callback(news.put)
    return waiting


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
