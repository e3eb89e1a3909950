"""Records that a robot sends as JSON, as the ROS messages that a log would hold."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from objstate.geometry import rotation_from_rpy, transform
from objstate.logs import Message
from objstate.logs.definitions import LASER_SCAN, ODOMETRY, POSE_WITH_COVARIANCE, TF, MessageType
from objstate.recording.messages import (
    BASE,
    MAP,
    ODOM,
    VECTOR,
    header,
    make,
    plane_pose,
    transform_message,
    transforms_message,
    triple,
)
from objstate.recording.ros import to_cdr

MOST_BEAMS = 100_000
MOST_RECORDS = 10_000
Stamp = Annotated[int, Field(ge=1, lt=2**31 * 10**9, description="ns since 1970")]
Number = Annotated[float, Field(allow_inf_nan=False, ge=-1e6, le=1e6)]


class Strict(BaseModel):
    model_config = ConfigDict(extra="forbid")


class ScanRecord(Strict):
    """A laser scan, as sensor_msgs/LaserScan; a range of null is no return."""

    type: Literal["scan"]
    stamp_ns: Stamp
    frame: str = Field(min_length=1, max_length=200)
    angle_min: Number = Field(description="rad")
    angle_increment: Number = Field(description="rad")
    time_increment: Number = Field(0.0, description="s from beam to beam")
    range_min: Number = Field(0.0, ge=0.0)
    range_max: Number = Field(gt=0.0)
    ranges: list[Number | None] = Field(min_length=1, max_length=MOST_BEAMS)


class OdometryRecord(Strict):
    """Where the robot is by its odometry."""

    type: Literal["odometry"]
    stamp_ns: Stamp
    x: Number
    y: Number
    yaw: Number


class PoseRecord(Strict):
    """Where the robot is in the building: where a drive starts."""

    type: Literal["pose"]
    stamp_ns: Stamp
    x: Number
    y: Number
    yaw: Number
    std_m: Number = Field(0.25, ge=0.0)
    std_rad: Number = Field(0.26, ge=0.0)


class MountingRecord(Strict):
    """Where a laser is on the robot: needed once, before its scans are used."""

    type: Literal["mounting"]
    stamp_ns: Stamp
    frame: str = Field(min_length=1, max_length=200)
    x: Number = 0.0
    y: Number = 0.0
    z: Number = 0.0
    roll: Number = 0.0
    pitch: Number = 0.0
    yaw: Number = 0.0


AnyRecord = Annotated[
    ScanRecord | OdometryRecord | PoseRecord | MountingRecord, Field(discriminator="type")
]


class Records(Strict):
    """What a robot sends, in the order in which it happened."""

    records: list[AnyRecord] = Field(min_length=1, max_length=MOST_RECORDS)


def messages_of(records: Sequence[Any]) -> list[Message]:
    """The messages of records, received now."""
    return [_message(record, time.time_ns()) for record in records]


def _message(record: Any, received_ns: int) -> Message:
    topic, kind, content = WAYS[record.type](record)
    return Message(topic, MessageType(kind), received_ns, to_cdr(kind, content))


def _scan(record: ScanRecord) -> tuple[str, str, Any]:
    ranges = np.array([math.inf if r is None else r for r in record.ranges], dtype=np.float32)
    content = make(
        LASER_SCAN,
        header=header(record.stamp_ns, record.frame),
        angle_min=record.angle_min,
        angle_max=record.angle_min + record.angle_increment * (len(ranges) - 1),
        angle_increment=record.angle_increment,
        time_increment=record.time_increment,
        scan_time=record.time_increment * len(ranges),
        range_min=record.range_min,
        range_max=record.range_max,
        ranges=ranges,
        intensities=np.zeros(0, dtype=np.float32),
    )
    return f"/{record.frame}/scan", LASER_SCAN, content


def _odometry(record: OdometryRecord) -> tuple[str, str, Any]:
    still = make(
        "geometry_msgs/msg/Twist",
        linear=triple(VECTOR, (0, 0, 0)),
        angular=triple(VECTOR, (0, 0, 0)),
    )
    content = make(
        ODOMETRY,
        header=header(record.stamp_ns, ODOM),
        child_frame_id=BASE,
        pose=make(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=plane_pose(np.array([record.x, record.y, record.yaw])),
            covariance=np.zeros(36),
        ),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=still, covariance=np.zeros(36)),
    )
    return "/odom", ODOMETRY, content


def _pose(record: PoseRecord) -> tuple[str, str, Any]:
    covariance = np.zeros((6, 6))
    covariance[0, 0] = covariance[1, 1] = record.std_m**2
    covariance[5, 5] = record.std_rad**2
    content = make(
        POSE_WITH_COVARIANCE,
        header=header(record.stamp_ns, MAP),
        pose=make(
            "geometry_msgs/msg/PoseWithCovariance",
            pose=plane_pose(np.array([record.x, record.y, record.yaw])),
            covariance=covariance.ravel(),
        ),
    )
    return "/initialpose", POSE_WITH_COVARIANCE, content


def _mounting(record: MountingRecord) -> tuple[str, str, Any]:
    turn = rotation_from_rpy(record.roll, record.pitch, record.yaw)
    matrix = transform(turn, (record.x, record.y, record.z))
    stamped = transform_message(record.stamp_ns, BASE, record.frame, matrix)
    return "/tf_static", TF[0], transforms_message([stamped])


WAYS: dict[str, Any] = {
    "scan": _scan,
    "odometry": _odometry,
    "pose": _pose,
    "mounting": _mounting,
}
