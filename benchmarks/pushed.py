"""A trolley that is pushed through a room: ``python -m benchmarks.pushed SEED...``

A robot that stands in a room sees a trolley start, cross the room at 0.3 to 0.8 m/s, pass behind a
pillar, and stop. Prints, with and without a mode of moving, how far the trolley is believed from
where it is while it is pushed, while it is hidden, and at the end, and how often the 90 % intervals
of x and y hold.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

import objstate
from objstate.objects import ObjectBelief
from objstate.recording.tables import read_truth
from objstate.simulation import simulate

URDF = """<robot name="hall">
  <link name="building">
{walls}  </link>
  <link name="trolley_link"><visual><origin xyz="0 0 0.4"/><geometry><box size="0.7 0.45 0.8"/>
  </geometry></visual></link>
  <joint name="trolley" type="planar"><parent link="building"/><child link="trolley_link"/>
  <origin xyz="-2 1.5 0"/><axis xyz="0 0 1"/></joint>
</robot>
"""
WALLS = ((0.0, 3.0, 8.0, 0.1), (0.0, -3.0, 8.0, 0.1), (-4.0, 0.0, 0.1, 6.0), (4.0, 0.0, 0.1, 6.0),
         (0.3, 0.4, 0.4, 0.4))  # fmt: skip
WALL = '    <visual><origin xyz="{} {} 1"/><geometry><box size="{} {} 2"/></geometry></visual>\n'
SCENE = """
building: hall.urdf
seed: {seed}
route:
  speed: 0.3
  start_yaw: 1.57
  waypoints: [{{x: 0.0, y: -1.5, pause: {pause}}}, {{x: 0.1, y: -1.5, pause: 2.0}}]
lasers:
  - {{frame: front, mount: {{x: 0.2, z: 0.3}}, beams: 181, range_max: 8.0, rate: 10.0, sigma: 0.02}}
objects:
  - name: trolley
    initial: {{x: {x}, y: {y}, yaw: {yaw}}}
    changes: [{{at: 4.0, to: {{x: {to_x}, y: {to_y}, yaw: {to_yaw}}}, duration: {seconds}}}]
"""


def written(seed: int, folder: Path) -> tuple[float, float]:
    """The scene, and when the trolley begins and ends to move, s."""
    rng = np.random.default_rng(seed)
    (folder / "hall.urdf").write_text(URDF.format(walls="".join(WALL.format(*w) for w in WALLS)))
    x, y = rng.uniform(-2.2, -1.8), rng.uniform(1.3, 1.7)
    to_x, to_y = rng.uniform(1.8, 2.4), rng.uniform(1.2, 2.0)
    yaw, to_yaw = rng.uniform(-0.2, 0.2, 2)
    seconds = np.hypot(to_x - x, to_y - y) / rng.uniform(0.3, 0.8)
    scene = SCENE.format(
        seed=seed, pause=6.0 + seconds, x=x, y=y, yaw=yaw,
        to_x=to_x, to_y=to_y, to_yaw=to_yaw, seconds=seconds,
    )  # fmt: skip
    (folder / "scene.yaml").write_text(scene)
    return 4.0, 4.0 + float(seconds)


def held(belief: ObjectBelief, truth: np.ndarray) -> bool:
    """Whether the intervals of x and y hold the true place."""
    lower, upper = belief.interval()
    return bool(((lower[:2] <= truth[:2]) & (truth[:2] <= upper[:2])).all())


def followed(seed: int, folder: Path, rules: dict) -> dict[str, list[tuple[float, bool]]]:
    """Errors in m, and whether intervals hold, by phase."""
    begin, end = written(seed, folder)
    simulate(folder / "scene.yaml", folder / "drive", overwrite=True)
    building = objstate.load_building(folder / "hall.urdf")
    truth: dict[int, dict[str, float]] = defaultdict(dict)
    for row in read_truth(folder / "drive" / "truth.csv"):
        if row.object == "trolley":
            truth[row.stamp_ns][row.coordinate] = row.value
    stamps = np.array(sorted(truth))
    places = np.array([[truth[stamp][axis] for axis in ("x", "y", "yaw")] for stamp in stamps])
    settings = objstate.Settings.model_validate({"objects": [{"match": "*", **rules}]})
    estimator = objstate.Estimator(building, settings, seed=seed)
    first, out = None, defaultdict(list)
    for record in objstate.open_log(folder / "drive" / "log.mcap"):
        first = record.stamp_ns if first is None else first
        rows = estimator.feed(record)
        if type(record).__name__ != "Scan":
            continue
        belief = estimator.object_at("trolley", record.stamp_ns)
        now = (record.stamp_ns - first) / 1e9
        place = np.array([np.interp(record.stamp_ns, stamps, axis) for axis in places.T])
        hidden = not any(row.observed for row in rows)
        moving = begin + 0.3 < now < end
        phase = "stands" if not moving else "hidden" if hidden else "pushed"
        off = float(np.hypot(*(belief.mean - place)[:2]))
        out[phase].append((off, held(belief, place)))
    return out


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="+")
    given = parser.parse_args()
    kinds: dict[str, dict] = {
        "moves, 1 an hour": {},
        "moves, 1 a second": {"dynamics": {"moves_per_hour": 3600.0}},
        "pushed": {"motion": "pushed"},
    }
    print("| dynamics | trolley | scans | off: mean, median, 95 % (cm) | in 90 % intervals |")
    print("| --- | --- | --- | --- | --- |")
    for kind, rules in kinds.items():
        found = defaultdict(list)
        for seed in given.seeds:
            with tempfile.TemporaryDirectory() as folder:
                for phase, rows in followed(seed, Path(folder), rules).items():
                    found[phase] += rows
        for phase, rows in sorted(found.items()):
            off = 100.0 * np.array([row[0] for row in rows])
            inside = np.mean([row[1] for row in rows])
            print(
                f"| {kind} | {phase} | {len(off)} | {off.mean():.1f}, {np.median(off):.1f}, "
                f"{np.quantile(off, 0.95):.1f} | {inside:.0%} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
