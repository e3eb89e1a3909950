"""A camera on a pan and a tilt axis: which places it may look at, and what it sees there.

Darmstadt, section 6.3.2. As printed, eqs. (6.27) and (6.31) clamp signed angles, by which places to
the right of the robot would weigh more than 1; here their sizes count.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.errors import SettingsError
from objstate.geometry import FloatArray, wrap

RIGHT = math.pi / 2.0


@dataclass(frozen=True)
class PanTilt:
    """A camera above the robot's feet. Raises SettingsError for figures that no camera has."""

    height: float  # m above the floor
    wide: float  # rad, opening angle to the sides
    high: float  # rad, opening angle upwards
    turn: float = math.pi  # rad, beta_space: from the robot's heading to where it may look
    reach: float = 6.0  # m, d_space: from the robot to where it may look
    turn_cost: float = math.pi  # rad, beta_cost: from the last gaze to the next
    reach_cost: float = 6.0  # m, d_cost: by which the next gaze is nearer or farther than the last

    def __post_init__(self) -> None:
        for name in ("height", "reach", "reach_cost"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise SettingsError(f"A camera can't have {name} {value:g} m; give above 0.")
        for name, most in (("wide", math.pi), ("high", math.pi), ("turn", 7.0), ("turn_cost", 7.0)):
            value = getattr(self, name)
            if not 0.0 < value < most:
                raise SettingsError(
                    f"A camera can't have {name} {value:g} rad; give above 0 and below {most:.3g}."
                )

    def space(self, points: FloatArray) -> FloatArray:
        """(n,) how good points (n, 2) m in the robot's frame are to look at, eqs. (6.26) to (6.28)."""
        away, bearing = _polar(points)
        return np.asarray(clamped(away, self.reach) * clamped(np.abs(bearing), self.turn))

    def cost(self, points: FloatArray, focus: FloatArray) -> FloatArray:
        """(n,) how near points (n, 2) are to the last one (2,), eqs. (6.30) to (6.32)."""
        (away, bearing), (last, pan) = _polar(points), _polar(np.asarray(focus, dtype=float))
        far = clamped(np.abs(away - last), self.reach_cost)
        return np.asarray(far * clamped(np.abs(wrap(bearing - pan)), self.turn_cost))

    def weights(self, points: FloatArray, focus: FloatArray) -> FloatArray:
        """(n,) both, eq. (6.33); 0 of what can't be looked at next."""
        return self.space(points) * self.cost(points, focus)

    def view(self, points: FloatArray) -> FloatArray:
        """(n, 2) m semiaxes of the ellipse that is seen about points, away from the robot and across.

        The former is the distance to the lower edge of the picture, as section 6.3.4 takes it.
        """
        away = np.hypot(points[:, 0], points[:, 1])
        down = np.minimum(np.arctan2(self.height, away) + self.high / 2.0, RIGHT)
        lower = self.height * np.cos(down) / np.sin(down)
        across = np.hypot(away, self.height) * math.tan(self.wide / 2.0)
        return np.column_stack([away - lower, across])

    def aim(self, point: FloatArray) -> tuple[float, float]:
        """Pan to the left and tilt below the horizon, rad, to a point (2,) m in the robot's frame."""
        away, bearing = _polar(np.asarray(point, dtype=float))
        return float(bearing), math.atan2(self.height, float(away))


def clamped(value: FloatArray, most: float) -> FloatArray:
    """Falls from 1 at nothing to 0 at ``most``, eq. (6.29)."""
    return np.asarray(1.0 - np.minimum(1.0, value / most))


def _polar(points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distances and bearings (...) of points (..., 2)."""
    return np.hypot(points[..., 0], points[..., 1]), np.arctan2(points[..., 1], points[..., 0])
