"""What looks at one door told of its habits, in a form to which further looks are added."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import Calendar
from objstate.habits.design import Design
from objstate.habits.looks import RegionLooks
from objstate.habits.model import BURN_IN_NS, Gaussian, Known, fit, mode, prior

RESTS = 48  # bins between the limits in which places are counted where a door stood


NEGLIGIBLE = 1e-6  # information about a direction, in units of the prior's


@dataclass(frozen=True, eq=False)
class Site:
    """A Gaussian factor: what was told beside the prior, in natural parameters.

    A few looks tell of a few directions in the space of the parameters: the precision is the square
    of a ``root``.
    """

    bounds: tuple[float, ...]  # rad or m from closed, between the regions
    pull: FloatArray  # (p,) precision times mean
    root: FloatArray  # (r, p)
    rests: FloatArray  # (RESTS,) how often the door stood in each part of its range
    looks: int = 0  # taken in
    fitted: int = 0  # of these by a fit to all looks, the others one after the other
    first_ns: int | None = None  # of the looks
    last: Known | None = None  # the state after the last one

    @staticmethod
    def empty(bounds: tuple[float, ...]) -> Site:
        """Of a door that nobody has looked at, with so many bounds between its regions."""
        p = Design(len(bounds) + 1).parameters
        return Site(bounds, np.zeros(p), np.zeros((0, p)), np.zeros(RESTS))

    @property
    def design(self) -> Design:
        """Of the door's parameters."""
        return Design(len(self.bounds) + 1)

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

    def with_looks(self, calendar: Calendar, looks: RegionLooks, rests: FloatArray) -> Site:
        """The site that has taken further looks in, near the mode of what is known then.

        A few passes over these looks alone: milliseconds. Looks before the last one count as if the
        state before them were unknown.
        """
        if not len(looks):
            return self
        first = int(looks.stamps_ns[0])
        follows = self.last is not None and 0 <= first - self.last.stamp_ns < BURN_IN_NS
        before = self.posterior(prior(self.design))
        found = mode(self.design, calendar, looks, before, after=self.last if follows else None)
        latest = Known(int(looks.stamps_ns[-1]), found.state)
        is_last = self.last is None or latest.stamp_ns >= self.last.stamp_ns
        return replace(
            self,
            pull=self.pull + found.score + found.information @ found.theta,
            root=root_of(self.precision + found.information, self.design),
            rests=self.rests + rests,
            looks=self.looks + len(looks),
            first_ns=first if self.first_ns is None else min(first, self.first_ns),
            last=latest if is_last else self.last,
        )


def root_of(precision: FloatArray, design: Design) -> FloatArray:
    """(r, p) whose square is a precision (p, p), but for what tells next to nothing."""
    spread = np.linalg.cholesky(design.covariance)
    values, vectors = np.linalg.eigh(spread.T @ precision @ spread)
    kept = values > NEGLIGIBLE
    scaled = np.sqrt(values[kept])[:, None] * vectors[:, kept].T
    return np.asarray(np.linalg.solve(spread.T, scaled.T).T)


def fitted_site(
    bounds: tuple[float, ...],
    calendar: Calendar,
    looks: RegionLooks,
    rests: FloatArray,
    before: Gaussian | None = None,
) -> Site:
    """The site of all looks together, about the mode that they have; some seconds for a year."""
    empty = Site.empty(bounds)
    before = before or prior(empty.design)
    after, found = fit(empty.design, calendar, looks, before)
    if found is None:
        return empty
    told, assumed = np.linalg.inv(after.covariance), np.linalg.inv(before.covariance)
    return Site(
        bounds,
        told @ after.mean - assumed @ before.mean,
        root_of(told - assumed, empty.design),
        rests,
        len(looks),
        len(looks),
        int(looks.stamps_ns[0]),
        Known(int(looks.stamps_ns[-1]), found.state),
    )
