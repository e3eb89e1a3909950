"""The filters behind the objects' beliefs: a prior, a prediction and an update each.

One degree of freedom is covered by samples at regular places, whose weights
alone change: nothing is ever lost between them. Three degrees of freedom take
free samples, which are resampled, and a scan that tells much is taken in by
steps.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import DoorSettings, FurnitureSettings, ObjectSettings, Settings
from objstate.geometry import FloatArray, IntArray, square_root, weighted_pose_mean, wrap
from objstate.objects.belief import ObjectBelief
from objstate.objects.evidence import ScanEvidence
from objstate.particles import Weights, largest_step, systematic

SECONDS_PER_HOUR = 3600.0
RESAMPLE_BELOW = 0.5  # of the samples; resample when the effective number falls below
MAJORITY = 0.5  # weight of scouts after a scan, above which the object counts as moved
CARRY_ON = 0.2  # of a nudge, by which scouts spread about the best of them
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
    """Furniture: free samples of x, y, yaw; the last of them are scouts that look for it elsewhere.

    Scouts have little weight, and keep it: what speaks for another place can add up
    over many scans before it wins.
    """

    item: MovableObject
    settings: FurnitureSettings

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        s = self.settings
        states = self._of_prior(s.first_samples + s.scouts, rng)
        equal = np.full(s.first_samples, 1.0 / s.first_samples)
        weights = _joined(equal, s.scouts, s.scout_weight)
        return ObjectBelief(self.item, states, weights, cell=np.zeros(3))

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        """Every sample creeps, and is now and then moved to where the prior says."""
        dynamics = self.settings.dynamics
        drift = np.array([dynamics.drift_m, dynamics.drift_m, np.radians(dynamics.drift_deg)])
        states = belief.states + drift * np.sqrt(seconds) * rng.standard_normal(belief.states.shape)
        states[:, 2] = wrap(states[:, 2])
        moved = -np.expm1(-dynamics.moves_per_hour * seconds / SECONDS_PER_HOUR)
        redrawn = rng.random(len(states)) < moved
        states[redrawn] = self._of_prior(int(redrawn.sum()), rng)
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
            belief = belief.with_weights(belief.weights.reweight(step * log_likelihood)[0])
            remaining -= step
            belief = self._renewed(belief, remaining > 0.0, rng)
        return belief

    def _renewed(
        self, belief: ObjectBelief, resample: bool, rng: np.random.Generator
    ) -> ObjectBelief:
        """The samples resampled where few carry the belief, and half of the scouts sent out anew."""
        s, values = self.settings, belief.weights.values
        count = len(values) - s.scouts
        share = float(values[count:].sum())
        if share > MAJORITY:  # it was moved: the scouts that found it are the belief
            states, weights = self._resampled(belief.states, values, rng)
            share = s.scout_weight
        else:
            states, weights = belief.states[:count], values[:count] / values[:count].sum()
            if resample or 1.0 / np.sum(weights**2) < RESAMPLE_BELOW * s.samples:
                states, weights = self._resampled(states, weights, rng)
        scouts = self._scouts(states, weights, belief.states[count:], values[count:], rng)
        share = max(share, s.scout_weight)
        return belief.with_samples(
            np.concatenate([states, scouts]), _joined(weights, s.scouts, share)
        )

    def _scouts(
        self,
        states: FloatArray,
        weights: FloatArray,
        scouts: FloatArray,
        scout_weights: FloatArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Half of the scouts carry on about the best of them; the others start afresh.

        Of those, half look near where the object stands, half where the prior says.
        """
        s = self.settings
        nudge = np.array([s.nudge_m, s.nudge_m, np.radians(s.nudge_deg)])
        carried, near = s.scouts // 2, s.scouts // 4
        best = scouts[systematic(Weights.of(scout_weights), carried, rng)]
        nearby = states[systematic(Weights.of(weights), near, rng)]
        fresh = [
            best + CARRY_ON * nudge * rng.standard_normal(best.shape),
            nearby + nudge * rng.standard_normal(nearby.shape),
            self._of_prior(s.scouts - carried - near, rng),
        ]
        out = np.concatenate(fresh)
        out[:, 2] = wrap(out[:, 2])
        return out

    def _of_prior(self, count: int, rng: np.random.Generator) -> FloatArray:
        """(count, 3) samples of the prior around the place where the object should stand."""
        s = self.settings
        width = np.array([s.prior_std_m, s.prior_std_m, np.radians(s.prior_std_deg)])
        unit = (
            rng.standard_normal((count, 3))
            if s.prior == "gaussian"
            else rng.uniform(-1.0, 1.0, (count, 3))
        )
        states = self.item.home + width * unit
        states[:, 2] = wrap(states[:, 2])
        return states

    def _resampled(
        self, states: FloatArray, weights: FloatArray, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray]:
        """States (samples, 3), spread by a kernel that keeps mean and covariance, equally weighted."""
        count = self.settings.samples
        mean = weighted_pose_mean(states, weights)
        off = states - mean
        off[:, 2] = wrap(off[:, 2])
        noise = rng.standard_normal((count, 3)) @ square_root((weights[:, None] * off).T @ off).T
        chosen = off[systematic(Weights.of(weights), count, rng)]
        out = mean + SHRINK * chosen + np.sqrt(1.0 - SHRINK**2) * noise
        out[:, 2] = wrap(out[:, 2])
        return out, np.full(count, 1.0 / count)


def _joined(weights: FloatArray, scouts: int, share: float) -> Weights:
    """Weights of samples (n,), which sum to one, and of the scouts behind them, who have ``share``."""
    return Weights.of(np.append((1.0 - share) * weights, np.full(scouts, share / scouts)))


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
