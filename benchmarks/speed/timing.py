"""Processor time of calls, taken in turns, so that other load on the machine hits all of them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median

AT_LEAST = 0.02  # s; shorter calls are repeated, so that the clock's grain doesn't matter
MOST_REPEATS = 1000


@dataclass(frozen=True)
class Effort:
    """How much time to spend on figures that wander less."""

    rounds: int  # of which the median is taken
    logs: int  # times that whole logs are run
    scans: int  # of a drive in which the cost of a scan is taken
    most_objects: int  # in a building


FULL = Effort(rounds=7, logs=3, scans=60, most_objects=10_000)
QUICK = Effort(rounds=3, logs=1, scans=20, most_objects=1_000)


def in_turns(calls: Mapping[str, Callable[[], object]], effort: Effort) -> dict[str, float]:
    """Median s of processor time of each call; called once before, which compiles and fills caches.

    Short calls are repeated, as in a drive; the first of each turn, which find the processor's caches full
    of what the others left, don't count.
    """
    repeats = dict.fromkeys(calls, 1)
    for name, call in calls.items():
        call()
        for _ in range(2):  # the second time with what the first repeats left in the caches
            least = max(processor_time(call, repeats[name]), 1e-9)
            repeats[name] = min(math.ceil(AT_LEAST / least), MOST_REPEATS)
    taken: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(effort.rounds):
        for name, call in calls.items():
            if repeats[name] > 1:
                processor_time(call, repeats[name])
            taken[name].append(processor_time(call, repeats[name]))
    return {name: median(each) for name, each in taken.items()}


def processor_time(call: Callable[[], object], repeats: int = 1) -> float:
    """s of processor time of one call, all threads together."""
    began = time.process_time()
    for _ in range(repeats):
        call()
    return (time.process_time() - began) / repeats
