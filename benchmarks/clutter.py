"""What ``estimate --grid`` finds of boxes that the building doesn't know: ``python -m benchmarks.clutter``

Simulates ``scenes/clutter.scene.yaml`` with several seeds. A cell counts as right within 10 cm of a box, and
a box as found with ten right cells or more in the map at the end. Prints processor times of runs without and
with a grid, too.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time

import numpy as np
import shapely

from objstate.geometry import compose
from objstate.recording.grids import read_clutter
from objstate.run import estimate_log
from objstate.simulation import simulate
from objstate.simulation.scene import load_scene

SCENE = Path(__file__).parent / "scenes/clutter.scene.yaml"
SEEDS = (1, 2, 3)
NEAR, FOUND = 0.1, 10  # m about a box; cells of a box that is found


def main() -> None:
    """Print a row for each seed."""
    scene = load_scene(SCENE)
    boxes = []
    for box in scene.boxes:
        assert box.pose is not None
        halves = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.array(box.size[:2]) / 2.0
        pose = np.array([box.pose.x, box.pose.y, box.pose.yaw])
        corners = compose(pose, np.column_stack([halves, np.zeros(4)]))[:, :2]
        boxes.append(shapely.Polygon(corners).buffer(NEAR))
    print("| seed | boxes found | cells of boxes | other cells | scans | s without | s with |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as folder:
        for seed in SEEDS:
            drive = Path(folder) / f"drive{seed}"
            simulate(SCENE, drive, seed=seed)
            seconds = {}
            for grid in (True, False, True):  # the first compiles what isn't compiled yet
                run = Path(folder) / f"{seed}{grid}"
                began = process_time()
                result = estimate_log(
                    [drive / "log.mcap"], scene.building, run, grid=grid, overwrite=True
                )
                seconds[grid] = process_time() - began
            last = read_clutter(Path(folder) / f"{seed}{True}").row(-1, named=True)
            points = shapely.points(np.array([last["x"], last["y"]]).T / 100.0)
            right = np.array([shapely.contains(box, points) for box in boxes])
            print(
                f"| {seed} | {(right.sum(axis=1) >= FOUND).sum()} of {len(boxes)} "
                f"| {right.any(axis=0).sum()} | {(~right.any(axis=0)).sum()} "
                f"| {result.counts['Scan']} | {seconds[False]:.2f} | {seconds[True]:.2f} |"
            )


if __name__ == "__main__":
    main()
