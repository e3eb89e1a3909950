"""What may be fed: records whose numbers can be used, checked before they change anything."""

from __future__ import annotations

from typing import TypeGuard

import numpy as np

from objstate.errors import LogError
from objstate.geometry import FloatArray, is_covariance
from objstate.records import GaussianRobotBelief, InitialPose, Odometry, Record, RobotBelief, Scan


def check(record: Record, now_ns: int) -> None:
    """Refuse a record that would spoil the beliefs, where the last one was of ``now_ns``.

    Raises LogError for numbers that are none and for records out of time order, TypeError for what
    is no record.
    """
    match record:
        case Scan():
            _check_scan(record)
        case Odometry():
            _check(record, record.pose, (3,), "pose")
        case InitialPose() | GaussianRobotBelief():
            _check(record, record.mean, (3,), "mean")
            if record.covariance is not None:  # else it isn't known
                _check(record, record.covariance, (3, 3), "covariance")
                if not is_covariance(record.covariance):
                    raise LogError(
                        f"The covariance of the {type(record).__name__} of {record.stamp_ns} ns is "
                        "not positive semidefinite; give None where it isn't known."
                    )
        case RobotBelief():
            _check(record, record.poses, (len(record.weights), 3), "poses")
            _check(record, record.weights, (len(record.poses),), "weights")
            if (record.weights < 0.0).any() or not record.weights.any():
                raise LogError(
                    f"The weights of the RobotBelief of {record.stamp_ns} ns are below zero, or all "
                    "zero; give samples that are possible."
                )
        case _:
            raise TypeError(
                f"{type(record).__name__} is no record; feed the Odometry, Scan and InitialPose "
                "that open_log gives, one by one."
            )
    if record.stamp_ns < now_ns:
        raise LogError(
            f"{type(record).__name__} of {record.stamp_ns} ns came after one of {now_ns} ns; feed "
            "records in time order, as open_log gives them."
        )


def _check_scan(scan: Scan) -> None:
    """Ranges may be nan, of discarded beams, and infinite, of beams without a return."""
    count = len(scan.rays)
    if not _is_array(scan.ranges, (count,)):
        raise LogError(
            f"A scan of {scan.stamp_ns} ns has ranges of shape {np.shape(scan.ranges)}, where its "
            f"rays need an array of shape ({count},); give one range for each ray."
        )
    if (scan.ranges < 0.0).any():
        raise LogError(
            f"A scan of {scan.stamp_ns} ns has ranges below zero; give nan for erroneous readings, "
            "and for those that are too close."
        )
    if scan.odometry is not None:
        _check(scan, scan.odometry, (3,), "odometry")


def _check(
    record: Scan | Odometry | InitialPose | GaussianRobotBelief | RobotBelief,
    values: FloatArray,
    shape: tuple[int, ...],
    what: str,
) -> None:
    if not are_finite(values, shape):
        raise LogError(
            f"The {what} of the {type(record).__name__} of {record.stamp_ns} ns must be a finite "
            f"array of shape {shape}; leave out readings that are none."
        )


def are_finite(values: object, shape: tuple[int, ...]) -> bool:
    """Whether something is an array of finite numbers, of a shape."""
    return _is_array(values, shape) and bool(np.isfinite(values).all())


def _is_array(values: object, shape: tuple[int, ...]) -> TypeGuard[FloatArray]:
    if not isinstance(values, np.ndarray):
        return False
    return values.dtype.kind in "iuf" and values.shape == shape
