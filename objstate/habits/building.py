"""The habits of all doors of a building: each like its class, each class like the building.

A door's parameters are those of its building, plus what its class differs by, plus what it
differs by itself: all Gaussian, with shares of the covariance of a single door's prior. So what looks
told of each door (``Site``) becomes what is known of every other one in closed form.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import Calendar
from objstate.habits.design import Design
from objstate.habits.forecast import Forecast
from objstate.habits.model import Gaussian
from objstate.habits.site import Site
from objstate.lazy import lazy

BUILDING, CLASS = 0.4, 0.2  # shares of the prior's covariance; the remainder is the door's own
COMMON = Design(2).parameters  # that doors of any number of regions have


@dataclass(frozen=True, eq=False)
class Habits:
    """A value; ``with_sites`` makes another one."""

    calendar: Calendar
    sites: Mapping[str, Site]  # by door
    classes: Mapping[str, str]  # of those doors
    _forecasts: dict[str, Forecast] = field(default_factory=dict, init=False, repr=False)

    def __contains__(self, name: object) -> bool:
        return name in self.sites

    def with_sites(self, sites: Mapping[str, Site], classes: Mapping[str, str]) -> Habits:
        """The habits with other sites of some doors."""
        return Habits(self.calendar, {**self.sites, **sites}, {**self.classes, **classes})

    def forecast(self, name: str) -> Forecast:
        """By what is known of a door."""
        found = self._forecasts.get(name)
        if found is None:
            site = self.sites[name]
            after = site.posterior(self.before(site.design, self.classes[name], but=name))
            found = self._forecasts[name] = Forecast(site.design, self.calendar, after)
        return found

    def before(self, design: Design, of_class: str, but: str | None = None) -> Gaussian:
        """What other doors than ``but`` make one expect of a door of a class."""
        own = _extended(design)
        precision = np.asarray(np.linalg.inv(BUILDING * _common()), dtype=float)
        pull = np.zeros(COMMON)
        for name in sorted(set(self.classes.values())):
            members = [self._messages[door] for door in self._members(name) if door != but]
            if name != of_class and members:
                told = _through(*_sum(members), CLASS * _common())
                precision, pull = precision + told[0], pull + told[1]
        mean, covariance = _moments(precision, pull)
        members = [self._messages[door] for door in self._members(of_class) if door != but]
        covariance = covariance + CLASS * _common()
        if members:
            before = np.linalg.inv(covariance)
            told = _sum(members)
            mean, covariance = _moments(before + told[0], before @ mean + told[1])
        out = design.mean.copy()
        out[:COMMON] += mean
        own[:COMMON, :COMMON] += covariance
        return Gaussian(out, own)

    def _members(self, of_class: str) -> Iterable[str]:
        return sorted(door for door, name in self.classes.items() if name == of_class)

    @lazy
    def _messages(self) -> dict[str, tuple[FloatArray, FloatArray]]:
        """What each door tells of its class, in natural parameters about the prior's mean."""
        out = {}
        for name, site in self.sites.items():
            pull = site.pull - site.precision @ site.design.mean
            precision, pull = _through(site.precision, pull, _extended(site.design))
            out[name] = precision[:COMMON, :COMMON], pull[:COMMON]
        return out


def _common() -> FloatArray:
    return Design(2).covariance


def _extended(design: Design) -> FloatArray:
    """(p, p) covariance of what a door differs by from its class."""
    out = design.covariance.copy()
    out[:COMMON, :COMMON] *= 1.0 - BUILDING - CLASS
    return out


def _through(
    precision: FloatArray, pull: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What is told of a vector by what is told of its sum with a Gaussian of mean 0."""
    damp = np.linalg.inv(np.eye(len(pull)) + precision @ covariance)
    out = damp @ precision
    return (out + out.T) / 2.0, damp @ pull


def _sum(messages: list[tuple[FloatArray, FloatArray]]) -> tuple[FloatArray, FloatArray]:
    return sum(each[0] for each in messages), sum(each[1] for each in messages)  # type: ignore[return-value]


def _moments(precision: FloatArray, pull: FloatArray) -> tuple[FloatArray, FloatArray]:
    covariance = np.linalg.inv(precision)
    return covariance @ pull, (covariance + covariance.T) / 2.0
