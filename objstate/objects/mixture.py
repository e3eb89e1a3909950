"""A door's joint posterior p(mode, s, d | z): a Gaussian mixture over components of its range.

The state s of a door is covered by cells between its limits and by two atoms at the limits, since a
latched door stands exactly there. Given a cell or an atom, there is a Gaussian over three kinds of
errors: that of the robot's pose, the distance of the state from the cell's middle, and those of the
hinge's place and of the angle's zero. So a leaf that is seen as a line determines its angle and its
hinge, and the angle's variance includes the uncertainty of robot, hinge and zero
(Rao-Blackwellized; see docs/model/door.md).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import BuildingErrorSettings, DoorSettings
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import Later, altered, lazy
from objstate.objects.belief import ObjectBelief
from objstate.objects.doorframe import BearingReading
from objstate.objects.doors import LatticeFilter, gaussian_prior, rest_shares
from objstate.particles import Weights

if TYPE_CHECKING:
    from objstate.objects import exchange_kernels, latch_kernels, repeats, update_kernels
    from objstate.objects import mixture_kernels as kernels
    from objstate.objects.mixture_kernels import Beams, Noise
else:
    exchange_kernels = Later("objstate.objects.exchange_kernels")
    kernels = Later("objstate.objects.mixture_kernels")
    latch_kernels = Later("objstate.objects.latch_kernels")
    repeats = Later("objstate.objects.repeats")
    update_kernels = Later("objstate.objects.update_kernels")

CELL_DEG, CELL_M = 2.5, 0.05  # width of a cell, hinged and sliding; ranges are linear within one
MARGIN_DEG, MARGIN_M = 6.0, 0.05  # beyond a limit, where leaves of latched doors may still stand
OVERLAP = 0.6  # deviation of the state within a cell, in cells: their sum is nearly flat
PLAY_DEG, PLAY_M = 0.1, 0.002  # deviation of a latched door's state from its limit
LATCHES = 0.8  # probability that a door that comes to rest in the last cell before a limit latches
FASTEST_S = 3.0  # s after which a moving door may be anywhere
HINGE = slice(4, 6)  # indices of a component's errors
THICKNESS_STD = 0.01  # m, prior deviation of a leaf's thickness from the model's
NEGLIGIBLE = 1e-9  # weight below which a component is left out of the evidence for a prior
SPREADS_KEPT = 256  # number of transitions of moving doors that are cached
MOST_NATS = 100.0  # most evidence for a component, beside the best one between the limits
FORGETS = 0.3  # probability that what was learnt of hinge and bearing is wrong, for a moved door
NEVER = 1e-30  # least weight of a component, so that nothing is impossible
UNMET = 0.002  # prior probability that no beam meets a leaf, wherever it stands
LOG_UNMET = math.log(UNMET / (1.0 - UNMET))
MOST_ODDS = -math.log(NEVER)  # nats, of such a leaf
PACES = np.geomspace(0.25, 256.0, 6)  # (k,) how often a door is moved, in units of the setting
AS_SET = np.eye(len(PACES))[int(np.abs(np.log(PACES)).argmin())]


@dataclass(frozen=True)
class Doorway:
    """The constant data of a door: its cells, their placements, and its dynamics."""

    item: MovableObject
    settings: DoorSettings
    error: BuildingErrorSettings
    bearing: BearingReading | None = None  # what the walls tell of its closed bearing

    @property
    def _hinged(self) -> bool:
        return self.item.kind is Kind.HINGED

    @lazy
    def cell(self) -> float:
        """rad or m, the width of a cell."""
        span, most = self.item.upper - self.item.lower, math.radians(CELL_DEG)
        return span / max(round(span / (most if self._hinged else CELL_M)), 3)

    @lazy
    def atoms(self) -> int:
        """The number of components that are limits: the last ones."""
        return 0 if self.item.wraps else 2

    @lazy
    def states(self) -> FloatArray:
        """(c,) rad or m, the middles of the components: cells in order, then both limits."""
        item = self.item
        cells = round((item.upper - item.lower) / self.cell)
        middles = item.lower + (np.arange(cells) + 0.5) * self.cell
        return np.append(middles, [item.lower, item.upper][: self.atoms])

    @property
    def cells(self) -> int:
        return len(self.states) - self.atoms

    @lazy
    def middles(self) -> FloatArray:
        """(c + o,) rad or m, of all components: the ``states``, and cells beyond both limits.

        No door rests freely beyond a limit. A latched one may stand there, where the bearing isn't
        as modelled.
        """
        margin = math.radians(MARGIN_DEG) if self._hinged else MARGIN_M
        count = math.ceil(margin / self.cell) if self.atoms else 0
        steps = (np.arange(count) + 0.5) * self.cell
        return np.concatenate([self.states, self.item.lower - steps, self.item.upper + steps])

    @lazy
    def edges(self) -> IntArray:
        """(o,) the last cell before the limit, of each cell beyond one."""
        count = len(self.middles) - len(self.states)
        return np.repeat([0, self.cells - 1], [count // 2, count - count // 2])

    @lazy
    def zero(self) -> int | None:
        """The component of the limit from which the state is measured; None if there is none."""
        off = np.abs(self.states[self.cells :] - self.item.home[0])
        return self.cells + int(off.argmin()) if off.min(initial=np.inf) < self.cell / 2 else None

    @lazy
    def widths(self) -> FloatArray:
        """(c + o,) variances of the state within each component.

        A latched door stands at the limit from which its state is measured. The place of the other
        stop isn't known exactly.
        """
        e = self.error
        out = np.full(len(self.middles), (OVERLAP * self.cell) ** 2)
        out[self.cells : len(self.states)] = (
            math.radians(e.bearing_std_deg) if self._hinged else e.hinge_std_m
        ) ** 2
        if self.zero is not None:
            out[self.zero] = (math.radians(PLAY_DEG) if self._hinged else PLAY_M) ** 2
        return out

    @lazy
    def turn(self) -> float:
        """Turn of the leaf in the building for each unit of the state."""
        return math.copysign(1.0, self.item.direction[2]) if self._hinged else 0.0

    @lazy
    def slide(self) -> FloatArray:
        """(2,) m that it moves for each unit of the state."""
        return np.zeros(2) if self._hinged else self.item.direction[:2].copy()

    @lazy
    def placements(self) -> FloatArray:
        """(c + o, 3) x, y and turn of the leaf's frame in the middle of each component."""
        home, out = float(self.item.home[0]), np.empty((len(self.middles), 3))
        shift = 0.0 if self._hinged else 1.0
        out[:, :2] = self.item.hinge + shift * self.middles[:, None] * self.slide
        out[:, 2] = self.turn * (self.middles - home)
        return out

    @lazy
    def conditioned(self) -> FloatArray:
        """(2 (c + o) + 1, 3) the placements twice, and nowhere: nan, where no beam meets a leaf."""
        return np.concatenate([self.placements, self.placements, np.full((1, 3), np.nan)])

    @lazy
    def nowhere(self) -> BoolArray:
        """(c + o,) no component."""
        return np.zeros(len(self.middles), dtype=bool)

    @lazy
    def rest(self) -> FloatArray:
        """(c,) distribution of the state after a move."""
        if not self.atoms:
            return np.full(self.cells, 1.0 / self.cells)
        edges = np.asarray(self.item.lower + np.arange(self.cells + 1) * self.cell)
        between, limits = rest_shares(self.item, self.settings.rest, edges)
        out = np.append(between, limits)
        return np.asarray(out / out.sum())

    @lazy
    def latching(self) -> FloatArray:
        """(c, c) probabilities of the component of a door that comes to rest where it is."""
        out = np.eye(len(self.states))
        if self.atoms:
            edges, limits = [0, self.cells - 1], [self.cells, self.cells + 1]
            latches = np.where(self.rest[limits] > 0.0, LATCHES, 0.0)  # not where no door rests
            out[edges, edges], out[edges, limits] = 1.0 - latches, latches
        return out

    @lazy
    def prior(self) -> FloatArray:
        """(c,) weights before any scan."""
        if self.settings.prior == "uniform":
            return self.rest
        out = self.rest * gaussian_prior(self.item, self.settings, self.states) + NEVER
        return np.asarray(out / out.sum())

    def zero_before(self, statics: Statics) -> tuple[float, float]:
        """rad, rad^2: mean and variance of the error of its state's zero before any scan."""
        if self.bearing is None:
            return 0.0, statics.bearing
        gain = statics.bearing / (statics.bearing + self.bearing.variance)
        return gain * self.bearing.error, gain * self.bearing.variance

    def static_errors(self, statics: Statics) -> tuple[FloatArray, FloatArray]:
        """Means (8,) and variances (8,) of the static errors before any scan; 0 of the others."""
        means, variances = np.zeros(kernels.ERRORS), np.zeros(kernels.ERRORS)
        variances[HINGE], variances[kernels.THICKNESS] = statics.hinge, THICKNESS_STD**2
        means[kernels.ZERO], variances[kernels.ZERO] = self.zero_before(statics)
        return means, variances

    def _wanders(self, seconds: float) -> FloatArray:
        """(c, c) probabilities of each component of a moving door after some time, given now's."""
        fastest = self.settings.swing.most(self._hinged)
        std = max(fastest / 2.0 * min(seconds, FASTEST_S) / self.cell, 0.3)
        return _wanders(round(std, 2), self.cells, self.item.wraps)

    def stays(self, seconds: float, pace: FloatArray | float = 1.0) -> FloatArray:
        """Probability that a resting door isn't moved for some time, ``pace`` as often as set."""
        return np.power(1.0 - self.settings.dynamics.moved(seconds), pace)

    def _stops(self, seconds: float) -> tuple[float, float]:
        """Probabilities that a moving door comes to rest, and that it then may be anywhere."""
        swing = self.settings.swing
        return -math.expm1(-seconds / swing.seconds), -math.expm1(-seconds / swing.near_s)

    def moved(
        self,
        resting: FloatArray,
        moving: FloatArray,
        seconds: float,
        pace: FloatArray | float = 1.0,
    ) -> Moved:
        """The weights (..., c) of resting and of moving doors after some time.

        Doors are moved ``pace`` (...) times as often as set.
        """
        remaining = self.stays(seconds, pace) * resting
        swinging = (moving + resting - remaining) @ self._wanders(seconds)
        ends, leaves = self._stops(seconds)
        stops, swinging = ends * swinging, (1.0 - ends) * swinging
        anywhere = stops.sum(axis=-1, keepdims=True) * self.rest
        arrived = (1.0 - leaves) * (stops @ self.latching) + leaves * anywhere
        return Moved(remaining + arrived, swinging, arrived)

    def expected(
        self,
        resting: FloatArray,
        moving: FloatArray,
        seconds: float,
        pace: FloatArray | float = 1.0,
    ) -> tuple[FloatArray, FloatArray]:
        """Expectations (..., c) of values after some time, given the present state.

        The values (..., c) are those of a door that then rests or moves in each component; the first
        expectations are for one that rests now, the second for one that moves. This is the adjoint
        of ``moved``.
        """
        ends, leaves = self._stops(seconds)
        anywhere = (resting @ self.rest)[..., None]
        stopped = (1.0 - leaves) * (resting @ self.latching.T) + leaves * anywhere
        out = (ends * stopped + (1.0 - ends) * moving) @ self._wanders(seconds).T
        stays = self.stays(seconds, pace)
        return stays * resting + (1.0 - stays) * out, out

    def on_lattice(self, states: States, lattice: ObjectBelief) -> tuple[FloatArray, FloatArray]:
        """Weights (k, n) of a lattice's states, and the probability of moving in each (k, n)."""
        first, cell, wraps = lattice.lattice
        weights, p_moving = (np.empty((len(states.means), len(lattice.states))) for _ in range(2))
        exchange_kernels.read_off(*states, self.cells, first, cell, wraps, NEVER, weights, p_moving)
        return weights, p_moving

    @lazy
    def _rests(self) -> FloatArray:
        """(n,) weights of a lattice's states of a door of which readings tell nothing."""
        return LatticeFilter(self.item, self.settings).rests

    def published(
        self, weights: FloatArray, moving: FloatArray, presence: float
    ) -> tuple[FloatArray, FloatArray]:
        """Weights of a lattice's states, and the probability of moving in each, (..., n).

        If beams meet the leaf, which has the probability ``presence``, these are ``weights``, of
        which ``moving`` move. Else readings tell nothing.
        """
        every = presence * weights + (1.0 - presence) * self._rests
        return every, np.minimum(presence * moving / np.maximum(every, NEVER), 1.0)


class Statics(NamedTuple):
    """Prior variances of a door's static errors."""

    hinge: float  # m^2, of the hinge's place in each direction
    bearing: float  # rad^2, of the angle's zero; unused for a sliding door


class States(NamedTuple):
    """p(mode, s) of a door under several priors: a Gaussian of the state in each component."""

    resting: FloatArray  # (k, ..., c) weights of a resting door; with ``moving`` they sum to one
    moving: FloatArray  # (k, ..., c) of a moving door
    means: FloatArray  # (k, c) of the state
    variances: FloatArray  # (k, c)


class Moved(NamedTuple):
    """The change of the components' weights over some time."""

    resting: FloatArray  # (..., c)
    moving: FloatArray  # (..., c)
    arrived: FloatArray  # (..., c) of those that rest, what came to rest since

    @property
    def arriving(self) -> FloatArray:
        """(..., c) share of each component's weight that has arrived."""
        every = np.maximum(self.resting + self.moving, NEVER)
        return np.asarray((self.arrived + self.moving) / every)

    def averaged(self, paces: FloatArray) -> Moved:
        """The average (..., c) of weights (..., k, c) over paces of some probabilities (k,)."""
        return Moved(*(paces @ part for part in self))


@dataclass(frozen=True, eq=False)
class DoorMixture:
    """p(mode, s, d | z) of one door. A value: updates return new ones."""

    door: Doorway
    by_pace: FloatArray  # (2, k, c) weights at rest and moving under each of ``PACES``; sum to one
    log_paces: FloatArray  # (k,) log p(z | pace), up to a constant
    paces: FloatArray  # (k,) prior probabilities of ``PACES``
    beyond: FloatArray  # (o,) weights of cells beyond the limits, which aren't in that sum
    means: FloatArray  # (c + o, 8) of errors, see ``mixture_kernels``
    covariances: FloatArray  # (c + o, 8, 8)
    statics: Statics  # their prior variances; a sliding door has no bearing
    kinds: FloatArray  # (c + o, 2) probabilities that the leaf has a handle, and is of glass
    arrived: BoolArray  # (c + o,) components that a moved door just arrived in
    ends: Mapping[str, repeats.Ends] = field(default_factory=dict)  # of each laser's last scan
    # log odds that no beam meets the leaf; all else is given that beams do
    log_unmet: float = LOG_UNMET
    stamp_ns: int | None = None

    @staticmethod
    def unknown(door: Doorway, statics: Statics) -> DoorMixture:
        """The mixture before any scan."""
        count, errors = len(door.middles), kernels.ERRORS
        statics = statics if door.turn else Statics(statics.hinge, 0.0)
        means, covariances = np.zeros((count, errors)), np.zeros((count, errors, errors))
        means[:], variances = door.static_errors(statics)
        covariances[:, range(errors), range(errors)] = variances
        covariances[:, kernels.STATE, kernels.STATE] = door.widths
        resting = door.prior
        return DoorMixture(
            door,
            _under_each(resting, np.zeros(len(resting))),
            np.zeros(len(PACES)),
            AS_SET,
            resting[door.edges],
            means,
            covariances,
            statics,
            np.tile(kernels.KINDS, (count, 1)),
            door.nowhere,
        )

    @staticmethod
    def of(door: Doorway, belief: ObjectBelief, statics: Statics) -> DoorMixture:
        """The mixture of a belief on a lattice, whose states at the limits represent the limits."""
        blank = DoorMixture.unknown(door, statics)
        if belief.stamp_ns is None:
            return blank
        states, weights = belief.states[:, 0], belief.weights.values
        where = np.floor((states - door.item.lower) / door.cell).astype(int)
        resting = np.bincount(where.clip(0, door.cells - 1), weights, len(door.states))
        if door.atoms:
            for atom, cell, edge in ((-2, 0, 0), (-1, door.cells - 1, -1)):
                resting[door.cells + 2 + atom] = weights[edge]
                resting[cell] -= weights[edge]
        p_moving = (
            belief.p_moving if len(belief.p_moving) == len(weights) else np.zeros(len(weights))
        )
        cells = where.clip(0, door.cells - 1)
        moving = np.bincount(cells, weights * p_moving, len(door.states)).astype(float)
        resting = np.maximum(resting - moving, NEVER)
        weighed = blank.weighed(resting, moving)
        return altered(weighed, beyond=weighed.resting[door.edges], stamp_ns=belief.stamp_ns)

    def weighed(self, resting: FloatArray, moving: FloatArray) -> DoorMixture:
        """The mixture with the same weights (c,) under each pace, normalized."""
        total = resting.sum() + moving.sum()
        return altered(self, by_pace=_under_each(resting / total, moving / total))

    @lazy
    def posterior_paces(self) -> FloatArray:
        """(k,) probabilities of ``PACES``."""
        shares = self.paces * np.exp(self.log_paces - self.log_paces.max())
        return np.asarray(shares / shares.sum())

    @property
    def unmet(self) -> float:
        """Probability that no beam meets the leaf: it was taken out, or lasers look past it."""
        return 1.0 / (1.0 + math.exp(-self.log_unmet))

    def begun(self, seconds: float) -> float:
        """Probability that a resting door begins to move within some time."""
        return 1.0 - float(self.posterior_paces @ self.door.stays(seconds, PACES))

    @lazy
    def resting(self) -> FloatArray:
        """(c,) weights of a resting door; with ``moving`` they sum to one."""
        return np.asarray(self.posterior_paces @ self.by_pace[0])

    @lazy
    def moving(self) -> FloatArray:
        """(c,) weights of a moving door."""
        return np.asarray(self.posterior_paces @ self.by_pace[1])

    @lazy
    def weights(self) -> FloatArray:
        """(c,) of the components, at rest or moving."""
        return self.resting + self.moving

    def later(self, seconds: float, transfer: FloatArray, added: FloatArray) -> DoorMixture:
        """The prediction over some time, in which the door may have been moved.

        The robot's error is ``transfer`` (3, 3) times the earlier one, plus an independent one of
        covariance ``added`` (3, 3).
        """
        door, means, covariances = self.door, self.means.copy(), self.covariances.copy()
        by_pace, beyond, kinds, arrived = self.by_pace, self.beyond, self.kinds, self.arrived
        if seconds > 0.0:
            beyond, kinds, arrived = beyond.copy(), kinds.copy(), np.empty(len(means), dtype=bool)
            moved = door.moved(by_pace[0], by_pace[1], seconds, PACES[:, None])
            update_kernels.arrive(
                self.posterior_paces,
                door.stays(seconds, PACES),
                self.weights,
                *moved,
                door.edges,
                NEVER,
                beyond,
                door.widths,
                means,
                covariances,
                kinds,
                arrived,
            )
            by_pace = np.stack([moved.resting, moved.moving])
        kernels.renew_robot(means, covariances, transfer, added)
        return altered(
            self,
            by_pace=by_pace,
            beyond=beyond,
            means=means,
            covariances=covariances,
            kinds=kinds,
            arrived=arrived,
            stamp_ns=None,
        )

    def among(self, paces: FloatArray) -> DoorMixture:
        """The same under other prior probabilities (k,) of ``PACES``."""
        return altered(self, paces=paces)

    def given(
        self,
        laser: str,
        beams: Beams,
        noise: Noise,
        shape: kernels.Shape,
        stamp_ns: int | None = None,
    ) -> tuple[DoorMixture, int]:
        """Bayes' rule for a laser's scan, and the largest number of its beams that reach the leaf.

        A component that a moved door just arrived in is conditioned with the hinge and bearing that
        were learnt and with their priors. Its evidence is the sum; the likelier Gaussian is kept.
        The evidence of all components competes with that of a leaf that no beam meets.
        """
        door, cells, atoms = self.door, self.door.cells, self.door.atoms
        count, errors = len(door.middles), kernels.ERRORS
        ends = repeats.followed(self.ends, laser, beams, noise)
        rows = len(door.conditioned)
        weights, log_evidence = np.empty(rows), np.empty(rows)
        arrived, kinds = np.empty(rows, dtype=bool), np.empty((rows, len(kernels.KINDS)))
        means, covariances = np.empty((rows, errors)), np.empty((rows, errors, errors))
        update_kernels.begin(
            self.weights,
            self.beyond,
            self.arrived,
            cells,
            atoms,
            NEVER,
            FORGETS,
            *door.static_errors(self.statics),
            self.means,
            self.covariances,
            self.kinds,
            weights,
            arrived,
            means,
            covariances,
            kinds,
            log_evidence,
        )
        before = means.copy(), covariances.copy()
        reached = kernels.condition(
            beams,
            shape,
            noise,
            repeats.shares(ends[laser]),
            repeats.counted(ends[laser], beams.origins),
            arrived,
            door.conditioned,
            weights,
            static_precisions(door, self.statics),
            means,
            covariances,
            kinds,
            log_evidence,
        )
        after = means, covariances, kinds
        update_kernels.choose(FORGETS, weights, log_evidence, *after, *before)
        means, covariances, kinds = (each[:count].copy() for each in after)
        if atoms:
            latch_kernels.limit(
                np.concatenate([np.maximum(self.resting, NEVER), self.beyond]),
                door.middles,
                door.widths,
                cells,
                before[0][:count],
                before[1][:count],
                means,
                covariances,
                log_evidence[:count],
            )
        by_pace, log_paces, beyond = self.by_pace.copy(), self.log_paces.copy(), self.beyond.copy()
        log_met = update_kernels.reweigh(
            log_evidence[:count],
            cells,
            atoms,
            MOST_NATS,
            NEVER,
            self.paces,
            by_pace,
            log_paces,
            beyond,
            kinds,
        )
        log_unmet = self.log_unmet + float(log_evidence[-1]) - log_met
        posterior = altered(
            self,
            by_pace=by_pace,
            log_unmet=min(max(log_unmet, -MOST_ODDS), MOST_ODDS),
            log_paces=log_paces,
            beyond=beyond,
            means=means,
            covariances=covariances,
            kinds=kinds,
            ends=ends,
            arrived=door.nowhere,
            stamp_ns=stamp_ns,
        )
        return posterior, int(reached)

    def log_evidence(self, name: str, variances: FloatArray) -> FloatArray:
        """(k,) log p(z | variance) of a static error, up to a constant, for variances (k,)."""
        before = getattr(self.statics, name)
        out = exchange_kernels.evidence_under(
            self.weights,
            self.means,
            self.covariances,
            name == "hinge",
            before,
            1.0 / variances - 1.0 / before,
            NEGLIGIBLE,
        )
        return np.asarray(out)

    def under(self, priors: Sequence[Statics]) -> States:
        """The states given the same readings, under each of some narrower priors (k,)."""
        every = self._under(priors, self.resting[None], self.moving[None])
        return States(every.resting[:, 0], every.moving[:, 0], every.means, every.variances)

    def by_pace_under(self, priors: Sequence[Statics]) -> States:
        """The same with weights (k, p, c) under each of ``PACES``."""
        return self._under(priors, *self.by_pace)

    def _under(self, priors: Sequence[Statics], resting: FloatArray, moving: FloatArray) -> States:
        """The states under priors (k,), with weights under them that were (p, c)."""
        paces, count = resting.shape
        weights = np.empty((2, len(priors), paces, count))
        means, variances = np.empty((2, len(priors), count))
        exchange_kernels.exchange(
            resting,
            moving,
            self.means,
            self.covariances,
            self.door.states,
            np.array(self.statics),
            np.array(priors),
            weights,
            means,
            variances,
        )
        return States(weights[0], weights[1], means, variances)

    @lazy
    def hinge(self) -> tuple[FloatArray, FloatArray]:
        """Mean (2,) m of the hinge's offset from its modelled place, and covariance (2, 2)."""
        mean, covariance = kernels.pooled(self.weights, self.means, self.covariances)
        return mean[HINGE], covariance[HINGE, HINGE]

    def on_lattice(self, lattice: ObjectBelief) -> ObjectBelief:
        """The posterior of the state as weights of a lattice's states."""
        (weights,), (p_moving,) = self.door.on_lattice(self.under([self.statics]), lattice)
        return altered(lattice, weights=Weights(weights), p_moving=p_moving, stamp_ns=self.stamp_ns)


def static_precisions(door: Doorway, statics: Statics) -> FloatArray:
    """(8,) inverse prior variances of the state within a cell, of hinge and thickness; 0 else."""
    out = np.zeros(kernels.ERRORS)
    out[kernels.STATE] = 1.0 / door.widths[0]
    out[HINGE] = 1.0 / statics.hinge
    out[kernels.THICKNESS] = 1.0 / THICKNESS_STD**2
    return out


def _under_each(resting: FloatArray, moving: FloatArray) -> FloatArray:
    """(2, k, c) weights that are the same under each pace."""
    weights = np.stack([resting, moving])
    return np.repeat(weights[:, None], len(PACES), axis=1)


@lru_cache(maxsize=SPREADS_KEPT)
def _wanders(std: float, cells: int, wraps: bool) -> FloatArray:
    """(c, c) probabilities of moves between components, by a Gaussian of a deviation in cells.

    It is cut off at four deviations. What would pass a limit stays in the last cell before it; a
    door at a limit begins in that cell.
    """
    reach = min(math.ceil(4.0 * std), cells)
    steps = np.arange(-reach, reach + 1)
    taps = np.exp(-0.5 * (steps / std) ** 2)
    begins = np.arange(cells) if wraps else np.append(np.arange(cells), [0, cells - 1])
    to = begins[:, None] + steps
    to, count = to % cells if wraps else to.clip(0, cells - 1), len(begins)
    pairs = to + count * np.arange(count)[:, None]
    weights = np.broadcast_to(taps / taps.sum(), to.shape)
    summed = np.bincount(pairs.ravel(), weights.ravel(), count**2).astype(float)
    return summed.reshape(count, count)
