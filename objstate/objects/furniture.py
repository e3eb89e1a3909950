"""The filter of a piece of furniture.

Three degrees of freedom take free samples, which are resampled, and a scan that
tells much is taken in by steps.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import MovableObject
from objstate.building.outline import outline
from objstate.config import FurnitureSettings
from objstate.geometry import BoolArray, FloatArray, IntArray, wrap
from objstate.lazy import Later, altered, lazy
from objstate.objects.belief import ObjectBelief
from objstate.objects.conditional import SAME, ConditionalBelief, Descent, Update
from objstate.objects.evidence import ScanEvidence
from objstate.objects.places import copies, occupied
from objstate.objects.proposals import TracedOutline
from objstate.particles import Weights, kld_sample_size, largest_step, systematic

if TYPE_CHECKING:
    from objstate.objects import sampling
    from objstate.objects.sampling import Moves
else:
    sampling = Later("objstate.objects.sampling")

SECONDS_PER_HOUR = 3600.0
FEWEST = 20.0  # effective samples by which robot samples may tell apart where they see an object
RESAMPLE_BELOW = 0.5  # of the samples; resample when the effective number falls below
AHEAD = 0.35  # of the samples, that a look ahead leaves effective
FOLLOWED = 0.1  # weight of scouts after a scan, above which they are samples like others
NEAR_SIGMAS = 3.0  # from the mean, within which a scout is at the same place
SPREAD = 0.2  # of a nudge, by which copies of a sample are spread at most
KLD_ERROR, KLD_QUANTILE = 0.05, 2.33  # as pf_err and pf_z of localization
TRIED = 400  # states through readings, of which scouts are chosen
ON_OBJECT = 0.1  # m from where an object is known to stand, within which it stopped the beam
FEWEST = 3  # ends of beams that may show an object
UNLIKELY = 1e-3  # density of a place, relative to home, below which readings don't lead there
HEIGHT_STEP = 0.01  # m; outlines at heights no further apart are one
LEAST_PRESENCE = 1e-6  # what is never ruled out: that it is there, or that it is gone
LEVER = (
    3.0  # m between walls: what they are off by turns the robot, and what it sees, by so much less
)
LEAST_SHARE = 1e-12  # weight of scouts that speak for nothing
TINY = 1e-300
LEAST_STD = 1e-9  # m and rad; what deviates by less deviates by rounding alone
ROOT_TAU = np.sqrt(2.0 * np.pi)


@dataclass(frozen=True)
class SampleFilter:
    """Furniture: free samples of x, y, yaw; the last of them are scouts that look for it elsewhere.

    Scouts have little weight, and keep it: what speaks for another place can add up
    over many scans before it wins. Of states that look alike, samples keep to the one
    nearest to the mean.
    """

    item: MovableObject
    settings: FurnitureSettings
    _outlines: dict[int, TracedOutline | None] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        s = self.settings
        states = self._of_prior(s.first_samples + s.scouts, rng)
        weights = Weights.of(
            np.append(
                np.full(s.first_samples, (1.0 - s.scout_weight) / s.first_samples),
                np.full(s.scouts, s.scout_weight / s.scouts),
            )
        )
        return ObjectBelief(
            self.item, states, weights, cell=np.zeros(3), scouts=s.scouts, presence=s.presence
        )

    def predict(
        self,
        belief: ObjectBelief,
        seconds: float,
        rng: np.random.Generator,
        drift: float = 1.0,
    ) -> ObjectBelief:
        """Every sample creeps, and is now and then moved to where the prior says."""
        step = np.sqrt(drift * self.drift_variance(seconds))
        states = belief.states + step * rng.standard_normal(belief.states.shape)
        states[:, 2] = wrap(states[:, 2])
        redrawn = rng.random(len(states)) < self._moved(seconds)
        states[redrawn] = self._of_prior(int(redrawn.sum()), rng)
        there = belief.presence + self._moved(seconds) * (self.settings.presence - belief.presence)
        return altered(belief.with_samples(states, belief.weights), presence=there)

    def drift_variance(self, seconds: float) -> FloatArray:
        dynamics = self.settings.dynamics
        drift = np.array([dynamics.drift_m, dynamics.drift_m, np.radians(dynamics.drift_deg)])
        return np.asarray(seconds * drift**2)

    def predict_each(
        self,
        believed: ConditionalBelief,
        seconds: float,
        rng: np.random.Generator,
        descent: Descent = SAME,
        drift: float = 1.0,
    ) -> ConditionalBelief:
        believed = believed.handed_on(descent)
        towards = self.settings.presence - believed.presence
        return altered(
            believed,
            belief=self.predict(believed.belief, seconds, rng, drift),
            presence=believed.presence + self._moved(seconds) * towards,
        )

    def _moved(self, seconds: float) -> float:
        """Probability that somebody has moved it meanwhile."""
        rate = self.settings.dynamics.moves_per_hour / SECONDS_PER_HOUR
        return float(-np.expm1(-rate * seconds))

    def update(
        self, believed: ConditionalBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> Update | None:
        """Take the evidence in by steps, each so large that enough samples survive.

        Between steps the samples are resampled and spread by a kernel. Of a belief that a scan may narrow
        much, a look ahead from a few robot samples decides which samples to copy first; what
        these weigh, all robot samples say (auxiliary particle filter, Pitt and Shephard 1999). So they do
        of a place that was open, as soon as it isn't.
        """
        robot = evidence.robot_weights.values
        log_evidence, remaining = np.zeros(len(robot)), 1.0
        from_few = 0.0  # exponent of what was cast from a few robot samples for all of them
        believed, ahead = self._looked_ahead(self._shown(believed, evidence, rng), evidence, rng)
        while remaining > 0.0:
            cast, bears = evidence.cast(believed.belief.states, self._whole(believed.belief))
            if not bears.any():
                return None
            exponent, after, told = self._taken_in(believed, cast, evidence, ahead, remaining)
            log_evidence += told
            remaining, ahead = remaining - exponent, 0.0
            from_few += 0.0 if believed.belief.settled else exponent
            believed = self._renewed(believed.averaged(after, robot), remaining > 0.0, rng)
        if from_few > 0.0 and believed.belief.settled:
            believed, told = self._told_apart(believed, evidence, from_few)
            log_evidence += told
        there, log_evidence = _presence(believed.presence, log_evidence)
        seen = evidence.robot_weights_after(log_evidence).values
        belief = altered(
            believed.belief,
            presence=float(seen @ there),
            last_observed_ns=believed.belief.stamp_ns,
        )
        return Update(altered(believed, belief=belief, presence=there), log_evidence, bears)

    def _told_apart(
        self, believed: ConditionalBelief, evidence: ScanEvidence, exponent: float
    ) -> tuple[ConditionalBelief, FloatArray]:
        """What each robot sample believes, where some of the likelihood was that from a few for all of them.

        ``exponent`` is how much of it. Also what that changes in the log evidence (l,). Where samples of the
        object are too few for that, nothing changes.
        """
        states, nowhere = believed.belief.states, np.zeros(len(believed.belief.states), dtype=bool)
        by_each, _ = evidence.cast(states, self._whole(believed.belief))
        by_few, _ = evidence.cast(states, nowhere)
        change = exponent * (by_each - by_few)
        top = change.max(axis=1, keepdims=True)
        rows = believed.given * np.exp(change - top)
        told = rows.sum(axis=1, keepdims=True)
        apart = believed.averaged(rows / told, evidence.robot_weights.values)
        if apart.belief.weights.effective_size < FEWEST:
            return believed, np.zeros(len(told))
        return apart, (top + np.log(told))[:, 0]

    def _looked_ahead(
        self, believed: ConditionalBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> tuple[ConditionalBelief, float]:
        """The samples that a first step from a few robot samples leads to, and its exponent.

        It is none where all of the likelihood can be taken in at once, or is
        known from a few robot samples anyway. The samples weigh what they did before.
        """
        belief = believed.belief
        if not belief.settled or (belief.std <= self._blur).all():
            return believed, 0.0
        told = evidence.cast(belief.states, np.zeros(len(belief.states), dtype=bool))[0][0]
        step = largest_step(belief.weights, told, 1.0, AHEAD * belief.weights.effective_size)
        if step == 1.0:
            return believed, 0.0
        chosen = belief.with_weights(belief.weights.reweight(step * told)[0])
        return self._renewed(altered(believed, belief=chosen), True, rng), step

    def _taken_in(
        self,
        believed: ConditionalBelief,
        log_likelihood: FloatArray,
        evidence: ScanEvidence,
        ahead: float,
        most: float,
    ) -> tuple[float, FloatArray, FloatArray]:
        """The largest exponent up to ``most`` with which enough samples survive the likelihood (l, n).

        Also, with it, Bayes' rule in every row (l, n) and the log evidence (l,) of each. A look
        ahead has used an exponent of ``ahead`` already, to choose the samples.
        """
        after, log_evidence = np.empty_like(believed.given), np.empty(len(believed.given))
        exponent = sampling.take_in(
            believed.given,
            believed.belief.weights.values,
            self.settings.scouts,
            log_likelihood,
            evidence.robot_weights_without.values,
            ahead,
            most,
            RESAMPLE_BELOW,
            after,
            log_evidence,
        )
        return exponent, after, log_evidence

    def widened(self, belief: ObjectBelief, factor: float, std_m: float) -> ObjectBelief:
        std = np.array([std_m, std_m, std_m / LEVER])
        kept = np.array(belief.kept_of(factor)) if belief.settled else 1.0
        belief = belief.standing
        wider = np.sqrt(kept + (std / np.maximum(belief.std, LEAST_STD)) ** 2)
        states = belief.mean + wider * belief.deviations
        states[:, 2] = wrap(states[:, 2])
        return belief.with_samples(states, belief.weights)

    # --- samples --------------------------------------------------------------------

    def _whole(self, belief: ObjectBelief) -> BoolArray:
        """Which samples (n,) differ for each robot sample: none while the object's place is open."""
        whole = np.full(len(belief.states), belief.settled)
        whole[-self.settings.scouts :] = False
        return whole

    def _renewed(
        self, believed: ConditionalBelief, resample: bool, rng: np.random.Generator
    ) -> ConditionalBelief:
        """The samples resampled where few carry the belief, and half of the scouts sent out anew."""
        belief, s = believed.belief, self.settings
        values, count = belief.weights.values, len(belief.states) - s.scouts
        states, place, ancestors = belief.states[:count], belief.mean, np.arange(count)
        pooled, near = np.empty_like(values), np.minimum(NEAR_SIGMAS * belief.std, self._nudge)
        share, effective, of_scouts = sampling.pool(
            belief.states, values, count, place, near, self._moves, FOLLOWED, pooled
        )
        kept = pooled[:count]
        is_poor = effective < RESAMPLE_BELOW * min(count, s.samples) or of_scouts > FOLLOWED
        if resample or is_poor:
            states, place, ancestors = self._resampled(belief.states, pooled, rng)
            kept = np.ones(len(states))
        scouts, won = belief.states[count:], values[count:] - pooled[count:]
        weights = self._weights(kept, share)
        given = np.empty((len(believed.given), len(weights)))
        sampling.inherit(believed.given, values, ancestors, weights.values, given)
        sent = self._sent_out(scouts, won, states, kept, place, rng)
        belief = belief.with_samples(np.concatenate([states, sent]), weights)
        return altered(believed, belief=belief, given=given)

    def _weights(self, kept: FloatArray, share: float) -> Weights:
        """Those of samples, which weigh ``kept`` (n,) among themselves, and of scouts behind them.

        The first of these carry on, who have won a ``share``; the others start afresh.
        """
        s, count = self.settings, len(kept)
        carried = s.scouts // 2
        weights = np.empty(count + s.scouts)
        weights[count:] = s.scout_weight / (s.scouts - carried)
        weights[count : count + carried] = max(share, LEAST_SHARE) / carried
        weights[:count] = (1.0 - weights[count:].sum()) / kept.sum() * kept
        return Weights(weights)

    def _resampled(
        self, states: FloatArray, weights: FloatArray, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray, IntArray]:
        """As many samples (c, 3) as the width of weighted ones (n, 3) needs (Fox 2003).

        Also the mean of these, and the ancestors (c,).
        """
        s, pool = self.settings, ObjectBelief(self.item, states, Weights.of(weights), np.zeros(3))
        needed = kld_sample_size(occupied(pool.deviations, weights), KLD_ERROR, KLD_QUANTILE)
        count = min(max(needed, s.least_samples), s.samples)
        ancestors = systematic(pool.weights, count, rng)
        out = pool.mean + copies(pool.deviations, weights, ancestors, self._blur, rng)
        out[:, 2] = wrap(out[:, 2])
        return out, pool.mean, ancestors

    # --- scouts ---------------------------------------------------------------------

    def _shown(
        self, believed: ConditionalBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> ConditionalBelief:
        """The last quarter of the scouts sent to where readings that nothing explains may show the object.

        They lie closer there than the places to which it may have been moved, and weigh less for it.
        """
        belief = believed.belief
        proposed = self._through_readings(belief, evidence.stopped, self.settings.scouts // 4, rng)
        if len(proposed) == 0:
            return believed
        states, factor = belief.states.copy(), np.ones(len(belief.states))
        states[-len(proposed) :] = proposed
        due = self._new_place_density(proposed, belief.mean) / self._crowding(proposed)
        factor[-len(proposed) :] = np.minimum(due, 1.0)
        given = factor * believed.given
        return altered(
            believed,
            belief=belief.with_samples(states, Weights.of(factor * belief.weights.values)),
            given=given / given.sum(axis=1, keepdims=True),
        )

    def _crowding(self, states: FloatArray) -> FloatArray:
        """Density (c,) with which states (c, 3) lie about each of themselves."""
        off = states[:, None] - states
        off[..., 2] = wrap(off[..., 2])
        near = np.exp(-0.5 * ((off / self._blur) ** 2).sum(axis=2))
        return np.asarray(near.mean(axis=1) / (ROOT_TAU * self._blur).prod())

    def _through_readings(
        self, belief: ObjectBelief, stopped: FloatArray, count: int, rng: np.random.Generator
    ) -> FloatArray:
        """At most ``count`` states (c, 3) in which the outline runs through ends of beams (m, 3)."""
        if len(stopped) < FEWEST:
            return np.empty((0, 3))
        traced = self._traced(float(np.sort(stopped[:, 2])[len(stopped) // 2]))
        if traced is None:
            return np.empty((0, 3))
        ends = stopped[:, :2]
        if belief.settled:
            ends = ends[~traced.holds(belief.mean[None], ends, ON_OBJECT)[0]]
            if len(ends) < FEWEST:
                return np.empty((0, 3))
        states, explained = traced.states_through(ends, TRIED, rng)
        density = self._new_place_density(states, belief.mean)
        able = density > UNLIKELY * self._new_place_density(self.item.home[None], belief.mean)
        if not able.any():
            return np.empty((0, 3))
        likely = density[able] * np.exp(explained[able] - explained[able].max())
        return states[able][systematic(Weights.of(likely), count, rng)]

    def _traced(self, height: float) -> TracedOutline | None:
        """The object's outline at a height above the floor, m."""
        step = round(height / HEIGHT_STEP)
        if step not in self._outlines:
            level = step * HEIGHT_STEP - self.item.origin[2, 3]
            self._outlines[step] = TracedOutline.of(outline(self.item.upright_mesh, level))
        return self._outlines[step]

    @lazy
    def _nudge(self) -> FloatArray:
        s = self.settings
        return np.array([s.nudge_m, s.nudge_m, np.radians(s.nudge_deg)])

    @lazy
    def _blur(self) -> FloatArray:
        """(3,) deviations of what one sample alone stands for."""
        return SPREAD * self._nudge

    @lazy
    def _moves(self) -> Moves:
        """Where it may be moved to, as the kernels take it."""
        s, symmetry = self.settings, self.item.symmetry
        width = np.array([s.prior_std_m, s.prior_std_m, np.radians(s.prior_std_deg)])
        is_gaussian = s.prior == "gaussian"
        home = self.item.home
        moves: Moves = sampling.Moves(
            home, width, is_gaussian, self._nudge, symmetry.order, symmetry.centre
        )
        return moves

    def _sent_out(
        self,
        scouts: FloatArray,
        won: FloatArray,
        states: FloatArray,
        weights: FloatArray,
        place: FloatArray,
        rng: np.random.Generator,
    ) -> FloatArray:
        """Half of the scouts (k, 3), by what each has ``won`` (k,), carry on; the others start afresh.

        Of those, half look near the samples (n, 3) about a place (3,), half where the prior says.
        """
        count = self.settings.scouts
        carried, led = count // 2, count // 2 + count // 4
        noise, unit = rng.standard_normal((led, 3)), self._units(count - led, rng)
        best = scouts[systematic(Weights.of(won + TINY), carried, rng)]
        near = states[systematic(Weights.of(weights), led - carried, rng)]
        drawn, out = rng.random(led), np.empty((count, 3))
        sampling.send_out(best, near, place, self._moves, self._blur, noise, unit, drawn, out)
        return out

    def _new_place_density(self, states: FloatArray, place: FloatArray) -> FloatArray:
        """Density (n,) of states to which an object at a place (3,) is moved: near it, or as the prior."""
        out = np.empty(len(states))
        sampling.densities(states, place, self._moves, out)
        return out

    def _of_prior(self, count: int, rng: np.random.Generator) -> FloatArray:
        """(count, 3) samples of the prior around the place where the object should stand."""
        states = self.item.home + self._moves.width * self._units(count, rng)
        states[:, 2] = wrap(states[:, 2])
        return states

    def _units(self, count: int, rng: np.random.Generator) -> FloatArray:
        """(count, 3) samples of the prior, by its width."""
        if self._moves.is_gaussian:
            return rng.standard_normal((count, 3))
        return np.asarray(rng.uniform(-1.0, 1.0, (count, 3)))


def _presence(presence: FloatArray, log_evidence: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Probability (l,) that an object is there after a scan, and the scan's log evidence (l,) then.

    ``log_evidence`` (l,) is that of its being there, against its absence.
    """
    there = np.log(presence) + log_evidence
    either = np.logaddexp(there, np.log1p(-presence))
    return np.exp(there - either).clip(LEAST_PRESENCE, 1.0 - LEAST_PRESENCE), either
