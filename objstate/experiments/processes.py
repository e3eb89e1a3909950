"""Work shared out over processes: the same results in the same order, however many there are."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

Task = TypeVar("Task")
Result = TypeVar("Result")


def default_workers() -> int:
    """One for each core that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def in_order(
    function: Callable[[Task], Result], tasks: Sequence[Task], workers: int
) -> Iterator[Result]:
    """``function`` of every task, in the order of the tasks, by so many processes.

    With one worker, or one task, all is done in this process. What a task raises is raised here;
    tasks that haven't begun are then given up.
    """
    if min(workers, len(tasks)) <= 1:
        yield from map(function, tasks)
        return
    # spawned: a fork would copy the threads' locks of the libraries in an unknown state
    pool = ProcessPoolExecutor(
        min(workers, len(tasks)), mp_context=get_context("spawn"), initializer=_leave_interrupts
    )
    try:
        yield from pool.map(function, tasks)
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def _leave_interrupts() -> None:
    """Ctrl-C is for the process that was called; it ends its workers."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
