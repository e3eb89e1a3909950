"""Messages of the types that nearly all logs are made of, read straight from their bytes.

Where a log defines them as ROS does, nothing has to be looked up in a type store, nor has one to
be loaded. Whatever isn't exactly as expected is left to the type store, which says what is wrong.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from struct import Struct
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from objstate.geometry import FloatArray


class Time(NamedTuple):
    """``builtin_interfaces/Time``"""

    sec: int
    nanosec: int


class Header(NamedTuple):
    """``std_msgs/Header``"""

    stamp: Time
    frame_id: str


class Vector(NamedTuple):
    """``geometry_msgs/Point`` and ``geometry_msgs/Vector3``"""

    x: float
    y: float
    z: float


class Quaternion(NamedTuple):
    """``geometry_msgs/Quaternion``"""

    x: float
    y: float
    z: float
    w: float


class Pose(NamedTuple):
    """``geometry_msgs/Pose``"""

    position: Vector
    orientation: Quaternion


class PoseWithCovariance(NamedTuple):
    """``geometry_msgs/PoseWithCovariance``"""

    pose: Pose
    covariance: FloatArray  # (36,)


class PoseStamped(NamedTuple):
    """``geometry_msgs/PoseWithCovarianceStamped``"""

    header: Header
    pose: PoseWithCovariance


class Odometry(NamedTuple):
    """``nav_msgs/Odometry`` but for the twist"""

    header: Header
    child_frame_id: str
    pose: PoseWithCovariance


class Transform(NamedTuple):
    """``geometry_msgs/Transform``"""

    translation: Vector
    rotation: Quaternion


class TransformStamped(NamedTuple):
    """``geometry_msgs/TransformStamped``"""

    header: Header
    child_frame_id: str
    transform: Transform


class TFMessage(NamedTuple):
    """``tf2_msgs/TFMessage``"""

    transforms: list[TransformStamped]


class LaserScan(NamedTuple):
    """``sensor_msgs/LaserScan`` but for the intensities"""

    header: Header
    angle_min: float
    angle_max: float
    angle_increment: float
    time_increment: float
    scan_time: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]  # (n,)


@dataclass(frozen=True)
class Wire:
    """How ROS 2 or ROS 1 lays out a message."""

    fields: Mapping[str, str]  # as ROS defines the types, by their names without the package
    prefix: bytes  # with which all messages begin that are read here
    stamp: Struct  # of a header
    terminator: bytes  # of a string, counted in its length
    padding: int  # bytes that may follow a message
    is_aligned: bool  # numbers begin at multiples of their size

    def aligned(self, at: int, size: int) -> int:
        """Where a number of ``size`` bytes begins that is next at ``at``."""
        return at + (len(self.prefix) - at) % size if self.is_aligned else at


FIELDS = {
    "LaserScan": (
        "Header header, float32 angle_min, float32 angle_max, float32 angle_increment, "
        "float32 time_increment, float32 scan_time, float32 range_min, float32 range_max, "
        "float32[] ranges, float32[] intensities"
    ),
    "Odometry": (
        "Header header, string child_frame_id, PoseWithCovariance pose, TwistWithCovariance twist"
    ),
    "PoseWithCovarianceStamped": "Header header, PoseWithCovariance pose",
    "PoseWithCovariance": "Pose pose, float64[36] covariance",
    "Pose": "Point position, Quaternion orientation",
    "Point": "float64 x, float64 y, float64 z",
    "Quaternion": "float64 x, float64 y, float64 z, float64 w",
    "TwistWithCovariance": "Twist twist, float64[36] covariance",
    "Twist": "Vector3 linear, Vector3 angular",
    "Vector3": "float64 x, float64 y, float64 z",
    "TFMessage": "TransformStamped[] transforms",
    "tfMessage": "TransformStamped[] transforms",
    "TransformStamped": "Header header, string child_frame_id, Transform transform",
    "Transform": "Vector3 translation, Quaternion rotation",
    "Header": "Time stamp, string frame_id",
    "Time": "int32 sec, uint32 nanosec",
}
CDR = Wire(FIELDS, b"\x00\x01\x00\x00", Struct("<iI"), b"\x00", 3, True)  # little-endian
ROS1 = Wire(
    FIELDS | {"Header": "uint32 seq, time stamp, string frame_id"},
    prefix=b"",
    stamp=Struct("<4xiI"),
    terminator=b"",
    padding=0,
    is_aligned=False,
)
WIRES = {"cdr": CDR, "ros1": ROS1}

LENGTH = Struct("<I")
FLOAT32, FLOAT64 = np.dtype("<f4"), np.dtype("<f8")
ANGLES_AND_LIMITS = Struct("<7f")
POSE = Struct("<7d")
COVARIANCE = 36  # numbers
TWIST = 8 * (6 + COVARIANCE)  # bytes


def reader(name: str, wire: str, text: str) -> Callable[[bytes], Any] | None:
    """What reads messages of a type that a log defines by ``text``; None where that isn't ROS's.

    It returns None for bytes that aren't those of such a message.
    """
    read, layout = READERS.get(name), WIRES[wire]
    if read is None or not _is_standard(name, layout, text):
        return None
    return partial(_read, read, layout)


def _is_standard(name: str, wire: Wire, text: str) -> bool:
    """Whether ROS 2's or ROS 1's layout is meant. A log may leave ROS 2's own types undefined."""
    try:
        own = _defined(name, text)
    except ValueError:
        return False
    if not text:
        return wire is CDR
    return all(fields == wire.fields.get(kind, fields) for kind, fields in own.items())


def _defined(name: str, text: str) -> dict[str, str]:
    """The fields of each type in a definition, without packages, constants and comments."""
    kind = _short(name)
    types: dict[str, list[str]] = {kind: []}
    for line in text.splitlines():
        words = line.partition("#")[0].split()
        if not words or words[0].startswith("==="):
            continue
        if words[0] == "MSG:":
            kind = _short(words[1])
            types[kind] = []
        elif "=" not in "".join(words):
            field_type, field, *_ = words
            types[kind].append(f"{_short(field_type)} {field}")
    return {kind: ", ".join(fields) for kind, fields in types.items()}


def _short(name: str) -> str:
    return name.rpartition("/")[2]


def _read(read: Callable[[bytes, Wire], tuple[Any, int]], wire: Wire, data: bytes) -> Any | None:
    if not data.startswith(wire.prefix):
        return None
    try:
        message, end = read(data, wire)
    except (struct.error, ValueError):
        return None
    return message if end <= len(data) <= end + wire.padding else None


def _laser_scan(data: bytes, wire: Wire) -> tuple[LaserScan, int]:
    header, at = _header(data, len(wire.prefix), wire)
    at = wire.aligned(at, 4)
    numbers = ANGLES_AND_LIMITS.unpack_from(data, at)
    ranges, at = _float32s(data, at + ANGLES_AND_LIMITS.size)
    _, at = _float32s(data, at)
    return LaserScan._make((header, *numbers, ranges)), at


def _odometry(data: bytes, wire: Wire) -> tuple[Odometry, int]:
    header, at = _header(data, len(wire.prefix), wire)
    child, at = _string(data, at, wire)
    pose, at = _pose_with_covariance(data, at, wire)
    return Odometry(header, child, pose), at + TWIST


def _pose_stamped(data: bytes, wire: Wire) -> tuple[PoseStamped, int]:
    header, at = _header(data, len(wire.prefix), wire)
    pose, at = _pose_with_covariance(data, at, wire)
    return PoseStamped(header, pose), at


def _transforms(data: bytes, wire: Wire) -> tuple[TFMessage, int]:
    at = len(wire.prefix)
    (count,) = LENGTH.unpack_from(data, at)
    at += LENGTH.size
    transforms = []
    for _ in range(count):
        header, at = _header(data, at, wire)
        child, at = _string(data, at, wire)
        at = wire.aligned(at, 8)
        x, y, z, *turn = POSE.unpack_from(data, at)
        transform = Transform(Vector(x, y, z), Quaternion(*turn))
        transforms.append(TransformStamped(header, child, transform))
        at += POSE.size
    return TFMessage(transforms), at


READERS: dict[str, Callable[[bytes, Wire], tuple[Any, int]]] = {
    "sensor_msgs/msg/LaserScan": _laser_scan,
    "nav_msgs/msg/Odometry": _odometry,
    "geometry_msgs/msg/PoseWithCovarianceStamped": _pose_stamped,
    "tf2_msgs/msg/TFMessage": _transforms,
    "tf/msg/tfMessage": _transforms,
}


def _header(data: bytes, at: int, wire: Wire) -> tuple[Header, int]:
    at = wire.aligned(at, 4)
    stamp = Time(*wire.stamp.unpack_from(data, at))
    frame, at = _string(data, at + wire.stamp.size, wire)
    return Header(stamp, frame), at


def _pose_with_covariance(data: bytes, at: int, wire: Wire) -> tuple[PoseWithCovariance, int]:
    at = wire.aligned(at, 8)
    x, y, z, *turn = POSE.unpack_from(data, at)
    at += POSE.size
    covariance = np.frombuffer(data, FLOAT64, COVARIANCE, at)
    pose = Pose(Vector(x, y, z), Quaternion(*turn))
    return PoseWithCovariance(pose, covariance), at + covariance.nbytes


def _string(data: bytes, at: int, wire: Wire) -> tuple[str, int]:
    at = wire.aligned(at, 4)
    (length,) = LENGTH.unpack_from(data, at)
    at += LENGTH.size
    end = at + length
    text = data[at:end]
    if len(text) < length or not text.endswith(wire.terminator):
        raise ValueError("a string is cut off")
    return text[: length - len(wire.terminator)].decode(), end


def _float32s(data: bytes, at: int) -> tuple[NDArray[np.float32], int]:
    (count,) = LENGTH.unpack_from(data, at)
    values = np.frombuffer(data, FLOAT32, count, at + LENGTH.size)
    return values, at + LENGTH.size + values.nbytes
