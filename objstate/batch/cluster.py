"""Workers on other machines, by Dask distributed.

Each Dask worker runs a log in a process of its own, as this machine's workers do, so that a
log that crashes or hangs leaves the Dask worker alive. What the logs share travels to each
Dask worker once, as a plugin. Where a Dask worker is lost, the scheduler gives its logs to
others. How often a log was begun is counted at the scheduler, across all workers.
"""

from __future__ import annotations

import json
import queue
import secrets
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.batch.attempts import KILLED, MOST_ATTEMPTS
from objstate.batch.delivery import unpack
from objstate.batch.events import Began, Ended, Event, Progressed
from objstate.batch.jobs import Context, Job
from objstate.batch.process import Work
from objstate.errors import SettingsError
from objstate.recording.batches import Outcome

if TYPE_CHECKING:
    from distributed import Client, Future

    News = queue.SimpleQueue[Event | Future[Any]]

PREFIX = "objstate-batch"  # how the names of plugins, topics and counters begin


def run_on_cluster(
    work: Work[Context, Job],
    context: Context,
    jobs: Sequence[Job],
    scheduler: str,
    time_limit: float | None,
) -> Generator[Event]:
    """Run all jobs on the workers of a Dask scheduler (address or scheduler file); what happens.

    Results are written here, as they arrive. Each log ends in one ``Ended``. Closing the
    iterator stops the batch on the cluster. Raises SettingsError where there is no
    scheduler, or its workers can't take the batch.
    """
    batch = f"{PREFIX}-{secrets.token_hex(4)}"
    news: News = queue.SimpleQueue()
    with _connected(scheduler) as client, _equipped(client, batch, work, context, time_limit):
        client.subscribe_topic(batch, lambda event: news.put(_told(*event[1])))
        waiting = _submit(client, batch, jobs, news)
        try:
            while waiting:
                event = news.get()
                if isinstance(event, Began | Progressed | Ended):
                    yield event
                else:
                    yield Ended(_received(event, waiting.pop(event)))
        finally:
            client.cancel(list(waiting), force=True)
            client.unsubscribe_topic(batch)


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
    with client:
        yield client


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
        raise SettingsError(
            f"The workers can't take the batch: {type(error).__name__}: {error}; install the same "
            "objstate there as here."
        ) from error
    try:
        yield
    finally:
        client.unregister_worker_plugin(batch)


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
    """How a task ended; the result that it brought is written."""
    from distributed import KilledWorker

    try:
        outcome, files = future.result()
        if outcome.status == "done":
            unpack(files, Path(job.out))
    except KilledWorker:
        return Outcome(job.name, "killed", KILLED, MOST_ATTEMPTS)
    except Exception as error:  # whatever comes from there
        return Outcome(job.name, "failed", f"{type(error).__name__}: {error}")
    finally:
        future.release()
    return outcome if isinstance(outcome, Outcome) else Outcome(job.name, "failed", str(outcome))
