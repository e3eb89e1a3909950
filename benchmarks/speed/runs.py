"""Whole logs, start-up, and what a second core is worth."""

from __future__ import annotations

import multiprocessing
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from benchmarks.speed.table import Table, number, times
from benchmarks.speed.timing import Effort
from objstate.run import RunResult, estimate_log

ROOT = Path(__file__).parents[2]
LOG = ROOT / "logs" / "corridor.mcap"
BUILDING = ROOT / "models" / "corridor" / "corridor.urdf"
COMMAND = (sys.executable, str(ROOT / "cli.py"))
SHORT = 20.0  # s of log in which all loops are needed
CORES = 2


@dataclass(frozen=True)
class Taken:
    """Seconds, by the clock and of the processor."""

    wall: float
    processor: float

    @staticmethod
    def median(all_: list[Taken]) -> Taken:
        return Taken(median(each.wall for each in all_), median(each.processor for each in all_))


def sample_log(effort: Effort) -> list[Table]:
    """The sample log, in one process and as a user types it."""
    seconds = _estimate().log_seconds  # compiles, and imports all there is
    inside, typed = [], []
    for _ in range(effort.logs):
        inside.append(_taken(_estimate, resource.RUSAGE_SELF))
        typed.append(_taken(_typed, resource.RUSAGE_CHILDREN))
    rows = [
        (name, number(each.processor), times(seconds / each.processor), number(each.wall))
        for name, each in (
            ("start-up excluded", Taken.median(inside)),
            ("as typed, start-up included", Taken.median(typed)),
        )
    ]
    return [
        Table(
            "The sample log",
            ("", "processor time (s)", "times real time", "elapsed (s)"),
            rows,
            (
                f"{LOG.name}: {seconds:.0f} s, two lasers of 180 beams at 5 scans a second each, "
                f"fourteen doors. Default settings, reading and writing included.",
            ),
        )
    ]


def start_up(effort: Effort) -> list[Table]:
    """How long a user waits before anything is estimated."""
    with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as other:
        fresh, made = (
            dict(os.environ, NUMBA_CACHE_DIR=folder),
            dict(os.environ, NUMBA_CACHE_DIR=other),
        )
        first = _begun(fresh)
        compiling = _taken(
            lambda: _started(*COMMAND, "compile", environment=made), resource.RUSAGE_CHILDREN
        )
        right_after = _begun(made)
        cached = Taken.median([_begun(made) for _ in range(effort.logs)])
    shown = [
        _taken(lambda: _started(*COMMAND, "--help"), resource.RUSAGE_CHILDREN)
        for _ in range(effort.rounds)
    ]
    beginning = f"the first {SHORT:.0f} s of the sample log"
    named = (
        ("`objstate --help`", Taken.median(shown)),
        ("`objstate compile`, once after an installation; `make` calls it", compiling),
        (f"{beginning}, the first run after it", right_after),
        ("the same, later runs", cached),
        ("the same, the first run without `objstate compile`", first),
    )
    rows = [(name, number(each.processor), number(each.wall)) for name, each in named]
    held_up = first.processor - cached.processor, first.wall - cached.wall
    rows.append(("of this, compiling", *map(number, held_up)))
    return [Table("Start-up", ("", "processor time (s)", "elapsed (s)"), rows)]


def two_cores(effort: Effort) -> list[Table]:
    """Two logs by one process, one after the other, and by two at once."""
    taken: dict[int, list[float]] = {1: [], CORES: []}
    with _pool(1) as one, _pool(CORES) as both:
        for _ in range(effort.logs):
            for pool, workers in ((one, 1), (both, CORES)):
                taken[workers].append(_together(pool))
    alone, together = median(taken[1]), median(taken[CORES])
    load = os.getloadavg()[0]
    return [
        Table(
            "Two cores",
            ("two runs of the sample log", "elapsed (s)", "speed"),
            [
                ("one after the other", number(alone), times(1.0)),
                ("in two processes at once", number(together), times(alone / together)),
            ],
            (
                f"As `objstate batch` runs logs; the processes were started and compiled before. The load was "
                f"{load:.1f} processes, these included.",
            ),
        )
    ]


def _begun(environment: dict[str, str]) -> Taken:
    """A run of the first seconds of the sample log."""
    return _taken(lambda: _typed(environment, end=SHORT), resource.RUSAGE_CHILDREN)


def _estimate() -> RunResult:
    with tempfile.TemporaryDirectory() as folder:
        return estimate_log([LOG], BUILDING, Path(folder) / "result")


def _typed(environment: dict[str, str] | None = None, end: float | None = None) -> None:
    with tempfile.TemporaryDirectory() as folder:
        result = str(Path(folder) / "result")
        part = () if end is None else ("--to", str(end))
        given = ("estimate", str(LOG), "--building", str(BUILDING), "--out", result)
        _started(*COMMAND, *given, *part, environment=environment)


def _started(*command: str, environment: dict[str, str] | None = None) -> None:
    subprocess.run(command, check=True, capture_output=True, env=environment)


def _taken(call: Callable[[], object], who: int) -> Taken:
    used, began = _processor(who), time.perf_counter()
    call()
    return Taken(time.perf_counter() - began, _processor(who) - used)


def _processor(who: int) -> float:
    used = resource.getrusage(who)
    return used.ru_utime + used.ru_stime


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Processes that have run the log before."""
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=spawn) as pool:
        _together(pool)
        yield pool


def _together(pool: ProcessPoolExecutor) -> float:
    """s by the clock until as many runs as there are cores are done."""
    began = time.perf_counter()
    for run in [pool.submit(_estimate) for _ in range(CORES)]:
        run.result()
    return time.perf_counter() - began
