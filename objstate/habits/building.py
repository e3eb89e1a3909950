"""The habits of all doors, or all furniture, of a building: each like its class, each class like the building.

An object's parameters are those of its building, plus what its class differs by, plus what it
differs by itself: all Gaussian, with shares of the covariance of a single object's prior. So what
looks told of each (``Factor``) becomes what is known of every other one in closed form.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import numpy as np

from objstate.geometry import FloatArray
from objstate.habits.calendar import Calendar
from objstate.habits.design import Design
from objstate.habits.factor import FEWEST, F, Factor
from objstate.habits.forecast import Forecast
from objstate.habits.model import Gaussian, Parameters
from objstate.habits.moves import Moves
from objstate.habits.piece import PieceSite
from objstate.habits.site import Site
from objstate.lazy import lazy

BUILDING, CLASS = 0.4, 0.2  # shares of the prior's covariance; the remainder is the object's own
Message = tuple[FloatArray, FloatArray]  # information (c, c) of what is common, and pull
S = TypeVar("S", bound=Factor[Any])


def doors(seasons: bool) -> Design:
    """What doors of any number of regions have in common."""
    return Design(2, seasons)


@dataclass(frozen=True, eq=False)
class Habits(Generic[S, F]):
    """A value; ``with_sites`` makes another one."""

    calendar: Calendar
    sites: Mapping[str, S]  # by object
    classes: Mapping[str, str]  # of those objects
    shared: Callable[[bool], Parameters] = doors  # by whether there are seasons
    _forecasts: dict[str, Any] = field(default_factory=dict, init=False, repr=False)

    def __contains__(self, name: object) -> bool:
        """Whether an object has been looked at more than once: one look tells nothing of moves."""
        site = self.sites.get(name) if isinstance(name, str) else None
        return site is not None and site.looks >= FEWEST

    def with_sites(self, sites: Mapping[str, S], classes: Mapping[str, str]) -> Habits[S, F]:
        """The habits with other sites of some objects."""
        every = {**self.sites, **sites}
        return Habits(self.calendar, every, {**self.classes, **classes}, self.shared)

    @lazy
    def common(self) -> Parameters:
        """The first parameters of each object."""
        return self.shared(self.calendar.seasons)

    def forecast(self, name: str) -> F:
        """By what is known of an object."""
        found: F | None = self._forecasts.get(name)
        if found is None:
            site = self.sites[name]
            after = site.posterior(self.before(site.design, self.classes[name], but=name))
            found = self._forecasts[name] = site.forecast(self.calendar, after)
        return found

    def before(self, design: Parameters, of_class: str, but: str | None = None) -> Gaussian:
        """What other objects than ``but`` make one expect of one of a class."""
        own, common = self._own(design), self.common.covariance
        shared = len(common)
        precision = np.asarray(np.linalg.inv(BUILDING * common), dtype=float)
        pull = np.zeros(shared)
        for name in sorted(self._of_classes):
            if name != of_class:
                told = self._of_classes[name]
                precision, pull = precision + told[0], pull + told[1]
        mean, covariance = _moments(precision, pull)
        covariance = covariance + CLASS * common
        if of_class in self._sums:
            information, told_of = self._sums[of_class]
            if but in self._messages:
                information = information - self._messages[but][0]
                told_of = told_of - self._messages[but][1]
            before = np.linalg.inv(covariance)
            mean, covariance = _moments(before + information, before @ mean + told_of)
        out = design.mean.copy()
        out[:shared] += mean
        own[:shared, :shared] += covariance
        return Gaussian(out, own)

    @lazy
    def _sums(self) -> dict[str, Message]:
        """What the objects of each class tell of it."""
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
        spread = CLASS * self.common.covariance
        return {name: _through(*message, spread) for name, message in self._sums.items()}

    @lazy
    def _messages(self) -> dict[str, Message]:
        """What each tells of its class, in natural parameters about the prior's mean."""
        return {name: self._message(site) for name, site in self.sites.items() if name in self}

    def _message(self, site: S) -> Message:
        """What an object tells of what it shares with others: its own differences are integrated out."""
        covariance, root = self._own(site.design), site.root
        pull = site.pull - root.T @ (root @ site.design.mean)
        gain = np.linalg.solve(np.eye(len(root)) + root @ covariance @ root.T, root)  # (r, p)
        of_all = pull - gain.T @ (root @ (covariance @ pull))
        shared = len(self.common.covariance)
        return root[:, :shared].T @ gain[:, :shared], of_all[:shared]

    def _own(self, design: Parameters) -> FloatArray:
        """(p, p) covariance of what an object differs by from its class."""
        out, shared = design.covariance.copy(), len(self.common.covariance)
        out[:shared, :shared] *= 1.0 - BUILDING - CLASS
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


DoorHabits = Habits[Site, Forecast]
PieceHabits = Habits[PieceSite, Moves]
