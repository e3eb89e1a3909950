"""What learning a long corridor takes: ``python -m benchmarks.corridor --drives 2 4 8``

A corridor of 200 m with 60 doors, whose model has all errors of the scenario ``everything``, is
driven through once a day in five minutes. Its walls, doors and lasers are learnt from so many drives
anew, each time in a process of its own. Printed are the time, the processor time and the largest
memory of all processes together, and how well hinges and bearings were learnt.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import resource
import shutil
import tempfile
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from benchmarks.independent.drive import Route
from benchmarks.independent.model import ModelErrors
from benchmarks.independent.scenarios import SCENARIOS, Plan
from benchmarks.independent.simulator import simulate
from objstate import load_building
from objstate.discovery import refine_building

LENGTH, ROOMS = 200.0, 30  # m; on each side
ROUTE = Route(returns=False, speeds=(0.66, 0.70))  # m/s: five minutes
MEMORY_STEP = 0.5  # s between looks at the memory


@dataclass(frozen=True)
class Cost:
    """What learning took."""

    seconds: float
    processor_s: float
    memory_mb: float  # of all processes at once, the largest


def plan_of(seed: int) -> Plan:
    """``everything``, with as many people and boxes a metre as in its short corridor."""
    plan = SCENARIOS["everything"](seed)
    many = replace(
        plan.world, length=LENGTH, rooms=ROOMS, walkers=8, standing=5, boxes=20, moves=20
    )
    return replace(plan, world=many, route=ROUTE)


def driven(seed: int, cache: Path, day: int, *, exact: bool = False) -> Path:
    """The folder of a day's drive, made if the cache doesn't hold it."""
    folder = cache / ("exact" if exact else "everything") / f"{seed}-day{day}"
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        made = Path(tempfile.mkdtemp(dir=folder.parent))
        plan = plan_of(seed)
        simulate(replace(plan, errors=ModelErrors()) if exact else plan, seed, made, day)
        made.rename(folder)
    return folder


def cost_of(logs: list[Path], model: Path, out: Path, jobs: int) -> Cost:
    """Learn in a process of its own."""
    began, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
    process = multiprocessing.get_context("spawn").Process(
        target=refine_building, args=(logs, model, out), kwargs={"jobs": jobs}
    )
    process.start()
    assert process.pid is not None
    largest, ended = [0.0], threading.Event()
    watcher = threading.Thread(target=_watch, args=(process.pid, largest, ended))
    watcher.start()
    process.join()
    ended.set()
    watcher.join()
    if process.exitcode:
        raise SystemExit("Learning failed.")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return Cost(time.perf_counter() - began, spent, largest[0])


def _watch(root: int, largest: list[float], ended: threading.Event) -> None:
    while not ended.wait(MEMORY_STEP):
        largest[0] = max(largest[0], sum(_memory(each) for each in _family(root)))


def _family(root: int) -> Iterator[int]:
    """A process and those that it started."""
    yield root
    for task in Path(f"/proc/{root}/task").glob("*/children"):
        try:
            children = task.read_text().split()
        except OSError:  # it ended meanwhile
            continue
        for child in children:
            yield from _family(int(child))


def _memory(process: int) -> float:
    """MB, of its own."""
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    except (OSError, IndexError):
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def quality(model: Path, exact: Path, out: Path) -> str:
    """How far hinges and bearings are off, before and after, and how often intervals hold them."""
    told = {each["door"]: each for each in json.loads((out / "learn.json").read_text())["doors"]}
    before, truth = load_building(model).objects, load_building(exact).objects
    after = load_building(next(out.glob("*.urdf"))).objects
    hinges, bearings = [], []
    for name, each in told.items():
        off = [np.abs(some[name].hinge - truth[name].hinge) for some in (before, after)]
        hinges.append((*(np.hypot(*one) for one in off), *(off[1] <= 1.645 * each["hinge_std_m"])))
        turns = [_turn(some[name].origin, truth[name].origin) for some in (before, after)]
        within = turns[1] <= 1.645 * each["bearing_std_deg"]
        bearings.append((*turns, within))
    of_hinges, of_bearings = np.array(hinges, dtype=float), np.array(bearings, dtype=float)
    return (
        f"{len(told)} doors; hinges off by {100 * np.median(of_hinges[:, 0]):.2f} cm, learnt "
        f"{100 * np.median(of_hinges[:, 1]):.2f}, {of_hinges[:, 2:].mean():.0%} of coordinates held; "
        f"bearings {np.median(of_bearings[:, 0]):.2f} deg, learnt {np.median(of_bearings[:, 1]):.2f}, "
        f"{of_bearings[:, 2].mean():.0%} held"
    )


def _turn(one: np.ndarray, other: np.ndarray) -> float:
    turn = one[:3, :3].T @ other[:3, :3]
    return abs(float(np.degrees(np.arctan2(turn[1, 0], turn[0, 0]))))


def main() -> None:
    """Simulate what isn't there, learn, and print a line for each number of drives."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seed", type=int, default=581, help="by seed % 3: two lasers, wide, skewed"
    )
    parser.add_argument("--drives", type=int, nargs="+", default=[2, 4, 8])
    parser.add_argument("--jobs", type=int, default=2, help="drives at a time")
    parser.add_argument("--cache", type=Path, default=Path("out/corridor"))
    parser.add_argument("--keep", type=Path, help="folder that gets what was learnt")
    given = parser.parse_args()
    exact = driven(given.seed, given.cache, 1, exact=True) / "building.urdf"
    for count in given.drives:
        drives = [driven(given.seed, given.cache, day) for day in range(1, count + 1)]
        model, logs = drives[0] / "building.urdf", [drive / "log.mcap" for drive in drives]
        with tempfile.TemporaryDirectory() as folder:
            out = Path(folder) / "learnt"
            cost = cost_of(logs, model, out, given.jobs)
            print(
                f"{count} drives: {cost.seconds:.0f} s, {cost.processor_s:.0f} s of processor time, "
                f"{cost.memory_mb:.0f} MB; {quality(model, exact, out)}",
                flush=True,
            )
            if given.keep is not None:
                shutil.copytree(out, given.keep / str(count))


if __name__ == "__main__":
    main()
