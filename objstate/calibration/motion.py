"""How the robot moved by its odometry: steps from scan to scan, and its speed at each.

Odometry errs at random, and systematically: ways are counted too long by a share, and
the heading drifts with the way. A share of turns is left to the random errors: turns
on a straight way are noise, and noise on both sides would be fitted by a share of one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.calibration.options import CalibrationOptions
from objstate.geometry import FloatArray, IntArray, between, interpolate_pose, wrap
from objstate.records import NANOSECONDS

STANDING = np.array([0.0005, 0.0005, 0.0005])  # m, m, rad; deviations of a step of no length
# s before and after a moment over which its speed is taken: longer than a step of odometry,
# whose jitter would else pass for motion, and draw the clocks together
SPEED_OVER = 0.5


@dataclass(frozen=True, eq=False)
class OdometryTrack:
    """Odometry over time."""

    stamps_ns: IntArray  # (n,) ascending
    poses: FloatArray  # (n, 3)

    def at(self, stamps_ns: IntArray) -> FloatArray:
        """Poses (k, 3) interpolated at stamps (k,); held at both ends."""
        known = (self.stamps_ns - self.stamps_ns[0]).astype(float)
        asked = (stamps_ns - self.stamps_ns[0]).clip(0, known[-1]).astype(float)
        after = np.searchsorted(known, asked, side="right").clip(1, len(known) - 1)
        share = (asked - known[after - 1]) / (known[after] - known[after - 1])
        return interpolate_pose(self.poses[after - 1], self.poses[after], share)

    def speeds(self, stamps_ns: IntArray) -> FloatArray:
        """(k, 3) m/s, m/s, rad/s in the robot's frame about stamps (k,)."""
        half = round(SPEED_OVER * NANOSECONDS)
        here = self.at(stamps_ns)
        ahead = between(here, self.at(stamps_ns + half))
        back = between(here, self.at(stamps_ns - half))
        step = (ahead - back) / 2.0
        step[:, :2] /= np.sinc(step[:, 2:] / np.pi)  # of an arc, only its chord is seen
        return np.asarray(step / SPEED_OVER)


@dataclass(frozen=True, eq=False)
class Links:
    """Steps of the odometry from each scan to the next."""

    steps: FloatArray  # (m, 3) as the odometry counts them
    whitening: FloatArray  # (m, 3, 3) turns a step's error into unit deviations

    def residuals(self, begin: FloatArray, end: FloatArray, errors: FloatArray) -> FloatArray:
        """Whitened errors (m, 3) of the steps between robot poses (m, 3) under systematic errors (2,)."""
        off = self.steps - counted_steps(between(begin, end), errors)
        off[:, 2] = wrap(off[:, 2])
        return np.asarray(np.einsum("mij,mj->mi", self.whitening, off))


def counted_steps(steps: FloatArray, errors: FloatArray) -> FloatArray:
    """True steps (..., 3) as odometry counts them that errs by a share of ways, and by a drift in rad/m."""
    share, drift = errors
    way = np.hypot(steps[..., 0], steps[..., 1])
    turn = steps[..., 2] + drift * way
    return np.concatenate([steps[..., :2] * (1.0 + share), turn[..., None]], axis=-1)


def links_between(odometry: FloatArray, options: CalibrationOptions) -> Links:
    """Links between successive odometry poses (m + 1, 3), with the options' noise."""
    steps = between(odometry[:-1], odometry[1:])
    way, turn = np.hypot(steps[:, 0], steps[:, 1]), np.abs(steps[:, 2])
    heading = options.drift_noise**2 * way + options.turn_noise**2 * turn
    slip = options.slip_noise**2 * turn
    covariance = np.zeros((len(steps), 3, 3))
    covariance[:, 0, 0] = options.way_noise**2 * way + slip
    # errors of the heading along the way also displace it sideways
    covariance[:, 1, 1] = options.aside_noise**2 * way + slip + heading * way**2 / 3.0
    covariance[:, 1, 2] = covariance[:, 2, 1] = heading * way / 2.0
    covariance[:, 2, 2] = heading
    covariance += np.diag(STANDING**2)
    return Links(steps, np.linalg.inv(np.linalg.cholesky(covariance)))
