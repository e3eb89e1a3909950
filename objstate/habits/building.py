"""The habits of all doors of a building: each like its class, each class like the building.

A door's parameters are those of its building, plus what its class differs by, plus what it
differs by itself: all Gaussian, with shares of the covariance of a single door's prior. So what looks
told of each door (``Site``) becomes what is known of every other one in closed form.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import Calendar
from objstate.habits.design import Design
from objstate.habits.forecast import Forecast
from objstate.habits.model import Gaussian
from objstate.habits.site import Site
from objstate.lazy import lazy

BUILDING, CLASS = 0.4, 0.2  # shares of the prior's covariance; the remainder is the door's own
FEWEST = 2  # looks at a door whose habits count
Message = tuple[FloatArray, FloatArray]  # information (COMMON, COMMON), and pull
COMMON = Design(2).parameters  # that doors of any number of regions have


@dataclass(frozen=True, eq=False)
class Habits:
    """A value; ``with_sites`` makes another one."""

    calendar: Calendar
    sites: Mapping[str, Site]  # by door
    classes: Mapping[str, str]  # of those doors
    _forecasts: dict[str, Forecast] = field(default_factory=dict, init=False, repr=False)

    def __contains__(self, name: object) -> bool:
        """Whether a door has been looked at more than once: one look tells nothing of moves."""
        site = self.sites.get(name) if isinstance(name, str) else None
        return site is not None and site.looks >= FEWEST

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
        for name in sorted(self._of_classes):
            if name != of_class:
                told = self._of_classes[name]
                precision, pull = precision + told[0], pull + told[1]
        mean, covariance = _moments(precision, pull)
        covariance = covariance + CLASS * _common()
        if of_class in self._sums:
            information, told_of = self._sums[of_class]
            if but in self._messages:
                information = information - self._messages[but][0]
                told_of = told_of - self._messages[but][1]
            before = np.linalg.inv(covariance)
            mean, covariance = _moments(before + information, before @ mean + told_of)
        out = design.mean.copy()
        out[:COMMON] += mean
        own[:COMMON, :COMMON] += covariance
        return Gaussian(out, own)

    @lazy
    def _sums(self) -> dict[str, Message]:
        """What the doors of each class tell of it."""
        out: dict[str, Message] = {}
        for door in sorted(self._messages):
            name, (information, pull) = self.classes[door], self._messages[door]
            known = out.get(name)
            out[name] = (
                (information, pull) if known is None else (known[0] + information, known[1] + pull)
            )
        return out

    @lazy
    def _of_classes(self) -> dict[str, Message]:
        """What each class tells of the building."""
        return {name: _through(*message, CLASS * _common()) for name, message in self._sums.items()}

    @lazy
    def _messages(self) -> dict[str, Message]:
        """What each door tells of its class, in natural parameters about the prior's mean."""
        return {name: _message(site) for name, site in self.sites.items() if name in self}


def _message(site: Site) -> Message:
    """What a door tells of what it shares with others: its own differences are integrated out."""
    covariance, root = _extended(site.design), site.root
    pull = site.pull - root.T @ (root @ site.design.mean)
    gain = np.linalg.solve(np.eye(len(root)) + root @ covariance @ root.T, root)  # (r, p)
    told = pull - gain.T @ (root @ (covariance @ pull))
    return root[:, :COMMON].T @ gain[:, :COMMON], told[:COMMON]


@cache
def _common() -> FloatArray:
    return Design(2).covariance


def _extended(design: Design) -> FloatArray:
    """(p, p) covariance of what a door differs by from its class."""
    return _own(design.regions).copy()


@cache
def _own(regions: int) -> FloatArray:
    out = Design(regions).covariance.copy()
    out[:COMMON, :COMMON] *= 1.0 - BUILDING - CLASS
    return out


def _through(
    precision: FloatArray, pull: FloatArray, covariance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What is told of a vector by what is told of its sum with a Gaussian of mean 0."""
    damp = np.linalg.inv(np.eye(len(pull)) + precision @ covariance)
    out = damp @ precision
    return (out + out.T) / 2.0, damp @ pull


def _moments(precision: FloatArray, pull: FloatArray) -> tuple[FloatArray, FloatArray]:
    covariance = np.linalg.inv(precision)
    return covariance @ pull, (covariance + covariance.T) / 2.0
