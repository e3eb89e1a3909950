"""Runs the recorded logs of ../shared/data and prints how far the results lie from what is known.

    python benchmarks/real_logs.py [part of a drive's name]...

Logs that are missing are skipped. docs/real-data.md holds what this printed, and what it means.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np

from objstate.building import building_from_map, load_building
from objstate.evaluation import compare_paths, latest_states
from objstate.logs import inspect_log, open_log, open_messages
from objstate.recording.tables import read_estimates
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.records import Path as RobotPath
from objstate.records import Scan
from objstate.run import RunOptions, estimate_log
from objstate.sensing.expected import ExpectedRanges

HERE = Path(__file__).parent
DATA = HERE.parents[1] / "shared" / "data"
THROUGH = 0.15  # m; a reading that much beyond the nearest wall says that the pose is wrong
STRETCH_NS = 15_000_000_000  # over which such readings are counted


@dataclass(frozen=True)
class Drive:
    """One log, one way of running it, and what is known of its outcome."""

    name: str
    log: str  # this and the map as paths in DATA
    map: str | None = None  # none: the log is only read
    doors: Path | None = None
    options: RunOptions = field(default_factory=RunOptions)
    reference: str | None = None  # topic of recorded PoseStamped in the map's frame


WEAN = partial(Drive, map="wean-hall/wean.yaml", doors=DATA / "wean-hall" / "doors.csv")
# the same doors, with hinges where the leaves of both runs meet
WEAN_SEEN = partial(Drive, map="wean-hall/wean.yaml", doors=HERE / "wean_hall_doors.csv")
NEATO = partial(
    Drive,
    log="olin-ac109-neato/ac109_1_demo.bag",
    map="olin-ac109-neato/ac109_1.yaml",
    reference="/map_pose_continuous",
)
FITTING_START = RunOptions(initial_pose=np.array([39.9, 41.5, -1.67]))  # of run 1

DRIVES = (
    WEAN("wean-hall run 1", "wean-hall/run1.mcap"),
    WEAN("wean-hall run 1, fitting start", "wean-hall/run1.mcap", options=FITTING_START),
    WEAN_SEEN("wean-hall run 1, moved hinges", "wean-hall/run1.mcap", options=FITTING_START),
    WEAN("wean-hall run 2", "wean-hall/run2.mcap"),
    WEAN_SEEN("wean-hall run 2, moved hinges", "wean-hall/run2.mcap"),
    NEATO("olin-ac109-neato, own belief"),
    NEATO("olin-ac109-neato, recorded belief", options=RunOptions(belief="recorded")),
    Drive(
        "olin-mac-tb4, from anywhere",
        "olin-mac-tb4/macfirst_floor_take_2",
        map="olin-mac-tb4/mac_1st_floor_final.yaml",
        options=RunOptions(global_start=True),
    ),
    Drive("birmingham-p3dx", "birmingham-p3dx/trace0.bag"),
    Drive("fr079", "fr079/freiburg-079-corrected.log.gz"),
)


def main(wanted: list[str]) -> None:
    """Run every drive, or those with a wanted word in their names."""
    for drive in DRIVES:
        if wanted and not any(word in drive.name for word in wanted):
            continue
        print(f"\n{drive.name}")
        if not (DATA / drive.log).exists():
            print(f"  skipped: {drive.log} is not in {DATA}")
            continue
        lines = read(drive) if drive.map is None else localize(drive)
        for line in lines:
            print(f"  {line}")


def read(drive: Drive) -> Iterator[str]:
    """What reading a log gives where there is no map for it."""
    summary = inspect_log([DATA / drive.log])
    yield f"records: {summary.records}"
    yield from (f"problem: {problem}" for problem in summary.problems)


def localize(drive: Drive) -> Iterator[str]:
    """Estimate a log in the building that its map makes; what came of it."""
    assert drive.map is not None
    log = DATA / drive.log
    with tempfile.TemporaryDirectory() as folder:
        urdf = building_from_map(DATA / drive.map, drive.doors, Path(folder) / "building")
        out = Path(folder) / "result"
        result = estimate_log([log], urdf, out, drive.options)
        yield f"{result.log_seconds:.0f} s of log in {result.elapsed_seconds:.1f} s"
        for since, found in result.lost_ns:
            stretch = [(stamp - result.begin_ns) / 1e9 for stamp in (since, found)]
            yield f"lost from {stretch[0]:.0f} s to {stretch[1]:.0f} s"
        path = read_tum(out / TRAJECTORY)
        x, y, yaw = path.poses[-1]
        yield f"at the end: x {x:.2f} m, y {y:.2f} m, yaw {np.degrees(yaw):.1f} deg"
        yield from fit(log, urdf, path)
        for state in latest_states(read_estimates(out), lost=result.lost_ns):
            e = state.estimate
            value, lower, upper = np.degrees([e.median, e.lower, e.upper])
            yield f"{e.object}: {value:.1f} deg ({lower:.1f} to {upper:.1f})"
    if drive.reference is not None:
        errors = compare_paths(path, reference_path(log, drive.reference))
        p, t = errors.position, errors.yaw
        yield (
            f"from {drive.reference}, {errors.count} poses: position mean {p.mean:.3f} m, median "
            f"{p.median:.3f} m, 90 % {p.p90:.3f} m, end {p.end:.3f} m; yaw mean "
            f"{np.degrees(t.mean):.1f} deg, 90 % {np.degrees(t.p90):.1f} deg"
        )


def fit(log: Path, urdf: Path, path: RobotPath) -> Iterator[str]:
    """How many readings of each stretch pass through walls, seen from the estimated poses.

    People and boxes shorten readings, but nothing lets a beam pass a wall.
    """
    expected = ExpectedRanges(load_building(urdf))
    poses = dict(zip(path.stamps_ns.tolist(), path.poses, strict=True))
    shares: dict[int, list[float]] = {}
    for record in open_log(log):
        if isinstance(record, Scan) and record.stamp_ns in poses:
            walls = expected.walls(poses[record.stamp_ns][None], record.rays)[0]
            returns = np.isfinite(record.ranges)
            through = (record.ranges > walls + THROUGH)[returns]
            stretch = (record.stamp_ns - int(path.stamps_ns[0])) // STRETCH_NS
            shares.setdefault(stretch, []).append(float(through.mean()) if len(through) else 0.0)
    percent = [f"{100 * np.mean(each):.0f}" for _, each in sorted(shares.items())]
    yield (
        f"% of readings through walls by more than {THROUGH} m, every "
        f"{STRETCH_NS / 1e9:g} s: {' '.join(percent)}"
    )


def reference_path(log: Path, topic: str) -> RobotPath:
    """The poses of a ``PoseStamped`` topic over time."""
    stamps, poses = [], []
    for message in open_messages(log, [topic]):
        stamped = message.decode()
        q, at = stamped.pose.orientation, stamped.pose.position
        stamps.append(stamped.header.stamp.sec * 10**9 + stamped.header.stamp.nanosec)
        poses.append((at.x, at.y, 2.0 * np.arctan2(q.z, q.w)))
    order = np.argsort(stamps, kind="stable")
    return RobotPath(np.array(stamps, dtype=np.int64)[order], np.array(poses)[order])


if __name__ == "__main__":
    main(sys.argv[1:])
