"""Drives simulated, estimated and measured, several at once."""

from __future__ import annotations

import multiprocessing
import shutil
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TypeVar

from benchmarks.independent.results import Measured, measure
from benchmarks.independent.simulator import simulated
from objstate import RunOptions, estimate_log, load_settings

T = TypeVar("T")


@dataclass(frozen=True)
class Task:
    """One drive to be simulated and estimated."""

    scenario: str
    seed: int
    cache: Path
    settings: Path | None
    keep: Path | None


def run(task: Task) -> list[Measured]:
    """Simulate a drive unless the cache holds it, estimate it, and measure the result."""
    drive = simulated(task.scenario, task.seed, task.cache)
    return estimated(task, drive, partial(measure, task.scenario, task.seed, drive))


def estimated(task: Task, drive: Path, measured: Callable[[Path, float], T]) -> T:
    """What is measured of a drive's result folder, and of the seconds that it took."""
    options = RunOptions() if task.settings is None else RunOptions(load_settings(task.settings))
    with tempfile.TemporaryDirectory() as folder:
        out, began = Path(folder) / "out", time.perf_counter()
        estimate_log([drive / "log.mcap"], drive / "building.urdf", out, options)
        result = measured(out, time.perf_counter() - began)
        if task.keep is not None:
            kept = task.keep / task.scenario / str(task.seed)
            shutil.rmtree(kept, ignore_errors=True)
            shutil.copytree(out, kept)
        return result


def measure_all(
    run: Callable[[Task], list[T]], tasks: Sequence[Task], jobs: int
) -> tuple[list[T], list[str]]:
    """What ``run`` measures of all drives, in the order of the tasks, and what failed."""
    done: dict[Task, list[T]] = {}
    failures = []
    # polars has threads, which a forked process would wait for in vain
    spawn = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(jobs, mp_context=spawn) as pool:
        futures = {pool.submit(run, task): task for task in tasks}
        for future in as_completed(futures):
            task = futures[future]
            try:
                done[task] = future.result()
            except Exception as error:  # a drive that fails must not take the others along
                failures.append(f"{task.scenario}, seed {task.seed}: {error!r}")
            print(f"\r{len(done) + len(failures)} of {len(tasks)} drives", end="", file=sys.stderr)
    print(file=sys.stderr)
    return [drive for task in tasks for drive in done.get(task, [])], failures
