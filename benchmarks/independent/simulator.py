"""A scenario and a seed make a folder: log, model, truth, path, and what was in view."""

from __future__ import annotations

import json
import os
import shutil
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.independent import log
from benchmarks.independent.drive import corridor_drive, odometry
from benchmarks.independent.lasers import Corridor, Laser, rig, scans
from benchmarks.independent.model import ModelErrors, model_of, urdf
from benchmarks.independent.scenarios import SCENARIOS, Plan
from benchmarks.independent.shapes import Floats
from benchmarks.independent.world import corridor

DAY = 1_000_000  # between the seeds of one day and the next
GENERATOR = 3  # raise it whenever the same seed gives other files


def simulated(scenario: str, seed: int, cache: Path, day: int = 0) -> Path:
    """The folder of a drive, made if the cache doesn't hold it."""
    name = str(seed) if day == 0 else f"{seed}-day{day}"
    folder = cache / f"v{GENERATOR}" / scenario / name
    return made_once(folder, lambda into: simulate(SCENARIOS[scenario](seed), seed, into, day))


def made_once(folder: Path, write: Callable[[Path], None]) -> Path:
    """A folder, whole; written into another one before, unless it is there."""
    if not folder.exists():
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}-"))
        try:
            write(temporary)
            os.chmod(temporary, 0o755)
            temporary.rename(folder)
        except OSError:
            if not folder.exists():  # else another process made it meanwhile
                raise
        finally:
            shutil.rmtree(temporary, ignore_errors=True)
    return folder


def simulate(plan: Plan, seed: int, folder: Path, day: int = 0) -> None:
    """Write a drive's files into a folder. On other days doors, boxes and noise are others."""
    drive = corridor_drive(seed, plan.route, plan.world.length)
    world = corridor(seed, plan.world, drive.along, day)
    lasers, mounts = _mounted(plan, seed)
    chance = seed + DAY * day
    readings = scans(chance, Corridor(world), drive, lasers)
    wheels = odometry(chance, drive, plan.odometry)
    log.write_log(folder / "log.mcap", chance, drive, wheels, lasers, mounts, readings)
    log.write_truth(folder / "truth.csv", world, drive.duration)
    log.write_path(folder / "path.tum", drive)
    log.write_seen(folder / "seen.npz", readings)
    model = urdf(model_of(world, plan.errors, seed))
    (folder / "building.urdf").write_text(model, encoding="utf-8")
    facts = {
        "doors": [door.name for door in world.doors],
        "limits": {door.name: [0.0, door.limit] for door in world.doors},
        "ends": [[name, log.stamp(time)] for name, time in world.ends],
        "begin": log.stamp(0.0),
        "end": log.stamp(drive.duration),
        "plan": repr(plan),
    }
    (folder / "facts.json").write_text(json.dumps(facts, indent=1), encoding="utf-8")


def _mounted(plan: Plan, seed: int) -> tuple[list[Laser], list[Floats]]:
    """The lasers as they really are, and where the log says that they are."""
    rng = np.random.default_rng([seed, 61])
    errors: ModelErrors = plan.errors
    lasers, mounts = [], []
    for laser in rig(plan.rig):
        dx, dy, yaw, bias = rng.standard_normal(4)
        mounts.append(np.array([laser.x, laser.y, laser.yaw]))
        lasers.append(
            replace(
                laser,
                x=laser.x + errors.laser_shift * dx,
                y=laser.y + errors.laser_shift * dy,
                yaw=laser.yaw + errors.laser_yaw * yaw,
                bias=plan.range_bias * bias,
                clock=plan.clock,
            )
        )
    return lasers, mounts
