"""The ROS messages that a robot would have recorded."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.geometry import FloatArray, quaternion_from_rotation, rotation_from_rpy
from objstate.recording.ros import standard_types
from objstate.simulation.scene import InitialPose, Laser, Mount

MAP, ODOM, BASE = "map", "odom", "base_link"  # frames of REP-105
SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
POSES = "geometry_msgs/msg/PoseArray"
X, Y, YAW = 0, 7, 35  # where the variances stand in a covariance of 6 x 6


def scan_message(stamp_ns: int, laser: Laser, ranges: FloatArray) -> Any:
    """One sweep; ``ranges`` (n,) m."""
    return _make(
        SCAN,
        header=_header(stamp_ns, laser.frame),
        angle_min=laser.angle_min,
        angle_max=laser.angle_max,
        angle_increment=(laser.angle_max - laser.angle_min) / (laser.beams - 1),
        time_increment=laser.time_increment,
        scan_time=1.0 / laser.rate,
        range_min=laser.range_min,
        range_max=laser.range_max,
        ranges=ranges.astype(np.float32),
        intensities=np.zeros(0, dtype=np.float32),
    )


def odometry_message(stamp_ns: int, pose: FloatArray, velocity: FloatArray) -> Any:
    """Pose (3,) in odom and velocity (3,) of the base: m/s ahead and to the left, rad/s."""
    twist = _make(
        "geometry_msgs/msg/Twist",
        linear=_vector(velocity[0], velocity[1], 0.0),
        angular=_vector(0.0, 0.0, velocity[2]),
    )
    return _make(
        ODOMETRY,
        header=_header(stamp_ns, ODOM),
        child_frame_id=BASE,
        pose=_make(
            "geometry_msgs/msg/PoseWithCovariance", pose=_pose(pose), covariance=np.zeros(36)
        ),
        twist=_make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
    )


def odometry_transform(stamp_ns: int, pose: FloatArray) -> Any:
    """The same as a transform odom -> base_link."""
    place = _vector(pose[0], pose[1], 0.0)
    return _transforms([_transform(stamp_ns, ODOM, BASE, place, _turn(0.0, 0.0, pose[2]))])


def mount_transforms(stamp_ns: int, mounts: dict[str, Mount]) -> Any:
    """Where the lasers sit on base_link, by frame."""
    return _transforms(
        [
            _transform(stamp_ns, BASE, frame, _vector(m.x, m.y, m.z), _turn(m.roll, m.pitch, m.yaw))
            for frame, m in mounts.items()
        ]
    )


def initial_pose_message(stamp_ns: int, pose: FloatArray, deviations: InitialPose) -> Any:
    """Pose (3,) in map with the deviations as its covariance."""
    covariance = np.zeros(36)
    covariance[[X, Y]] = deviations.sigma_xy**2
    covariance[YAW] = deviations.sigma_yaw**2
    return _make(
        POSE,
        header=_header(stamp_ns, MAP),
        pose=_make("geometry_msgs/msg/PoseWithCovariance", pose=_pose(pose), covariance=covariance),
    )


def poses_message(stamp_ns: int, poses: FloatArray) -> Any:
    """Samples (n, 3) of a robot belief in map."""
    return _make(POSES, header=_header(stamp_ns, MAP), poses=[_pose(pose) for pose in poses])


def _make(name: str, **fields: Any) -> Any:
    return standard_types().types[name](**fields)


def _header(stamp_ns: int, frame: str) -> Any:
    seconds, rest = divmod(stamp_ns, 10**9)
    stamp = _make("builtin_interfaces/msg/Time", sec=seconds, nanosec=rest)
    return _make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def _vector(x: float, y: float, z: float) -> Any:
    return _make("geometry_msgs/msg/Vector3", x=float(x), y=float(y), z=float(z))


def _turn(roll: float, pitch: float, yaw: float) -> Any:
    x, y, z, w = quaternion_from_rotation(rotation_from_rpy(roll, pitch, yaw))
    return _make("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)


def _pose(pose: FloatArray) -> Any:
    x, y, yaw = (float(value) for value in pose)
    return _make(
        "geometry_msgs/msg/Pose",
        position=_make("geometry_msgs/msg/Point", x=x, y=y, z=0.0),
        orientation=_turn(0.0, 0.0, yaw),
    )


def _transform(stamp_ns: int, parent: str, child: str, place: Any, turn: Any) -> Any:
    return _make(
        "geometry_msgs/msg/TransformStamped",
        header=_header(stamp_ns, parent),
        child_frame_id=child,
        transform=_make("geometry_msgs/msg/Transform", translation=place, rotation=turn),
    )


def _transforms(items: list[Any]) -> Any:
    return _make(TRANSFORMS, transforms=items)
