"""Localization in maps made of the logs themselves: ``python -m benchmarks.own_maps``

The Radish logs come with corrected poses, and with a scan every one to three seconds. A map is made
of each log's own scans, and the log is run in it with the robot's own localization, from its first
pose. Prints the mean distance from the corrected poses, and when the robot was said to be lost:
it never is.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from benchmarks.scan_map import write_map
from objstate.building import building_from_map
from objstate.evaluation import compare_paths
from objstate.logs import open_log
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.records import Path as RobotPath
from objstate.records import Scan
from objstate.run import RunOptions, estimate_log

DATA = Path(__file__).parents[2] / "shared" / "data" / "radish"
LOGS = ("fhw", "acapulco", "edmonton")
HITS = 2  # such logs see a wall in few scans


def main() -> None:
    """Run each log that is there."""
    print("| log | s of log | s of work | from the corrected poses: m | deg | lost (s) |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in LOGS:
        log = DATA / f"{name}-corrected.log.gz"
        print(row(name, log) if log.exists() else f"| {name} | skipped: {log} is missing |")


def row(name: str, log: Path) -> str:
    """What came of one log."""
    scans = [record for record in open_log([log]) if isinstance(record, Scan)]
    corrected = RobotPath(
        np.array([scan.stamp_ns for scan in scans], dtype=np.int64),
        np.array([scan.odometry for scan in scans]),
    )
    with tempfile.TemporaryDirectory() as folder:
        made = write_map(scans, Path(folder), HITS)
        urdf = building_from_map(made, None, Path(folder) / "building")
        options = RunOptions(initial_pose=corrected.poses[0])
        result = estimate_log([log], urdf, Path(folder) / "result", options)
        off = compare_paths(read_tum(result.folder / TRAJECTORY), corrected)
    lost = [[round((t - result.begin_ns) / 1e9) for t in each] for each in result.lost_ns]
    return (
        f"| {name} | {result.log_seconds:.0f} | {result.elapsed_seconds:.0f} | "
        f"{off.position.mean:.3f} | {np.degrees(off.yaw.mean):.2f} | {lost or 'never'} |"
    )


if __name__ == "__main__":
    main()
