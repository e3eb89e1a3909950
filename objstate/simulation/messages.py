"""The ROS messages that a robot would have recorded."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.geometry import FloatArray, rotation_from_rpy, transform
from objstate.recording.messages import (
    BASE,
    MAP,
    ODOM,
    VECTOR,
    header,
    make,
    plane_pose,
    robot_transform,
    transform_message,
    transforms_message,
    triple,
)
from objstate.simulation.scene import InitialPose, Laser, Mount

SCAN = "sensor_msgs/msg/LaserScan"
ODOMETRY = "nav_msgs/msg/Odometry"
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"
X, Y, YAW = 0, 7, 35  # where the variances stand in a covariance of 6 x 6


def scan_message(stamp_ns: int, laser: Laser, ranges: FloatArray) -> Any:
    """One sweep; ``ranges`` (n,) m."""
    return make(
        SCAN,
        header=header(stamp_ns, laser.frame),
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
    twist = make(
        "geometry_msgs/msg/Twist",
        linear=triple(VECTOR, (velocity[0], velocity[1], 0.0)),
        angular=triple(VECTOR, (0.0, 0.0, velocity[2])),
    )
    return make(
        ODOMETRY,
        header=header(stamp_ns, ODOM),
        child_frame_id=BASE,
        pose=make(
            "geometry_msgs/msg/PoseWithCovariance", pose=plane_pose(pose), covariance=np.zeros(36)
        ),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
    )


def odometry_transform(stamp_ns: int, pose: FloatArray) -> Any:
    """The same as a transform odom -> base_link."""
    return transforms_message([robot_transform(stamp_ns, ODOM, pose)])


def mount_transforms(stamp_ns: int, mounts: dict[str, Mount]) -> Any:
    """Where the lasers sit on base_link, by frame."""
    return transforms_message(
        transform_message(
            stamp_ns,
            BASE,
            frame,
            transform(rotation_from_rpy(m.roll, m.pitch, m.yaw), (m.x, m.y, m.z)),
        )
        for frame, m in mounts.items()
    )


def initial_pose_message(stamp_ns: int, pose: FloatArray, deviations: InitialPose) -> Any:
    """Pose (3,) in map with the deviations as its covariance."""
    covariance = np.zeros(36)
    covariance[[X, Y]] = deviations.sigma_xy**2
    covariance[YAW] = deviations.sigma_yaw**2
    return make(
        POSE,
        header=header(stamp_ns, MAP),
        pose=make(
            "geometry_msgs/msg/PoseWithCovariance", pose=plane_pose(pose), covariance=covariance
        ),
    )
