"""A simulated drive as files: the log, the truth, the robot's path, and what was in view."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.independent.drive import Drive
from benchmarks.independent.lasers import Laser, Scan
from benchmarks.independent.shapes import Floats
from benchmarks.independent.world import World
from objstate.recording.logs import open_log_writer
from objstate.recording.messages import (
    BASE,
    MAP,
    ODOM,
    TRANSFORMS,
    header,
    make,
    plane_pose,
    transform_message,
    transforms_message,
    triple,
)

START_NS = 1_600_000_000 * 10**9
START_STD = (0.1, 0.1, 0.06)  # m, m, rad; of /initialpose
LASER_HEIGHT = 0.3  # m
TRUTH_STEP = 0.05  # s between rows of the truth while a door moves
PATH_RATE = 20.0  # Hz

Entry = tuple[int, str, str, Any]  # when recorded, topic, type, message


def stamp(time: float) -> int:
    """A time of the drive as integer nanoseconds."""
    return START_NS + round(time * 1e9)


def write_log(
    path: Path,
    seed: int,
    drive: Drive,
    odometry: tuple[Floats, Floats],
    lasers: Sequence[Laser],
    mounts: Sequence[Floats],
    scans: Iterable[Scan],
) -> None:
    """An MCAP log; ``mounts`` (x, y, yaw) is where the log says that the lasers are."""
    entries = [*_start(seed, drive), *_wheels(*odometry), *_readings(lasers, scans)]
    entries.insert(0, (START_NS, "/tf_static", TRANSFORMS, _mountings(lasers, mounts)))
    with open_log_writer(path, "mcap") as log:
        for recorded, topic, type_name, message in sorted(entries, key=lambda entry: entry[0]):
            log.write(topic, type_name, recorded, message)


def _matrix(x: float, y: float, yaw: float, z: float = 0.0) -> Floats:
    matrix = np.eye(4)
    matrix[:2, :2] = [[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]]
    matrix[:3, 3] = x, y, z
    return matrix


def _mountings(lasers: Sequence[Laser], mounts: Sequence[Floats]) -> Any:
    return transforms_message(
        transform_message(START_NS, BASE, laser.frame, _matrix(*mount, LASER_HEIGHT))
        for laser, mount in zip(lasers, mounts, strict=True)
    )


def _start(seed: int, drive: Drive) -> Iterator[Entry]:
    """Where the robot is said to start."""
    off = np.random.default_rng([seed, 41]).normal(0.0, START_STD)
    covariance = np.zeros(36)
    covariance[[0, 7, 35]] = np.square(START_STD)
    pose = make(
        "geometry_msgs/msg/PoseWithCovariance",
        pose=plane_pose(drive.poses[0] + off),
        covariance=covariance,
    )
    kind = "geometry_msgs/msg/PoseWithCovarianceStamped"
    yield START_NS, "/initialpose", kind, make(kind, header=header(START_NS, MAP), pose=pose)


def _wheels(times: Floats, poses: Floats) -> Iterator[Entry]:
    """/odom, and the same in /tf."""
    zero = make(
        "geometry_msgs/msg/Twist",
        linear=triple("geometry_msgs/msg/Vector3", (0.0, 0.0, 0.0)),
        angular=triple("geometry_msgs/msg/Vector3", (0.0, 0.0, 0.0)),
    )
    twist = make("geometry_msgs/msg/TwistWithCovariance", twist=zero, covariance=np.zeros(36))
    for time, pose in zip(times, poses, strict=True):
        at = stamp(time)
        placed = make(
            "geometry_msgs/msg/PoseWithCovariance", pose=plane_pose(pose), covariance=np.zeros(36)
        )
        kind = "nav_msgs/msg/Odometry"
        message = make(kind, header=header(at, ODOM), child_frame_id=BASE, pose=placed, twist=twist)
        yield at, "/odom", kind, message
        moved = transform_message(at, ODOM, BASE, _matrix(*pose))
        yield at, "/tf", TRANSFORMS, transforms_message([moved])


def _readings(lasers: Sequence[Laser], scans: Iterable[Scan]) -> Iterator[Entry]:
    """The scans, recorded when they were made and stamped by the laser's clock."""
    kind = "sensor_msgs/msg/LaserScan"
    for scan in scans:
        laser = lasers[scan.laser]
        topic = "/scan" if len(lasers) == 1 else f"/scan_{laser.frame}"
        per_beam = laser.turn_time / len(laser.angles) if laser.tells_turn else 0.0
        message = make(
            kind,
            header=header(stamp(scan.time + laser.clock), laser.frame),
            angle_min=float(laser.angles[0]),
            angle_max=float(laser.angles[-1]),
            angle_increment=float(laser.angles[1] - laser.angles[0]),
            time_increment=per_beam,
            scan_time=1.0 / laser.rate,
            range_min=laser.range_min,
            range_max=laser.range_max,
            ranges=scan.ranges.astype(np.float32),
            intensities=np.empty(0, np.float32),
        )
        yield stamp(scan.time + laser.turn_time), topic, kind, message


def write_truth(path: Path, world: World, duration: float) -> None:
    """The doors' angles: at the start, and every 50 ms while they move."""
    rows = []
    for door, course in zip(world.doors, world.courses, strict=True):
        times = np.arange(0.0, duration, TRUTH_STEP)
        inside = course.times[(course.times > 0.0) & (course.times < duration)]
        times = np.unique(np.concatenate([times, inside]))
        angles = np.interp(times, course.times, course.values)
        changed = np.concatenate([[True], np.diff(angles) != 0.0])
        rows += [
            (stamp(time), door.name, angle)
            for time, angle in zip(times[changed], angles[changed], strict=True)
        ]
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(("stamp", "object", "coordinate", "value"))
        writer.writerows((at, name, "angle", f"{angle:.9f}") for at, name, angle in sorted(rows))


def write_path(path: Path, drive: Drive) -> None:
    """The robot's true path in the TUM format."""
    times = np.arange(0.0, drive.duration, 1 / PATH_RATE)
    lines = ["# stamp tx ty tz qx qy qz qw"]
    for time, (x, y, yaw) in zip(times, drive.at(times), strict=True):
        seconds, rest = divmod(stamp(time), 10**9)
        turn = f"{np.sin(yaw / 2):.9f} {np.cos(yaw / 2):.9f}"
        lines.append(f"{seconds}.{rest:09d} {x:.7f} {y:.7f} 0 0 0 {turn}")
    path.write_text("\n".join([*lines, ""]), encoding="utf-8")


def write_seen(path: Path, scans: Sequence[Scan]) -> None:
    """Of each scan, its true time and how many beams really ended on each leaf."""
    np.savez_compressed(
        path,
        stamps=np.array([stamp(scan.time) for scan in scans]),
        beams=np.array([scan.beams_on for scan in scans], dtype=np.int32),
    )
