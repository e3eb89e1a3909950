"""Objects that stand, or move at a constant velocity: an interacting multiple model filter.

Blom and Bar-Shalom, "The interacting multiple model algorithm for systems with Markovian switching
coefficients", IEEE Trans. Automatic Control 33 (1988) 780-783. Both modes share the state x, y,
vx, vy. All arrays may have leading batch axes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import exp
from typing import Any

import numpy as np

from objstate.geometry import FloatArray

TINY = 1e-300
COORDINATES = 2  # x and y
STATE = 2 * COORDINATES


@dataclass(frozen=True)
class Motion:
    """How objects of a class move.

    With ``starts`` 0 they only stand (constant position), with ``stops`` 0 they only move (constant
    velocity).
    """

    walk: float = 2.2e-4  # m^2/s, by which the variance of a standing object's position grows
    starts: float = 0.0  # 1/s, of standing objects
    stops: float = 1.0  # 1/s, of moving ones
    speed: float = 0.4  # m/s, sigma of each coordinate's velocity as an object starts
    acceleration: float = 1.0  # m^2/s^3, power spectral density of the velocity's noise

    @property
    def modes(self) -> int:
        return 2 if self.starts > 0.0 else 1

    def switches(self, step: float) -> FloatArray:
        """(m, m) probabilities from one mode to another within a step."""
        if self.modes == 1:
            return np.ones((1, 1))
        rate = self.starts + self.stops
        changed = 1.0 - exp(-rate * step)
        start, stop = self.starts / rate * changed, self.stops / rate * changed
        return np.array([[1.0 - start, start], [stop, 1.0 - stop]])

    def dynamics(self, step: float) -> tuple[FloatArray, FloatArray]:
        """Transitions (m, 4, 4) and process noise (m, 4, 4) of a step, of each mode."""
        eye, none = np.eye(COORDINATES), np.zeros((COORDINATES, COORDINATES))
        # the velocity of what stands is the one with which it would start
        stands = np.block([[eye, none], [none, none]])
        still = np.diag([self.walk * step] * COORDINATES + [self.speed**2] * COORDINATES)
        moves = np.block([[eye, step * eye], [none, eye]])
        noise = np.array([[step**3 / 3.0, step**2 / 2.0], [step**2 / 2.0, step]])
        driven = self.acceleration * np.kron(noise, eye)
        transitions, noises = np.stack([stands, moves]), np.stack([still, driven])
        return transitions[: self.modes], noises[: self.modes]


@dataclass(frozen=True, eq=False)
class Tracks:
    """What is known of where objects are and how they move: a mixture of Gaussians, one of each mode."""

    motion: Motion
    chances: FloatArray = field(repr=False)  # (..., m), which sum to one
    means: FloatArray = field(repr=False)  # (..., m, 4) x, y m; vx, vy m/s
    covariances: FloatArray = field(repr=False)  # (..., m, 4, 4)

    @staticmethod
    def at(positions: FloatArray, std: float, motion: Motion) -> Tracks:
        """Objects at positions (..., 2), known to ``std`` m."""
        batch, modes = positions.shape[:-1], motion.modes
        means = np.zeros((*batch, modes, STATE))
        means[..., :COORDINATES] = positions[..., None, :]
        spread = np.diag([std**2] * COORDINATES + [motion.speed**2] * COORDINATES)
        chances = np.zeros((*batch, modes))
        chances[..., 0 if motion.modes == 1 or motion.stops > 0.0 else 1] = 1.0
        covariances = np.broadcast_to(spread, (*batch, modes, STATE, STATE))
        return Tracks(motion, chances, means, covariances)

    @property
    def mean(self) -> FloatArray:
        """(..., 4)."""
        return np.asarray((self.chances[..., None] * self.means).sum(axis=-2))

    @property
    def covariance(self) -> FloatArray:
        """(..., 4, 4)."""
        return _moments(self.chances, self.means, self.covariances)[1]

    @property
    def positions(self) -> FloatArray:
        """(..., 2) m."""
        return self.mean[..., :COORDINATES]

    @property
    def position_covariance(self) -> FloatArray:
        """(..., 2, 2) m^2."""
        return self.covariance[..., :COORDINATES, :COORDINATES]

    def __getitem__(self, index: Any) -> Tracks:
        """Those of some batch entries."""
        return Tracks(
            self.motion,
            self.chances[index],
            self.means[index],
            self.covariances[index],
        )

    def predicted(self, step: float) -> Tracks:
        """A step of ``step`` seconds later."""
        motion = self.motion
        chances, means, covariances = self._mixed(motion.switches(step))
        transitions, noises = motion.dynamics(step)
        return Tracks(
            motion,
            chances,
            (transitions @ means[..., None])[..., 0],
            transitions @ covariances @ np.swapaxes(transitions, -1, -2) + noises,
        )

    def _mixed(self, switches: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Chances, means and covariances with which each mode is predicted: of what was in any before."""
        if self.motion.modes == 1:
            return self.chances, self.means, self.covariances
        joint = self.chances[..., :, None] * switches  # from, to
        chances = joint.sum(axis=-2)
        shares = np.swapaxes(joint / np.maximum(chances, TINY)[..., None, :], -1, -2)  # to, from
        means, covariances = _moments(
            shares, self.means[..., None, :, :], self.covariances[..., None, :, :, :]
        )
        return chances, means, covariances

    def corners(self) -> FloatArray:
        """(..., m, 5, 2) positions that stand for each mode's: its mean, and what lies about it evenly."""
        root = np.linalg.cholesky(self.covariances[..., :COORDINATES, :COORDINATES])
        steps = np.sqrt(COORDINATES + 0.5) * np.concatenate([root, -root], axis=-1)
        middle = self.means[..., None, :COORDINATES]
        return np.concatenate([middle, middle + np.swapaxes(steps, -1, -2)], axis=-2)

    def unseen(self, seen: FloatArray) -> tuple[Tracks, FloatArray]:
        """After nothing was read of what each mode expects to be seen with probability (..., m)."""
        joint = self.chances * (1.0 - seen)
        total = joint.sum(axis=-1, keepdims=True)
        after = Tracks(self.motion, joint / total, self.means, self.covariances)
        return after, np.log(total[..., 0])

    def updated(
        self, position: FloatArray, noise: FloatArray, seen: FloatArray | float = 1.0
    ) -> tuple[Tracks, FloatArray]:
        """After positions (..., 2) were read with covariances (..., 2, 2), and their log-likelihoods (...).

        ``seen`` (..., m) is the probability with which each mode expects a reading at all.
        """
        along = self.covariances[..., :COORDINATES]  # (..., m, 4, 2)
        spread = along[..., :COORDINATES, :] + noise[..., None, :, :]
        off = position[..., None, :] - self.means[..., :COORDINATES]
        inverse = np.linalg.inv(spread)
        gains = along @ inverse
        squared = (off * (inverse @ off[..., None])[..., 0]).sum(axis=-1)
        log = -0.5 * (squared + np.log(np.linalg.det(2.0 * np.pi * spread)))
        best = log.max(axis=-1, keepdims=True)
        joint = self.chances * seen * np.exp(log - best)
        total = joint.sum(axis=-1, keepdims=True)
        left = self.covariances - gains @ np.swapaxes(along, -1, -2)
        after = Tracks(
            self.motion,
            joint / np.maximum(total, TINY),
            self.means + (gains @ off[..., None])[..., 0],
            (left + np.swapaxes(left, -1, -2)) / 2.0,  # or rounding grows from step to step
        )
        return after, np.asarray((best + np.log(np.maximum(total, TINY)))[..., 0])


def _moments(
    shares: FloatArray, means: FloatArray, covariances: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Means (..., 4) and covariances (..., 4, 4) of mixtures of shares (..., m)."""
    mean = (shares[..., None] * means).sum(axis=-2)
    off = means - mean[..., None, :]
    spread = covariances + off[..., :, None] * off[..., None, :]
    return mean, np.asarray((shares[..., None, None] * spread).sum(axis=-3))
