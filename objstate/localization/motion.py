"""The odometry motion model p(l | a, l'): eq. (7), with AMCL's alphas.

A step of odometry is an arc: half of its turn before and half after the translation. The noise is
that of AMCL's model (Thrun, Burgard and Fox 2005, table 5.6) for a step of ``update_min_d`` or a
turn of ``update_min_a``, except that both halves of the turn share the variance that AMCL gives to
each. For other steps the variance is in proportion to their length, so that the spread after a
drive doesn't depend on the odometry's rate.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from objstate.config import LocalizationSettings
from objstate.geometry import FloatArray
from objstate.localization import samples


class Variances(NamedTuple):
    """Variances of a step's length, m^2, and of its turn, rad^2; or factors on them."""

    length: float
    turn: float

    def plus(self, others: Variances) -> Variances:
        """The sum for two independent steps."""
        return Variances(self.length + others.length, self.turn + others.turn)


def motion_variances(step: FloatArray, settings: LocalizationSettings) -> Variances:
    """The variances that the alphas give to a step (3,)."""
    s, (ahead, left, turn) = settings, step.tolist()
    driven = math.hypot(ahead, left) * s.update_min_d  # m^2
    turned = abs(turn) * s.update_min_a  # rad^2
    return Variances(
        s.alpha3 * driven + s.alpha4 * turned,
        s.alpha1 * turned + s.alpha2 * driven,
    )


def sample_motion(
    poses: FloatArray, step: FloatArray, variances: Variances, rng: np.random.Generator
) -> FloatArray:
    """Poses (n, 3) after the odometry moved by ``step`` (3,) in the robot's frame, with noise."""
    length_std, half_turn_std = math.sqrt(variances.length), math.sqrt(variances.turn / 2.0)
    ahead, left, turn = step.tolist()
    length, bearing = math.hypot(ahead, left), math.atan2(left, ahead)
    noise, out = rng.standard_normal((3, len(poses))), np.empty((len(poses), 3))
    samples.moved(poses, length, bearing, turn, length_std, half_turn_std, noise, out)
    return out
