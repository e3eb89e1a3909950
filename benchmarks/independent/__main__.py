"""``python -m benchmarks.independent``: simulate, estimate, and print a table per scenario."""

from __future__ import annotations

import argparse
import shutil
import sys
import tempfile
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from benchmarks.independent.results import Measured, from_json, measure, to_json
from benchmarks.independent.scenarios import SCENARIOS
from benchmarks.independent.simulator import simulated
from benchmarks.independent.table import comparison, table
from objstate import RunOptions, estimate_log, load_settings


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
    options = RunOptions() if task.settings is None else RunOptions(load_settings(task.settings))
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        estimate_log([drive / "log.mcap"], drive / "building.urdf", Path(folder) / "out", options)
        seconds = time.perf_counter() - began
        measured = measure(task.scenario, task.seed, drive, Path(folder) / "out", seconds)
        if task.keep is not None:
            kept = task.keep / task.scenario / str(task.seed)
            shutil.rmtree(kept, ignore_errors=True)
            shutil.copytree(Path(folder) / "out", kept)
        return measured


def measure_all(tasks: Sequence[Task], jobs: int) -> tuple[list[Measured], list[str]]:
    """All drives, in the order of the tasks, and what failed."""
    done: dict[Task, list[Measured]] = {}
    failures = []
    with ProcessPoolExecutor(jobs) as pool:
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


def seeds_of(text: str) -> list[int]:
    """``1:9`` is 1 to 8, ``3`` is 3; several are parted by commas."""
    seeds: list[int] = []
    for part in text.split(","):
        begin, colon, end = part.partition(":")
        seeds += range(int(begin), int(end)) if colon else [int(begin)]
    return seeds


def scenarios_of(text: str) -> list[str]:
    """Names parted by commas."""
    names = text.split(",")
    for name in names:
        if name not in SCENARIOS:
            raise argparse.ArgumentTypeError(
                f"no scenario '{name}'; choose of {', '.join(SCENARIOS)}"
            )
    return names


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command; 1 if a drive failed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.independent",
        description="Accuracy on drives of an independent simulator.",
    )
    parser.add_argument(
        "--scenarios",
        type=scenarios_of,
        default=list(SCENARIOS),
        help=f"by commas; default: all of {', '.join(SCENARIOS)}",
    )
    parser.add_argument("--seeds", type=seeds_of, default=[1, 2, 3, 4], help="as in 1:9 or 3,5")
    parser.add_argument("--jobs", type=int, default=2, help="processes")
    parser.add_argument("--settings", type=Path, help="YAML, as of `objstate estimate --config`")
    parser.add_argument("--cache", type=Path, default=Path("out/independent"), help="of drives")
    parser.add_argument("--keep", type=Path, help="a folder for the results of all drives")
    parser.add_argument("--json", type=Path, help="write what was measured")
    parser.add_argument("--against", type=Path, help="JSON of another run, paired by seed")
    given = parser.parse_args(arguments)

    tasks = [
        Task(scenario, seed, given.cache, given.settings, given.keep)
        for scenario in given.scenarios
        for seed in given.seeds
    ]
    drives, failures = measure_all(tasks, given.jobs)
    if given.json:
        given.json.parent.mkdir(parents=True, exist_ok=True)
        given.json.write_text(to_json(drives), encoding="utf-8")
    print(table(drives))
    if given.against:
        print("\n" + comparison(drives, from_json(given.against.read_text(encoding="utf-8"))))
    for failure in failures:
        print(f"failed: {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
