"""What looks at one door told of its habits, in a form to which further looks are added."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import Calendar
from objstate.habits.design import Design
from objstate.habits.factor import Factor, told
from objstate.habits.forecast import Forecast
from objstate.habits.looks import RegionLooks
from objstate.habits.model import BURN_IN_NS, Gaussian, Known, evidence_of, fit, mode, prior

RESTS = 48  # bins between the limits in which places are counted where a door stood


@dataclass(frozen=True, eq=False)
class Site(Factor[Forecast]):
    """The factor of a door's habits, and where it came to rest."""

    bounds: tuple[float, ...]  # rad or m from closed, between the regions
    rests: FloatArray  # (RESTS,) how often the door stood in each part of its range
    last: Known | None = None  # the state after the last one

    @staticmethod
    def empty(bounds: tuple[float, ...], seasons: bool = False) -> Site:
        """Of a door that nobody has looked at, with so many bounds between its regions."""
        p = Design(len(bounds) + 1, seasons).parameters
        return Site(np.zeros(p), np.zeros((0, p)), bounds, np.zeros(RESTS), seasons=seasons)

    @property
    def design(self) -> Design:
        """Of the door's parameters."""
        return Design(len(self.bounds) + 1, self.seasons)

    def forecast(self, calendar: Calendar, after: Gaussian) -> Forecast:
        return Forecast(self.design, calendar, after)

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
        after = self.last if follows else None
        found = mode(evidence_of(self.design, calendar, looks, after), before)
        latest = Known(int(looks.stamps_ns[-1]), found.state)
        is_last = self.last is None or latest.stamp_ns >= self.last.stamp_ns
        return replace(
            self,
            **self.also(found),
            rests=self.rests + rests,
            looks=self.looks + len(looks),
            first_ns=first if self.first_ns is None else min(first, self.first_ns),
            last=latest if is_last else self.last,
        )


def fitted_site(
    bounds: tuple[float, ...],
    calendar: Calendar,
    looks: RegionLooks,
    rests: FloatArray,
    before: Gaussian | None = None,
) -> Site:
    """The site of all looks together, about the mode that they have; some seconds for a year."""
    empty = Site.empty(bounds, calendar.seasons)
    before = before or prior(empty.design)
    after, found = fit(empty.design, calendar, looks, before)
    if found is None:
        return empty
    return Site(
        **told(before, after, empty.design),
        bounds=bounds,
        rests=rests,
        looks=len(looks),
        fitted=len(looks),
        first_ns=int(looks.stamps_ns[0]),
        seasons=empty.seasons,
        last=Known(int(looks.stamps_ns[-1]), found.state),
    )
