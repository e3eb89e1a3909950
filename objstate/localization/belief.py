"""The robot belief p(l): weighted samples of the robot's pose."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from objstate.geometry import FloatArray, compose, wrap
from objstate.lazy import lazy
from objstate.localization import samples
from objstate.particles import Weights, systematic

TINY = 1e-18  # added to variances, so that a covariance without any has a root


@dataclass(frozen=True, eq=False)
class PoseBelief:
    """Weighted samples of ``base_link`` in the building's frame."""

    samples: FloatArray | Callable[[], FloatArray]  # (n, 3) x m, y m, yaw rad, or what draws them
    weights: Weights  # (n,)

    @lazy
    def poses(self) -> FloatArray:
        """(n, 3) x m, y m, yaw rad of the samples."""
        return self.samples if isinstance(self.samples, np.ndarray) else self.samples()

    @staticmethod
    def whitened(mean: FloatArray, covariance: FloatArray, draws: FloatArray) -> PoseBelief:
        """A Gaussian, by samples that are computed on demand from ``draws`` (n, 3) of a normal one.

        These have exactly a mean of 0 and unit covariance.
        """
        out = PoseBelief(partial(_drawn, mean, covariance, draws), Weights.uniform(len(draws)))
        out.__dict__["_moments"] = mean, covariance
        return out

    @staticmethod
    def gaussian(
        mean: FloatArray, covariance: FloatArray, count: int, rng: np.random.Generator
    ) -> PoseBelief:
        """Equally weighted samples of a Gaussian with mean (3,) and covariance (3, 3)."""
        poses = rng.multivariate_normal(mean, covariance, size=count, method="eigh")
        return PoseBelief(poses, Weights.uniform(count))

    @property
    def mean(self) -> FloatArray:
        """(3,) the yaw is a circular mean."""
        return self._moments[0]

    @property
    def covariance(self) -> FloatArray:
        """(3, 3) of x, y, yaw about the mean; yaw differences wrapped."""
        return self._moments[1]

    @lazy
    def _moments(self) -> tuple[FloatArray, FloatArray]:
        mean, covariance = np.empty(3), np.empty((3, 3))
        samples.moments(self.poses, self.weights.values, mean, covariance)
        return mean, covariance

    @lazy
    def position_std(self) -> float:
        """Root of the larger eigenvalue of the position's covariance, m."""
        (xx, xy, _), (_, yy, _), _ = self.covariance.tolist()
        return math.sqrt((xx + yy) / 2 + math.hypot((xx - yy) / 2, xy))

    def moved(self, step: FloatArray) -> PoseBelief:
        """Every sample moved by the same step (3,) in its own frame."""
        return PoseBelief(compose(self.poses, step), self.weights)

    def thinned(self, count: int, rng: np.random.Generator) -> PoseBelief:
        """``count`` equally weighted samples of the belief, or itself if it has fewer."""
        if len(self.weights) <= count:
            return self
        chosen = systematic(self.weights, count, rng)
        return PoseBelief(self.poses[chosen], Weights.uniform(count))


def _drawn(mean: FloatArray, covariance: FloatArray, draws: FloatArray) -> FloatArray:
    """Samples (n, 3) of a Gaussian from ``draws`` (n, 3) of a normal one."""
    drawn = mean + draws @ np.linalg.cholesky(covariance + TINY * np.eye(3)).T
    drawn[:, 2] = wrap(drawn[:, 2])
    return np.asarray(drawn)
