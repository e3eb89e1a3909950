"""How the robot moved by its odometry: knots along the way, and links between them.

A knot is a pose of the robot that is sought. Within the short way to the next one,
odometry is trusted but for its systematic errors: ways are counted too long by a
share, turns too wide by a share, and the heading drifts with the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.calibration.options import CalibrationOptions
from objstate.geometry import FloatArray, IntArray, between, compose, wrap

KNOT_WAY = 0.25  # m between knots
KNOT_TURN = 0.15  # rad that also make a new one
STANDING = np.array([0.002, 0.002, 0.002])  # m, m, rad; deviations of the shortest link


@dataclass(frozen=True, eq=False)
class Links:
    """Steps of the odometry from each knot to the next."""

    steps: FloatArray  # (m, 3) as the odometry counts them
    whitening: FloatArray  # (m, 3, 3) turns a step's error into unit deviations

    def residuals(self, begin: FloatArray, end: FloatArray, errors: FloatArray) -> FloatArray:
        """Whitened errors (m, 3) of the steps between poses (m, 3) under systematic errors (3,)."""
        off = self.steps - counted_steps(between(begin, end), errors)
        off[:, 2] = wrap(off[:, 2])
        return np.einsum("mij,mj->mi", self.whitening, off)


def counted_steps(steps: FloatArray, errors: FloatArray) -> FloatArray:
    """True steps (..., 3) as odometry with systematic errors (3,) counts them: of ways, of turns, drift rad/m."""
    way_scale, turn_scale, drift = errors
    way = np.hypot(steps[..., 0], steps[..., 1])
    turn = steps[..., 2] * (1.0 + turn_scale) + drift * way
    return np.stack(
        [steps[..., 0] * (1.0 + way_scale), steps[..., 1] * (1.0 + way_scale), turn], axis=-1
    )


def true_steps(steps: FloatArray, errors: FloatArray) -> FloatArray:
    """What was driven where such odometry counts ``steps`` (..., 3): the inverse of ``counted_steps``."""
    way_scale, turn_scale, drift = errors
    straight = steps[..., :2] / (1.0 + way_scale)
    way = np.hypot(straight[..., 0], straight[..., 1])
    turn = (steps[..., 2] - drift * way) / (1.0 + turn_scale)
    return np.concatenate([straight, turn[..., None]], axis=-1)


def poses_from_knots(knots: FloatArray, steps: FloatArray, errors: FloatArray) -> FloatArray:
    """Robot poses (n, 3) after odometry steps (n, 3) from knots (n, 3)."""
    return compose(knots, true_steps(steps, errors))


def choose_knots(odometry: FloatArray) -> IntArray:
    """(n,) the number of the knot that each of successive odometry poses (n, 3) belongs to."""
    knot, numbers, number = odometry[0], [], 0
    for pose in odometry:
        x, y, turn = between(knot, pose)
        if np.hypot(x, y) >= KNOT_WAY or abs(turn) >= KNOT_TURN:
            knot, number = pose, number + 1
        numbers.append(number)
    return np.array(numbers, dtype=np.int64)


def links_between(odometry: FloatArray, options: CalibrationOptions) -> Links:
    """Links between knots at odometry poses (m + 1, 3), with the options' noise."""
    steps = between(odometry[:-1], odometry[1:])
    way, turn = np.hypot(steps[:, 0], steps[:, 1]), np.abs(steps[:, 2])
    heading = options.drift_noise**2 * way + options.turn_noise**2 * turn
    covariance = np.zeros((len(steps), 3, 3))
    covariance[:, 0, 0] = options.way_noise**2 * way
    # heading errs all along the way, so that it also leads aside
    covariance[:, 1, 1] = options.aside_noise**2 * way + heading * way**2 / 3.0
    covariance[:, 1, 2] = covariance[:, 2, 1] = heading * way / 2.0
    covariance[:, 2, 2] = heading
    covariance += np.diag(STANDING**2)
    return Links(steps, np.linalg.inv(np.linalg.cholesky(covariance)))
