"""Agreement between the parts of a drive, and its consequence for the deviations.

The assumptions about walls and odometry are never quite true: maps are bent, wheels slip, a robot
may have been lost for a while. Where results of the parts differ by more than they should, all
deviations are widened accordingly: the Birge ratio (Birge 1932; the Particle Data Group's "scale
factor").
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from objstate.calibration.adjustment import Adjusted
from objstate.geometry import FloatArray


def birge_ratios(whole: Adjusted, parts: Sequence[Adjusted]) -> FloatArray:
    """(2 + 4l,) by how much more than expected parts differ, at least 1, of odometry's errors and lasers.

    A part counts for the lasers that it has scans of.
    """
    ratios = [_ratio(_values(parts, k, None)) for k in range(2)]
    for frame in whole.frames:
        ratios += [_ratio(_values(parts, k, frame)) for k in range(4)]
    return np.array(ratios)


def _values(parts: Sequence[Adjusted], k: int, frame: str | None) -> list[tuple[float, float]]:
    """Each part's value and deviation of one quantity: of odometry, or of a laser."""
    found = []
    for part in parts:
        if frame is not None and frame not in part.frames:
            continue
        place = k if frame is None else 2 + 4 * part.frames.index(frame) + k
        variance = float(part.covariance[place, place])
        found.append((float(part.unknowns.others[place]), float(np.sqrt(variance))))
    return found


def _ratio(found: Sequence[tuple[float, float]]) -> float:
    """Root of chi-squared over the degrees of freedom, of values about their weighted mean."""
    if len(found) < 2:
        return 1.0
    values, stds = np.array(found).T
    weights = stds**-2.0
    off = (values - weights @ values / weights.sum()) / stds
    return max(1.0, float(np.sqrt(off @ off / (len(found) - 1))))
