"""A door's joint posterior p(mode, s, d | z): a Gaussian mixture, given where the door may be.

The state s of a door is covered by cells between its limits, and by two atoms at the limits: a
latched door stands exactly there. Given a cell or an atom, three kinds of error are a Gaussian:
what the robot's pose is off, how far the state lies from the cell's middle, and where the hinge
really is. So a leaf seen as a line tells its angle and where it hangs, and the angle's variance
counts what isn't known of robot and hinge (Rao-Blackwellized; see docs/model.md).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import BuildingErrorSettings, DoorSettings
from objstate.geometry import FloatArray, wrap
from objstate.lazy import Later, altered, lazy
from objstate.objects.belief import ObjectBelief
from objstate.particles import Weights

if TYPE_CHECKING:
    from objstate.objects import mixture_kernels as kernels
    from objstate.objects.mixture_kernels import Beams, Noise
else:
    kernels = Later("objstate.objects.mixture_kernels")

SECONDS_PER_HOUR = 3600.0
CELL_DEG, CELL_M = 2.5, 0.05  # width of a cell, hinged and sliding; a scan is linear within one
OVERLAP = 0.6  # deviation of the state within a cell, in cells: their sum is nearly flat
LATCHES = 0.8  # probability that a door that comes to rest in the last cell before a limit is at it
FASTEST_S = 3.0  # s after which a door that moves may be anywhere
NEVER = 1e-30  # weight that no component falls below: what was impossible may come true


@dataclass(frozen=True)
class Doorway:
    """What of a door doesn't change: its cells, where they put the leaf, and how it moves."""

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
        """How many of the components are limits: the last ones."""
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
    def widths(self) -> FloatArray:
        """(c,) variances of the state within each component.

        Within an atom it is that of the limit's own place: the leaf is closed, but the bearing of
        the closed leaf isn't known exactly.
        """
        e = self.error
        limit = math.radians(e.bearing_std_deg) if self._hinged else e.hinge_std_m
        out = np.full(len(self.states), (OVERLAP * self.cell) ** 2)
        out[self.cells :] = limit**2
        return out

    @lazy
    def turn(self) -> float:
        """By how much the leaf turns in the building for each unit of the state."""
        return math.copysign(1.0, self.item.direction[2]) if self._hinged else 0.0

    @lazy
    def slide(self) -> FloatArray:
        """(2,) m by which it moves."""
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
        """(c,) where a door comes to rest that somebody has moved."""
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

    def wandered(self, moving: FloatArray, seconds: float) -> FloatArray:
        """(c,) where doors that move (c,) are after a while."""
        swing, count = self.settings.swing, self.cells
        fastest = math.radians(swing.most_deg_per_s) if self._hinged else swing.most_m_per_s
        std = max(fastest / 2.0 * min(seconds, FASTEST_S) / self.cell, 0.3)
        taps = _taps(round(std, 2), count)
        spread = moving[:count].copy()
        if self.atoms:
            spread[0] += moving[count]
            spread[-1] += moving[count + 1]
        out = np.zeros(len(self.states))
        if self.item.wraps:
            turned = np.fft.irfft(np.fft.rfft(spread) * np.fft.rfft(_circle(taps, count)), count)
            out[:count] = np.maximum(turned, 0.0)
        else:
            both = np.convolve(spread, taps)
            reach = len(taps) // 2
            out[:count] = both[reach : reach + count]
            out[0] += both[:reach].sum()
            out[count - 1] += both[reach + count :].sum()
        return out


class Moved(NamedTuple):
    """How the components' weights change as time goes by."""

    resting: FloatArray  # (c,)
    moving: FloatArray  # (c,)
    arriving: FloatArray  # (c,) share of a component's weight that wasn't there before


@dataclass(frozen=True, eq=False)
class DoorMixture:
    """p(mode, s, d | z) of one door. A value: updates return new ones."""

    door: Doorway
    resting: FloatArray  # (c,) weights of a door at rest; with those that move, they sum to one
    moving: FloatArray  # (c,) of one that is being moved
    means: FloatArray  # (c, 6) of errors, see ``mixture_kernels``
    covariances: FloatArray  # (c, 6, 6)
    stamp_ns: int | None = None

    @staticmethod
    def unknown(
        door: Doorway, hinge_variance: float, hinge: FloatArray | None = None
    ) -> DoorMixture:
        """Before any scan; the hinge may be known from before by its place (2,) m."""
        count = len(door.states)
        means, covariances = np.zeros((count, 6)), np.zeros((count, 6, 6))
        covariances[:, 3, 3] = door.widths
        covariances[:, 4, 4] = covariances[:, 5, 5] = hinge_variance
        if hinge is not None:
            means[:, 4:] = hinge - door.item.hinge
        return DoorMixture(door, door.prior, np.zeros(count), means, covariances)

    @staticmethod
    def of(door: Doorway, belief: ObjectBelief, hinge_variance: float) -> DoorMixture:
        """What a belief on a lattice says; of the hinge, where its object hangs."""
        blank = DoorMixture.unknown(door, hinge_variance, belief.item.hinge)
        states, weights = belief.states[:, 0], belief.weights.values
        where = np.floor((states - door.item.lower) / door.cell).astype(int)
        resting = np.bincount(where.clip(0, door.cells - 1), weights, len(door.states))
        if door.atoms:
            for atom, cell, edge in ((-2, 0, 0), (-1, door.cells - 1, -1)):
                resting[door.cells + 2 + atom] = weights[edge]
                resting[cell] -= weights[edge]
        swung = belief.swung if len(belief.swung) == len(weights) else np.zeros(len(weights))
        moving = np.bincount(where.clip(0, door.cells - 1), weights * swung, len(door.states))
        resting = np.maximum(resting - moving, NEVER)
        total = resting.sum() + moving.sum()
        return DoorMixture(
            door, resting / total, moving / total, blank.means, blank.covariances, belief.stamp_ns
        )

    @lazy
    def weights(self) -> FloatArray:
        """(c,) of the components, whether the door moves or not."""
        return self.resting + self.moving

    def later(self, seconds: float, kept: float, robot: FloatArray) -> DoorMixture:
        """The mixture after a while, in which somebody may have moved the door.

        The robot's errors are others by then: a share ``kept`` stays, and its covariance (3, 3)
        makes up for the rest.
        """
        means, covariances = self.means.copy(), self.covariances.copy()
        resting, moving = self.resting, self.moving
        if seconds > 0.0:
            moved = self._moved(seconds)
            mean, covariance = kernels.pooled(self.weights, means, covariances)
            kernels.join(moved.arriving, mean, covariance, self.door.widths, means, covariances)
            resting, moving = moved.resting, moved.moving
        kernels.renew_robot(means, covariances, kept, robot)
        return DoorMixture(self.door, resting, moving, means, covariances)

    def _moved(self, seconds: float) -> Moved:
        door, swing = self.door, self.door.settings.swing
        stays = math.exp(-door.settings.dynamics.moves_per_hour * seconds / SECONDS_PER_HOUR)
        resting = stays * self.resting
        swinging = door.wandered(self.moving + self.resting - resting, seconds)
        ends, leaves = (-math.expm1(-seconds / each) for each in (swing.seconds, swing.near_s))
        stops, swinging = ends * swinging, (1.0 - ends) * swinging
        near, count = stops.copy(), door.cells
        if door.atoms:
            near[count:] += LATCHES * near[[0, count - 1]]
            near[[0, count - 1]] *= 1.0 - LATCHES
        arrived = (1.0 - leaves) * near + leaves * stops.sum() * door.rest
        total = resting + arrived + swinging
        share = (arrived + swinging) / np.maximum(total, NEVER)
        return Moved(resting + arrived, swinging, share)

    def at(self, stamp_ns: int) -> DoorMixture:
        """The same at a moment."""
        return altered(self, stamp_ns=stamp_ns)

    def given(self, beams: Beams, noise: Noise, shape: kernels.Shape) -> tuple[DoorMixture, int]:
        """Bayes' rule for a scan, and the largest number of its beams that reach the leaf."""
        means, covariances = self.means.copy(), self.covariances.copy()
        log_evidence = np.empty(len(means))
        reached = kernels.condition(
            beams, shape, noise, self.door.placements, means, covariances, log_evidence
        )
        likelihood = np.exp(log_evidence - log_evidence.max())
        resting = np.maximum(self.resting * likelihood, NEVER)
        moving = self.moving * likelihood
        total = resting.sum() + moving.sum()
        after = DoorMixture(self.door, resting / total, moving / total, means, covariances)
        return after, int(reached)

    @lazy
    def hinge(self) -> tuple[FloatArray, FloatArray]:
        """Mean (2,) m of the hinge's offset from its place in the model, and covariance (2, 2)."""
        mean, covariance = kernels.pooled(self.weights, self.means, self.covariances)
        return mean[4:], covariance[4:, 4:]

    def on_lattice(self, lattice: ObjectBelief) -> ObjectBelief:
        """The posterior of the state alone, as weights of a lattice's states."""
        first, cell, wraps = lattice.lattice
        count, door = len(lattice.states), self.door
        bearing = door.widths[-1] if door.atoms else 0.0
        variances = self.covariances[: door.cells, 3, 3] + bearing
        states = door.states[: door.cells] + self.means[: door.cells, 3]
        weights, swung = np.empty(count), np.empty(count)
        kernels.read_off(
            self.moving[: door.cells] + NEVER, states, np.sqrt(variances), first, cell, wraps, swung
        )
        swung *= self.moving.sum()
        kernels.read_off(
            self.weights[: door.cells], states, np.sqrt(variances), first, cell, wraps, weights
        )
        if door.atoms:
            limits = self.weights[door.cells :]
            weights *= 1.0 - limits.sum()
            weights[0] += limits[0]
            weights[-1] += limits[1]
        weights /= weights.sum()
        swung = np.minimum(swung / np.maximum(weights, NEVER), 1.0)
        return altered(
            lattice, weights=Weights(weights), swung=swung, stamp_ns=self.stamp_ns, joint=self
        )


def _taps(std: float, most: int) -> FloatArray:
    """(2 r + 1,) a Gaussian of a deviation, in cells, cut off at its ends."""
    reach = min(math.ceil(4.0 * std), most)
    taps = np.exp(-0.5 * (np.arange(-reach, reach + 1) / std) ** 2)
    return np.asarray(taps / taps.sum())


def _circle(taps: FloatArray, count: int) -> FloatArray:
    """(count,) the same wrapped round a circle of so many cells."""
    reach = len(taps) // 2
    return np.bincount(np.arange(-reach, reach + 1) % count, taps, count).astype(float)
