"""Objects at points with Gaussian beliefs, and the expected gain of a way past them.

A Kalman filter whose state is a position with a random drift, which is measured directly. The
coordinates are independent, so that a covariance is its diagonal (section 7, Elfring et al. 2014).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from objstate.gaze.entropy import diagonal_entropy
from objstate.gaze.sensors import Sensor
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.gaze import kernels
else:
    kernels = Later("objstate.gaze.kernels")

Counting = Literal["every update", "at the end"]
Counted = Literal["all objects", "own object"]


@dataclass(frozen=True, eq=False)
class PointBeliefs:
    """Gaussian beliefs of several objects' positions. A value: steps return new ones."""

    means: FloatArray  # (n, d) m; the first two are on the floor
    variances: FloatArray  # (n, d) m^2
    drift: FloatArray  # (n,) m^2, variance that a time step adds

    def predicted(self) -> PointBeliefs:
        """One time step later."""
        return replace(self, variances=self.variances + self.drift[:, None])

    def updated(self, measured: BoolArray, positions: FloatArray, noise: float) -> PointBeliefs:
        """After measuring some objects (n,) at ``positions`` (n, d), each with variance ``noise``."""
        share = np.where(measured[:, None], self.variances / (self.variances + noise), 0.0)
        means = self.means + share * (positions - self.means)
        return replace(self, means=means, variances=(1.0 - share) * self.variances)

    @property
    def entropies(self) -> FloatArray:
        """(n,) nats, eq. (3)."""
        return diagonal_entropy(self.variances)


def gains_along(
    beliefs: PointBeliefs,
    ways: FloatArray,
    lengths: IntArray,
    sensor: Sensor,
    counting: Counting = "every update",
    counted: Counted = "all objects",
) -> FloatArray:
    """Expected information gain (a,) in nats of each of some ways (section 5.2).

    ``ways`` (a, k, 3) are poses, one for each time step, of which the first ``lengths`` (a,) count.
    At each one the beliefs are predicted, and what is in view is updated by a simulated measurement
    at its mean with the sensor's variance. A way's gain is the sum of the gains, eq. (6), of
    ``every update``, or the entropy removed ``at the end``: of ``all objects``, or of its ``own
    object`` alone, which is the a-th for the a-th way.
    """
    out = np.empty(len(ways))
    shape = (len(ways), len(beliefs.means))
    counts = np.ones(shape, dtype=bool) if counted == "all objects" else np.eye(*shape, dtype=bool)
    kernels.gains_along(
        beliefs.means,
        beliefs.variances,
        beliefs.drift,
        np.ascontiguousarray(ways),
        lengths,
        sensor.range_min,
        sensor.range_max,
        sensor.field_of_view,
        sensor.sigma**2,
        counting == "at the end",
        counts,
        out,
    )
    return out


def straight_ways(
    start: FloatArray, goals: FloatArray, stride: float
) -> tuple[FloatArray, IntArray]:
    """Poses (a, k, 3), one a time step, straight from ``start`` (2,) to goals (a, 2); how many (a,).

    ``stride`` m is driven in a time step; a way ends in the goal and has at least one pose.
    """
    off = goals - start
    distance = np.hypot(off[:, 0], off[:, 1])
    lengths = np.maximum(np.ceil(distance / stride - 1e-9), 1).astype(np.int64)
    driven = np.minimum(stride * np.arange(1, lengths.max() + 1), distance[:, None])  # (a, k)
    shares = driven / np.where(distance > 0.0, distance, 1.0)[:, None]
    yaw = np.broadcast_to(np.arctan2(off[:, 1], off[:, 0])[:, None], driven.shape)
    places = start + shares[..., None] * off[:, None]
    return np.concatenate([places, yaw[..., None]], axis=2), lengths
