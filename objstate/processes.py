"""Work shared out over processes: the same results in the same order, however many there are."""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import active_children, get_context, parent_process
from threading import Thread
from typing import Protocol, TypeVar

from objstate.interrupts import heed_interrupts

ENDED = 1  # exit code of a process that was told to end
AHEAD = 8  # tasks of each process that are made before their results are taken

Task = TypeVar("Task")
Result = TypeVar("Result")


class Each(Protocol):
    """A function of every task, in the order of the tasks."""

    def __call__(
        self, function: Callable[[Task], Result], tasks: Iterable[Task], /
    ) -> Iterator[Result]: ...


def default_workers() -> int:
    """One for each core that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_order(
    function: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Iterator[Result]:
    """``function`` of every task, in the order of the tasks, by so many processes.

    With one worker, or one task, all is done in this process. What a task raises is raised here;
    all other tasks are then given up.
    """
    with lasting(min(workers, len(tasks))) as each:
        yield from each(function, tasks)


@contextmanager
def lasting(workers: int) -> Iterator[Each]:
    """``in_order`` by processes that last, so that the next tasks needn't wait for others to begin.

    With one worker, all is done in this process. They begin with the first tasks.
    """
    if workers <= 1:
        yield map
        return
    # spawned: a fork would copy the threads' locks of the libraries in an unknown state
    others = set(active_children())
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_begin)
    heed_interrupts()

    def each(function: Callable[[Task], Result], tasks: Iterable[Task]) -> Iterator[Result]:
        begun = deque[Future[Result]]()
        for task in tasks:
            begun.append(pool.submit(_interruptible, function, task))
            if len(begun) > AHEAD * workers:
                yield begun.popleft().result()
        while begun:
            yield begun.popleft().result()

    try:
        yield each
    except BaseException:  # Ctrl-C among them: what has begun isn't waited for
        for worker in set(active_children()) - others:
            worker.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _interruptible(function: Callable[[Task], Result], task: Task) -> Result:
    """A task that tidies up after itself when its process is told to end."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        return function(task)
    except KeyboardInterrupt:
        os._exit(ENDED)  # or the pool would go on with the next task
    finally:
        _ignore_interrupts()


def _begin() -> None:
    """A process of the pool ends, tidily, when its parent is gone."""
    _ignore_interrupts()
    Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None  # pools have one
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)


def _ignore_interrupts() -> None:
    """An idle process leaves Ctrl-C to its parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
