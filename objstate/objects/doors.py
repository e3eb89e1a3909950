"""The filter of a hinged or sliding door.

One degree of freedom is covered by samples at regular places, whose weights
alone change: nothing is ever lost between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import DoorSettings
from objstate.geometry import FloatArray, wrap
from objstate.lazy import Later, lazy
from objstate.objects.belief import CENTRAL, ObjectBelief, within_limits
from objstate.objects.conditional import SAME, ConditionalBelief, Descent, Update
from objstate.objects.evidence import ScanEvidence
from objstate.particles import Weights

if TYPE_CHECKING:
    from objstate.objects import kernels
else:
    kernels = Later("objstate.objects.kernels")

SECONDS_PER_HOUR = 3600.0
# Where beams spread evenly over a leaf, a shift turns it by 1.5 over its width; leaf and robot are
# off by themselves, as their squares add up.
LEAN = 1.5 * 2.0**0.5
# Along its rail, so are they, and nothing turns; and of what walls are off along their normals, half is told once
# the robot has followed them.
ALONG = 2.0 * 2.0**0.5
FINE = 50  # states with weight that are cast at most; of more, an even comb
NEGLIGIBLE = 1e-4  # weight, relative to the largest, below which a state is cast only coarsely
PARTS = 6  # in which a cell is taken where a belief is narrowed
BLURRED = 0.25  # of a cell, squared: the variance that its width and its parts' places on the lattice make
NARROWEST = 0.01  # of a variance, to which a belief is narrowed at most
COARSE = 0.05  # m between states that are cast whatever their weight, at a leaf's outer edge


@dataclass(frozen=True)
class LatticeFilter:
    """A hinged or sliding door: samples at regular angles or offsets between the limits."""

    item: MovableObject
    settings: DoorSettings

    @lazy
    def _states(self) -> FloatArray:
        """(n,) from limit to limit, so that a door at its stop lies on a sample."""
        s, hinged = self.settings, self.item.kind is Kind.HINGED
        resolution = np.radians(s.resolution_deg) if hinged else s.resolution_m
        span = self.item.upper - self.item.lower
        cells = max(int(np.ceil(span / resolution)), 1)
        return np.linspace(
            self.item.lower, self.item.upper, cells + 1, endpoint=not self.item.wraps
        )

    @lazy
    def _spacing(self) -> float:
        """rad or m between neighbouring states."""
        return float(self._states[1] - self._states[0])

    def prior(self, rng: np.random.Generator) -> ObjectBelief:
        states = self._states
        return ObjectBelief(
            item=self.item,
            states=states[:, None],
            weights=Weights.of(self._prior_weights),
            cell=np.array([self._spacing]),
        )

    @lazy
    def _normals(self) -> FloatArray:
        """(n, 2) the direction in which the leaf is thin, in each state, seen from above."""
        across, _ = leaf_axes(self.item)
        turns = self.item.transforms(self._states[:, None])[:, :2, :2]
        return np.asarray(turns @ across)

    @lazy
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

    @lazy
    def _rest_weights(self) -> FloatArray:
        """(n,) where a door comes to rest that somebody has moved: closed, open, or anywhere."""
        rest, states, closed = self.settings.rest, self._states, self.item.home[0]
        anywhere = np.full(len(states), 1.0 / len(states))
        if self.item.wraps:
            return anywhere
        std = np.radians(rest.std_deg) if self.item.kind is Kind.HINGED else rest.std_m
        weights = rest.anywhere * anywhere
        opened = max(self.item.lower, self.item.upper, key=lambda limit: abs(limit - closed))
        for place, share in ((closed, rest.closed), (opened, rest.open)):
            peak = np.exp(-0.5 * ((states - place) / std) ** 2)
            weights = weights + share * peak / peak.sum()
        return np.asarray(weights / weights.sum())

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        nobody = np.empty((0, len(belief.states)))
        return self._later(belief, nobody, seconds, SAME)[0]

    def drift_variance(self, seconds: float) -> FloatArray:
        return np.array([self._cells_per_second * seconds * self._spacing**2])

    def predict_each(
        self,
        believed: ConditionalBelief,
        seconds: float,
        rng: np.random.Generator,
        descent: Descent = SAME,
        drift: float = 1.0,
    ) -> ConditionalBelief:
        belief, given = self._later(believed.belief, believed.given, seconds, descent, drift)
        presence = believed.presence  # nobody doubts that a door is there
        if len(presence) != len(given):
            presence = np.full(len(given), belief.presence)
        return ConditionalBelief(belief, given, presence, believed.hidden_by(descent.forgotten))

    def _later(
        self,
        belief: ObjectBelief,
        given: FloatArray,
        seconds: float,
        descent: Descent,
        drift: float = 1.0,
    ) -> tuple[ObjectBelief, FloatArray]:
        """A belief, and what rows (l, n) hand on (l', n), after a while: the door drifts, or somebody moves it."""
        before, ancestors = belief.weights.values, descent.of(len(given))
        weights, swung = np.empty(len(before)), np.empty(len(before))
        later = np.empty((len(ancestors), len(before)))
        mean, std = kernels.predict(
            given,
            before,
            belief.swung,
            descent.forgotten,
            ancestors,
            *belief.lattice,
            self._cells_per_second * drift * seconds,
            1.0 - self.stayed(seconds),
            seconds,
            self._swing,
            self._rest_weights,
            later,
            weights,
            swung,
        )
        return belief.on_lattice(weights, mean, std, swung=swung), later

    @lazy
    def _swing(self) -> FloatArray:
        """(3,) how the door moves while somebody moves it, as the loops take it."""
        swing, hinged = self.settings.swing, self.item.kind is Kind.HINGED
        most = math.radians(swing.most_deg_per_s) if hinged else swing.most_m_per_s
        return np.array([swing.seconds, swing.near_s, most / self._spacing])

    def stayed(self, seconds: float) -> float:
        """Probability that nobody has moved the door for so long."""
        return math.exp(-self.settings.dynamics.moves_per_hour * seconds / SECONDS_PER_HOUR)

    @lazy
    def _cells_per_second(self) -> float:
        """The variance of the drift, in cells squared."""
        dynamics, hinged = self.settings.dynamics, self.item.kind is Kind.HINGED
        drift = math.radians(dynamics.drift_deg) if hinged else dynamics.drift_m
        return (drift / self._spacing) ** 2

    def update(
        self, believed: ConditionalBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> Update | None:
        """Bayes' rule on the lattice, which is cast finely only where the belief has weight.

        Between the states that are cast, the likelihood is linear.
        """
        belief = believed.belief
        chosen, whole = kernels.worth_casting(
            belief.weights.values, NEGLIGIBLE, FINE, self._coarsely
        )
        states, normals = belief.states.take(chosen, axis=0), self._normals.take(chosen, axis=0)
        log_likelihood, bears = evidence.cast(states, whole, normals)
        if np.count_nonzero(bears) == 0:
            return None
        given, log_evidence = np.empty_like(believed.given), np.empty(len(believed.given))
        weights = np.empty(given.shape[1])
        mean, std = kernels.condition(
            believed.given,
            chosen,
            whole,
            log_likelihood,
            evidence.robot_weights.values,
            *belief.lattice,
            given,
            log_evidence,
            weights,
        )
        belief = belief.on_lattice(weights, mean, std, last_observed_ns=belief.stamp_ns)
        after = ConditionalBelief(belief, given, believed.presence, believed.inherited)
        return Update(after, log_evidence, bears)

    def widened(self, belief: ObjectBelief, factor: float, std_m: float) -> ObjectBelief:
        more, power = (self._off_per_shift * std_m) ** 2, 1.0
        if belief.settled:
            variance, factor = float(belief.std[0]) ** 2, belief.kept_of(factor)[0]
            if factor < 1.0:
                more -= BLURRED * self._spacing**2  # by which the lattice widens it by itself
                power = 1.0 / max(factor + min(more, 0.0) / variance, NARROWEST)
                more = max(more, 0.0)
            else:
                more += (factor - 1.0) * variance
        cells, weights = more / self._spacing**2, np.empty(len(belief.states))
        (mean, std), bounds = kernels.widen(
            belief.weights.values,
            power,
            PARTS,
            cells,
            *belief.lattice,
            (1.0 - CENTRAL) / 2.0,
            weights,
        )
        known = {} if self.item.wraps else {"central": within_limits(self.item, *bounds)}
        return belief.on_lattice(weights, mean, std, **known)

    @lazy
    def _off_per_shift(self) -> float:
        """By how much a leaf reads off, rad or m, for each m that walls are off.

        A hinged one that hangs aside reads turned by what the shift is to its mean lever.
        """
        return LEAN / self._width if self.item.kind is Kind.HINGED else ALONG

    @lazy
    def _width(self) -> float:
        """m from the hinge to the leaf's outer edge, seen from above."""
        plan = self.item.mesh.vertices[:, :2]
        return float(np.hypot(plan[:, 0], plan[:, 1]).max())

    @lazy
    def _coarsely(self) -> int:
        """Of how many states one is cast whatever its weight."""
        hinged = self.item.kind is Kind.HINGED
        return max(int(COARSE / (self._spacing * (self._width if hinged else 1.0))), 1)


def leaf_axes(item: MovableObject) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (2,) across a leaf, where it is thin, and along it; in its link's frame, from above."""
    _, axes = np.linalg.eigh(np.cov(item.mesh.vertices[:, :2].T))
    across, along = axes.T
    return across, along
