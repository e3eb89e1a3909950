"""Doors that stand open all the time, in a building made from the log's own scans: ``python -m benchmarks.fr079``

The Freiburg 079 log comes with corrected poses. A map is made of its scans by counting, doors are put
where leaves are seen to stand, and the log is run in that building with the robot's own localization.
Nobody moves these leaves, so each pass should find them where the last one did. Prints for each door
and pass the last estimate with its 90 % interval, and what a line through the leaf's readings says, as the
corrected poses have them.
"""

from __future__ import annotations

import csv
import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np

from benchmarks.scan_map import ends_of, write_map
from objstate.building import building_from_map
from objstate.evaluation import compare_paths
from objstate.geometry import FloatArray
from objstate.logs import open_log
from objstate.recording.tables import read_estimates
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.records import NANOSECONDS, Scan
from objstate.records import Path as RobotPath
from objstate.run import RunOptions, estimate_log

HERE = Path(__file__).parent
LOG = HERE.parents[1] / "shared" / "data" / "fr079" / "freiburg-079-corrected.log.gz"
DOORS = HERE / "fr079_doors.csv"
PASS_NS = 10 * 10**9  # without a look at a door, the next is another pass
FRAME = 0.15  # m from its hinge, within which readings are of a door's frame
FAN = 10.0  # deg within which most readings are of the leaf
ENOUGH, SPAN = 60, 0.3  # readings, and m that they cover, by which a line is to be told


def main() -> None:
    """Make the map, run the log, say what came of it."""
    if not LOG.exists():
        print(f"skipped: {LOG} is missing")
        return
    scans = [record for record in open_log([LOG]) if isinstance(record, Scan)]
    corrected = RobotPath(
        np.array([scan.stamp_ns for scan in scans], dtype=np.int64),
        np.array([scan.odometry for scan in scans]),
    )
    with tempfile.TemporaryDirectory() as folder:
        urdf = building_from_map(write_map(scans, Path(folder)), DOORS, Path(folder) / "building")
        options = RunOptions(initial_pose=corrected.poses[0])
        result = estimate_log([LOG], urdf, Path(folder) / "result", options)
        print(f"{result.log_seconds:.0f} s of log in {result.elapsed_seconds:.0f} s")
        print(f"lost: {[[(t - result.begin_ns) / 1e9 for t in s] for s in result.lost_ns]}")
        off = compare_paths(read_tum(result.folder / TRAJECTORY), corrected)
        print(
            f"from the corrected poses: {off.position.mean:.3f} m, {np.degrees(off.yaw.mean):.2f} deg"
        )
        estimates = read_estimates(result.folder)
    for door in csv.DictReader(DOORS.open()):
        rows = estimates.filter(estimates["object"] == door["door"])
        print_passes(door, rows, scans, result.begin_ns)


def print_passes(door: dict[str, str], rows, scans: list[Scan], begin_ns: int) -> None:
    """The last estimate of each pass, and how the leaf was seen to stand in it."""
    rows = rows.filter(rows["observed"])
    stamps = rows["stamp"].to_numpy()
    ends = [k for k, (a, b) in enumerate(pairwise([*stamps, np.inf])) if b - a > PASS_NS]
    print(f"{door['door']}: {len(stamps)} looks in {len(ends)} passes")
    for first, last in zip([0, *(k + 1 for k in ends)], ends, strict=False):
        columns = ("median", "lower", "upper")
        angle, lower, upper = (np.degrees(rows[name][last]) for name in columns)
        looks = [scan for scan in scans if stamps[first] <= scan.stamp_ns <= stamps[last]]
        line = seen(door, np.concatenate([ends_of(scan) for scan in looks]))
        print(
            f"  {(stamps[last] - begin_ns) / NANOSECONDS:5.0f} s: {angle:.1f} deg ({lower:.1f} to {upper:.1f}), "
            f"fit {rows['fit'][last]:.2f}, "
            + (f"seen {line:.1f}" if line else "not seen as a line")
        )


def seen(door: dict[str, str], places: FloatArray) -> float | None:
    """Opening angle in degrees of a line through the readings (n, 2) that are a door's leaf, if they show enough."""
    sign = 1.0 if door["opens"] == "ccw" else -1.0
    closed = float(door["closed_bearing_deg"])
    away = places - [float(door["hinge_x"]), float(door["hinge_y"])]
    away = away[(np.hypot(*away.T) > FRAME) & (np.hypot(*away.T) < float(door["width_m"]))]
    angles = (sign * (np.degrees(np.arctan2(away[:, 1], away[:, 0])) - closed)) % 360.0
    counts, edges = np.histogram(angles, np.arange(FAN, float(door["upper_limit_deg"]), FAN))
    leaf = away[np.abs(angles - edges[int(np.argmax(counts))] - FAN / 2.0) < FAN]
    if len(leaf) < ENOUGH or np.ptp(np.hypot(*leaf.T)) < SPAN:
        return None
    along = np.linalg.svd(leaf - leaf.mean(axis=0))[2][0]
    along *= np.sign(along @ leaf.mean(axis=0))
    return float((sign * (np.degrees(np.arctan2(along[1], along[0])) - closed)) % 360.0)


if __name__ == "__main__":
    main()
