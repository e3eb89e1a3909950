"""The filters behind the objects' beliefs: a prior, a prediction and an update each.

One degree of freedom is covered by samples at regular places, whose weights
alone change: nothing is ever lost between them. Three degrees of freedom take
free samples, which are resampled, and a scan that tells much is taken in by
steps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import DoorSettings, FurnitureSettings, ObjectSettings, Settings
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.objects.belief import ObjectBelief
from objstate.objects.evidence import ScanEvidence
from objstate.particles import Weights, largest_step, systematic

SECONDS_PER_HOUR = 3600.0
RESAMPLE_BELOW = 0.5  # of the samples; resample when the effective number falls below
SHRINK = 0.95  # by which samples draw towards their mean before the kernel spreads them
NEGLIGIBLE = 1e-4  # weight, relative to the largest, below which a state is cast only coarsely
COARSE = 8  # every so many states are cast whatever their weight


class ObjectFilter(Protocol):
    """The estimation of one object's state, as functions of a belief."""

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        """p(s) before any reading."""

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        """Eq. (5): the belief ``seconds`` later, by the dynamics p(s | t, s')."""

    def update(
        self, belief: ObjectBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> ObjectBelief:
        """The belief after a scan; itself where no beam bears on the object."""


def filter_for(item: MovableObject, settings: Settings) -> ObjectFilter:
    """The filter of an object, with the settings whose rules match its name."""
    is_door = item.kind is not Kind.PLANAR
    chosen: ObjectSettings = settings.for_object(item.name, "door" if is_door else "furniture")
    if isinstance(chosen, DoorSettings):
        return LatticeFilter(item, chosen)
    return SampleFilter(item, chosen)


@dataclass(frozen=True)
class LatticeFilter:
    """A hinged or sliding door: samples at regular angles or offsets between the limits."""

    item: MovableObject
    settings: DoorSettings

    @cached_property
    def _states(self) -> FloatArray:
        """(n,) from limit to limit, so that a door at its stop lies on a sample."""
        s, hinged = self.settings, self.item.kind is Kind.HINGED
        resolution = np.radians(s.resolution_deg) if hinged else s.resolution_m
        span = self.item.upper - self.item.lower
        cells = max(int(np.ceil(span / resolution)), 1)
        return np.linspace(
            self.item.lower, self.item.upper, cells + 1, endpoint=not self.item.wraps
        )

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        states = self._states
        return ObjectBelief(
            item=self.item,
            states=states[:, None],
            weights=Weights.of(self._prior_weights),
            cell=np.array([states[1] - states[0]]),
        )

    @cached_property
    def _prior_weights(self) -> FloatArray:
        states, s = self._states, self.settings
        if s.prior == "uniform":
            return np.full(len(states), 1.0 / len(states))
        mean, std = s.prior_mean_m, s.prior_std_m
        if self.item.kind is Kind.HINGED:
            mean = None if s.prior_mean_deg is None else np.radians(s.prior_mean_deg)
            std = np.radians(s.prior_std_deg)
        off = states - (self.item.home[0] if mean is None else mean)
        off = wrap(off) if self.item.wraps else off
        weights = np.exp(-0.5 * (off / std) ** 2) + np.finfo(float).tiny
        return np.asarray(weights / weights.sum())

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        dynamics, hinged = self.settings.dynamics, self.item.kind is Kind.HINGED
        drift = np.radians(dynamics.drift_deg) if hinged else dynamics.drift_m
        stayed = np.exp(-dynamics.moves_per_hour * seconds / SECONDS_PER_HOUR)
        drifted = self._drifted(belief.weights.values, drift * np.sqrt(seconds))
        mixed = stayed * drifted + (1.0 - stayed) * self._prior_weights
        return belief.with_weights(Weights.of(mixed))

    def _drifted(self, weights: FloatArray, std: float) -> FloatArray:
        """Weights after a random walk on the lattice of standard deviation ``std``.

        A walk reflects at the limits. Its variance is met exactly, by steps to the
        neighbours where it is below the spacing and by a Gaussian kernel where not.
        """
        variance = float((std / (self._states[1] - self._states[0])) ** 2)
        if variance < 1.0:
            ends = (weights[-1:], weights[:1]) if self.item.wraps else (weights[:1], weights[-1:])
            padded = np.concatenate([ends[0], weights, ends[1]])
            return np.asarray(
                (1.0 - variance) * weights + variance / 2.0 * (padded[:-2] + padded[2:])
            )
        from scipy.ndimage import convolve1d

        reach = min(int(np.ceil(4.0 * np.sqrt(variance))), len(weights))
        kernel = np.exp(-0.5 * np.arange(-reach, reach + 1) ** 2 / variance)
        mode = "wrap" if self.item.wraps else "reflect"
        return np.asarray(convolve1d(weights, kernel / kernel.sum(), mode=mode))

    def update(
        self, belief: ObjectBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> ObjectBelief:
        """Bayes' rule on the lattice, which is cast finely only where the belief has weight.

        Between the states that are cast, the log-likelihood is linear.
        """
        chosen = _worth_casting(belief.weights)
        cast, bears = evidence.cast(belief.states[chosen])
        if not bears.any():
            return belief
        log_likelihood = evidence.integrated(
            _interpolated(cast, chosen, len(belief.states)), belief.weights
        )
        return belief.with_weights(belief.weights.reweight(log_likelihood)[0])


@dataclass(frozen=True)
class SampleFilter:
    """Furniture: free samples of x, y, yaw."""

    item: MovableObject
    settings: FurnitureSettings

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        count = self.settings.samples
        states = self._drawn(count, rng)
        return ObjectBelief(self.item, states, Weights.uniform(count), cell=np.zeros(3))

    def _drawn(self, count: int, rng: np.random.Generator) -> FloatArray:
        """(count, 3) samples of the prior around the place where the object should stand."""
        s = self.settings
        width = np.array([s.prior_std_m, s.prior_std_m, np.radians(s.prior_std_deg)])
        draw = rng.standard_normal if s.prior == "gaussian" else _unit_uniform(rng)
        states = self.item.home + width * draw((count, 3))
        states[:, 2] = wrap(states[:, 2])
        return states

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        dynamics = self.settings.dynamics
        moved_share = 1.0 - np.exp(-dynamics.moves_per_hour * seconds / SECONDS_PER_HOUR)
        drift = np.array([dynamics.drift_m, dynamics.drift_m, np.radians(dynamics.drift_deg)])
        states = belief.states + drift * np.sqrt(seconds) * rng.standard_normal(belief.states.shape)
        states[:, 2] = wrap(states[:, 2])
        moved = rng.random(len(states)) < moved_share
        states[moved] = self._drawn(int(moved.sum()), rng)
        return belief.with_samples(states, belief.weights)

    def update(
        self, belief: ObjectBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> ObjectBelief:
        """Take the evidence in by steps, each so large that enough samples survive.

        Between steps the samples are resampled and spread by a kernel that keeps
        their mean and covariance (Liu and West 2001).
        """
        remaining = 1.0
        while remaining > 0.0:
            cast, bears = evidence.cast(belief.states)
            if not bears.any():
                return belief
            log_likelihood = evidence.integrated(cast, belief.weights)
            enough = RESAMPLE_BELOW * belief.weights.effective_size
            step = largest_step(belief.weights, log_likelihood, remaining, enough)
            weights, _ = belief.weights.reweight(step * log_likelihood)
            belief = belief.with_weights(weights)
            remaining -= step
            if weights.effective_size <= RESAMPLE_BELOW * len(weights):
                belief = self._resampled(belief, rng)
        return belief

    def _resampled(self, belief: ObjectBelief, rng: np.random.Generator) -> ObjectBelief:
        count = len(belief.weights)
        chosen = belief.deviations[systematic(belief.weights, count, rng)]
        covariance = (belief.weights.values[:, None] * belief.deviations).T @ belief.deviations
        values, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(values.clip(min=0.0))
        noise = rng.standard_normal(chosen.shape) @ root.T
        states = belief.mean + SHRINK * chosen + np.sqrt(1.0 - SHRINK**2) * noise
        states[:, 2] = wrap(states[:, 2])
        return belief.with_samples(states, Weights.uniform(count))


def _worth_casting(weights: Weights) -> IntArray:
    """Indices of the states with weight, and of a coarse comb over all the others."""
    heavy = weights.log > weights.log.max() + np.log(NEGLIGIBLE)
    heavy[::COARSE] = True
    heavy[-1] = True
    return np.flatnonzero(heavy)


def _interpolated(values: FloatArray, known: IntArray, count: int) -> FloatArray:
    """Values (l, k) at ascending indices ``known`` (k,), linearly filled in to (l, count)."""
    if len(known) == count:
        return values
    place = np.interp(np.arange(count), known, np.arange(len(known)))
    left = np.minimum(place.astype(np.int64), len(known) - 2)
    share = place - left
    return np.asarray(values[:, left] * (1.0 - share) + values[:, left + 1] * share)


def _unit_uniform(rng: np.random.Generator) -> Callable[[tuple[int, int]], FloatArray]:
    return lambda shape: rng.uniform(-1.0, 1.0, shape)
