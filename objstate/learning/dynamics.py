"""From a run's estimates to the dynamics of its objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.config import Dynamics, Settings
from objstate.geometry import IntArray
from objstate.learning.rates import Rate, Waits, posterior_rate
from objstate.learning.rests import Rest, alike, difference, rests_of
from objstate.learning.shares import RestShares, learn_shares
from objstate.units import SECONDS_PER_HOUR

if TYPE_CHECKING:
    import polars as pl

ROOM_M = 4.0  # m, side of the square in which moved furniture may stand anywhere
LEAST_RATE = 1e-3  # moves per hour of a prior for objects that settings say are never moved


@dataclass(frozen=True)
class ObjectDynamics:
    """What was learnt of one object."""

    name: str
    rate: Rate
    assumed: Dynamics  # by the settings
    is_door: bool


@dataclass(frozen=True)
class LearntDynamics:
    """The learnt dynamics of a run's objects."""

    objects: tuple[ObjectDynamics, ...]  # all of the building
    classes: Mapping[str, Rate]  # by door and furniture
    rest: RestShares | None  # of doors; None where the building has none with two limits


def learn_dynamics(
    estimates: pl.DataFrame,
    building: Building,
    settings: Settings,
    lost_ns: Sequence[tuple[int, int]] = (),
) -> LearntDynamics:
    """Moves per hour of every object, and the rest shares of doors, after a run's estimates.

    ``estimates`` are the rows of ``estimates.parquet``; stretches ``lost_ns`` don't
    count. Objects of one class learn from each other: the class's posterior mean is
    the mean of each object's prior. Raises SettingsError as ``Settings.for_object`` does.
    """
    kept = estimates.filter(_outside(estimates["stamp"].to_numpy(), lost_ns))
    rests = {name: rests_of(kept, item) for name, item in building.objects.items()}
    waits = {name: _waits(building[name], found) for name, found in rests.items()}
    assumed = {
        name: settings.for_object(name, _class(item)).dynamics
        for name, item in building.objects.items()
    }
    classes = {}
    for kind in ("door", "furniture"):
        names = [name for name, item in building.objects.items() if _class(item) == kind]
        if names:
            before = float(np.mean([assumed[name].moves_per_hour for name in names]))
            joined = Waits.joined([waits[name] for name in names])
            classes[kind] = posterior_rate(joined, max(before, LEAST_RATE))
    objects = tuple(
        ObjectDynamics(
            name=name,
            rate=posterior_rate(waits[name], classes[_class(item)].mean),
            assumed=assumed[name],
            is_door=_class(item) == "door",
        )
        for name, item in building.objects.items()
    )
    return LearntDynamics(objects, classes, _shares(building, rests))


def _outside(stamps_ns: IntArray, stretches: Sequence[tuple[int, int]]) -> pl.Series:
    import polars as pl

    inside = np.zeros(len(stamps_ns), dtype=bool)
    for since, found in stretches:
        inside |= (since <= stamps_ns) & (stamps_ns < found)
    return pl.Series(~inside)


def _class(item: MovableObject) -> Literal["door", "furniture"]:
    return "furniture" if item.kind is Kind.PLANAR else "door"


def _waits(item: MovableObject, rests: Sequence[Rest]) -> Waits:
    """The waits between an object's rests."""
    pairs = list(pairwise(rests))
    return Waits(
        watched=sum(rest.seconds for rest in rests) / SECONDS_PER_HOUR,
        hours=np.array([(b.begin_ns - a.end_ns) / 3.6e12 for a, b in pairs]),
        stayed=np.array([_stayed(item, a, b) for a, b in pairs]),
        moved=np.full(len(pairs), _anywhere(item)),
    )


def _stayed(item: MovableObject, before: Rest, after: Rest) -> float:
    """Density of the second rest's state, the object having stayed in the first one's."""
    off = difference(item, after.state, before.state)
    width = np.sqrt(before.std**2 + after.std**2 + alike(item) ** 2)
    return float(np.prod(np.exp(-0.5 * (off / width) ** 2) / (width * np.sqrt(2.0 * np.pi))))


def _anywhere(item: MovableObject) -> float:
    """Density of a state, the object having been moved: even over where it can be."""
    if item.kind is Kind.PLANAR:
        return 1.0 / (ROOM_M**2 * 2.0 * np.pi)
    return 1.0 / (2.0 * np.pi if item.wraps else item.upper - item.lower)


def _shares(building: Building, rests: Mapping[str, Sequence[Rest]]) -> RestShares | None:
    doors = [
        item
        for item in building.objects.values()
        if item.kind is not Kind.PLANAR and not item.wraps
    ]
    if not doors:
        return None
    return learn_shares([(item, rest) for item in doors for rest in _changed(item, rests)])


def _changed(item: MovableObject, rests: Mapping[str, Sequence[Rest]]) -> list[Rest]:
    """A door's rests, those in one state counted once."""
    out: list[Rest] = []
    for rest in rests[item.name]:
        if not out or _stayed(item, out[-1], rest) < _anywhere(item):
            out.append(rest)
    return out
