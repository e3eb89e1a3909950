"""Plane poses, rigid transforms and angles. SI units and radians throughout.

A pose is an array whose last axis is ``(x, y, yaw)``; a transform is a ``(4, 4)``
matrix. All functions take any leading batch axes.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]
IntArray = NDArray[np.int64]

TURN = 2.0 * math.pi  # rad
WHOLE_TURN = 6.29  # rad, with room for rounding; a larger angle was probably meant in degrees
ROUNDING = 1e-6  # relative to the largest variance; a smaller negative one is a rounding error


def wrap(angle: ArrayLike) -> FloatArray:
    """Angles wrapped to [-pi, pi)."""
    return np.asarray((np.asarray(angle, dtype=float) + np.pi) % (2 * np.pi) - np.pi)


def wrapped(angle: float) -> float:
    """One angle wrapped to [-pi, pi), without the cost of arrays."""
    return (angle + math.pi) % (2 * math.pi) - math.pi


def compose(a: FloatArray, b: FloatArray) -> FloatArray:
    """The pose ``b``, given in the frame of pose ``a``, in the frame of ``a``'s parent."""
    a, b = np.broadcast_arrays(a, b)
    cos, sin = np.cos(a[..., 2]), np.sin(a[..., 2])
    return np.stack(
        [
            a[..., 0] + cos * b[..., 0] - sin * b[..., 1],
            a[..., 1] + sin * b[..., 0] + cos * b[..., 1],
            wrap(a[..., 2] + b[..., 2]),
        ],
        axis=-1,
    )


def between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Pose ``b`` seen from pose ``a``: ``compose(a, between(a, b)) == b``."""
    if a.ndim == b.ndim == 1:  # the most frequent case, without the cost of arrays
        (ax, ay, heading), (bx, by, towards) = a.tolist(), b.tolist()
        c, s, x, y = math.cos(heading), math.sin(heading), bx - ax, by - ay
        return np.array([c * x + s * y, -s * x + c * y, wrapped(towards - heading)])
    a, b = np.broadcast_arrays(a, b)
    cos, sin = np.cos(a[..., 2]), np.sin(a[..., 2])
    dx, dy = b[..., 0] - a[..., 0], b[..., 1] - a[..., 1]
    return np.stack(
        [cos * dx + sin * dy, -sin * dx + cos * dy, wrap(b[..., 2] - a[..., 2])], axis=-1
    )


def interpolate_pose(a: FloatArray, b: FloatArray, share: ArrayLike) -> FloatArray:
    """The pose at a ``share`` of the motion from ``a`` to ``b``.

    0 gives a, 1 gives b; the heading turns the shorter way round.
    """
    if isinstance(share, float) and a.ndim == b.ndim == 1:  # the most frequent case, as above
        (ax, ay, heading), (bx, by, towards) = a.tolist(), b.tolist()
        yaw = wrapped(heading + share * wrapped(towards - heading))
        return np.array([ax + share * (bx - ax), ay + share * (by - ay), yaw])
    part = np.asarray(share, dtype=float)[..., None]
    step = np.concatenate([b[..., :2] - a[..., :2], wrap(b[..., 2:] - a[..., 2:])], axis=-1)
    moved = a + part * step
    return np.concatenate([moved[..., :2], wrap(moved[..., 2:])], axis=-1)


def square_root(covariance: FloatArray) -> FloatArray:
    """A matrix ``root`` (d, d) with ``root @ root.T == covariance``, which may be singular."""
    values, vectors = np.linalg.eigh(covariance)
    return np.asarray(vectors * np.sqrt(np.maximum(values, 0.0)))


def is_covariance(matrix: FloatArray) -> bool:
    """Whether a finite matrix (d, d) is positive semidefinite, up to rounding errors."""
    variances = np.linalg.eigvalsh(0.5 * (matrix + matrix.T))
    return bool(variances[0] >= -ROUNDING * max(variances[-1], 0.0))


def whitened(points: FloatArray) -> FloatArray:
    """Points (n, d), moved and sheared to mean zero and unit covariance."""
    points = points - points.mean(axis=0)
    root = np.linalg.cholesky(points.T @ points / len(points))
    return np.asarray(np.linalg.solve(root, points.T).T)


def rotation_about(axis: ArrayLike, angles: ArrayLike) -> FloatArray:
    """Rotation matrices (..., 3, 3) by ``angles`` (...) about a unit ``axis`` (3,) (Rodrigues)."""
    x, y, z = np.asarray(axis, dtype=float)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    angle = np.asarray(angles, dtype=float)[..., None, None]
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross))


def rotation_from_rpy(roll: float, pitch: float, yaw: float) -> FloatArray:
    """Rotation matrix (3, 3) of fixed-axis roll, pitch, yaw, as URDF and tf define them."""
    z, y, x = np.eye(3)[2], np.eye(3)[1], np.eye(3)[0]
    return np.asarray(rotation_about(z, yaw) @ rotation_about(y, pitch) @ rotation_about(x, roll))


def rpy_from_rotation(rotation: FloatArray) -> tuple[float, float, float]:
    """Roll, pitch, yaw (rad) of a rotation matrix (3, 3)."""
    pitch = float(np.arctan2(-rotation[2, 0], np.hypot(rotation[0, 0], rotation[1, 0])))
    if abs(np.cos(pitch)) < 1e-9:  # gimbal lock: give the whole turn to yaw
        return 0.0, pitch, float(np.arctan2(-rotation[0, 1], rotation[1, 1]))
    return (
        float(np.arctan2(rotation[2, 1], rotation[2, 2])),
        pitch,
        float(np.arctan2(rotation[1, 0], rotation[0, 0])),
    )


def rotation_from_quaternion(x: float, y: float, z: float, w: float) -> FloatArray:
    """Rotation matrix (3, 3) of a quaternion, which need not be of unit length.

    Raises ValueError for a quaternion of length zero.
    """
    q = np.array([x, y, z, w], dtype=float)
    with np.errstate(over="ignore", invalid="ignore"):  # numbers that overflow are no direction
        norm = float(q @ q)
    if not np.isfinite(norm) or norm < 1e-12:
        raise ValueError(f"quaternion ({x}, {y}, {z}, {w}) has no direction")
    x, y, z, w = q / np.sqrt(norm)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def quaternion_from_rotation(rotation: FloatArray) -> tuple[float, float, float, float]:
    """Quaternion ``(x, y, z, w)`` of a rotation matrix (3, 3), with w >= 0."""
    from scipy.spatial.transform import Rotation

    x, y, z, w = Rotation.from_matrix(rotation).as_quat(canonical=True)
    return float(x), float(y), float(z), float(w)


def transform(rotation: ArrayLike, translation: ArrayLike) -> FloatArray:
    """Homogeneous matrices (..., 4, 4) from rotations (..., 3, 3) and translations (..., 3)."""
    rotation, translation = np.asarray(rotation, dtype=float), np.asarray(translation, dtype=float)
    batch = np.broadcast_shapes(rotation.shape[:-2], translation.shape[:-1])
    out = np.zeros((*batch, 4, 4))
    out[..., :3, :3] = rotation
    out[..., :3, 3] = translation
    out[..., 3, 3] = 1.0
    return out


def invert(matrix: FloatArray) -> FloatArray:
    """Inverse of rigid transforms (..., 4, 4)."""
    back = np.swapaxes(matrix[..., :3, :3], -1, -2)
    return transform(back, -(back @ matrix[..., :3, 3, None])[..., 0])


def transform_from_pose(pose: ArrayLike, z: ArrayLike = 0.0) -> FloatArray:
    """Transforms (..., 4, 4) of plane poses (..., 3) at height ``z`` metres."""
    pose = np.asarray(pose, dtype=float)
    out = np.zeros((*pose.shape[:-1], 4, 4))
    out[..., 0, 0] = out[..., 1, 1] = np.cos(pose[..., 2])
    out[..., 1, 0] = np.sin(pose[..., 2])
    out[..., 0, 1] = -out[..., 1, 0]
    out[..., :2, 3] = pose[..., :2]
    out[..., 2, 3] = z
    out[..., 2, 2] = out[..., 3, 3] = 1.0
    return out


def pose_from_transform(matrix: FloatArray) -> FloatArray:
    """The plane pose (..., 3) of transforms (..., 4, 4): position and heading of the x axis."""
    yaw = np.arctan2(matrix[..., 1, 0], matrix[..., 0, 0])
    return np.stack([matrix[..., 0, 3], matrix[..., 1, 3], yaw], axis=-1)


def is_rigid(matrix: Any) -> bool:
    """Whether a (4, 4) matrix is a proper rigid transform."""
    rotation = np.asarray(matrix)[:3, :3]
    return bool(
        np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
        and np.linalg.det(rotation) > 0
        and np.isfinite(matrix).all()
    )


def pose_from_text(text: str) -> FloatArray:
    """The pose (3,) written as ``x,y,yaw``. Raises ValueError with the fault."""
    parts = text.split(",")
    if len(parts) != 3:
        raise ValueError(f"it has {len(parts)} parts, not 3")
    x, y, yaw = parts
    return np.array([finite(x), finite(y), angle_from_text(yaw)])


def angle_from_text(text: str) -> float:
    """Radians, or degrees where the text ends in ``deg``. Raises ValueError with the fault.

    Radians beyond a whole turn are refused.
    """
    number = text.strip().removesuffix("deg")
    if text.strip().endswith("deg"):
        return math.radians(finite(number))
    value = finite(number)
    return checked_angle(value, f"{number}deg")


def checked_angle(value: float, in_degrees: str | None = None) -> float:
    """An angle in radians from a user. Raises ValueError for more than a whole turn.

    ``in_degrees`` is how to write the same number of degrees, where not as radians.
    """
    if abs(value) <= WHOLE_TURN:
        return value
    cure = in_degrees or f"{math.radians(value):.4g}"
    raise ValueError(
        f"{value:g} rad is more than a whole turn (6.28 rad); if degrees are meant, write {cure}"
    )


def finite(text: str) -> float:
    """The number that a text gives. Raises ValueError for none, and for infinities."""
    try:
        value = float(text)
    except ValueError as error:
        raise ValueError(f"'{text.strip()}' is no number") from error
    if not math.isfinite(value):
        raise ValueError(f"{text.strip()} is not finite")
    return value


def crosses(a: FloatArray, b: FloatArray) -> bool:
    """Whether any segment of a (m, 2, 2) crosses any of b (k, 2, 2)."""

    def parted(segments: FloatArray, by: FloatArray) -> BoolArray:
        """(m, k) whether the ends of each segment lie on both sides of each line."""
        start = by[None, :, 0]
        edge = by[None, :, 1] - start
        sides = [cross_product(edge, segments[:, None, end] - start) for end in (0, 1)]
        return np.asarray(sides[0] * sides[1] < 0)

    return bool(np.any(parted(a, b) & parted(b, a).T))


def cross_product(a: FloatArray, b: FloatArray) -> FloatArray:
    """The z component of the cross product of plane vectors (..., 2)."""
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
