"""The filter of a piece of furniture.

Three degrees of freedom take free samples, which are resampled, and a scan that
tells much is taken in by steps.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from objstate.building.model import MovableObject
from objstate.config import FurnitureSettings
from objstate.geometry import BoolArray, FloatArray, IntArray, square_root, weighted_pose_mean, wrap
from objstate.objects.belief import ObjectBelief
from objstate.objects.conditional import ConditionalBelief, Update
from objstate.objects.evidence import ScanEvidence
from objstate.particles import Weights, largest_step, systematic

SECONDS_PER_HOUR = 3600.0
RESAMPLE_BELOW = 0.5  # of the samples; resample when the effective number falls below
MAJORITY = 0.5  # weight of scouts after a scan, above which the object counts as moved
CARRY_ON = 0.2  # of a nudge, by which scouts spread about the best of them
SHRINK = 0.95  # by which samples draw towards their mean before the kernel spreads them
LEAST_PRESENCE = 1e-6  # what is never ruled out: that it is there, or that it is gone
TINY = 1e-300


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
        return ObjectBelief(self.item, states, weights, cell=np.zeros(3), presence=s.presence)

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
        there = belief.presence + moved * (self.settings.presence - belief.presence)
        return replace(belief.with_samples(states, belief.weights), presence=float(there))

    def predict_each(
        self, believed: ConditionalBelief, seconds: float, rng: np.random.Generator
    ) -> ConditionalBelief:
        return replace(believed, belief=self.predict(believed.belief, seconds, rng))

    def update(
        self, believed: ConditionalBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> Update | None:
        """Take the evidence in by steps, each so large that enough samples survive.

        Between steps the samples are resampled and spread by a kernel that keeps
        their mean and covariance (Liu and West 2001).
        """
        robot = evidence.robot_weights.values
        log_evidence, remaining = np.zeros(len(robot)), 1.0
        while remaining > 0.0:
            cast, bears = evidence.cast(believed.belief.states, self._whole(believed.belief))
            if not bears.any():
                return None
            weights = believed.belief.weights
            after, _ = _conditioned(believed.given, cast)
            telling = np.log(robot @ after + TINY) - weights.log
            enough = RESAMPLE_BELOW * weights.effective_size
            step = largest_step(weights, telling, remaining, enough)
            after, evidence_of_step = _conditioned(believed.given, step * cast)
            log_evidence += evidence_of_step
            remaining -= step
            believed = self._renewed(believed.averaged(after, robot), remaining > 0.0, rng)
        there, log_evidence = _presence(believed.belief.presence, log_evidence, robot)
        return Update(
            replace(believed, belief=replace(believed.belief, presence=there)), log_evidence, bears
        )

    def widened(self, belief: ObjectBelief, factor: float, std_m: float) -> ObjectBelief:
        std = np.array([std_m, std_m, std_m * self._lean])
        factor = factor if belief.settled else 1.0
        wider = np.sqrt(factor + (std / np.maximum(belief.std, TINY)) ** 2)
        states = belief.mean + wider * belief.deviations
        states[:, 2] = wrap(states[:, 2])
        return belief.with_samples(states, belief.weights)

    @cached_property
    def _lean(self) -> float:
        """rad for each m by which what is seen of the object may be off."""
        plan = self.item.mesh.vertices[:, :2]
        return 1.0 / float(np.hypot(*(plan - plan.mean(axis=0)).T).max())

    def _renewed(
        self, believed: ConditionalBelief, resample: bool, rng: np.random.Generator
    ) -> ConditionalBelief:
        """The samples resampled where few carry the belief, and half of the scouts sent out anew."""
        belief = believed.belief
        s, values = self.settings, belief.weights.values
        count = len(values) - s.scouts
        elsewhere = np.where(self._is_elsewhere(belief), values[count:], 0.0)
        share = float(elsewhere.sum())
        ancestors = np.arange(count)
        if share > MAJORITY:  # it was moved: the scouts that found it are the belief
            states, weights, ancestors = self._resampled(belief.states, values, rng)
            share = 0.0
        else:
            states, weights = belief.states[:count], values[:count] / values[:count].sum()
            if resample or 1.0 / np.sum(weights**2) < RESAMPLE_BELOW * s.samples:
                states, weights, ancestors = self._resampled(states, weights, rng)
        scouts = self._scouts(states, weights, belief.states[count:], elsewhere, rng)
        carried = s.scouts // 2
        joined = Weights.of(
            np.concatenate(
                [
                    (1.0 - share) * weights,
                    np.full(carried, share / carried),
                    np.full(s.scouts - carried, s.scout_weight / (s.scouts - carried)),
                ]
            )
        )
        ratio = believed.given[:, ancestors] / np.maximum(values[ancestors], TINY)
        given = joined.values * np.concatenate([ratio, np.ones((len(ratio), s.scouts))], axis=1)
        return ConditionalBelief(
            belief.with_samples(np.concatenate([states, scouts]), joined),
            given / given.sum(axis=1, keepdims=True),
        )

    def _whole(self, belief: ObjectBelief) -> BoolArray:
        """Which samples (n,) differ for each robot sample: none while the object's place is open."""
        whole = np.full(len(belief.states), belief.settled)
        whole[-self.settings.scouts :] = False
        return whole

    def _is_elsewhere(self, belief: ObjectBelief) -> BoolArray:
        """Which scouts (k,) have left where the samples are; the others only know the same."""
        count = len(belief.states) - self.settings.scouts
        off = belief.states[count:] - weighted_pose_mean(
            belief.states[:count], belief.weights.values[:count]
        )
        off[:, 2] = wrap(off[:, 2])
        return np.asarray((np.abs(off) > self._nudge).any(axis=1))

    @cached_property
    def _nudge(self) -> FloatArray:
        s = self.settings
        return np.array([s.nudge_m, s.nudge_m, np.radians(s.nudge_deg)])

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
        carried, near = s.scouts // 2, s.scouts // 4
        best = scouts[systematic(Weights.of(scout_weights + TINY), carried, rng)]
        nearby = states[systematic(Weights.of(weights), near, rng)]
        on = best + CARRY_ON * self._nudge * rng.standard_normal(best.shape)
        before, after = (self._new_place_density(each, states[0]) for each in (best, on))
        kept = after >= rng.random(carried) * before  # Metropolis: evidence alone leads them on
        fresh = [
            np.where(kept[:, None], on, best),
            nearby + self._nudge * rng.standard_normal(nearby.shape),
            self._of_prior(s.scouts - carried - near, rng),
        ]
        out = np.concatenate(fresh)
        out[:, 2] = wrap(out[:, 2])
        return out

    def _new_place_density(self, states: FloatArray, place: FloatArray) -> FloatArray:
        """Density (n,), up to a factor, of states to which an object at a place (3,) is moved."""
        s = self.settings
        width = np.array([s.prior_std_m, s.prior_std_m, np.radians(s.prior_std_deg)])
        densities = []
        for middle, scale in ((self.item.home, width), (place, self._nudge)):
            off = states - middle
            off[:, 2] = wrap(off[:, 2])
            densities.append(np.exp(-0.5 * ((off / scale) ** 2).sum(axis=1)) / scale.prod())
        if s.prior == "uniform":
            off = np.abs(states - self.item.home)
            off[:, 2] = np.abs(wrap(off[:, 2]))
            densities[0] = (off <= width).all(axis=1) / (8.0 * width.prod())
        return np.asarray(densities[0] + densities[1])

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
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """States (samples, 3), spread by a kernel that keeps mean and covariance, equally weighted.

        Also the states that they come from.
        """
        count = self.settings.samples
        mean = weighted_pose_mean(states, weights)
        off = states - mean
        off[:, 2] = wrap(off[:, 2])
        noise = rng.standard_normal((count, 3)) @ square_root((weights[:, None] * off).T @ off).T
        ancestors = systematic(Weights.of(weights), count, rng)
        out = mean + SHRINK * off[ancestors] + np.sqrt(1.0 - SHRINK**2) * noise
        out[:, 2] = wrap(out[:, 2])
        return out, np.full(count, 1.0 / count), ancestors


def _joined(weights: FloatArray, scouts: int, share: float) -> Weights:
    """Weights of samples (n,), which sum to one, and of the scouts behind them, who have ``share``."""
    return Weights.of(np.append((1.0 - share) * weights, np.full(scouts, share / scouts)))


def _presence(
    presence: float, log_evidence: FloatArray, robot_weights: FloatArray
) -> tuple[float, FloatArray]:
    """Probability that an object is there after a scan, and the scan's log evidence (l,) then.

    ``log_evidence`` (l,) is that of its being there, against its absence.
    """
    there = np.log(presence) + log_evidence
    either = np.logaddexp(there, np.log1p(-presence))
    after = float(robot_weights @ np.exp(there - either))
    return float(np.clip(after, LEAST_PRESENCE, 1.0 - LEAST_PRESENCE)), either


def _conditioned(given: FloatArray, log_likelihood: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Bayes' rule in every row (l, n), and the log evidence (l,) of each."""
    top = log_likelihood.max(axis=1)
    after = given * np.exp(log_likelihood - top[:, None])
    total = after.sum(axis=1)
    return after / total[:, None], top + np.log(total)
