"""How soon a door is followed that somebody moves while the robot watches: ``watched.py SEED...``

The robot stands at three places of the corridor, and every door is moved once. Of the doors near it
that turn by over 5 degrees and that the lasers see where they come to rest, a row for each: how long
after it came to rest the estimate was within 5 degrees of the truth for good, and how far off it is
in the end.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from objstate.building import load_building
from objstate.geometry import FloatArray
from objstate.recording.tables import read_estimates, read_truth
from objstate.records import NANOSECONDS, Rays
from objstate.run import RunOptions, estimate_log
from objstate.sensing import ExpectedRanges
from objstate.simulation import simulate
from objstate.simulation.scene import Laser, load_scene

CORRIDOR = Path(__file__).parents[1] / "models" / "corridor"
PLACES = (4.0, 10.5, 17.5)  # m along the corridor
RIGHT = np.radians(5.0)
SEEN_BY = 5  # beams, a degree apart, that a leaf must stop to count as seen
REACH = 3.5  # m; within which doors are estimated


@dataclass(frozen=True)
class Followed:
    """One door that was moved while it was watched."""

    name: str
    turned: float  # rad
    late: float  # s after it came to rest
    error: float  # rad, in the end


def scene_at(folder: Path, x: float, seed: int) -> Path:
    """The corridor with a robot that stops at x, and doors that move 12 to 15 s after the start."""
    scene = yaml.safe_load((CORRIDOR / "corridor.scene.yaml").read_text())
    scene["building"] = str(CORRIDOR / "corridor.urdf")
    scene["route"]["waypoints"] = [
        {"x": x - 1.5, "y": 0.0, "pause": 0.5},
        {"x": x, "y": 0.0, "pause": 25.0},
    ]
    change = {"at": 12.0 + seed % 4, "to": "random"}
    scene["objects"] = [{"name": "door_*", "initial": "random", "changes": [change]}]
    path = folder / "watched.scene.yaml"
    path.write_text(yaml.safe_dump(scene))
    return path


def followed(x: float, seed: int) -> Iterator[Followed]:
    """The doors that are moved near a robot at x."""
    with tempfile.TemporaryDirectory() as folder:
        scene = scene_at(Path(folder), x, seed)
        building, lasers = load_building(load_scene(scene).building), load_scene(scene).lasers
        expected = ExpectedRanges(building)
        simulated = simulate(scene, Path(folder) / "drive", seed=seed)
        truth = read_truth(simulated.folder / "truth.csv")
        run = estimate_log(
            [simulated.log], load_scene(scene).building, Path(folder) / "result", RunOptions()
        )
        estimates = read_estimates(run.folder)
        for name in sorted(set(estimates["object"])):
            states = [(each.stamp_ns, each.value) for each in truth if each.object == name]
            stamps, angles = (np.array(column) for column in zip(*states, strict=True))
            rested = stamps[np.flatnonzero(angles != angles[-1])[-1] + 1]
            turned = float(angles[-1] - angles[0])
            if abs(turned) < RIGHT or not seen(expected, lasers, name, angles[-1:], x):
                continue
            rows = estimates.filter(estimates["object"] == name)
            off = np.abs(rows["median"].to_numpy() - angles[-1])
            wrong = rows["stamp"].to_numpy()[off > RIGHT]
            late = max(float(wrong.max(initial=rested) - rested) / NANOSECONDS, 0.0)
            yield Followed(name, turned, late, float(off[-1]))


def seen(
    expected: ExpectedRanges, lasers: Sequence[Laser], name: str, state: FloatArray, x: float
) -> bool:
    """Whether enough beams of the lasers end on a door's leaf."""
    pose, count = np.array([[x, 0.0, 0.0]]), 0
    for laser in lasers:
        bearings = np.linspace(laser.angle_min, laser.angle_max, laser.beams) + laser.mount.yaw
        directions = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(laser.beams)])
        at = [laser.mount.x, laser.mount.y, laser.mount.z]
        rays = Rays(np.tile(at, (laser.beams, 1)), directions)
        walls, leaf = (
            expected.walls(pose, rays)[0],
            expected.object(name, state[None], pose, rays)[0, 0],
        )
        count = max(count, int(((leaf < walls) & (leaf < REACH)).sum()))
    return count >= SEEN_BY


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="How soon moved doors are followed.")
    parser.add_argument("seeds", type=int, nargs="+")
    every = []
    for seed in parser.parse_args().seeds:
        for x in PLACES:
            for each in followed(x, seed):
                every.append(each)
                print(
                    f"seed {seed}, {each.name}: turned by {np.degrees(each.turned):.0f} deg, right "
                    f"{each.late:.1f} s after it came to rest; {np.degrees(each.error):.1f} deg off",
                    flush=True,
                )
    late = np.array([each.late for each in every])
    print(
        f"{len(every)} doors: right within 1 s {np.mean(late <= 1.0):.0%}; median "
        f"{np.median(late):.1f} s, largest {late.max():.1f} s"
    )
