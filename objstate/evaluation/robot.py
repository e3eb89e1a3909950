"""How far the estimated path of the robot lies from the true one."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.errors import TruthError
from objstate.evaluation.summary import Distances, summarize_distances
from objstate.geometry import interpolate_pose, wrap
from objstate.records import Path

# The true path is interpolated between poses; where it has a longer gap, nothing is compared.
LONGEST_GAP_NS = 1_000_000_000


@dataclass(frozen=True)
class RobotErrors:
    """The robot's own error; both paths in the same frame, no alignment."""

    count: int  # poses compared
    position: Distances  # m
    yaw: Distances  # rad


def compare_paths(estimated: Path, true: Path) -> RobotErrors:
    """Estimated poses against the true path, interpolated at their stamps.

    Raises TruthError where the paths share no time.
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
    off = estimated.poses[known] - expected
    return RobotErrors(
        count=int(known.sum()),
        position=summarize_distances(np.hypot(off[:, 0], off[:, 1])),
        yaw=summarize_distances(np.abs(wrap(off[:, 2]))),
    )


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
