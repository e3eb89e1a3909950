"""Logs as CARMEN text: odometry and level lasers, nothing else.

The format has two lasers, on the robot's axis, one facing forwards and one backwards: FLASER and
RLASER where the beams cover half a turn in steps of 1 or 0.5 degrees, else ROBOTLASER1 and
ROBOTLASER2, which hold their bearings. Heights are lost.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

import numpy as np

from objstate.errors import LogError
from objstate.frame_names import frame_name, laser_name
from objstate.geometry import (
    FloatArray,
    compose,
    interpolate_pose,
    pose_from_transform,
    rotation_from_quaternion,
    transform,
    wrap,
)
from objstate.recording.ros import decoded
from objstate.recording.tum import seconds

LASER = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"

WHEEL_ODOMETRY = "/wheel_odom"  # beside corrected poses: ODOM lines only, no part of a laser line
HALF_TURN_BEAMS = {180: 1.0, 181: 1.0, 360: 0.5, 361: 0.5}  # beams of a FLASER: degrees between
BEARING_TOLERANCE = 1e-3  # rad; bearings that are off by less are a FLASER's
ON_AXIS = 1e-3  # m; a laser farther from the robot's axis can't be written
LEVEL = np.radians(0.5)  # a laser that tilts by more is not a level one
NO_RETURN = 81.91  # m; what a SICK laser reads where nothing is hit
FARTHEST = 1e6  # m; what lies farther is damage
FULL_TURN = 2 * np.pi + BEARING_TOLERANCE  # rad; no bearing is larger
END_OF_TIME_NS = 2**31 * 10**9  # a ROS time has 31 bits of seconds
HOST = "objstate"
KNOWN = (LASER, ODOMETRY, TRANSFORMS)


@dataclass(frozen=True)
class Side:
    """One of the two lasers that the format knows."""

    yaw: float  # rad
    half_turn_word: str
    word: str
    offset_parameter: str
    max_parameter: str


FRONT = Side(0.0, "FLASER", "ROBOTLASER1", "robot_frontlaser_offset", "robot_front_laser_max")
REAR = Side(np.pi, "RLASER", "ROBOTLASER2", "robot_rearlaser_offset", "robot_rear_laser_max")


@dataclass(frozen=True, eq=False)
class Laser:
    """How a laser frame appears in the file."""

    side: Side
    offset: float  # m along the robot's axis
    turn: float  # rad, what the mounting adds to the bearings seen from that side


@dataclass(frozen=True, eq=False)
class TimedPose:
    """Where odometry says the robot was."""

    stamp_ns: int
    pose: FloatArray  # (3,)


class CarmenLog:
    """Writes odometry and laser scans as lines; what has no line is counted."""

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._mounts: dict[str, tuple[str, FloatArray]] = {}  # child: parent, (4, 4)
        self._lasers: dict[str, Laser] = {}  # by frame
        self._base = "base_link"
        self._odometry_topic: str | None = None
        self._is_in_lines: bool | None = None  # the latest odometry; None before there is any
        self._has_wheel_odometry = False
        self._before: TimedPose | None = None  # the last two of the odometry
        self._after: TimedPose | None = None
        self._waiting: deque[tuple[str, Any]] = deque()  # topics and scans newer than the odometry
        self._dropped: Counter[str] = Counter()
        self.counts: Counter[str] = Counter()
        self.warnings: list[str] = []

    def refusal(self, type_name: str, definition: str | None) -> str | None:
        return None if type_name in KNOWN else "CARMEN holds only planar lasers and odometry"

    def write(
        self, topic: str, type_name: str, recorded_ns: int, cdr: bytes, definition: str | None
    ) -> None:
        message = decoded(type_name, definition, cdr)
        if type_name == ODOMETRY:
            self._add_odometry(topic, message)
        elif type_name == LASER:
            self._add_scan(topic, _checked(message))
        else:
            self._add_mounts(message)

    def finish(self) -> None:
        """Count what still waits for odometry, and report what was left out."""
        self._end_odometry()
        unplaced = (
            "scans, as no topic holds odometry (nav_msgs/Odometry), and CARMEN has a pose for each"
            if self._after is None
            else "scans after the last odometry"
        )
        self._dropped[unplaced] += len(self._waiting)
        if self._lasers:
            self.warnings.append(
                "CARMEN keeps of all transforms only where lasers are mounted along the robot's "
                "axis; give their heights with --mount when reading."
            )
        self.warnings += [
            f"{count} {what}: left out." for what, count in sorted(self._dropped.items()) if count
        ]

    def _add_mounts(self, message: Any) -> None:
        for item in message.transforms:
            self._mounts[frame_name(item.child_frame_id)] = (
                frame_name(item.header.frame_id),
                _matrix(item.transform.translation, item.transform.rotation),
            )

    def _add_odometry(self, topic: str, message: Any) -> None:
        place, speed = message.pose.pose, message.twist.twist
        now = TimedPose(
            _stamp(message.header),
            pose_from_transform(_matrix(place.position, place.orientation)),
        )
        if topic == WHEEL_ODOMETRY:
            self._has_wheel_odometry = True
            self._write_odometry(now, speed)
            self.counts[topic] += 1
            return
        self._odometry_topic = self._odometry_topic or topic
        if topic != self._odometry_topic:
            self._dropped[f"messages of {topic}, a second odometry"] += 1
            return
        self._base = frame_name(message.child_frame_id) or self._base
        self._before, self._after = self._after, now
        self._end_odometry()
        self._is_in_lines = not self._has_wheel_odometry
        self._write_ready_scans()
        if not self._has_wheel_odometry:
            self._write_odometry(now, speed)

    def _end_odometry(self) -> None:
        """Count the latest odometry, now that no scan has its time any more."""
        if self._odometry_topic is None or self._is_in_lines is None:
            return
        if self._is_in_lines:
            self.counts[self._odometry_topic] += 1
        else:
            self._dropped[f"messages of {self._odometry_topic} between scans"] += 1

    def _add_scan(self, topic: str, scan: Any) -> None:
        frame = laser_name(topic, scan)
        if frame in self._lasers or self._introduce(frame, scan):
            self._waiting.append((topic, scan))
            self._write_ready_scans()

    def _introduce(self, frame: str, scan: Any) -> bool:
        """Find the word for a laser that is new, and write where it is; False if it has none."""
        mount = self._mount(frame)
        if mount is None:
            self._dropped[f"scans of '{frame}', whose mounting is not known by then"] += 1
            return False
        fault = _unfit(mount)
        if fault:
            self._dropped[f"scans of '{frame}', which {fault}"] += 1
            return False
        laser = _laser(pose_from_transform(mount))
        if laser.side in (other.side for other in self._lasers.values()):
            self._dropped[f"scans of '{frame}', a second laser on its side"] += 1
            return False
        self._lasers[frame] = laser
        self._file.write(f"PARAM {laser.side.offset_parameter} {laser.offset:.6f}\n")
        self._file.write(f"PARAM {laser.side.max_parameter} {_reach(scan):.4f}\n")
        return True

    def _mount(self, frame: str) -> FloatArray | None:
        """(4, 4) the laser on the robot, along the chain of fixed transforms."""
        matrix = np.eye(4)
        passed: set[str] = set()
        while frame != self._base:
            if frame not in self._mounts or frame in passed:
                return None
            passed.add(frame)
            frame, step = self._mounts[frame]
            matrix = step @ matrix
        return matrix

    def _write_ready_scans(self) -> None:
        """Write the scans whose time the odometry has reached, with their place in it."""
        while (
            self._waiting
            and self._after
            and _stamp(self._waiting[0][1].header) <= self._after.stamp_ns
        ):
            topic, scan = self._waiting.popleft()
            robot = _interpolate(self._before, self._after, _stamp(scan.header))
            if robot is None:
                self._dropped["scans before the odometry"] += 1
            else:
                self._write_scan(self._lasers[laser_name(topic, scan)], scan, robot)
                self.counts[topic] += 1
                self._is_in_lines = True

    def _write_scan(self, laser: Laser, scan: Any, robot: FloatArray) -> None:
        placed = np.array([laser.offset, 0.0, laser.side.yaw])
        poses = _numbers([*compose(robot, placed), *robot], 6)
        ranges = _ranges(scan)
        readings = f"{len(ranges)} {_numbers(ranges, 3)}"
        if _is_half_turn(scan, laser.turn):
            self._line(laser.side.half_turn_word, f"{readings} {poses}", _stamp(scan.header))
            return
        # type 0, accuracy 1 cm, remission mode 0; no remissions; speeds and distances not known
        span = scan.angle_increment * (len(ranges) - 1)
        head = [scan.angle_min + laser.turn, span, scan.angle_increment, _reach(scan), 0.01]
        body = f"0 {_numbers(head, 9)} 0 {readings} 0 {poses} 0 0 0 0 0"
        self._line(laser.side.word, body, _stamp(scan.header))

    def _write_odometry(self, now: TimedPose, speed: Any) -> None:
        values = np.nan_to_num([*now.pose, speed.linear.x, speed.angular.z, 0.0])
        self._line("ODOM", _numbers(values, 6), now.stamp_ns)

    def _line(self, word: str, body: str, stamp_ns: int) -> None:
        time = seconds(stamp_ns)
        self._file.write(f"{word} {body} {time} {HOST} {time}\n")


@contextmanager
def write_carmen(path: Path) -> Iterator[CarmenLog]:
    """One CARMEN log as text."""
    with path.open("w", encoding="ascii", newline="\n") as file:
        log = CarmenLog(file)
        yield log
        log.finish()


def _stamp(header: Any) -> int:
    """ns. Raises LogError for a time that the format can't hold."""
    stamp_ns = int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)
    if not 0 <= stamp_ns < END_OF_TIME_NS:
        raise LogError(f"its time, {seconds(stamp_ns)} s, is none from 1970 to 2038")
    return stamp_ns


def _matrix(position: Any, q: Any) -> FloatArray:
    """(4, 4). Raises LogError for a place or a direction that is none."""
    place = [position.x, position.y, position.z]
    if not (np.abs(place) <= FARTHEST).all():
        raise LogError("its position is out of all bounds")
    try:
        return transform(rotation_from_quaternion(q.x, q.y, q.z, q.w), place)
    except ValueError as error:
        raise LogError(f"its {error}") from error


def _checked(scan: Any) -> Any:
    """The scan. Raises LogError where its beams have no directions, or it has no beams."""
    if not (np.abs([scan.angle_min, scan.angle_increment]) <= FULL_TURN).all():
        raise LogError("its angles are out of all bounds")
    if not len(scan.ranges):
        raise LogError("it has no ranges")
    _stamp(scan.header)
    return scan


def _reach(scan: Any) -> float:
    """m; what a laser that says nothing usable can see is a SICK's."""
    return float(scan.range_max) if 0 < scan.range_max <= FARTHEST else NO_RETURN


def _unfit(mount: FloatArray) -> str | None:
    """Why no CARMEN laser is mounted like that, or None."""
    if mount[2, 2] < np.cos(LEVEL):
        return "isn't level"
    if abs(mount[1, 3]) > ON_AXIS:
        return "isn't on the robot's axis"
    return None


def _laser(mount: FloatArray) -> Laser:
    """The direction in which a laser at ``mount`` (3,) faces, and the offset of its bearings."""
    side = FRONT if abs(wrap(mount[2])) <= np.pi / 2 else REAR
    return Laser(side, float(mount[0]), float(wrap(mount[2] - side.yaw)))


def _interpolate(before: TimedPose | None, after: TimedPose, stamp: int) -> FloatArray | None:
    """The pose at a time between two; None for a time before both."""
    if stamp == after.stamp_ns:
        return after.pose
    if before is None or stamp < before.stamp_ns:
        return None
    share = (stamp - before.stamp_ns) / (after.stamp_ns - before.stamp_ns)
    return interpolate_pose(before.pose, after.pose, share)


def _is_half_turn(scan: Any, turn: float) -> bool:
    """Whether the beams are where a reader of FLASER expects them."""
    step = HALF_TURN_BEAMS.get(len(scan.ranges))
    if step is None:
        return False
    first = scan.angle_min + turn + np.pi / 2
    widening = (scan.angle_increment - np.radians(step)) * len(scan.ranges)
    return bool(max(abs(first), abs(widening)) < BEARING_TOLERANCE)


def _ranges(scan: Any) -> FloatArray:
    """Ranges as CARMEN has them: 0 for what is no reading, SICK's number for no return."""
    ranges = np.asarray(scan.ranges, dtype=float)
    nothing = max(NO_RETURN, _reach(scan))
    known = np.where(np.isfinite(ranges), np.clip(ranges, 0.0, nothing), 0.0)
    return np.where(np.isposinf(ranges), nothing, known)


def _numbers(values: Iterable[float], decimals: int) -> str:
    return " ".join(f"{value:.{decimals}f}" for value in values)
