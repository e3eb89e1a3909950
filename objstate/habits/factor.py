"""What looks told of parameters beside their prior: a Gaussian factor, to which more is added."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import Calendar
from objstate.habits.model import Evidence, Gaussian, Parameters

FEWEST = 2  # looks at an object whose habits count: one tells nothing of moves
# Times as many looks as the last fit had, from which on there is another one. All fits of an object
# together cost at most 1 / (1 - 1 / GROWN) = 5 times the last one.
GROWN = 1.25
NEGLIGIBLE = 1e-6  # information about a direction, in units of the prior's
F = TypeVar("F")  # what foretells


@dataclass(frozen=True, eq=False)
class Factor(Generic[F]):
    """In natural parameters. A few looks tell of a few directions: the precision is a ``root``'s square."""

    pull: FloatArray  # (p,) precision times mean
    root: FloatArray  # (r, p)
    looks: int = field(default=0, kw_only=True)  # taken in
    fitted: int = field(default=0, kw_only=True)  # of these by a fit to all looks, others in turn
    first_ns: int | None = field(default=None, kw_only=True)  # of the looks
    seasons: bool = field(default=False, kw_only=True)  # whether its calendar has them

    @property
    @abstractmethod
    def design(self) -> Parameters:
        """Of its parameters."""

    @abstractmethod
    def forecast(self, calendar: Calendar, after: Gaussian) -> F:
        """What is foretold where its parameters are distributed so."""

    @property
    def due(self) -> bool:
        """Whether so many looks were taken in in turn that it is to be fitted to all anew."""
        return self.looks >= max(FEWEST, GROWN * self.fitted)

    @property
    def precision(self) -> FloatArray:
        """(p, p) what was told."""
        return self.root.T @ self.root

    def posterior(self, before: Gaussian) -> Gaussian:
        """The parameters after a prior and the looks."""
        precision = np.linalg.inv(before.covariance)
        covariance = np.linalg.inv(precision + self.precision)
        mean = covariance @ (precision @ before.mean + self.pull)
        return Gaussian(mean, (covariance + covariance.T) / 2.0)

    def also(self, found: Evidence) -> dict[str, Any]:
        """The fields after further evidence."""
        root = root_of(self.precision + found.information, self.design)
        return {
            "pull": self.pull + found.score + found.information @ found.theta,
            "root": root,
        }


def told(before: Gaussian, after: Gaussian, design: Parameters) -> dict[str, Any]:
    """The fields of what leads from one distribution to another."""
    assumed, known = np.linalg.inv(before.covariance), np.linalg.inv(after.covariance)
    return {
        "pull": known @ after.mean - assumed @ before.mean,
        "root": root_of(known - assumed, design),
    }


def root_of(precision: FloatArray, design: Parameters) -> FloatArray:
    """(r, p) whose square is a precision (p, p), but for what tells next to nothing."""
    spread = np.linalg.cholesky(design.covariance)
    values, vectors = np.linalg.eigh(spread.T @ precision @ spread)
    kept = values > NEGLIGIBLE
    scaled = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    return np.asarray(np.linalg.solve(spread.T, scaled.T).T)
