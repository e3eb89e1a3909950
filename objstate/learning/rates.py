"""How often an object is moved: a Poisson process that is observed now and then.

In a wait of t hours an object is moved with probability 1 - exp(-mu t), whether seen or not. A wait
between two observations is evidence for "stayed" and for "moved" by the probability of the second
one in either case. So a robot that observed seldom counts no fewer moves than one that watched,
only with more uncertainty.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray
from objstate.particles import quantiles

SHAPE = 1.0  # of the Gamma prior: it weighs as much as one move seen in 1 / mean hours
RATES = 1201  # on which the posterior is evaluated, evenly in their logarithm
LEAST, MOST = 1e-7, 1e4  # times the prior's mean, between which they lie
CENTRAL = np.array([0.05, 0.95])


@dataclass(frozen=True, eq=False)
class Waits:
    """What was seen of one object, or of several."""

    watched: float  # h in which it was seen to stay
    hours: FloatArray  # (n,) h of each wait between two observations
    stayed: FloatArray  # (n,) density of the second look where the object stayed
    moved: FloatArray  # (n,) and where it was moved

    @staticmethod
    def joined(parts: Sequence[Waits]) -> Waits:
        """What was seen of several objects, or in several drives."""
        return Waits(
            sum(part.watched for part in parts),
            np.concatenate([np.zeros(0), *(part.hours for part in parts)]),
            np.concatenate([np.zeros(0), *(part.stayed for part in parts)]),
            np.concatenate([np.zeros(0), *(part.moved for part in parts)]),
        )

    @property
    def total(self) -> float:
        """h that were watched or waited."""
        return self.watched + float(self.hours.sum())

    def log_likelihood(self, rates: FloatArray) -> FloatArray:
        """(r,) of rates (r,) per hour."""
        quiet = np.exp(-rates[:, None] * self.hours)
        seen = quiet * self.stayed - np.expm1(-rates[:, None] * self.hours) * self.moved
        with np.errstate(divide="ignore"):
            return np.asarray(-rates * self.watched + np.log(seen).sum(axis=1))

    def moves(self, rate: float) -> float:
        """Expected number of waits in which it was moved, at a rate per hour."""
        moved = -np.expm1(-rate * self.hours) * self.moved
        seen = np.exp(-rate * self.hours) * self.stayed + moved
        return float(np.sum(moved[seen > 0.0] / seen[seen > 0.0]))


@dataclass(frozen=True)
class Rate:
    """A posterior of moves per hour."""

    mean: float
    lower: float  # central 90 %
    upper: float
    moves: float  # expected number of waits with a move
    hours: float  # that were watched or waited


def posterior_rate(waits: Waits, prior_mean: float) -> Rate:
    """Moves per hour after ``waits``, from a Gamma prior of shape ``SHAPE`` about ``prior_mean``.

    Without any wait that is unclear the posterior is the conjugate one, Gamma of shape
    ``SHAPE`` + moves and rate ``SHAPE`` / mean + hours. ``prior_mean`` must be above 0.
    """
    rates = prior_mean * np.geomspace(LEAST, MOST, RATES)
    # over the logarithm of the rate, a Gamma density gains one power of the rate
    log_prior = SHAPE * np.log(rates) - SHAPE * rates / prior_mean
    log_posterior = log_prior + waits.log_likelihood(rates)
    weights = np.exp(log_posterior - log_posterior.max())
    weights /= weights.sum()
    mean = float(weights @ rates)
    lower, upper = quantiles(rates, weights, CENTRAL)
    return Rate(mean, float(lower), float(upper), waits.moves(mean), waits.total)
