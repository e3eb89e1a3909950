"""CARMEN logs: text, one reading a line, also gzipped; http://carmen.sourceforge.net/logger_playback.html.

The readings come out as the ROS messages that a driver would have sent, so that all
that follows is the same for every format:

``/scan`` and ``/rear_scan``
    FLASER and RLASER, or ROBOTLASER1 and ROBOTLASER2. Readings at or beyond the laser's
    maximum become ``inf``, no return.
``/odom``
    The robot's pose that every laser line carries. It belongs to the scan exactly, and in
    logs that were corrected afterwards it is the corrected one.
``/wheel_odom``
    ODOM lines. In corrected logs they do not fit the laser lines' poses, and some have no
    usable time, so they are kept apart.
``/tf_static``
    Where the lasers are mounted.

A line ends in the time at which the reading was taken (ipc time), the computer's name and
the time at which the logger wrote it. The first is the header's stamp and, because the
second counts from the logger's start in most logs, the recording time as well.
"""

from __future__ import annotations

import math
import re
import zlib
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from gzip import BadGzipFile, GzipFile
from io import BufferedReader
from pathlib import Path
from typing import Any

import numpy as np

from objstate.geometry import FloatArray, between
from objstate.logs.decompression import MOST_RATIO, most_unpacked
from objstate.logs.definitions import MessageType
from objstate.logs.messages import Message
from objstate.logs.notices import Notices

LASER_SCAN = MessageType("sensor_msgs/msg/LaserScan")
ODOMETRY = MessageType("nav_msgs/msg/Odometry")
TF = MessageType("tf2_msgs/msg/TFMessage")

TOPICS = {
    "/scan": LASER_SCAN,
    "/rear_scan": LASER_SCAN,
    "/odom": ODOMETRY,
    "/wheel_odom": ODOMETRY,
    "/tf_static": TF,
}

# m; a SICK LMS says 81.91 for no return and has no reading beyond 80 m
LASER_MAX = 80.0
# m; CARMEN's lasers report no smaller reading than this
LASER_MIN = 0.02

# m; CARMEN knows no heights, and a laser on the floor itself would see under all that stands on it
LASER_HEIGHT = 0.3

# m; a laser pose farther than this from the robot's is no mounting but another frame
LARGEST_OFFSET = 2.0

# bytes; a laser line of a thousand beams has ten thousand. A longer one is damage, and may have no
# end
LONGEST_LINE = 2**20

# ns; a ROS time has 31 bits of seconds
END_OF_TIME_NS = 2**31 * 10**9

# m, rad; larger values are damage
LARGEST_NUMBER = 1e9

# s; a line whose time lies farther back than this has lost its time
LARGEST_STEP_BACK = 1.0


@dataclass(frozen=True)
class Laser:
    """How one of the robot's lasers appears in the log."""

    topic: str
    frame: str
    offset_parameter: str
    max_parameter: str
    yaw: float  # rad: the rear laser faces backwards


FRONT = Laser("/scan", "front_laser", "robot_frontlaser_offset", "robot_front_laser_max", 0.0)
REAR = Laser("/rear_scan", "rear_laser", "robot_rearlaser_offset", "robot_rear_laser_max", math.pi)


@dataclass(frozen=True, eq=False)
class Reading:
    """One laser line."""

    laser: Laser
    ranges: FloatArray  # (n,) m
    start: float  # rad
    increment: float  # rad
    range_max: float | None  # m, where the line says it
    laser_pose: FloatArray  # (3,)
    robot_pose: FloatArray  # (3,)
    stamp_ns: int


class NoTimeError(ValueError):
    """A line's times are invalid: negative, or beyond 32 bits."""


class CarmenFile:
    """A CARMEN log, plain or gzipped."""

    def __init__(self, path: Path, notices: Notices) -> None:
        self.path = path
        self._notices = notices
        self._size = max(path.stat().st_size, 1)
        self._position = 0

    @property
    def share(self) -> float:
        """How much of the file the latest iteration has read, 0..1."""
        return min(self._position / self._size, 1.0)

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic, of all that a CARMEN log may hold."""
        return TOPICS

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """None: lines are in the order of writing, and a laser's mounting comes with its first."""
        return ()

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """The readings as ROS messages, all or those of some topics."""
        return (
            message for message in self._all_messages() if topics is None or message.topic in topics
        )

    def _all_messages(self) -> Iterator[Message]:
        parameters: dict[str, str] = {}
        mounted: set[str] = set()
        unread: dict[str, None] = {}
        latest_ns = 0
        for words in self._lines():
            if words[0] == "PARAM" and len(words) > 2:
                parameters[words[1]] = words[2]
            elif words[0] == "ODOM":
                message = self._wheel_odometry(words, latest_ns)
                if message:
                    yield message
            elif words[0] in PARSERS:
                reading = self._reading(words)
                if reading is None:
                    continue
                latest_ns = reading.stamp_ns
                if reading.laser.frame not in mounted:
                    mounted.add(reading.laser.frame)
                    yield self._mounting(reading, parameters)
                yield _odometry("/odom", reading.robot_pose, reading.stamp_ns)
                yield _scan(reading, self._range_max(reading, parameters))
            elif UNREAD.fullmatch(words[0]):
                unread[words[0]] = None
        for keyword in unread:
            self._tell_unread(keyword, mounted)

    def _tell_unread(self, keyword: str, mounted: Collection[str]) -> None:
        """Note laser lines that weren't read, unless they repeat what those of ``mounted`` hold."""
        laser = {"1": FRONT, "2": REAR}.get(keyword[-1])
        if laser is None:
            self._notices.add(
                f"{self.path.name}: {keyword} lines are left out: of CARMEN's lasers, only the front "
                "and the rear one are read"
            )
        elif laser.frame not in mounted:
            self._notices.add(
                f"{self.path.name}: {keyword} lines are left out, since they lack the robot's pose: "
                f"log the ROBOTLASER{keyword[-1]} messages of CARMEN's robot module"
            )

    def _lines(self) -> Iterator[list[str]]:
        with self.path.open("rb") as raw:
            is_zipped = raw.read(2) == b"\x1f\x8b"
            raw.seek(0)
            text = GzipFile(fileobj=raw) if is_zipped else raw
            most = most_unpacked(self._size) if is_zipped else math.inf
            try:
                for line in self._whole_lines(text):
                    self._position = raw.tell()
                    most -= len(line)
                    if most < 0:
                        self._notices.add(
                            f"{self.path.name} unpacks to more than {MOST_RATIO} times its size, "
                            "which no recording does: what precedes is used"
                        )
                        return
                    words = line.decode("latin-1").split()
                    if words:
                        yield words
            except (EOFError, zlib.error, BadGzipFile) as error:
                self._notices.add(
                    f"{self.path.name} is cut off or damaged ({error}): what precedes is used"
                )

    def _whole_lines(self, text: GzipFile | BufferedReader) -> Iterator[bytes]:
        """The lines, those that are far too long replaced by empty ones; long ones in pieces."""
        is_rest = False
        while line := text.readline(LONGEST_LINE):
            is_whole = line.endswith(b"\n") or len(line) < LONGEST_LINE
            yield line if is_whole and not is_rest else b" " * len(line)
            if not is_whole and not is_rest:
                self._notices.add(
                    f"{self.path.name} has a line of more than {LONGEST_LINE} bytes: left out"
                )
            is_rest = not is_whole

    def _reading(self, words: list[str]) -> Reading | None:
        try:
            return PARSERS[words[0]](words)
        except NoTimeError:
            self._notices.add(f"{self.path.name}: a {words[0]} line has no usable time: left out")
            return None
        except (ValueError, IndexError):
            self._notices.add(f"{self.path.name}: a {words[0]} line is damaged: left out")
            return None

    def _wheel_odometry(self, words: list[str], latest_ns: int) -> Message | None:
        try:
            pose = _finite(words[1:4], 3)
            stamp_ns = _nanoseconds(words[7])
        except (ValueError, IndexError):
            self._notices.add(f"{self.path.name}: an ODOM line is damaged: left out")
            return None
        if not _is_time(stamp_ns) or latest_ns - stamp_ns > LARGEST_STEP_BACK * 1e9:
            self._notices.add(f"{self.path.name}: an ODOM line has no usable time: left out")
            return None
        return _odometry("/wheel_odom", pose, stamp_ns)

    def _mounting(self, reading: Reading, parameters: Mapping[str, str]) -> Message:
        laser = reading.laser
        if np.array_equal(reading.laser_pose, reading.robot_pose):
            # The writer of a corrected log put one pose in both places: the laser's,
            # because it is the laser's readings that were matched.
            offset = 0.0
        else:
            told = self._parameter(laser.offset_parameter, parameters)
            offset = self._offset_in_line(reading) if told is None else told
        translation = (offset, 0.0, LASER_HEIGHT)
        return _static_transform(laser.frame, translation, laser.yaw, reading.stamp_ns)

    def _range_max(self, reading: Reading, parameters: Mapping[str, str]) -> float:
        told = reading.range_max or self._parameter(reading.laser.max_parameter, parameters)
        return LASER_MAX if told is None else told

    def _parameter(self, name: str, parameters: Mapping[str, str]) -> float | None:
        """What a PARAM line says, in metres; None where there is none, or no number in it."""
        if name not in parameters:
            return None
        try:
            return float(_finite([parameters[name]], 1)[0])
        except ValueError:
            self._notices.add(f"{self.path.name}: PARAM {name} is no number: left out")
            return None

    def _offset_in_line(self, reading: Reading) -> float:
        offset = float(between(reading.robot_pose, reading.laser_pose)[0])
        if abs(offset) <= LARGEST_OFFSET:
            return offset
        self._notices.add(
            f"{self.path.name} does not say where {reading.laser.frame} is mounted: taken as "
            f"the robot's centre; supply it with --mount {reading.laser.frame}=x,y,z,roll,pitch,yaw"
        )
        return 0.0


def is_carmen(head: bytes) -> bool:
    """Whether a file's beginning is a CARMEN log: one of its lines starts with a CARMEN keyword."""
    return BEGINS.search(head) is not None


def _old_laser(laser: Laser, words: list[str]) -> Reading:
    """``FLASER n ranges x y theta odom_x odom_y odom_theta ipc_time host logger_time``."""
    count = int(words[1])
    tail = words[2 + count :]
    poses = _finite(tail[:6], 6)
    start, increment = _half_circle(count)
    ranges = _numbers(words[2 : 2 + count], count)
    stamp = _stamp(tail[6:])
    return Reading(laser, ranges, start, increment, None, poses[:3], poses[3:], stamp)


def _new_laser(laser: Laser, words: list[str]) -> Reading:
    """The newer line.

    ``ROBOTLASER1 type start fov resolution max accuracy remission_mode n ranges m remissions
    laser_pose robot_pose tv rv forward_safety side_safety turn_axis ipc_time host logger_time``
    """
    start, _, resolution, range_max = _finite(words[2:6], 4).tolist()
    count = int(words[8])
    at = 9 + count
    at += 1 + int(words[at])
    poses = _finite(words[at : at + 6], 6)
    ranges = _numbers(words[9 : 9 + count], count)
    stamp = _stamp(words[at + 11 :])
    return Reading(laser, ranges, start, resolution, range_max, poses[:3], poses[3:], stamp)


PARSERS: dict[str, Callable[[list[str]], Reading]] = {
    "FLASER": lambda words: _old_laser(FRONT, words),
    "RLASER": lambda words: _old_laser(REAR, words),
    "ROBOTLASER1": lambda words: _new_laser(FRONT, words),
    "ROBOTLASER2": lambda words: _new_laser(REAR, words),
}

# lines of raw lasers, and of lasers beyond the front and the rear one
UNREAD = re.compile(r"RAWLASER\d|(?:ROBOT)?LASER[3-9]")

KEYWORDS = "|".join(("PARAM", "ODOM", *PARSERS, UNREAD.pattern))
# At the begin of a line, and a whole word
BEGINS = re.compile(rb"(?:\A|[\r\n])(?:" + KEYWORDS.encode() + rb")(?=[ \r\n]|\Z)")


def _half_circle(count: int) -> tuple[float, float]:
    """Start and increment (rad) of some number of beams over 180 degrees.

    An odd count (181, 361) has a beam at both ends; an even one (180, 360) lacks the last.
    """
    steps = count - 1 if count % 2 else count
    if steps < 1:
        raise ValueError("a scan needs two beams")
    return -math.pi / 2, math.pi / steps


def _numbers(words: list[str], count: int) -> FloatArray:
    numbers = np.array(words, dtype=float)
    if len(numbers) != count:
        raise ValueError("the line is too short")
    return numbers


def _finite(words: list[str], count: int) -> FloatArray:
    numbers = _numbers(words, count)
    if not (np.abs(numbers) <= LARGEST_NUMBER).all():
        raise ValueError("a number is out of all bounds")
    return numbers


def _stamp(tail: list[str]) -> int:
    """The ipc time; where a converter wrote none, the logger's."""
    ipc_ns, logger_ns = _nanoseconds(tail[0]), _nanoseconds(tail[2])
    if _is_time(ipc_ns):
        return ipc_ns
    if logger_ns and not _is_time(logger_ns):
        raise NoTimeError
    return logger_ns


def _is_time(stamp_ns: int) -> bool:
    return 0 < stamp_ns < END_OF_TIME_NS


def _nanoseconds(seconds: str) -> int:
    """Decimal seconds, exact to the microseconds that they are written with."""
    whole, _, fraction = seconds.partition(".")
    if whole.isdigit() and fraction.isdigit():
        return int(whole) * 10**9 + int(fraction[:9].ljust(9, "0"))
    number = float(seconds)
    return round(number * 1e9) if abs(number) < END_OF_TIME_NS else -1  # no time


def _scan(reading: Reading, range_max: float) -> Message:
    laser = reading.laser
    count = len(reading.ranges)
    ranges = np.where(reading.ranges >= range_max, np.inf, reading.ranges)
    scan = LASER_SCAN.create(
        "sensor_msgs/msg/LaserScan",
        header=_header(LASER_SCAN, laser.frame, reading.stamp_ns),
        angle_min=reading.start,
        angle_max=reading.start + (count - 1) * reading.increment,
        angle_increment=reading.increment,
        time_increment=0.0,
        scan_time=0.0,
        range_min=LASER_MIN,
        range_max=range_max,
        ranges=ranges.clip(-LARGEST_NUMBER).astype(np.float32),
        intensities=np.zeros(0, np.float32),
    )
    return Message(laser.topic, LASER_SCAN, reading.stamp_ns, LASER_SCAN.encode(scan))


def _odometry(topic: str, pose: FloatArray, stamp_ns: int) -> Message:
    make = ODOMETRY.create
    no_covariance = np.zeros(36)
    still = make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    odometry = make(
        "nav_msgs/msg/Odometry",
        header=_header(ODOMETRY, "odom", stamp_ns),
        child_frame_id="base_link",
        pose=make(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=make(
                "geometry_msgs/msg/Pose",
                position=make("geometry_msgs/msg/Point", x=pose[0], y=pose[1], z=0.0),
                orientation=_turn(ODOMETRY, pose[2]),
            ),
            covariance=no_covariance,
        ),
        twist=make(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=make("geometry_msgs/msg/Twist", linear=still, angular=still),
            covariance=no_covariance,
        ),
    )
    return Message(topic, ODOMETRY, stamp_ns, ODOMETRY.encode(odometry))


def _static_transform(
    frame: str, translation: tuple[float, float, float], yaw: float, stamp_ns: int
) -> Message:
    x, y, z = translation
    make = TF.create
    transform = make(
        "geometry_msgs/msg/TransformStamped",
        header=_header(TF, "base_link", stamp_ns),
        child_frame_id=frame,
        transform=make(
            "geometry_msgs/msg/Transform",
            translation=make("geometry_msgs/msg/Vector3", x=x, y=y, z=z),
            rotation=_turn(TF, yaw),
        ),
    )
    message = make("tf2_msgs/msg/TFMessage", transforms=[transform])
    return Message("/tf_static", TF, stamp_ns, TF.encode(message))


def _header(message_type: MessageType, frame: str, stamp_ns: int) -> Any:
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    stamp = message_type.create("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)
    return message_type.create("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def _turn(message_type: MessageType, yaw: float) -> Any:
    return message_type.create(
        "geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2)
    )
