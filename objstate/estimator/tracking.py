"""One hypothesis of where the robot is, how well it fits, and the search for a better one.

Something that isn't in the model makes beams shorter, never longer. So beams that
return from beyond a wall tell a robot in the wrong place from a changed world.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from objstate.config import LocalizationSettings
from objstate.geometry import FloatArray, between
from objstate.localization import PoseBelief

NANOSECONDS = 1e9


@dataclass(frozen=True, eq=False)
class Track:
    """A robot belief and its record: when it was last corrected, and how badly it fits."""

    belief: PoseBelief
    misfit: float = 0.0  # share of returning beams that pass through walls, a running mean
    corrected_ns: int | None = None
    corrected_at: FloatArray | None = None  # (3,) odometry at the last correction
    known_since_ns: int | None = None  # since when the belief has been narrow

    def moved_enough(self, odometry: FloatArray | None, s: LocalizationSettings) -> bool:
        """Whether the robot has moved on since the last correction.

        Scans from one place repeat each other's errors, and would settle a wide
        belief on a wrong place.
        """
        if self.corrected_at is None or odometry is None:
            return True
        step = between(self.corrected_at, odometry)
        return bool(np.hypot(step[0], step[1]) >= s.update_min_d or abs(step[2]) >= s.update_min_a)

    def corrected(self, belief: PoseBelief, stamp_ns: int, odometry: FloatArray | None) -> Track:
        return replace(self, belief=belief, corrected_ns=stamp_ns, corrected_at=odometry)

    def judged(self, through_walls: float, stamp_ns: int, s: LocalizationSettings) -> Track:
        """The track after a scan, ``through_walls`` of whose returns pass through walls."""
        if self.corrected_ns is None or self.known_since_ns is None:
            return replace(self, known_since_ns=stamp_ns)
        seconds = (stamp_ns - self.corrected_ns) / NANOSECONDS
        share = 1.0 - np.exp(-seconds / s.lost_after)
        return replace(self, misfit=float(self.misfit + share * (through_walls - self.misfit)))

    def known_for(self, stamp_ns: int) -> float:
        """Seconds since when the belief has been narrow."""
        return (
            0.0 if self.known_since_ns is None else (stamp_ns - self.known_since_ns) / NANOSECONDS
        )


def share_through_walls(measured: FloatArray, walls: FloatArray, margin: float) -> float:
    """Share of returning beams (n,) that measured more than ``margin`` m beyond the walls (n,).

    Beams stand in the order of their bearings. The farthest wall of a beam and its
    two neighbours counts, since beside a corner, or along a wall, a small turn of
    the robot moves the expected range far.
    """
    returns = np.isfinite(measured)
    if not returns.any():
        return 0.0
    farthest = walls.copy()
    farthest[1:] = np.maximum(farthest[1:], walls[:-1])
    farthest[:-1] = np.maximum(farthest[:-1], walls[1:])
    return float(np.mean(measured[returns] > farthest[returns] + margin))
