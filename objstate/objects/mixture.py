"""A door's joint posterior p(mode, s, d | z): a Gaussian mixture over components of its range.

The state s of a door is covered by cells between its limits and by two atoms at the limits, since a
latched door stands exactly there. Given a cell or an atom, there is a Gaussian over three kinds of
errors: that of the robot's pose, the distance of the state from the cell's middle, and those of the
hinge's place and of the angle's zero. So a leaf that is seen as a line determines its angle and its
hinge, and the angle's variance includes the uncertainty of robot, hinge and zero
(Rao-Blackwellized; see docs/model.md).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import BuildingErrorSettings, DoorSettings
from objstate.geometry import FloatArray, wrap
from objstate.lazy import Later, altered, lazy
from objstate.linear import ROOT_2
from objstate.objects.belief import ObjectBelief
from objstate.particles import Weights
from objstate.records import SECONDS_PER_HOUR

if TYPE_CHECKING:
    from objstate.objects import exchange_kernels
    from objstate.objects import mixture_kernels as kernels
    from objstate.objects.mixture_kernels import Beams, Noise
else:
    exchange_kernels = Later("objstate.objects.exchange_kernels")
    kernels = Later("objstate.objects.mixture_kernels")

CELL_DEG, CELL_M = 2.5, 0.05  # width of a cell, hinged and sliding; ranges are linear within one
OVERLAP = 0.6  # deviation of the state within a cell, in cells: their sum is nearly flat
PLAY_DEG, PLAY_M = 0.1, 0.002  # deviation of a latched door's state from its limit
LEAST_WAY = 0.3  # cells; least deviation of a moving door's way
HINGE = slice(4, 6)  # indices of a component's errors
NEGLIGIBLE = 1e-9  # weight below which a component is left out of the evidence for a prior
WAYS_KEPT = 64  # number of transitions of moving doors that are cached
DIRECTIONS = 2  # of a moving door: up to larger states, and down
NEVER = 1e-30  # least weight of a component, so that nothing is impossible


def half_cauchy(factors: FloatArray) -> FloatArray:
    """Probabilities (n,) of factors at equal ratios, distributed about one; the tail is heavy."""
    density = factors / (1.0 + factors**2)
    return np.asarray(density / density.sum())


FACTORS = 4.0 ** np.arange(-1.0, 4.0)  # (r,) multiples of ``moves_per_hour`` that a rate may be
FACTORS_PRIOR = half_cauchy(FACTORS)  # (r,)


@dataclass(frozen=True)
class Doorway:
    """The constant data of a door: its cells, their placements, and its dynamics."""

    item: MovableObject
    settings: DoorSettings
    error: BuildingErrorSettings

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
    def zero(self) -> int | None:
        """The component of the limit from which the state is measured; None if there is none."""
        off = np.abs(self.states[self.cells :] - self.item.home[0])
        return self.cells + int(off.argmin()) if off.min(initial=np.inf) < self.cell / 2 else None

    @lazy
    def widths(self) -> FloatArray:
        """(c,) variances of the state within each component.

        A latched door stands at the limit from which its state is measured. The place of the other
        stop isn't known exactly.
        """
        e = self.error
        out = np.full(len(self.states), (OVERLAP * self.cell) ** 2)
        out[self.cells :] = (
            math.radians(e.bearing_std_deg) if self._hinged else e.hinge_std_m
        ) ** 2
        if self.zero is not None:
            out[self.zero] = (math.radians(PLAY_DEG) if self._hinged else PLAY_M) ** 2
        return out

    @lazy
    def tied(self) -> FloatArray:
        """(c,) 1 for components tied to the state's zero, the limits; 0 for the others."""
        return np.asarray(np.arange(len(self.states)) >= self.cells, dtype=float)

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
        """(c, 3) x, y and turn of the leaf's frame in the middle of each component."""
        home, out = float(self.item.home[0]), np.empty((len(self.states), 3))
        shift = 0.0 if self._hinged else 1.0
        out[:, :2] = self.item.hinge + shift * self.states[:, None] * self.slide
        out[:, 2] = self.turn * (self.states - home)
        return out

    @lazy
    def rest(self) -> FloatArray:
        """(c,) distribution of the state after a move."""
        s, item = self.settings.rest, self.item
        out = np.full(len(self.states), 1.0 / self.cells)
        if self.atoms:
            closed_is_first = abs(item.lower - item.home[0]) <= abs(item.upper - item.home[0])
            limits = (s.closed, s.open) if closed_is_first else (s.open, s.closed)
            out[: self.cells] *= s.anywhere
            out[self.cells :] = limits
        return np.asarray(out / out.sum())

    @lazy
    def prior(self) -> FloatArray:
        """(c,) weights before any scan."""
        s = self.settings
        if s.prior == "uniform":
            return self.rest
        mean, std = s.prior_mean_m, s.prior_std_m
        if self._hinged:
            mean = None if s.prior_mean_deg is None else math.radians(s.prior_mean_deg)
            std = math.radians(s.prior_std_deg)
        off = self.states - (self.item.home[0] if mean is None else mean)
        off = wrap(off) if self.item.wraps else off
        out = self.rest * np.exp(-0.5 * (off / std) ** 2) + NEVER
        return np.asarray(out / out.sum())

    def _movement(self, seconds: float) -> Movement:
        """Where doors that move get in some time."""
        swing = self.settings.swing
        fastest = math.radians(swing.most_deg_per_s) if self._hinged else swing.most_m_per_s
        way = max(fastest * seconds / self.cell, LEAST_WAY)
        limits = tuple(self.rest[self.cells :].tolist())
        return _movement(round(min(way, 10.0 * self.cells), 2), self.cells, limits)

    def stays(self, seconds: float, factors: FloatArray | float = 1.0) -> FloatArray:
        """Probability that a resting door isn't moved for some time, by ``factors`` of the rate."""
        rate = self.settings.dynamics.moves_per_hour / SECONDS_PER_HOUR
        return np.exp(-rate * seconds * factors)

    def moved(
        self,
        resting: FloatArray,
        moving: FloatArray,
        seconds: float,
        factors: FloatArray | float = 1.0,
    ) -> Moved:
        """The weights of resting (.., c) and of moving doors (.., 2 c) after some time.

        A door that moves has a direction: up to larger states, or down. The rate of movements is
        multiplied by ``factors``, one or (.., 1).
        """
        remaining, movement = self.stays(seconds, factors) * resting, self._movement(seconds)
        began, count = resting - remaining, len(self.states)
        swinging = moving + np.concatenate([began, began], axis=-1) * movement.begins
        after = swinging @ movement.transition
        return Moved(remaining + after[..., :count], after[..., count:], remaining)

    def expected(
        self,
        resting: FloatArray,
        moving: FloatArray,
        seconds: float,
        factors: FloatArray | float = 1.0,
    ) -> tuple[FloatArray, FloatArray]:
        """Expectations of values after some time, given the present state.

        The values are those of a door that then rests (.., c) or moves (.., 2 c) in each component;
        the first expectations are for one that rests now, the second for one that moves. This is
        the adjoint of ``moved``.
        """
        movement, count = self._movement(seconds), len(self.states)
        out = np.concatenate([resting, moving], axis=-1) @ movement.transition.T
        begun = out * movement.begins
        stays = self.stays(seconds, factors)
        return stays * resting + (1.0 - stays) * (begun[..., :count] + begun[..., count:]), out

    def on_lattice(self, states: States, lattice: ObjectBelief) -> tuple[FloatArray, FloatArray]:
        """Weights (k, n) of a lattice's states, and the probability of moving in each (k, n)."""
        first, cell, wraps = lattice.lattice
        weights, p_moving = (np.empty((len(states.means), len(lattice.states))) for _ in range(2))
        exchange_kernels.read_off(*states, self.cells, first, cell, wraps, NEVER, weights, p_moving)
        return weights, p_moving


class Statics(NamedTuple):
    """Prior variances of a door's static errors."""

    hinge: float  # m^2, of the hinge's place in each direction
    bearing: float  # rad^2, of the angle's zero; unused for a sliding door


class States(NamedTuple):
    """p(mode, s) of a door under several priors: a Gaussian of the state in each component."""

    resting: FloatArray  # (k, c) weights of a resting door; with ``moving`` they sum to one
    moving: FloatArray  # (k, c) of a moving door
    means: FloatArray  # (k, c) of the state
    variances: FloatArray  # (k, c)


class Moved(NamedTuple):
    """The change of the components' weights over some time."""

    resting: FloatArray  # (.., c)
    moving: FloatArray  # (.., 2 c) up, and down
    remaining: FloatArray  # (.., c) of ``resting``, that of doors which haven't been moved

    @property
    def arriving(self) -> FloatArray:
        """(.., c) share of a component's weight that has arrived."""
        up, down = np.split(self.moving, DIRECTIONS, axis=-1)
        total = np.maximum(self.resting + up + down, NEVER)
        return np.asarray(1.0 - self.remaining / total)


@dataclass(frozen=True, eq=False)
class DoorMixture:
    """p(mode, s, d | z) of one door. A value: updates return new ones."""

    door: Doorway
    resting: FloatArray  # (c,) weights of a resting door; with ``moving`` they sum to one
    moving: FloatArray  # (c,) of a moving door
    means: FloatArray  # (c, 7) of errors, see ``mixture_kernels``
    covariances: FloatArray  # (c, 7, 7)
    statics: Statics  # their prior variances
    # (3, r, c) p(rate | at rest, component), and p(direction, rate | moving, component) of both
    rates: FloatArray
    rates_prior: FloatArray  # (r,) under which these, the weights and the evidence are
    stamp_ns: int | None = None
    # log p(z) of all scans under that prior, up to a constant shared by all priors
    total: float = 0.0

    @staticmethod
    def unknown(door: Doorway, statics: Statics) -> DoorMixture:
        """The mixture before any scan."""
        count, errors = len(door.states), kernels.ERRORS
        means, covariances = np.zeros((count, errors)), np.zeros((count, errors, errors))
        covariances[:, kernels.STATE, kernels.STATE] = door.widths
        covariances[:, HINGE, HINGE] = statics.hinge * np.eye(2)
        covariances[:, kernels.ZERO, kernels.ZERO] = statics.bearing if door.turn else 0.0
        modes = np.array([1.0, 0.5, 0.5])[:, None, None]
        rates = np.broadcast_to(modes * FACTORS_PRIOR[:, None], (3, len(FACTORS), count))
        return DoorMixture(
            door, door.prior, np.zeros(count), means, covariances, statics, rates, FACTORS_PRIOR
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
        moving = np.bincount(where.clip(0, door.cells - 1), weights * p_moving, len(door.states))
        resting = np.maximum(resting - moving, NEVER)
        total = resting.sum() + moving.sum()
        return altered(
            blank, resting=resting / total, moving=moving / total, stamp_ns=belief.stamp_ns
        )

    @lazy
    def weights(self) -> FloatArray:
        """(c,) of the components, at rest or moving."""
        return self.resting + self.moving

    def later(self, seconds: float, transfer: FloatArray, added: FloatArray) -> DoorMixture:
        """The prediction over some time, in which the door may have been moved.

        The robot's error is ``transfer`` (3, 3) times the earlier one, plus an independent one of
        covariance ``added`` (3, 3).
        """
        means, covariances = self.means.copy(), self.covariances.copy()
        resting, moving, rates = self.resting, self.moving, self.rates
        if seconds > 0.0:
            rest, up, down = self.by_rates
            by_rate = self.door.moved(
                rest, np.concatenate([up, down], axis=-1), seconds, FACTORS[:, None]
            )
            moved = Moved(*(each.sum(axis=0) for each in by_rate))
            resting, moving = moved.resting, moved.moving.reshape(DIRECTIONS, -1).sum(axis=0)
            rates = np.stack([by_rate.resting, *np.split(by_rate.moving, DIRECTIONS, axis=-1)])
            rates[0] /= np.maximum(resting, NEVER)
            rates[1:] /= np.maximum(moving, NEVER)
            mean, covariance = kernels.pooled(self.weights, means, covariances)
            kernels.join(moved.arriving, mean, covariance, self.door.widths, means, covariances)
        kernels.renew_robot(means, covariances, transfer, added)
        return altered(
            self,
            resting=resting,
            moving=moving,
            means=means,
            covariances=covariances,
            rates=rates,
            stamp_ns=None,
        )

    def under_rates(self, prior: FloatArray) -> DoorMixture:
        """The same under another prior (r,) of the rates of movements; exact."""
        rates = self.rates * (prior / self.rates_prior)[:, None]
        of_rest, of_move = rates[0].sum(axis=0), rates[1:].sum(axis=(0, 1))
        rates[0] /= np.maximum(of_rest, NEVER)
        rates[1:] /= np.maximum(of_move, NEVER)
        resting, moving = self.resting * of_rest, self.moving * of_move
        share = float(resting.sum() + moving.sum())
        return altered(
            self,
            resting=resting / share,
            moving=moving / share,
            rates=rates,
            rates_prior=prior,
            total=self.total + math.log(share),
        )

    @property
    def of_rates(self) -> FloatArray:
        """(r,) p(z | rate), up to a constant."""
        return np.asarray(self.by_rates.sum(axis=(0, 2)) / self.rates_prior)

    @property
    def by_rates(self) -> FloatArray:
        """(3, r, c) weights of each rate, at rest, moving up and moving down."""
        return self.rates * np.stack([self.resting, self.moving, self.moving])[:, None]

    def at(self, stamp_ns: int) -> DoorMixture:
        """The same at a moment."""
        return altered(self, stamp_ns=stamp_ns)

    def given(self, beams: Beams, noise: Noise, shape: kernels.Shape) -> tuple[DoorMixture, int]:
        """Bayes' rule for a scan, and the largest number of its beams that reach the leaf."""
        door, means, covariances = self.door, self.means.copy(), self.covariances.copy()
        log_evidence = np.empty(len(means))
        reached = kernels.condition(
            beams,
            shape,
            noise,
            door.placements,
            door.tied,
            np.maximum(self.weights, NEVER),
            means,
            covariances,
            log_evidence,
        )
        largest = float(log_evidence.max())
        likelihood = np.exp(log_evidence - largest)
        resting = np.maximum(self.resting * likelihood, NEVER)
        moving = self.moving * likelihood
        share = float(resting.sum() + moving.sum())
        after = altered(
            self,
            resting=resting / share,
            moving=moving / share,
            means=means,
            covariances=covariances,
            total=self.total + largest + math.log(share),
        )
        return after, int(reached)

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
        shape = len(priors), len(self.resting)
        weights, means, variances = np.empty((2, *shape)), np.empty(shape), np.empty(shape)
        exchange_kernels.exchange(
            self.resting,
            self.moving,
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


class Movement(NamedTuple):
    """Where doors that move up or down get in some time."""

    begins: FloatArray  # (2 c,) probability that a door that rested moves up, and down
    transition: FloatArray  # (2 c, 3 c) to rest, to moving up and to moving down


@lru_cache(maxsize=WAYS_KEPT)
def _movement(way: float, cells: int, limits: tuple[float, ...]) -> Movement:
    """Where moving doors get, in cells and perhaps at two limits with shares of rests.

    A movement has a destination, distributed as rests are. Of a door that moves up it lies above,
    and it rests there as soon as it gets so far. The ways of doors are absolute values of a
    Gaussian of a deviation, in cells.
    """
    rest = np.append(np.full(cells, (1.0 - sum(limits)) / cells), limits)
    places = np.append(np.arange(cells) + 0.5, [0.0, cells][: len(limits)])
    count = len(rest)
    own = np.where(np.arange(count) < cells, 0.5, 0.0) * np.eye(count)
    ahead, begins = places - places[:, None], list[FloatArray]()
    transition = np.zeros((DIRECTIONS, count, 1 + DIRECTIONS, count))
    for direction, sign in enumerate((1.0, -1.0)):
        off = sign * ahead if limits else (sign * ahead) % cells
        there = rest * ((off > 0.0) + own)  # of destinations
        every = there.sum(axis=1)
        begins.append(every)
        edges = np.array([off - 0.5, off, off + 0.5]) / (ROOT_2 * way)
        least, far, most = np.vectorize(math.erfc)(np.maximum(edges, 0.0))
        arrived = there * far
        lands = np.where(off >= 0.0, least - most, 0.0) * every
        lands[:, cells:] = 0.0
        remains = (every - arrived.sum(axis=1)) / np.maximum(lands.sum(axis=1), NEVER)
        past = np.maximum(every, NEVER)[:, None]
        transition[direction, :, 0] = arrived / past
        transition[direction, :, 1 + direction] = lands * remains[:, None] / past
        ended = every <= 0.0  # at the limit
        transition[direction, ended, 0] = np.eye(count)[ended]
    chosen = np.concatenate(begins / np.sum(begins, axis=0))
    return Movement(chosen, transition.reshape(2 * count, 3 * count))
