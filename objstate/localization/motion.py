"""The odometry motion model p(l | a, l'): eq. (7), with AMCL's alphas.

A step of odometry is an arc: half of its turn before and half after the
translation. Noise is that of AMCL's model (Thrun, Burgard and Fox 2005, table 5.6)
when the step is as long as ``update_min_d`` or turns as far as ``update_min_a``, but
that both halves of the turn share the variance that AMCL gives to each; for other steps
the variance is in proportion to their length. So the spread after a drive doesn't
depend on the odometry's rate.
"""

from __future__ import annotations

import math

import numpy as np

from objstate.config import LocalizationSettings
from objstate.geometry import FloatArray
from objstate.localization import kernels


def sample_motion(
    poses: FloatArray, step: FloatArray, settings: LocalizationSettings, rng: np.random.Generator
) -> FloatArray:
    """Poses (n, 3) after the odometry moved by ``step`` (3,) in the robot's frame, with noise."""
    s = settings
    translation, rotation = math.hypot(step[0], step[1]), abs(float(step[2]))
    driven, turned = translation * s.update_min_d, rotation * s.update_min_a  # m^2, rad^2
    half_turn_std = math.sqrt((s.alpha1 * turned + s.alpha2 * driven) / 2.0)
    length_std = math.sqrt(s.alpha3 * driven + s.alpha4 * turned)
    bearing, turn = math.atan2(step[1], step[0]), float(step[2])
    noise = rng.standard_normal((3, len(poses)))
    out = kernels.moved(poses, translation, bearing, turn, length_std, half_turn_std, noise)
    return np.asarray(out)
