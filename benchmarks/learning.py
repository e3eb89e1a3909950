"""What is gained by learning a building from drives: ``python -m benchmarks.learning --seeds 401:404``

Each seed is a building of the independent simulator, whose model has the errors of a scenario. Its
walls, doors and lasers are learnt from some drives on different days, and other days' drives are
estimated with the model as it was, as it was learnt, and with none of these errors; also, if asked,
with a world that has learnt from the same drives, one after the other.
"""

from __future__ import annotations

import argparse
import json
import shutil
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.independent.metrics import Value
from benchmarks.independent.options import seeds_of
from benchmarks.independent.results import Measured, measure
from benchmarks.independent.simulator import simulated
from benchmarks.independent.table import table
from objstate import RunOptions, estimate_log
from objstate.discovery import refine_building

EXACT = "nothing"  # the scenario without errors


KINDS = ("modelled", "learnt", "world", "exact")


def held_out(
    drive: Path, building: Path, name: str, seed: int, run: RunOptions, world: Path | None = None
) -> list[Measured]:
    """The measures of a drive estimated in a building, perhaps with a copy of a world."""
    with tempfile.TemporaryDirectory() as folder:
        copy = None
        if world is not None:
            copy = Path(shutil.copyfile(world, Path(folder) / "world.db"))
        began = time.perf_counter()
        estimate_log([drive / "log.mcap"], building, Path(folder) / "out", run, world=copy)
        return measure(name, seed, drive, Path(folder) / "out", time.perf_counter() - began)


def bearings_off(drives: Path, learnt: Path) -> str:
    """How far learnt bearings are from the truth, and how often 90 % intervals hold it."""
    told = {each["door"]: each for each in json.loads(learnt.read_text())["doors"]}
    errors = []
    for name, truth in true_bearings(drives).items():
        if name in told:
            off = told[name]["bearing_deg"] - truth
            errors.append((abs(off), abs(off) <= 1.645 * max(told[name]["bearing_std_deg"], 0.02)))
    off = np.array([each[0] for each in errors])
    held = np.mean([each[1] for each in errors])
    return f"{len(off)} bearings: median {np.median(off):.2f}, mean {off.mean():.2f} deg off, {held:.0%} held"


def true_bearings(drive: Path) -> dict[str, float]:
    """deg by door, of the true closed leaf beside the modelled one; by the files of both models."""
    import math

    from objstate import load_building

    model = load_building(drive / "building.urdf")
    exact = load_building(drive.parents[1] / EXACT / drive.name / "building.urdf")
    out = {}
    for name, item in model.objects.items():
        turn = item.origin[:3, :3].T @ exact.objects[name].origin[:3, :3]
        out[name] = math.degrees(math.atan2(turn[1, 0], turn[0, 0])) * float(item.axis[2])
    return out


def summary(name: str, values: Sequence[Value]) -> str:
    errors = [abs(value.error) for value in values]
    return f"{name}: {len(errors)} final angles, mean {np.mean(errors):.2f} deg"


def main() -> None:
    """Learn, estimate, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scenario", default="bearing-2deg")
    parser.add_argument("--seeds", type=seeds_of, default=seeds_of("401:404"))
    parser.add_argument("--days", type=int, default=5, help="drives that are learnt from")
    parser.add_argument("--jobs", type=int, default=2, help="drives at a time")
    parser.add_argument("--held-out", type=int, default=2, help="drives that are estimated")
    parser.add_argument("--cache", type=Path, default=Path("out/independent"))
    parser.add_argument(
        "--kinds", nargs="+", choices=KINDS, default=("modelled", "learnt", "exact")
    )
    arguments = parser.parse_args()
    found: list[Measured] = []
    for seed in arguments.seeds:
        with tempfile.TemporaryDirectory() as folder:
            found += _of_seed(seed, arguments, Path(folder))
    print(table(found))


def _of_seed(seed: int, arguments: argparse.Namespace, folder: Path) -> list[Measured]:
    """The measures of one building, which is learnt in a folder."""
    scenario, cache, found = arguments.scenario, arguments.cache, list[Measured]()
    days = range(1, arguments.days + 1)
    drives = [simulated(scenario, seed, cache, day) for day in days]
    logs = [drive / "log.mcap" for drive in drives]
    model, world = folder / "office.urdf", folder / "world.db"
    shutil.copyfile(drives[0] / "building.urdf", model)
    learnt, mounts = model, {}
    if "learnt" in arguments.kinds:
        began = time.perf_counter()
        refined = refine_building(logs, model, folder / "learnt", jobs=arguments.jobs)
        seconds = time.perf_counter() - began
        learnt, mounts = refined.urdf, {each.frame: each.corrected_mount for each in refined.lasers}
        for day in days:
            simulated(EXACT, seed, cache, day)
        print(f"seed {seed}: learnt in {seconds:.0f} s;", end=" ")
        print(bearings_off(drives[0], learnt.with_name("learn.json")), flush=True)
    if "world" in arguments.kinds:
        began = time.perf_counter()
        for day, log in zip(days, logs, strict=True):
            estimate_log([log], model, folder / f"out{day}", world=world)
        print(f"seed {seed}: a world learnt in {time.perf_counter() - began:.0f} s", flush=True)
    for day in range(arguments.days + 1, arguments.days + 1 + arguments.held_out):
        drive, exact = (simulated(each, seed, cache, day) for each in (scenario, EXACT))
        own, usual = RunOptions(mounts=mounts), RunOptions()
        for kind in arguments.kinds:
            if kind == "modelled":
                found += held_out(drive, model, "as modelled", seed, usual)
            elif kind == "learnt":
                found += held_out(drive, learnt, "as learnt", seed, own)
            elif kind == "world":
                found += held_out(drive, model, "by a world", seed, usual, world)
            else:
                found += held_out(drive, exact / "building.urdf", "exact", seed, usual)
    return found


if __name__ == "__main__":
    main()
