"""What is gained by learning a building from drives: ``python -m benchmarks.learning --seeds 401:404``

Each seed is a building of the independent simulator, whose model has the errors of a scenario. Its
walls, doors and lasers are learnt from some drives on different days, and other days' drives are estimated with the
model as it was, as it was learnt, and with none of these errors.
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

from benchmarks.independent.__main__ import seeds_of
from benchmarks.independent.metrics import Value
from benchmarks.independent.results import Measured, measure
from benchmarks.independent.simulator import simulated
from benchmarks.independent.table import table
from objstate import RunOptions, estimate_log
from objstate.discovery import refine_building

EXACT = "nothing"  # the scenario without errors


def held_out(drive: Path, building: Path, name: str, seed: int, run: RunOptions) -> list[Measured]:
    """The measures of a drive estimated in a building."""
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        estimate_log([drive / "log.mcap"], building, Path(folder) / "out", run)
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
    parser.add_argument("--held-out", type=int, default=2, help="drives that are estimated")
    parser.add_argument("--cache", type=Path, default=Path("out/independent"))
    arguments = parser.parse_args()
    found: list[Measured] = []
    for seed in arguments.seeds:
        days = range(1, arguments.days + 1)
        drives = [simulated(arguments.scenario, seed, arguments.cache, day) for day in days]
        with tempfile.TemporaryDirectory() as text:
            folder = Path(text)
            shutil.copyfile(drives[0] / "building.urdf", folder / "office.urdf")
            began = time.perf_counter()
            logs = [drive / "log.mcap" for drive in drives]
            refined = refine_building(logs, folder / "office.urdf", folder / "learnt", jobs=2)
            seconds = time.perf_counter() - began
            for day in range(arguments.days + 1, arguments.days + 1 + arguments.held_out):
                drive = simulated(arguments.scenario, seed, arguments.cache, day)
                exact = simulated(EXACT, seed, arguments.cache, day)
                mounts = {each.frame: each.corrected_mount for each in refined.lasers}
                kinds = (
                    ("as modelled", drive / "building.urdf", RunOptions()),
                    ("as learnt", refined.urdf, RunOptions(mounts=mounts)),
                    ("exact", exact / "building.urdf", RunOptions()),
                )
                for name, building, run in kinds:
                    found += held_out(drive, building, name, seed, run)
            for day in days:
                simulated(EXACT, seed, arguments.cache, day)
            print(f"seed {seed}: learnt in {seconds:.0f} s;", end=" ")
            print(bearings_off(drives[0], folder / "learnt" / "learn.json"), flush=True)
    print(table(found))


if __name__ == "__main__":
    main()
