"""Recorded beliefs about the robot's pose, and initial poses, from ROS messages."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from objstate.frame_names import frame_name
from objstate.geometry import FloatArray, is_covariance
from objstate.records import GaussianRobotBelief, InitialPose, RobotBelief

MAP = "map"

# rows and columns of x, y and yaw in ROS's covariance over x, y, z, roll, pitch, yaw
PLANE = np.ix_([0, 1, 5], [0, 1, 5])


def plane_pose(pose: Any) -> tuple[float, float, float]:
    """x, y and yaw of a ``geometry_msgs/Pose``; yaw is the heading of its x axis.

    Raises ValueError for numbers that are no pose.
    """
    q = pose.orientation
    cos = q.w * q.w + q.x * q.x - q.y * q.y - q.z * q.z
    sin = 2 * (q.w * q.z + q.x * q.y)
    x, y = pose.position.x, pose.position.y
    if (cos == 0 and sin == 0) or not math.isfinite(x + y + cos + sin):
        raise ValueError("the pose is not finite, or its orientation is zero")
    return x, y, math.atan2(sin, cos)


def initial_pose(message: Any, stamp_ns: int) -> InitialPose:
    """From a ``PoseWithCovarianceStamped`` on ``/initialpose``."""
    return InitialPose(stamp_ns, *_gaussian(message))


def gaussian_belief(message: Any, stamp_ns: int) -> GaussianRobotBelief:
    """From any other ``PoseWithCovarianceStamped``, such as AMCL's pose."""
    return GaussianRobotBelief(stamp_ns, *_gaussian(message))


def pose_array_belief(message: Any, stamp_ns: int) -> RobotBelief:
    """From a ``geometry_msgs/PoseArray``: samples of equal weight."""
    poses = np.array([plane_pose(pose) for pose in message.poses])
    if not len(poses):
        raise ValueError("it holds no poses")
    return RobotBelief(stamp_ns, poses, np.full(len(poses), 1.0 / len(poses)))


def particle_cloud_belief(message: Any, stamp_ns: int) -> RobotBelief:
    """From a ``nav2_msgs/ParticleCloud``: weighted samples."""
    poses = np.array([plane_pose(particle.pose) for particle in message.particles])
    weights = np.array([particle.weight for particle in message.particles])
    if not (np.isfinite(weights).all() and (weights >= 0).all() and weights.sum() > 0):
        raise ValueError("its weights are not usable")
    return RobotBelief(stamp_ns, poses, weights / weights.sum())


def check_frame(message: Any) -> None:
    """Raises ValueError for a belief that is not about the building's frame."""
    frame = frame_name(message.header.frame_id)
    if frame.rpartition("/")[2] != MAP:
        raise ValueError(f"it is in the frame '{frame}', not '{MAP}'")


def _gaussian(message: Any) -> tuple[FloatArray, FloatArray | None]:
    """Mean (3,) and covariance (3, 3); None where a variance is 0, by which ROS says "unknown"."""
    mean = np.array(plane_pose(message.pose.pose))
    covariance = np.asarray(message.pose.covariance, dtype=float).reshape(6, 6)[PLANE]
    if not np.isfinite(covariance).all():
        raise ValueError("its covariance is not finite")
    if not is_covariance(covariance):
        raise ValueError("its covariance is not positive semidefinite")
    return mean, covariance if covariance.diagonal().all() else None
