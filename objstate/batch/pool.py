"""The workers of this machine: one process each, one log at a time."""

from __future__ import annotations

import queue
import threading
from collections import Counter
from collections.abc import Callable, Generator, Iterator, Sequence
from typing import Protocol, TypeVar

from objstate.batch.attempts import Runner
from objstate.batch.events import Began, Ended, Event, Progressed
from objstate.batch.process import Context, Work
from objstate.interrupts import heed_interrupts


class Named(Protocol):
    """A job that says which log it is."""

    @property
    def name(self) -> str: ...


NamedJob = TypeVar("NamedJob", bound=Named)


class BatchStoppedError(Exception):
    """The batch was broken off; nothing more is to be begun."""


def run_here(
    work: Work[Context, NamedJob],
    context: Context,
    jobs: Sequence[NamedJob],
    workers: int,
    time_limit: float | None,
) -> Generator[Event]:
    """Run all jobs on ``workers`` processes; what happens, as it happens.

    Each log ends in one ``Ended``, whatever becomes of it. Closing the iterator stops
    every worker at once. Raises OutageError where logs can't be run for a cause outside them.
    """
    waiting: queue.SimpleQueue[NamedJob] = queue.SimpleQueue()
    events: queue.SimpleQueue[Event | BaseException] = queue.SimpleQueue()
    stopped = threading.Event()
    for job in jobs:
        waiting.put(job)
    runners = [Runner(work, context, time_limit) for _ in range(min(workers, len(jobs)))]
    threads = [
        threading.Thread(target=_serve, args=(runner, waiting, events, stopped), daemon=True)
        for runner in runners
    ]
    for thread in threads:
        thread.start()
    try:
        yield from _until_all_ended(events, len(jobs))
    finally:
        stopped.set()
        for runner in runners:
            runner.end()
        for thread in threads:
            thread.join()


def _until_all_ended(
    events: queue.SimpleQueue[Event | BaseException], count: int
) -> Iterator[Event]:
    while count:
        heed_interrupts()
        event = events.get()
        if isinstance(event, BaseException):
            raise event
        count -= isinstance(event, Ended)
        yield event


def _serve(
    runner: Runner[Context, NamedJob],
    waiting: queue.SimpleQueue[NamedJob],
    events: queue.SimpleQueue[Event | BaseException],
    stopped: threading.Event,
) -> None:
    """One worker's thread: job after job, until none is left."""
    try:
        while True:
            job = waiting.get_nowait()
            outcome = runner.run(
                job.name, job, _counting(events, stopped), _telling(job.name, events)
            )
            events.put(Ended(outcome))
    except (queue.Empty, BatchStoppedError):
        return
    except BaseException as error:
        events.put(error)


def _counting(
    events: queue.SimpleQueue[Event | BaseException], stopped: threading.Event
) -> Callable[[str], int]:
    """How often a log was begun, as long as anything may be."""
    begun: Counter[str] = Counter()

    def begin(name: str) -> int:
        if stopped.is_set():
            raise BatchStoppedError
        events.put(Began(name))
        begun[name] += 1
        return begun[name]

    return begin


def _telling(
    name: str, events: queue.SimpleQueue[Event | BaseException]
) -> Callable[[float, float], None]:
    return lambda share, seconds: events.put(Progressed(name, share, seconds))
