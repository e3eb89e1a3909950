"""The standard ROS messages that objstate itself makes, and their parts."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from objstate.geometry import FloatArray, quaternion_from_rotation, transform_from_pose
from objstate.recording.ros import standard_types

MAP, ODOM, BASE = "map", "odom", "base_link"  # frames of REP-105
TRANSFORMS = "tf2_msgs/msg/TFMessage"
POSES = "geometry_msgs/msg/PoseArray"
POINT, VECTOR = "geometry_msgs/msg/Point", "geometry_msgs/msg/Vector3"


def make(type_name: str, /, **fields: Any) -> Any:
    """A message of a standard type."""
    return standard_types().types[type_name](**fields)


def header(stamp_ns: int, frame: str) -> Any:
    seconds, rest = divmod(stamp_ns, 10**9)
    stamp = make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
    return make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def triple(name: str, values: Iterable[float]) -> Any:
    """A ``POINT`` or a ``VECTOR``."""
    x, y, z = (float(value) for value in values)
    return make(name, x=x, y=y, z=z)


def turn(rotation: FloatArray) -> Any:
    """The quaternion of a rotation (3, 3)."""
    x, y, z, w = quaternion_from_rotation(rotation)
    return make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


def placed(matrix: FloatArray) -> Any:
    """The pose of a transform (4, 4)."""
    return make(
        "geometry_msgs/msg/Pose",
        position=triple(POINT, matrix[:3, 3]),
        orientation=turn(matrix[:3, :3]),
    )


def plane_pose(pose: FloatArray) -> Any:
    """The pose of a plane pose (3,)."""
    half = float(pose[2]) / 2
    upright = make(
        "geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=float(np.sin(half)), w=float(np.cos(half))
    )
    place = triple(POINT, (pose[0], pose[1], 0.0))
    return make("geometry_msgs/msg/Pose", position=place, orientation=upright)


def poses_message(stamp_ns: int, poses: FloatArray) -> Any:
    """Samples (n, 3) of a robot belief in map."""
    return make(POSES, header=header(stamp_ns, MAP), poses=[plane_pose(pose) for pose in poses])


def transform_message(stamp_ns: int, parent: str, child: str, matrix: FloatArray) -> Any:
    """The transform (4, 4) of ``child`` in ``parent``."""
    return make(
        "geometry_msgs/msg/TransformStamped",
        header=header(stamp_ns, parent),
        child_frame_id=child,
        transform=make(
            "geometry_msgs/msg/Transform",
            translation=triple(VECTOR, matrix[:3, 3]),
            rotation=turn(matrix[:3, :3]),
        ),
    )


def transforms_message(transforms: Iterable[Any]) -> Any:
    return make(TRANSFORMS, transforms=list(transforms))


def robot_transform(stamp_ns: int, parent: str, pose: FloatArray) -> Any:
    """The transform of ``base_link`` at a plane pose (3,) in ``parent``."""
    return transform_message(stamp_ns, parent, BASE, transform_from_pose(pose))
