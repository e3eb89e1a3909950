"""Logs as CARMEN text: odometry and level lasers, nothing else.

A laser that looks straight ahead with 180 or 360 beams over half a turn is
written as FLASER, one that looks straight back as RLASER, and one other as
ROBOTLASER1. The heights of the lasers are lost: the format has no word for them.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from objstate.geometry import (
    FloatArray,
    compose,
    interpolate_pose,
    pose_from_transform,
    rotation_from_quaternion,
    transform,
    wrap,
)
from objstate.recording.ros import ros2_types
from objstate.recording.tum import seconds

LASER = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"

HALF_TURN_BEAMS = {180: 1.0, 181: 1.0, 360: 0.5, 361: 0.5}  # beams of a FLASER: degrees between
STRAIGHT_RAD = 1e-3  # a laser that is off the robot's axis by less looks straight
ON_AXIS_M = 1e-3
LEVEL_RAD = np.radians(0.5)  # a laser that tilts by more is not a level one
NO_RETURN_M = 81.91  # what CARMEN's lasers read where nothing is hit
HOST = "objstate"


@dataclass(frozen=True)
class _Reading:
    """A scan that waits for the odometry on both sides of it."""

    stamp_ns: int
    frame: str
    scan: Any


class CarmenLog:
    """Writes odometry and laser scans as lines; what has no line is counted."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._mounts: dict[str, tuple[str, FloatArray]] = {}  # child: parent, (4, 4)
        self._base = "base_link"
        self._words: dict[str, str] = {}  # laser frame: FLASER, RLASER or ROBOTLASER1
        self._odometry: tuple[int, FloatArray] | None = None
        self._waiting: deque[_Reading] = deque()
        self._dropped: Counter[str] = Counter()
        self.warnings: list[str] = []

    def refusal(self, type_name: str, definition: str | None) -> str | None:
        if type_name in (LASER, ODOMETRY, TRANSFORMS):
            return None
        return "CARMEN holds only planar lasers and odometry"

    def write(
        self, topic: str, type_name: str, recorded_ns: int, cdr: bytes, definition: str | None
    ) -> None:
        message: Any = ros2_types(type_name, definition).deserialize_cdr(cdr, type_name)
        if type_name == ODOMETRY:
            self._add_odometry(message)
        elif type_name == LASER:
            self._add_scan(message)
        elif topic == "/tf_static":
            self._add_mounts(message)
        else:
            self._dropped[f"transforms of {topic}, which CARMEN has no word for"] += 1

    def finish(self) -> None:
        """Count what still waits for odometry, and say what was left out."""
        self._dropped["scans after the last odometry"] += len(self._waiting)
        if self._words:
            self.warnings.append(
                "CARMEN keeps no heights of lasers; give them with --mount when reading."
            )
        self.warnings += [
            f"{count} {what}: left out." for what, count in sorted(self._dropped.items()) if count
        ]

    def _add_mounts(self, message: Any) -> None:
        for item in message.transforms:
            self._mounts[item.child_frame_id.lstrip("/")] = (
                item.header.frame_id.lstrip("/"),
                _matrix(item.transform.translation, item.transform.rotation),
            )

    def _add_odometry(self, message: Any) -> None:
        self._base = message.child_frame_id.lstrip("/") or self._base
        stamp = _stamp(message.header)
        place = message.pose.pose
        pose = pose_from_transform(_matrix(place.position, place.orientation))
        while self._waiting and self._waiting[0].stamp_ns <= stamp:
            self._write_scan(self._waiting.popleft(), stamp, pose)
        self._odometry = (stamp, pose)
        speed = message.twist.twist
        self._line(
            "ODOM", _numbers([*pose, speed.linear.x, speed.angular.z, 0.0], 6), stamp_ns=stamp
        )

    def _add_scan(self, scan: Any) -> None:
        frame = scan.header.frame_id.lstrip("/")
        mount = self._mount(frame)
        if mount is None:
            self._dropped[f"scans of '{frame}', whose mounting is not known by then"] += 1
        elif not _is_level(mount):
            self._dropped[f"scans of '{frame}', which isn't level"] += 1
        elif self._word(frame, mount, scan) is None:
            self._dropped[f"scans of '{frame}', for which CARMEN has no third word"] += 1
        else:
            self._waiting.append(_Reading(_stamp(scan.header), frame, scan))

    def _mount(self, frame: str) -> FloatArray | None:
        """(4, 4) the laser on the robot, along the chain of fixed transforms."""
        matrix = np.eye(4)
        while frame != self._base:
            if frame not in self._mounts:
                return None
            frame, step = self._mounts[frame]
            matrix = step @ matrix
        return matrix

    def _word(self, frame: str, mount: FloatArray, scan: Any) -> str | None:
        """The word that this laser's lines begin with; PARAM lines tell the first time where it is."""
        if frame in self._words:
            return self._words[frame]
        word = _word_for(pose_from_transform(mount), scan)
        if word in self._words.values():
            word = "ROBOTLASER1"
        if word in self._words.values():
            return None
        self._words[frame] = word
        side = {"FLASER": "front", "RLASER": "rear"}.get(word)
        if side is not None:
            self._line(f"PARAM robot_{side}laser_offset", f"{mount[0, 3]:.6f}")
            self._line(f"PARAM robot_{side}_laser_max", f"{scan.range_max:.4f}")
        return word

    def _write_scan(self, reading: _Reading, stamp: int, pose: FloatArray) -> None:
        """One line for a scan, with the odometry interpolated to its time."""
        if self._odometry is None or reading.stamp_ns < self._odometry[0]:
            if reading.stamp_ns < stamp:
                self._dropped["scans before the odometry"] += 1
                return
            robot = pose
        else:
            before, from_pose = self._odometry
            share = (reading.stamp_ns - before) / max(stamp - before, 1)
            robot = interpolate_pose(from_pose, pose, share)
        mount = self._mount(reading.frame)
        assert mount is not None  # checked when the scan came
        laser = compose(robot, pose_from_transform(mount))
        word = self._words[reading.frame]
        ranges = _ranges(reading.scan)
        if word == "ROBOTLASER1":
            self._line(word, _robotlaser(reading.scan, ranges, laser, robot), reading.stamp_ns)
            return
        body = f"{len(ranges)} {_numbers(ranges, 3)} {_numbers([*laser, *robot], 6)}"
        self._line(word, body, reading.stamp_ns)

    def _line(self, word: str, body: str, stamp_ns: int | None = None) -> None:
        times = "" if stamp_ns is None else f" {seconds(stamp_ns)} {HOST} {seconds(stamp_ns)}"
        self._file.write(f"{word} {body}{times}\n")


@contextmanager
def write_carmen(path: Path) -> Iterator[CarmenLog]:
    """One CARMEN log as text."""
    with path.open("w", encoding="ascii", newline="\n") as file:
        log = CarmenLog(file)
        yield log
        log.finish()


def _stamp(header: Any) -> int:
    return int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def _matrix(position: Any, q: Any) -> FloatArray:
    return transform(
        rotation_from_quaternion(q.x, q.y, q.z, q.w), [position.x, position.y, position.z]
    )


def _is_level(mount: FloatArray) -> bool:
    """Upright and level; a laser upside down would count its beams the other way."""
    return bool(mount[2, 2] >= np.cos(LEVEL_RAD))


def _word_for(mount: FloatArray, scan: Any) -> str:
    """FLASER and RLASER where their fixed layout fits the laser, else ROBOTLASER1."""
    step = HALF_TURN_BEAMS.get(len(scan.ranges))
    half_turn = (
        step is not None
        and abs(scan.angle_min + np.pi / 2) < STRAIGHT_RAD
        and abs(np.degrees(scan.angle_increment) - step) * len(scan.ranges)
        < np.degrees(STRAIGHT_RAD)
    )
    if half_turn and abs(mount[1]) < ON_AXIS_M:
        if abs(mount[2]) < STRAIGHT_RAD:
            return "FLASER"
        if abs(wrap(mount[2] - np.pi)) < STRAIGHT_RAD:
            return "RLASER"
    return "ROBOTLASER1"


def _ranges(scan: Any) -> FloatArray:
    """Ranges as CARMEN has them: 0 for what is no reading, the laser's own "nothing" for none."""
    ranges = np.asarray(scan.ranges, dtype=float)
    nothing = max(NO_RETURN_M, float(scan.range_max))
    return np.where(np.isposinf(ranges), nothing, np.where(np.isfinite(ranges), ranges, 0.0))


def _robotlaser(scan: Any, ranges: FloatArray, laser: FloatArray, robot: FloatArray) -> str:
    """The body of a ROBOTLASER1 line: configuration, readings, no remissions, poses, velocities."""
    span = float(scan.angle_increment) * (len(ranges) - 1)
    laser_type, accuracy, remission_mode = 0, 0.01, 0
    head = [scan.angle_min, span, scan.angle_increment, scan.range_max, accuracy]
    tail = "0 0 0 0 0"  # speeds, safety distances, turn axis: not known
    return (
        f"{laser_type} {_numbers(head, 9)} {remission_mode} {len(ranges)} {_numbers(ranges, 3)} "
        f"0 {_numbers([*laser, *robot], 6)} {tail}"
    )


def _numbers(values: Any, decimals: int) -> str:
    return " ".join(f"{value:.{decimals}f}" for value in values)
