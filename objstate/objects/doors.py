"""The lattice filter of a hinged or sliding door.

One degree of freedom is covered by samples at regular places, of which only the weights change.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.config import DoorSettings, Rest
from objstate.geometry import FloatArray, wrap
from objstate.lazy import Later, lazy
from objstate.objects.belief import ObjectBelief
from objstate.objects.evidence import ScanEvidence, Update
from objstate.particles import Weights

if TYPE_CHECKING:
    from objstate.objects import lattice, mixture
else:
    lattice = Later("objstate.objects.lattice")
    mixture = Later("objstate.objects.mixture")

FINE = 50  # most states with weight that are cast; of more, a regular selection
NEGLIGIBLE = 1e-4  # weight, relative to the largest, below which a state is cast only coarsely
AJAR = 0.2  # how often a hinged door is left ajar, for each time that it is closed
AJAR_DEG = 1.0, 6.0  # at angles between these: its bolt rests on the strike plate
COARSE = 0.05  # m between states that are cast whatever their weight, at a leaf's outer edge


@dataclass(frozen=True)
class LatticeFilter:
    """A hinged or sliding door: samples at regular angles or offsets between the limits."""

    item: MovableObject
    settings: DoorSettings

    @property
    def _hinged(self) -> bool:
        return self.item.kind is Kind.HINGED

    @lazy
    def _states(self) -> FloatArray:
        """(n,) from limit to limit, so that a door at its stop lies on a sample."""
        s = self.settings
        resolution = np.radians(s.resolution_deg) if self._hinged else s.resolution_m
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
        """(n, 2) the direction across the leaf in each state, seen from above."""
        across, _ = leaf_axes(self.item)
        turns = self.item.transforms(self._states[:, None])[:, :2, :2]
        return np.asarray(turns @ across)

    @lazy
    def _prior_weights(self) -> FloatArray:
        if self.settings.prior == "uniform":
            return self._rest_weights
        weights = gaussian_prior(self.item, self.settings, self._states) + np.finfo(float).tiny
        return np.asarray(weights / weights.sum())

    @lazy
    def _rest_weights(self) -> FloatArray:
        """(n,) distribution of the state after a move: at a limit, or anywhere between."""
        count, item = len(self._states), self.item
        if item.wraps:
            return np.full(count, 1.0 / count)
        edges = np.append(self._states, item.upper + self._spacing) - self._spacing / 2.0
        between, limits = rest_shares(item, self.settings.rest, edges)
        between[[0, -1]] += limits
        return np.asarray(between / between.sum())

    def predict(
        self, belief: ObjectBelief, seconds: float, rng: np.random.Generator
    ) -> ObjectBelief:
        """The prediction: drift and moves."""
        moved, begun = belief.p_moving, self.settings.dynamics.moved(seconds)
        if isinstance(belief.joint, mixture.DoorMixture):
            begun = belief.joint.begun(seconds)
        return self._later(belief, belief.weights.values, moved, begun, self._rest_weights, seconds)

    def carried(
        self, belief: ObjectBelief, kept: FloatArray, rest: FloatArray, seconds: float
    ) -> ObjectBelief:
        """The belief after some time, given the probability (n,) of staying in each state.

        Where it was moved it rests after ``rest`` (n,), which sums to one.
        """
        stays = belief.weights.values * kept
        total = float(stays.sum())
        weights = stays / total if total > 0.0 else rest
        return self._later(belief, weights, np.zeros(1), 1.0 - total, rest, seconds)

    def _later(
        self,
        belief: ObjectBelief,
        before: FloatArray,
        moving: FloatArray,
        begun: float,
        rest: FloatArray,
        seconds: float,
    ) -> ObjectBelief:
        """The prediction of weights ``before`` (n,), see ``lattice.predict``."""
        weights, p_moving = np.empty(len(belief.states)), np.empty(len(belief.states))
        mean, std = lattice.predict(
            before,
            moving,
            *belief.lattice,
            self._cells_per_second * seconds,
            begun,
            seconds,
            self._swing,
            rest,
            weights,
            p_moving,
        )
        return belief.on_lattice(weights, mean, std, p_moving=p_moving)

    @lazy
    def distances(self) -> FloatArray:
        """(n,) rad or m of each state from the closed one, along the way that the door opens."""
        off = self._states - self.item.home[0]
        return np.abs(wrap(off) if self.item.wraps else off)

    @property
    def rests(self) -> FloatArray:
        """(n,) where a door comes to rest by its settings; sums to one."""
        return self._rest_weights

    @lazy
    def _swing(self) -> FloatArray:
        """(3,) how the door moves while it is being moved, as the loops take it."""
        swing = self.settings.swing
        return np.array([swing.seconds, swing.near_s, swing.most(self._hinged) / self._spacing])

    @lazy
    def _cells_per_second(self) -> float:
        """The variance of the drift, in cells squared."""
        drift, _, turn = self.settings.dynamics.drift
        return ((turn if self._hinged else drift) / self._spacing) ** 2

    def update(
        self, belief: ObjectBelief, evidence: ScanEvidence, rng: np.random.Generator
    ) -> Update | None:
        """Bayes' rule on the lattice, cast finely only where the belief has weight.

        Between the states that are cast, the likelihood is interpolated.
        """
        chosen = lattice.worth_casting(belief.weights.values, NEGLIGIBLE, FINE, self._coarsely)
        states, normals = belief.states.take(chosen, axis=0), self._normals.take(chosen, axis=0)
        log_likelihood, bears = evidence.cast(states, normals)
        if np.count_nonzero(bears) == 0:
            return None
        log_evidence, weights = np.empty(len(log_likelihood)), np.empty(len(belief.states))
        mean, std = lattice.condition(
            belief.weights.values,
            chosen,
            log_likelihood,
            evidence.robot_weights.values,
            *belief.lattice,
            log_evidence,
            weights,
        )
        after = belief.on_lattice(weights, mean, std, last_observed_ns=belief.stamp_ns)
        return Update(after, log_evidence, bears)

    @lazy
    def _width(self) -> float:
        """m from the hinge to the leaf's outer edge, seen from above."""
        plan = self.item.mesh.vertices[:, :2]
        return float(np.hypot(plan[:, 0], plan[:, 1]).max())

    @lazy
    def _coarsely(self) -> int:
        """One of so many states is cast whatever its weight."""
        return max(int(COARSE / (self._spacing * (self._width if self._hinged else 1.0))), 1)


def gaussian_prior(item: MovableObject, settings: DoorSettings, states: FloatArray) -> FloatArray:
    """Densities (n,), up to a factor, of a door's states (n,) by a Gaussian about its prior mean."""
    mean, std = settings.prior_mean_m, settings.prior_std_m
    if item.kind is Kind.HINGED:
        mean = None if settings.prior_mean_deg is None else math.radians(settings.prior_mean_deg)
        std = math.radians(settings.prior_std_deg)
    off = states - (item.home[0] if mean is None else mean)
    off = wrap(off) if item.wraps else off
    return np.asarray(np.exp(-0.5 * (off / std) ** 2))


def rest_shares(
    item: MovableObject, rest: Rest, edges: FloatArray
) -> tuple[FloatArray, tuple[float, float]]:
    """Shares of resting doors in each cell between the ``edges`` (n + 1,), and at both limits.

    Closed is the limit nearer to home. Of the hinged doors that somebody closed, some stand ajar.
    """
    closed_is_first = abs(item.lower - item.home[0]) <= abs(item.upper - item.home[0])
    ajar, closed = np.zeros(len(edges) - 1), rest.closed
    if item.kind is Kind.HINGED:
        least, most = np.radians(AJAR_DEG)
        opened = edges - item.lower if closed_is_first else item.upper - edges
        ajar = np.abs(np.diff(opened.clip(least, most))) / (most - least)
        ajar *= rest.closed * AJAR / (1.0 + AJAR)
        closed -= float(ajar.sum())
    between = ajar + rest.anywhere / len(ajar)
    return between, (closed, rest.open) if closed_is_first else (rest.open, closed)


def leaf_axes(item: MovableObject) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (2,) across a leaf and along it; in its link's frame, from above."""
    _, axes = np.linalg.eigh(np.cov(item.mesh.vertices[:, :2].T))
    across, along = axes.T
    return across, along
