"""How often a piece of furniture is moved, by time of day and kind of day: a Poisson process.

The logarithm of the rate is the smooth function of local time that a settled door has (``design``),
about a mean and with a deviation of its own. What is seen are two looks and whether the piece
was moved between them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.habits.calendar import Calendar
from objstate.habits.design import ALL, SETTLED, Design
from objstate.habits.model import Evidence, Gaussian
from objstate.lazy import lazy
from objstate.units import SECONDS_PER_HOUR

MEAN_LOG = float(np.log(0.1))  # moves an hour of a working day, before any look
LEVEL_STD = 2.0  # of that logarithm, beside what doors differ by
DRAWS = 64  # of the parameters
LEAST = 1e-12  # expected moves


@dataclass(frozen=True)
class MoveDesign:
    """The parameters of a door's design that the rate of its moves depends on."""

    seasons: bool = False  # as in ``Design``

    @lazy
    def _doors(self) -> Design:
        return Design(2, self.seasons)

    @lazy
    def _chosen(self) -> IntArray:
        return np.flatnonzero((self._doors.matrix[:, SETTLED] != 0.0).any(axis=0))

    @lazy
    def _level(self) -> FloatArray:
        """(p,) whether a parameter is of the function that all days share."""
        out = np.zeros(self._doors.parameters)
        for first, block in self._doors.placed:
            if block.local == SETTLED and block.on == ALL:
                out[first : first + block.knots] = 1.0
        return np.asarray(out[self._chosen])

    @lazy
    def matrix(self) -> FloatArray:
        """(k, p) from parameters to the logarithms of moves an hour, by key of a cell."""
        return self._doors.matrix[:, SETTLED][:, self._chosen]

    @lazy
    def mean(self) -> FloatArray:
        """(p,) prior mean."""
        return np.where(self._level > 0.0, MEAN_LOG, self._doors.mean[self._chosen])

    @lazy
    def covariance(self) -> FloatArray:
        """(p, p) prior covariance."""
        of_doors = self._doors.covariance[np.ix_(self._chosen, self._chosen)]
        level = LEVEL_STD**2 * np.outer(self._level, self._level)
        return np.asarray(of_doors + level)

    def rates(self, theta: FloatArray) -> FloatArray:
        """(..., k) 1/s by key, of parameters (..., p)."""
        return np.asarray(np.exp(theta @ self.matrix.T) / SECONDS_PER_HOUR)


@dataclass(frozen=True, eq=False)
class Spans:
    """Times between neighbouring looks, and what these told of moves in between."""

    design: MoveDesign
    seconds: FloatArray  # (n, k) by key of a cell
    odds: FloatArray  # (n,) p(what was seen | it was moved) / p(... | it was not)

    def evidence(self, theta: FloatArray) -> Evidence:
        """Log-likelihood of the looks with its derivatives at parameters (p,).

        A span in which m moves are expected has the likelihood ``exp(-m) + odds (1 - exp(-m))``. The
        information is Fisher's, of looks that tell moves as surely as these.
        """
        by_key = self.seconds * self.design.rates(theta)  # (n, k)
        expected = np.maximum(by_key.sum(axis=1), LEAST)
        stays = np.exp(-expected)
        likelihood = stays - self.odds * np.expm1(-expected)
        slope = (self.odds - 1.0) * stays / likelihood
        error = 1.0 / (1.0 + np.maximum(self.odds, 1.0 / self.odds))
        seen = error - (1.0 - 2.0 * error) * np.expm1(-expected)
        weight = ((1.0 - 2.0 * error) * stays) ** 2 / (seen * (1.0 - seen))
        by_parameter = by_key @ self.design.matrix  # (n, p)
        return Evidence(
            theta,
            float(np.log(likelihood).sum()),
            slope @ by_parameter,
            (weight[:, None] * by_parameter).T @ by_parameter,
            np.empty(0),
        )


@dataclass(frozen=True, eq=False)
class Moves:
    """The rate of a piece's moves, for several draws of what isn't known of it."""

    design: MoveDesign
    calendar: Calendar
    habits: Gaussian

    @lazy
    def rates(self) -> FloatArray:
        """(d, k) 1/s by key of a cell."""
        return self.design.rates(self.habits.draws(DRAWS))

    def stays(self, begin_ns: int, end_ns: int) -> float:
        """Probability that nobody moves it from one moment to another."""
        expected = self.rates @ self.calendar.seconds_by_key(begin_ns, end_ns)
        return float(np.exp(-expected).mean())
