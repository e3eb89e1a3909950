"""How far the estimated path of the robot lies from the true one."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.errors import TruthError
from objstate.evaluation.summary import Distances, summarize_distances
from objstate.geometry import FloatArray, IntArray, between, compose, interpolate_pose, wrap
from objstate.records import Path

# The true path is interpolated between poses; where it has a longer gap, nothing is compared.
LONGEST_GAP_NS = 1_000_000_000


RELATIVE_TO_M = 1.0  # m of way, after which relative errors are taken
TINY = 1e-6  # m; a path that spans less has no direction to be aligned by


@dataclass(frozen=True)
class RobotErrors:
    """The robot's own error.

    ``position`` and ``yaw`` are absolute errors, at every estimated pose; the root mean square of
    ``position`` is the absolute trajectory error (ATE). ``relative_position`` and ``relative_yaw``
    are those of the movement from pose to pose, each ``RELATIVE_TO_M`` of way after the last: the
    relative pose error (RPE). None where the path is shorter.
    """

    count: int  # poses compared
    position: Distances  # m
    yaw: Distances  # rad
    relative_position: Distances | None = None  # m
    relative_yaw: Distances | None = None  # rad
    pairs: int = 0  # of poses, of the relative errors
    aligned_by: tuple[float, float, float] | None = (
        None  # x, y (m), yaw of the movement made before
    )


def compare_paths(estimated: Path, true: Path, align: bool = False) -> RobotErrors:
    """Estimated poses against the true path, interpolated at their stamps.

    Both paths are in the same frame. With ``align``, the estimated one is moved and turned first,
    so that the sum of squared distances is least (Umeyama 1991, in the plane, without scale).

    Raises TruthError where the paths share no time, or one can't be aligned.
    """
    if len(true.stamps_ns) < 2:
        raise TruthError("The true path has fewer than two poses; give one that spans the log.")
    after = np.searchsorted(true.stamps_ns, estimated.stamps_ns, side="left")
    after = np.clip(after, 1, len(true.stamps_ns) - 1)
    begin, end = true.stamps_ns[after - 1], true.stamps_ns[after]
    stamps = estimated.stamps_ns
    known = (begin <= stamps) & (stamps <= end) & (end - begin <= LONGEST_GAP_NS)
    if not known.any():
        raise TruthError(_no_shared_time(estimated, true))
    share = (stamps - begin)[known] / np.maximum(end - begin, 1)[known]
    expected = interpolate_pose(true.poses[after - 1][known], true.poses[after][known], share)
    poses = estimated.poses[known]
    moved = alignment(poses, expected) if align else None
    if moved is not None:
        poses = compose(moved, poses)
    off = poses - expected
    ends = _each_metre(poses)
    first, last = ends[:-1], ends[1:]
    drift = between(between(expected[first], expected[last]), between(poses[first], poses[last]))
    return RobotErrors(
        count=int(known.sum()),
        position=summarize_distances(np.hypot(off[:, 0], off[:, 1])),
        yaw=summarize_distances(np.abs(wrap(off[:, 2]))),
        relative_position=_summary(np.hypot(drift[:, 0], drift[:, 1])),
        relative_yaw=_summary(np.abs(drift[:, 2])),
        pairs=len(drift),
        aligned_by=None if moved is None else (float(moved[0]), float(moved[1]), float(moved[2])),
    )


def alignment(poses: FloatArray, expected: FloatArray) -> FloatArray:
    """The motion (3,) of poses (n, 3) that minimizes their squared distances to others.

    Raises TruthError where the positions don't determine a direction.
    """
    middle, other = poses[:, :2].mean(axis=0), expected[:, :2].mean(axis=0)
    a, b = poses[:, :2] - middle, expected[:, :2] - other
    if min(np.hypot(*a.T).max(), np.hypot(*b.T).max()) < TINY:
        raise TruthError("The robot stood still, which determines no direction; leave out --align.")
    turn = math.atan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    turned = compose(np.array([0.0, 0.0, turn]), np.array([*middle, 0.0]))
    return np.array([*(other - turned[:2]), turn])


def _each_metre(poses: FloatArray) -> IntArray:
    """The first pose, and each that is at least ``RELATIVE_TO_M`` of way after the last."""
    steps = np.hypot(*np.diff(poses[:, :2], axis=0).T)
    ends, way = [0], 0.0
    for place, step in enumerate(steps.tolist(), start=1):
        way += step
        if way >= RELATIVE_TO_M:
            ends.append(place)
            way = 0.0
    return np.array(ends, dtype=np.int64)


def _summary(distances: FloatArray) -> Distances | None:
    return summarize_distances(distances) if len(distances) else None


def _no_shared_time(estimated: Path, true: Path) -> str:
    spans = [
        f"{path.stamps_ns[0] / 1e9:.3f} to {path.stamps_ns[-1] / 1e9:.3f} s"
        if len(path.stamps_ns)
        else "no poses"
        for path in (estimated, true)
    ]
    return (
        f"No estimated pose ({spans[0]}) falls between two true ones ({spans[1]}) that are at most "
        f"{LONGEST_GAP_NS / 1e9:g} s apart; use the path of the same log."
    )
