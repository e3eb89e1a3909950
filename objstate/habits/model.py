"""The habits of a door: how often it is moved, and where to, by time of day and kind of day.

A door is a Markov process in continuous time over regions of its state (closed, ajar, open, wide),
each of which it holds for long (settled) or shortly (brief), so that stays are not
exponential. Rates and resting places are functions of local time (``design``), with Gaussian
priors. Learning is by Fisher scoring on the likelihood of all looks, which the forward pass
gives with its derivatives (``kernels``), for looks of any number at any hours; the posterior is
Laplace's. As the likelihood is that of the process, hours that nobody looked at stay as
uncertain as the prior has them, however often others were looked at.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import NANOSECONDS, PER_DAY, Calendar, kinds
from objstate.habits.chain import chain, slopes
from objstate.habits.design import Design
from objstate.habits.looks import RegionLooks
from objstate.habits.steps import by_days, steps
from objstate.lazy import Later, lazy

if TYPE_CHECKING:
    from objstate.habits import kernels
else:
    kernels = Later("objstate.habits.kernels")

ROUNDS = 40  # of Fisher scoring at most
CONVERGED = 1e-3  # squared length of a step, in posterior deviations
HALVINGS = 12  # of a step that doesn't raise the posterior
SPREADS, SPREAD_DRAWS = 4, 16  # rounds and draws that widen Laplace's approximation
SEED, JITTER = 0, 1e-10  # of draws, and what is added to the diagonal of a covariance
BURN_IN_NS = 14 * 86400 * NANOSECONDS  # before the first look, over which a start is forgotten


@dataclass(frozen=True, eq=False)
class Gaussian:
    """A distribution of parameters."""

    mean: FloatArray  # (p,)
    covariance: FloatArray  # (p, p)

    @lazy
    def root(self) -> FloatArray:
        """(p, p) Cholesky's factor of the covariance."""
        return np.asarray(
            np.linalg.cholesky(self.covariance + JITTER * np.eye(len(self.mean))), dtype=float
        )

    def draws(self, count: int) -> FloatArray:
        """(count, p) draws, always the same, in pairs about the mean; the mean alone for one."""
        if count == 1:
            return self.mean[None]
        size = (count // 2, len(self.mean))
        off = np.random.default_rng(SEED).standard_normal(size) @ self.root.T
        return np.concatenate([self.mean + off, self.mean - off])


@dataclass(frozen=True, eq=False)
class Evidence:
    """What looks tell of parameters, near those at which it was worked out."""

    theta: FloatArray  # (p,) where
    log_likelihood: float
    score: FloatArray  # (p,)
    information: FloatArray  # (p, p)
    state: FloatArray = field(repr=False)  # (s,) after the last look


class Distribution(Protocol):
    """Of parameters."""

    def draws(self, count: int) -> FloatArray:
        """(count, p) draws, always the same."""


class Parameters(Protocol):
    """What a habit is described by, before any look."""

    @property
    def mean(self) -> FloatArray:
        """(p,) prior mean."""

    @property
    def covariance(self) -> FloatArray:
        """(p, p) prior covariance."""


Told = Callable[[FloatArray], Evidence]  # at parameters (p,)


@dataclass(frozen=True, eq=False)
class Known:
    """The state at a moment, from which on looks are taken in."""

    stamp_ns: int
    state: FloatArray  # (s,)


def prior(design: Parameters) -> Gaussian:
    """What is assumed of an object that nobody has looked at."""
    return Gaussian(design.mean, design.covariance)


def evidence_of(
    design: Design, calendar: Calendar, looks: RegionLooks, after: Known | None = None
) -> Told:
    """Log-likelihood of looks, at least one, with its derivatives at any parameters.

    The door is known at a moment before them, or else whatever it is at such a time.
    """
    begin = int(looks.stamps_ns[0]) - BURN_IN_NS if after is None else after.stamp_ns
    cells, of_days = steps(calendar, begin, looks.stamps_ns), kinds(calendar.seasons)
    states, parameters = design.states, design.parameters
    # a day is passed through from each state, which takes as long as so many days
    cut = by_days(cells, of_days, least=states)
    days = np.unique(cut.keys[cut.keys >= of_days * PER_DAY]) - of_days * PER_DAY

    def told(theta: FloatArray) -> Evidence:
        u = design.matrix @ theta
        of = chain(u)
        state = of.settled[cells.keys[0]].copy() if after is None else after.state.copy()
        right, left = np.ascontiguousarray(of.right), np.ascontiguousarray(of.left)
        process = kernels.Process(of.rates, right, left, slopes(u, of), *design.active)
        over_days = np.empty((of_days, states, states))
        day_slopes = np.empty((of_days if len(days) else 0, states, states, parameters))
        kernels.whole_days(days, PER_DAY, process, over_days, day_slopes)
        score, information = np.empty(parameters), np.empty((parameters, parameters))
        total = kernels.forward(
            state,
            *cut,
            looks.likelihood,
            process,
            over_days,
            day_slopes,
            score,
            information,
        )
        return Evidence(theta, float(total), score, information, state)

    return told


def ready() -> None:
    """Load the compiled loops, or compile them, where this must not be waited for later."""
    design, nothing = Design(2), np.zeros(1, dtype=np.int64)
    evidence_of(design, Calendar(), RegionLooks.certain(nothing, nothing, 2))(design.mean)


def fit(
    design: Design,
    calendar: Calendar,
    looks: RegionLooks,
    before: Gaussian | None = None,
    start: FloatArray | None = None,
) -> tuple[Gaussian, Evidence | None]:
    """The posterior of the parameters, with the evidence at its mode; None without looks."""
    before = before or prior(design)
    if not len(looks):
        return before, None
    return fit_to(evidence_of(design, calendar, looks), before, start)


def fit_to(
    told: Told, before: Gaussian, start: FloatArray | None = None
) -> tuple[Gaussian, Evidence]:
    """The posterior of the parameters by the evidence at any of them, and the evidence at its mode."""
    found = mode(told, before, start)
    return _spread(told, before, laplace(found, before)), found


def laplace(found: Evidence, before: Gaussian) -> Gaussian:
    """The Gaussian about a mode."""
    return Gaussian(found.theta, _inverse(_inverse(before.covariance) + found.information))


def mode(told: Told, before: Gaussian, start: FloatArray | None = None) -> Evidence:
    """The evidence at the parameters that are most probable after it."""
    precision = _inverse(before.covariance)
    theta = before.mean if start is None else start
    found = told(theta)
    height = _height(found, before, precision)
    for _ in range(ROUNDS):
        total = precision + found.information
        pull = found.score - precision @ (theta - before.mean)
        step = np.linalg.solve(total, pull)
        if step @ total @ step < CONVERGED:
            break
        for _ in range(HALVINGS):
            tried = told(theta + step)
            higher = _height(tried, before, precision)
            if higher >= height:
                break
            step = step / 2.0
        else:
            break
        theta, found, height = theta + step, tried, higher
    return found


def _spread(told: Told, before: Gaussian, after: Gaussian) -> Gaussian:
    """The Gaussian nearest to the posterior, from Laplace's about its mode.

    Of an hour in which a door was never seen to move, the likelihood falls off steeply towards higher rates
    and not at all towards lower ones, which Laplace's approximation doesn't see. Score and
    information are averaged over draws (Opper and Archambeau 2009, *The variational Gaussian
    approximation revisited*, Neural Computation 21).
    """
    precision = _inverse(before.covariance)
    for _ in range(SPREADS):
        found = [told(theta) for theta in after.draws(SPREAD_DRAWS)]
        total = precision + np.mean([each.information for each in found], axis=0)
        score = np.mean([each.score for each in found], axis=0)
        pull = score - precision @ (after.mean - before.mean)
        after = Gaussian(after.mean + np.linalg.solve(total, pull), _inverse(total))
    return after


def _inverse(of: FloatArray) -> FloatArray:
    out = np.linalg.inv(of)
    return np.asarray((out + out.T) / 2.0)


def _height(found: Evidence, before: Gaussian, precision: FloatArray) -> float:
    off = found.theta - before.mean
    return float(found.log_likelihood - 0.5 * off @ precision @ off)
