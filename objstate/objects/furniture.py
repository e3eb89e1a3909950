"""The paper's filter of furniture: samples of x, y, yaw that are weighted and resampled."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from objstate.building.model import MovableObject
from objstate.config import FurnitureSettings
from objstate.geometry import FloatArray, wrap
from objstate.lazy import altered
from objstate.objects.belief import ObjectBelief
from objstate.objects.evidence import ScanEvidence, Update
from objstate.particles import Weights, systematic

RESAMPLE_BELOW = 0.5  # share of samples; resample when the effective number falls below
LEAST_PRESENCE = 1e-6  # least probability of presence, and of absence


@dataclass(frozen=True)
class SampleFilter:
    """Furniture: sampling importance resampling (section 2.1 of Schulz and Burgard 2001).

    Of states that look alike, samples keep to the one nearest to the mean.
    """

    item: MovableObject
    settings: FurnitureSettings

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        count = self.settings.samples
        states, presence = self._of_prior(count, rng), self.settings.presence
        return ObjectBelief(
            self.item, states, Weights.uniform(count), cell=np.zeros(3), presence=presence
        )

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        """The prediction: drift, small moves, and moves to the prior."""
        s, count = self.settings, len(belief.states)
        moved = s.dynamics.moved(seconds)
        presence = belief.presence + moved * (s.presence - belief.presence)
        came = moved * s.presence / max(presence, LEAST_PRESENCE)  # of what is there then
        is_moved, is_nudged = rng.random(count) < came, rng.random(count) < 0.5
        drift = math.sqrt(seconds) * np.array(s.dynamics.drift)
        step = np.where((is_moved & is_nudged)[:, None], s.nudge, drift)
        states = belief.states + step * rng.standard_normal(belief.states.shape)
        states[:, 2] = wrap(states[:, 2])
        anew = is_moved & ~is_nudged
        states[anew] = self._of_prior(int(anew.sum()), rng)
        return altered(belief.with_samples(states, belief.weights), presence=presence)

    def carried(
        self,
        belief: ObjectBelief,
        seconds: float,
        moved: float,
        arrive: Callable[[int, np.random.Generator], FloatArray],
        presence: float,
        rng: np.random.Generator,
    ) -> ObjectBelief:
        """The belief after a time in which a sample was moved with a probability, to where samples arrive."""
        drift = math.sqrt(seconds) * np.array(self.settings.dynamics.drift)
        states = belief.states + drift * rng.standard_normal(belief.states.shape)
        states[:, 2] = wrap(states[:, 2])
        is_moved = rng.random(len(states)) < moved
        states[is_moved] = arrive(int(is_moved.sum()), rng)
        return altered(belief.with_samples(states, belief.weights), presence=presence)

    def update(
        self, belief: ObjectBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> Update | None:
        """Eqs. (8) and (9): each sample is weighted by its likelihood over all robot samples."""
        log, bears = evidence.cast(belief.states)
        if not bears.any():
            return None
        there, log_evidence = rows_given(belief.weights.values, log)
        robot = evidence.robot_weights.values
        weights = Weights.of(robot @ there)
        after = altered(
            belief.with_weights(weights),
            presence=self._presence(belief.presence, evidence, log_evidence),
            last_observed_ns=belief.stamp_ns,
            joint=None,
        )
        return Update(self._renewed(after, rng), log_evidence, bears)

    def _presence(self, before: float, evidence: ScanEvidence, log_evidence: FloatArray) -> float:
        """Probability of presence, by its log evidence (l,) relative to absence."""
        absent = evidence.tempering * evidence.log_absent
        robot, _ = evidence.robot_weights.reweight(absent)
        _, log_ratio = robot.reweight(log_evidence)
        log_odds = math.log(before) - math.log1p(-before) + log_ratio
        most = math.log1p(-LEAST_PRESENCE) - math.log(LEAST_PRESENCE)
        return 1.0 / (1.0 + math.exp(-min(max(log_odds, -most), most)))

    def _renewed(self, belief: ObjectBelief, rng: np.random.Generator) -> ObjectBelief:
        """Resampled where few samples are effective, with a kernel that keeps mean and covariance.

        The kernel is that of Liu and West (2001), its width Silverman's.
        """
        count = self.settings.samples
        if belief.weights.effective_size >= RESAMPLE_BELOW * count:
            return belief
        off, width = belief.deviations, kernel_width(count)
        covariance = (belief.weights.values[:, None] * off).T @ off
        root = np.linalg.cholesky(covariance + np.finfo(float).eps * np.eye(3))
        copied = off[systematic(belief.weights, count, rng)]
        spread = width * rng.standard_normal(copied.shape) @ root.T
        states = belief.mean + math.sqrt(1.0 - width**2) * copied + spread
        states[:, 2] = wrap(states[:, 2])
        return belief.with_samples(states, Weights.uniform(count))

    def _of_prior(self, count: int, rng: np.random.Generator) -> FloatArray:
        """(count, 3) samples of the prior around the modelled place."""
        is_gaussian = self.settings.prior == "gaussian"
        unit = rng.standard_normal((count, 3)) if is_gaussian else rng.uniform(-1, 1, (count, 3))
        states = self.item.home + np.array(self.settings.prior_std) * unit
        states[:, 2] = wrap(states[:, 2])
        return states


def kernel_width(count: int) -> float:
    """Width of a kernel relative to a Gaussian that ``count`` of them cover (Silverman 1986)."""
    return float((4.0 / (5.0 * count)) ** (1.0 / 7.0))


def rows_given(prior: FloatArray, log_likelihood: FloatArray) -> tuple[FloatArray, FloatArray]:
    """p(s | o, l) (l, n) for a prior (n,), and log p(o | l) (l,), from log p(o | s, l) (l, n)."""
    top = log_likelihood.max(axis=1, keepdims=True)
    rows = prior * np.exp(log_likelihood - top)
    total = rows.sum(axis=1, keepdims=True)
    return rows / total, (top + np.log(total))[:, 0]
