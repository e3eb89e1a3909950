"""The filter of a hinged or sliding door.

One degree of freedom is covered by samples at regular places, whose weights
alone change: nothing is ever lost between them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import DoorSettings
from objstate.geometry import FloatArray, IntArray, wrap
from objstate.lazy import lazy
from objstate.objects.belief import ObjectBelief
from objstate.objects.conditional import ConditionalBelief, Update
from objstate.objects.evidence import ScanEvidence
from objstate.particles import Weights

SECONDS_PER_HOUR = 3600.0
# Where beams spread evenly over a leaf, a shift turns it by 1.5 over its width; leaf and robot are
# off by themselves, as their squares add up.
LEAN = 1.5 * 2.0**0.5
FINE = 50  # states with weight that are cast at most; of more, an even comb
NEGLIGIBLE = 1e-4  # weight, relative to the largest, below which a state is cast only coarsely
PARTS = 6  # in which a cell is taken where a belief is narrowed
BLURRED = 0.25  # of a cell, squared: the variance that its width and its parts' places on the lattice make
NARROWEST = 0.01  # of a variance, to which a belief is narrowed at most
TINY = np.finfo(float).tiny
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
        return self._later(belief, nobody, seconds, 0.0, np.arange(0))[0]

    def predict_each(
        self,
        believed: ConditionalBelief,
        seconds: float,
        rng: np.random.Generator,
        forgotten: float = 0.0,
        ancestors: IntArray | None = None,
    ) -> ConditionalBelief:
        if ancestors is None:
            ancestors = np.arange(len(believed.given))
        before = believed.belief
        belief, given = self._later(before, believed.given, seconds, forgotten, ancestors)
        presence = believed.presence[ancestors]  # all the same: nobody doubts that a door is there
        return ConditionalBelief(belief, given, presence, believed.hidden_by(forgotten))

    def _later(
        self,
        belief: ObjectBelief,
        given: FloatArray,
        seconds: float,
        forgotten: float,
        ancestors: IntArray,
    ) -> tuple[ObjectBelief, FloatArray]:
        """A belief, and what rows (l, n) hand on (l', n), after a while: the door drifts, or somebody has moved it."""
        from objstate.objects.kernels import predict

        dynamics, swing = self.settings.dynamics, self.settings.swing
        begun = -math.expm1(-dynamics.moves_per_hour * seconds / SECONDS_PER_HOUR)
        swung, resting = apart(belief)
        stayed = (1.0 - begun) * (1.0 - float(swung.sum()))
        moved = self._moved(swung + begun * (belief.weights.values - swung), seconds)
        goes_on = math.exp(-seconds / swing.seconds)
        weights = np.empty(len(belief.states))
        later = np.empty((len(ancestors), len(weights)))
        mean, std = predict(
            given,
            belief.weights.values,
            resting,
            forgotten,
            ancestors,
            *belief.lattice,
            self._cells_per_second * seconds,
            stayed,
            moved / max(1.0 - stayed, TINY),
            later,
            weights,
        )
        return belief.on_lattice(weights, mean, std, swung=goes_on * moved), later

    def _moved(self, swung: FloatArray, seconds: float) -> FloatArray:
        """(n,) where what is being moved, with weights (n,) of any sum, is after a while: near, or where doors come to rest."""
        from objstate.objects.kernels import moved

        hinged, swing = self.item.kind is Kind.HINGED, self.settings.swing
        near, later = math.exp(-seconds / swing.near_s), np.empty(len(swung))
        speed = math.radians(swing.most_deg_per_s) if hinged else swing.most_m_per_s
        reach = 1 if near < NEGLIGIBLE else max(round(speed * seconds / self._spacing), 1)
        moved(swung, reach, near, self._rest_weights, self.item.wraps, later)
        return later

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
        from objstate.objects.kernels import condition, worth_casting

        belief = believed.belief
        chosen, whole = worth_casting(belief.weights.values, NEGLIGIBLE, FINE, self._coarsely)
        log_likelihood, bears = evidence.cast(belief.states[chosen], whole, self._normals[chosen])
        if not bears.any():
            return None
        given, log_evidence = np.empty_like(believed.given), np.empty(len(believed.given))
        weights = np.empty(given.shape[1])
        mean, std = condition(
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
        belief = belief.on_lattice(
            weights,
            mean,
            std,
            last_observed_ns=belief.stamp_ns,
            swung=still_swung(belief, weights),
        )
        after = ConditionalBelief(belief, given, believed.presence, believed.inherited)
        return Update(after, log_evidence, bears)

    def widened(self, belief: ObjectBelief, factor: float, std_m: float) -> ObjectBelief:
        """A hinged leaf that hangs aside reads turned by what the shift is to its mean lever."""
        from objstate.objects.kernels import widen

        lever, power = self._width / LEAN, 1.0
        more = (std_m / lever if self.item.kind is Kind.HINGED else std_m) ** 2
        if belief.settled:
            variance, factor = float(belief.std[0]) ** 2, float(belief.kept_of(factor)[0])
            if factor < 1.0:
                more -= BLURRED * self._spacing**2  # by which the lattice widens it by itself
                power = 1.0 / max(factor + min(more, 0.0) / variance, NARROWEST)
                more = max(more, 0.0)
            else:
                more += (factor - 1.0) * variance
        cells, weights = more / self._spacing**2, np.empty(len(belief.states))
        mean, std = widen(belief.weights.values, power, PARTS, cells, *belief.lattice, weights)
        return belief.on_lattice(weights, mean, std)

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


def apart(belief: ObjectBelief) -> tuple[FloatArray, FloatArray]:
    """Of a door's weights, what is being moved (n,), and the share that isn't (n,) in each state."""
    weights, swung = belief.weights.values, belief.swung
    if swung is None:
        return np.zeros(len(weights)), np.ones(len(weights))
    return swung, np.maximum(1.0 - swung / np.maximum(weights, TINY), TINY)


def still_swung(predicted: ObjectBelief, weights: FloatArray) -> FloatArray | None:
    """(n,) of weights (n,) that a scan gives a door's states, what is being moved."""
    if predicted.swung is None:
        return None
    share = predicted.swung / np.maximum(predicted.weights.values, TINY)
    return np.asarray(np.minimum(share, 1.0) * weights)


def leaf_axes(item: MovableObject) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (2,) across a leaf, where it is thin, and along it; in its link's frame, from above."""
    _, axes = np.linalg.eigh(np.cov(item.mesh.vertices[:, :2].T))
    across, along = axes.T
    return across, along
