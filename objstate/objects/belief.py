"""The object belief p(s): weighted samples over an object's state, and what follows from them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from operator import le
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.errors import QueryError
from objstate.geometry import BoolArray, FloatArray, wrap
from objstate.lazy import Later, altered, lazy
from objstate.objects.footprint import footprint
from objstate.objects.passage import clear_widths, lattice_clear_widths
from objstate.particles import Weights, evenly, quantiles
from objstate.records import Estimate
from objstate.sensing import UncertainObject

if TYPE_CHECKING:
    from objstate.objects import lattice, sampling
    from objstate.objects.furniture_mixture import FurnitureMixture
    from objstate.objects.mixture import DoorMixture
    from objstate.objects.steps import Past
else:
    lattice = Later("objstate.objects.lattice")
    sampling = Later("objstate.objects.sampling")

CENTRAL = 0.9  # probability between lower and upper
SETTLED_ANGLE = np.radians(5.0)  # rad; a state with a smaller deviation counts as certain
SETTLED_LENGTH = 0.05  # m
LARGEST = 20.0  # m, of robots that pass doors
ROUNDING = 1e-12  # rounding error of sums of weights
SETTLED = {  # largest deviation of a certain state, by coordinate
    Kind.HINGED: (SETTLED_ANGLE,),
    Kind.SLIDING: (SETTLED_LENGTH,),
    Kind.PLANAR: (SETTLED_LENGTH, SETTLED_LENGTH, SETTLED_ANGLE),
}


@dataclass(frozen=True, eq=False)
class Distribution:
    """Weighted samples of one number."""

    values: FloatArray  # (n,)
    weights: FloatArray  # (n,) sum to one

    @property
    def mean(self) -> float:
        """The expected value, in the unit of the values."""
        return float(self.weights @ self.values)

    @property
    def std(self) -> float:
        """The standard deviation, in the unit of the values."""
        return float(np.sqrt(self.weights @ (self.values - self.mean) ** 2))

    def interval(self, share: float = CENTRAL) -> tuple[float, float]:
        """Lower and upper bound of the central ``share``.

        Raises QueryError as ``checked_share`` does.
        """
        share = checked_share(share)
        tails = np.array([(1.0 - share) / 2.0, (1.0 + share) / 2.0])
        lower, upper = quantiles(self.values, self.weights, tails)
        return float(lower), float(upper)

    def probability_above(self, value: float) -> float:
        """Probability of at least ``value``."""
        return min(float(self.weights[self.values >= value].sum()), 1.0)  # sums are rounded


@dataclass(frozen=True, eq=False)
class ObjectBelief:
    """Weighted samples of one object's state. A value: updates return new ones."""

    item: MovableObject
    states: FloatArray  # (n, d)
    weights: Weights  # (n,)
    cell: FloatArray  # (d,) width of the cell of a sample; zero for free samples
    # probability that furniture is there, on which its states are conditioned; that beams meet a
    # door's leaf, on which its states aren't
    presence: float = 1.0
    stamp_ns: int | None = None  # None before the first update
    last_observed_ns: int | None = None
    p_moving: FloatArray = field(  # (n,) or (1,), probability in each state that a door is moving
        default_factory=partial(np.zeros, 1)
    )
    # the mixture it was computed from, if any
    joint: DoorMixture | FurnitureMixture | None = None
    attributes: Mapping[str, Mapping[str, float]] = field(  # such as class: {cup: 0.7, mug: 0.3}
        default_factory=dict
    )
    past: Past | None = None  # earlier steps, where the estimator keeps them for smoothing

    @property
    def wraps(self) -> BoolArray:
        """(d,) which coordinates are directions, where -pi and pi are equal."""
        if self.item.kind is Kind.PLANAR:
            return np.array([False, False, True])
        return np.array([self.item.wraps])

    @lazy
    def lattice(self) -> tuple[float, float, bool]:
        """The first of a door's states, their spacing, and whether the last is beside the first."""
        return float(self.states[0, 0]), float(self.cell[0]), self.item.wraps

    def with_weights(self, weights: Weights) -> ObjectBelief:
        """The same states with other weights (n,)."""
        return altered(self, weights=weights)

    def on_lattice(self, weights: FloatArray, mean: float, std: float, **also: Any) -> ObjectBelief:
        """A door's belief with other weights (n,), given their mean and standard deviation.

        ``also`` are other fields, and what else is known.
        """
        known = {"mean": np.array([mean]), "std": np.array([std]), "lattice": self.lattice}
        return altered(self, weights=Weights(weights), joint=None, **known, **also)

    def with_samples(self, states: FloatArray, weights: Weights) -> ObjectBelief:
        """Other states (n, d) with their weights (n,), and all else as it is."""
        return altered(self, states=states, weights=weights, joint=None)

    @lazy
    def mean(self) -> FloatArray:
        """(d,) of directions the circular mean.

        Of furniture with several equal headings, states count as the one nearest to the modelled
        heading.
        """
        return self._moments[0]

    @lazy
    def _moments(self) -> tuple[FloatArray, FloatArray]:
        """Mean (d,) and standard deviations (d,)."""
        if self.item.kind is not Kind.PLANAR:
            mean, std = lattice.moments(self.weights.values, *self.lattice)
            return np.array([mean]), np.array([std])
        middle, off, symmetry = np.empty(3), np.empty(3), self.item.symmetry
        home = float(self.item.home[2])
        sampling.moments(
            self.states, self.weights.values, home, symmetry.order, symmetry.centre, middle, off
        )
        return middle, off

    @lazy
    def deviations(self) -> FloatArray:
        """(n, d) samples relative to the mean; directions the shorter way round."""
        if self.item.kind is Kind.PLANAR:
            off, symmetry = np.empty_like(self.states), self.item.symmetry
            sampling.offsets(self.states, self.mean, symmetry.order, symmetry.centre, off)
            return off
        return self.relative_to(self.mean)

    def relative_to(self, state: FloatArray) -> FloatArray:
        """(n, 1) samples of a door relative to a state (1,); the shorter way round if it wraps."""
        off = self.states - state
        return wrap(off) if self.item.wraps else off

    def unfolded(self) -> ObjectBelief:
        """The same belief with all states that look alike: a square table has four equal headings.

        The filters keep one of them, as no reading distinguishes them.
        """
        if self.item.kind is not Kind.PLANAR:
            return self
        equals = self.item.symmetry.equals(self.states)
        weights = np.tile(self.weights.values, len(equals))
        return self.with_samples(equals.reshape(-1, 3), Weights.of(weights))

    @lazy
    def std(self) -> FloatArray:
        """(d,) standard deviations, the width of a sample's cell included."""
        return self._moments[1]

    def interval(self, share: float = CENTRAL) -> tuple[FloatArray, FloatArray]:
        """Lower and upper bounds (d,) of the central ``share`` of the posterior.

        A direction's bounds lie around its mean and may pass pi. Raises QueryError for a share
        that isn't above 0 and at most 1.
        """
        if share == CENTRAL:
            return self.central
        return self._interval(checked_share(share))

    @lazy
    def central(self) -> tuple[FloatArray, FloatArray]:
        """The bounds (d,) of ``CENTRAL``, as of any share."""
        if self._is_line:
            return self._interval_on_line(_tails(CENTRAL)[0])
        lower, _, upper = self._usual_quantiles
        return lower, upper

    @lazy
    def _usual_quantiles(self) -> FloatArray:
        """(3, d) the lower bounds of ``CENTRAL``, medians and upper bounds, not on a line."""
        below, above = _tails(CENTRAL)
        return self._quantiles_of((below, 0.5, above))

    @lazy
    def median(self) -> FloatArray:
        """(d,) of each coordinate. A direction's lies near its mean, and may pass pi.

        A door whose median lies in the cell at a limit stands at the limit.
        """
        if not self._is_line:
            return np.asarray(self._usual_quantiles[1])
        middle, _ = lattice.interval(self.weights.values, *self.lattice[:2], 0.5)
        item, half = self.item, self.cell[0] / 2
        limits = [limit for limit in (item.lower, item.upper) if abs(middle - limit) <= half]
        return np.array([*limits, middle][:1])

    def _interval(self, share: float) -> tuple[FloatArray, FloatArray]:
        if self._is_line:
            return self._interval_on_line(_tails(share)[0])
        lower, upper = self._quantiles_of(_tails(share))
        return lower, upper

    def _quantiles_of(self, shares: Sequence[float]) -> FloatArray:
        """(q, d) quantiles of each coordinate; a direction's lie around its mean."""
        off = [self._quantiles(k, np.array(shares)) for k in range(self.states.shape[1])]
        return np.asarray(self.mean + np.transpose(off))

    @property
    def _is_line(self) -> bool:
        """Whether the states are a lattice between two limits."""
        return self.cell[0] > 0.0 and not self.item.wraps

    def _interval_on_line(self, tail: float) -> tuple[FloatArray, FloatArray]:
        return within_limits(
            self.item, *lattice.interval(self.weights.values, *self.lattice[:2], tail)
        )

    def _quantiles(self, coordinate: int, shares: FloatArray) -> FloatArray:
        values, weights = self.deviations[:, coordinate], self.weights.values
        width = self.cell[coordinate]
        if width == 0.0:
            return quantiles(values, weights, shares)
        order = np.argsort(values, kind="stable")  # the mass of each cell is spread over its width
        edges = np.append(values[order] - width / 2, values[order[-1]] + width / 2)
        filled = np.concatenate([[0.0], np.cumsum(weights[order])])
        return np.asarray(np.interp(shares, filled, edges))

    @lazy
    def clear_width(self) -> Distribution:
        """The passage that a door's leaf leaves free, m. Raises BuildingError for furniture."""
        return self.clear_width_for(0.0)

    def clear_width_for(self, length: float) -> Distribution:
        """The same for a robot of a length, m, that drives straight through; 0 is a disc.

        Raises BuildingError for furniture, QueryError as ``check_robot`` does.
        """
        check_robot(0.0, length)
        if self.item.kind is Kind.PLANAR or self.cell[0] == 0.0:
            widths = clear_widths(self.item, self.states, length)
        else:
            first, last = float(self.states[0, 0]), float(self.states[-1, 0])
            widths = lattice_clear_widths(self.item, first, last, len(self.states), length)
        return Distribution(widths, self.weights.values)

    def probability_clear(self, width: float, length: float = 0.0) -> float:
        """Probability that a passage of ``width`` m is free at a door.

        A robot that isn't round gives its ``length`` m too (see ``passage.clear_widths``).
        Raises BuildingError for furniture, QueryError as ``check_robot`` does.
        """
        check_robot(width, length)
        passage = self.clear_width if length == 0.0 else self.clear_width_for(length)
        return passage.probability_above(width)

    def footprint(self, probability: float = CENTRAL) -> FloatArray:
        """Convex polygon (k, 2) m, counter-clockwise, that holds the object with a probability.

        Of furniture it is conditioned on its being there (``presence``). Raises QueryError for a
        probability that isn't above 0 and at most 1.
        """
        return footprint(self.item, self._most_central(probability))

    def _most_central(self, probability: float) -> FloatArray:
        """The states (m, d) nearest to the mean that together have the probability.

        Distances are in units of the belief's covariance. Of a lattice, both ends of each sample's
        cell are given.
        """
        probability = checked_share(probability)
        weights, off = self.weights.values, self.deviations
        covariance = (weights[:, None] * off).T @ off
        tiny = np.finfo(float).eps * (1.0 + np.trace(covariance))
        root = np.linalg.cholesky(covariance + tiny * np.eye(len(covariance)))
        order = np.argsort((np.linalg.solve(root, off.T) ** 2).sum(axis=0), kind="stable")
        filled = np.cumsum(weights[order])
        enough = int(np.searchsorted(filled, probability * filled[-1] - ROUNDING)) + 1
        states = self.states[order[:enough]]
        if not self.cell.any():
            return states
        ends = np.concatenate([states - self.cell / 2, states + self.cell / 2])
        return ends if self.item.wraps else ends.clip(self.item.lower, self.item.upper)

    @property
    def probability_closed(self) -> float | None:
        """Probability that a door stands at the limit at which the model shows it; else None.

        The lattice's state at that limit represents the limit itself.
        """
        item = self.item
        if item.kind is Kind.PLANAR or item.wraps or self.cell[0] == 0.0:
            return None
        home = item.home[0]
        if home not in (item.lower, item.upper):
            return None
        return float(self.weights.values[0 if home == item.lower else -1])

    @lazy
    def is_certain(self) -> bool:
        """Whether the object certainly is there, in a state certain enough for a scene."""
        if self.presence < 0.5:
            return False
        return all(map(le, self.std.tolist(), SETTLED[self.item.kind]))

    def represented_by(self, count: int) -> UncertainObject:
        """A few states that represent the belief: the mean if certain, else a systematic sample."""
        name = self.item.name
        if self.is_certain:
            return UncertainObject(name, self.mean[None], np.array([self.presence]))
        states = self.states[evenly(self.weights, count)]
        return UncertainObject(name, states, np.full(count, self.presence / count))

    @property
    def best(self) -> FloatArray:
        """(d,) the most probable state: the mean of a unimodal belief, else the heaviest sample."""
        if self.is_certain:
            return self.mean
        return np.asarray(self.states[int(np.argmax(self.weights.log))])

    def estimates(self, fit: float | None, lost: bool = False) -> list[Estimate]:
        """The belief as rows, one for each coordinate.

        ``fit`` is the share of beams that the most probable state explains, None where no beam
        reached the object.
        """
        if self.stamp_ns is None:
            raise ValueError("a belief without a moment has no estimates")
        lower, upper = self.interval()
        return [
            Estimate(
                stamp_ns=self.stamp_ns,
                object=self.item.name,
                coordinate=coordinate,
                mean=mean,
                std=std,
                lower=low,
                upper=high,
                observed=fit is not None,
                fit=math.nan if fit is None else fit,
                presence=self.presence,
                lost=lost,
                p_closed=self.probability_closed,
                median=median,
            )
            for coordinate, mean, std, median, low, high in zip(
                self.item.coordinates,
                *(each.tolist() for each in (self.mean, self.std, self.median, lower, upper)),
                strict=True,
            )
        ]


def checked_share(share: float) -> float:
    """A probability. Raises QueryError where it isn't above 0 and at most 1."""
    if not 0.0 < share <= 1.0:
        raise QueryError(f"A probability of {share} must be above 0 and at most 1.")
    return share


def check_robot(width: float, length: float = 0.0) -> None:
    """Raises QueryError for a width or a length, m, that no robot has."""
    if not (0.0 <= width <= LARGEST and 0.0 <= length <= LARGEST):
        raise QueryError(
            f"A width of {width} m and a length of {length} m must be between 0 and {LARGEST:g} m; "
            "give metres."
        )


def _tails(share: float) -> tuple[float, float]:
    """The shares below the bounds of a central share."""
    return (1.0 - share) / 2.0, (1.0 + share) / 2.0


def within_limits(item: MovableObject, lower: float, upper: float) -> tuple[FloatArray, FloatArray]:
    """Bounds (1,) of a door's state: a cell at a limit reaches beyond it."""
    return np.array([max(lower, item.lower)]), np.array([min(upper, item.upper)])
