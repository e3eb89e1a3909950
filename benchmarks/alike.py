"""Furniture that looks alike, by who stands where: ``python benchmarks/alike.py SEED...``

Three bins with one outline stand in a row, 0.7 m apart, in a room that a robot drives through.
Prints, for each case, the expected number of bins at a place where one stands (one is right), at all
other places, and beyond one at a place; and the probability of each bin's most probable place
beside the share of those that are right. Cases: ``stands``, each within 0.15 m of its place;
``gone``, the first was carried out of the room; ``shifted``, each stands at the next one's place;
``leaves``, the second is carried out while the robot drives; ``passes``, the first is carried around
the second one; ``drawn``, all stand as the prior has it.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

import objstate
from objstate.simulation import simulate

BINS, APART, AT_PLACE = 3, 0.7, 0.15  # m
OUTSIDE = (20.0, 20.0)
URDF = Path(__file__).parent / "scenes" / "room.urdf"
CASES = ("stands", "gone", "shifted", "leaves", "passes", "drawn")
BIN = """
  <link name="bin_{k}_link"><visual><origin xyz="0 0 0.4"/><geometry><box size="0.4 0.4 0.8"/></geometry>
  </visual></link>
  <joint name="bin_{k}" type="planar"><parent link="building"/><child link="bin_{k}_link"/>
  <origin xyz="{x} {y} 0"/><axis xyz="0 0 1"/></joint>
"""
SCENE = """
building: room.urdf
seed: {seed}
route:
  speed: 0.4
  start_yaw: 0.0
  waypoints: [{{x: -2.3, y: -1.9, pause: 1.0}}, {{x: 2.3, y: -1.9}}, {{x: -2.3, y: -1.9}}]
lasers:
  - {{frame: front, mount: {{x: 0.2, z: 0.3}}, beams: 181, range_max: 8.0, sigma: 0.03,
     false_share: 0.02}}
objects:
{objects}
"""


def home(k: int) -> np.ndarray:
    """(2,) m, where the model has a bin."""
    return np.array([(k - 1) * APART, 0.2])


def written(case: str, seed: int, folder: Path) -> None:
    """The building with its bins, and the scene."""
    rng = np.random.default_rng([seed, CASES.index(case)])
    walls = URDF.read_text().split("</link>")[0] + "</link>"
    bins = "".join(BIN.format(k=k + 1, x=home(k)[0], y=home(k)[1]) for k in range(BINS))
    (folder / "room.urdf").write_text(walls + bins + "</robot>")
    lines, drawn = [], np.zeros((BINS, 2))
    while np.hypot(*(drawn[[0, 1, 2]] - drawn[[1, 2, 0]]).T).min() < 0.6:
        homes = np.array([home(k) for k in range(BINS)])
        drawn = homes + np.clip(rng.normal(0.0, 0.5, (BINS, 2)), -1.0, 1.0)
    for k in range(BINS):
        place = home(k + 1 if case == "shifted" else k) + rng.uniform(-0.15, 0.15, 2)
        if case == "drawn":
            place = drawn[k]
        if case == "gone" and k == 0:
            place = np.array(OUTSIDE)
        yaw = rng.uniform(-0.3, 0.3)
        line = f"  - name: bin_{k + 1}\n    initial: {{x: {place[0]}, y: {place[1]}, yaw: {yaw}}}\n"
        to = None
        if case == "leaves" and k == 1:
            to = np.array(OUTSIDE)
        if case == "passes" and k == 0:
            to = np.array([0.35, 0.9]) + rng.uniform(-0.1, 0.1, 2)
        if to is not None:
            line += (
                f"    changes: [{{at: 14.0, to: {{x: {to[0]}, y: {to[1]}, yaw: {yaw}}}, "
                "duration: 0.1}]\n"
            )
        lines.append(line)
    (folder / "scene.yaml").write_text(SCENE.format(seed=seed, objects="".join(lines)))


class Outcome(NamedTuple):
    """How one drive came out."""

    there: float  # expected number of bins at a place where one stands, mean
    elsewhere: float  # expected number at all other places
    twice: float  # expected number beyond one at a place, sum
    stated: float  # probability of each bin's most probable place, or of its absence, mean
    right: float  # share of those that are right


def outcome(case: str, seed: int) -> Outcome:
    """One drive."""
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        written(case, seed, folder)
        simulate(folder / "scene.yaml", folder / "drive")
        building = objstate.load_building(folder / "room.urdf")
        rules = {"objects": [{"match": "bin_*", "prior_std_m": 0.5}]}
        estimator = objstate.Estimator(building, objstate.Settings.model_validate(rules), seed=seed)
        for record in objstate.open_log(folder / "drive" / "log.mcap"):
            estimator.feed(record)
        truth = objstate.recording.tables.read_truth(folder / "drive" / "truth.csv")
    last = {(row.object, row.coordinate): row.value for row in truth}
    places = np.array([[last[f"bin_{k + 1}", axis] for axis in "xy"] for k in range(BINS)])
    there = np.hypot(*places.T) < 10.0
    chance = np.zeros((BINS, BINS))  # of a bin's standing at each one's true place
    total = np.zeros(BINS)
    for k in range(BINS):
        belief = estimator.objects[f"bin_{k + 1}"]
        off = np.hypot(*np.moveaxis(belief.states[:, None, :2] - places, 2, 0))
        chance[k] = belief.presence * (belief.weights.values @ (off < AT_PLACE))
        total[k] = belief.presence
    count, stated = chance.sum(axis=0), np.column_stack([chance, 1.0 - total])
    true = np.where(there, np.arange(BINS), BINS)
    return Outcome(
        float(count[there].mean()),
        float((total - chance[:, there].sum(axis=1)).sum()),
        float(np.maximum(count - 1.0, 0.0).sum()),
        float(stated.max(axis=1).mean()),
        float((stated.argmax(axis=1) == true).mean()),
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+")
    parser.add_argument("--cases", nargs="+", default=CASES)
    arguments = parser.parse_args()
    print("| case | bins at a true place | elsewhere | twice | most probable: stated | right |")
    print("|" + " --- |" * 6)
    for name in arguments.cases:
        each = np.array([outcome(name, seed) for seed in arguments.seeds])
        figures = " | ".join(f"{value:.2f}" for value in each.mean(axis=0))
        print(f"| {name} | {figures} |", flush=True)
