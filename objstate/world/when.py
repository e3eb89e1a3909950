"""When a door may be passed: most probable times, waiting, and the best moment to set off."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.errors import QueryError
from objstate.geometry import BoolArray, FloatArray
from objstate.habits.passage import waiting
from objstate.habits.regions import region_of
from objstate.objects.belief import check_robot, checked_share
from objstate.objects.doors import LatticeFilter
from objstate.records import NANOSECONDS
from objstate.units import SECONDS_PER_HOUR
from objstate.world.habitual import state_of
from objstate.world.world import World

STEP_S = 300.0  # between the moments that are asked for
MOST_MOMENTS = 2100  # a week of such steps, and some
LONGEST_S = 7 * 86_400.0  # of a way from door to door
NEARLY = 0.01  # departures whose probability is less below the best one's are as good


@dataclass(frozen=True)
class Span:
    """A time in which a door may be passed with at least the probability that was asked for."""

    begin_ns: int
    end_ns: int
    probability: float  # on average


@dataclass(frozen=True)
class Wait:
    """How long a robot waits before a door until it may pass."""

    mean_s: float  # of what is waited until the horizon at most
    median_s: float | None  # None: later than the horizon
    within: float  # probability that it may pass by the horizon


@dataclass(frozen=True)
class Departure:
    """A moment to set off, and how probably all doors may be passed on the way."""

    stamp_ns: int
    probability: float


def passable(world: World, name: str, width: float, stamps_ns: Sequence[int]) -> FloatArray:
    """(n,) how probably a robot of a width, m, may pass a door at moments. Raises QueryError."""
    _check_door(world, name)
    moments = [world.moment(stamp) for stamp in stamps_ns]
    return np.array([world.belief(name, stamp).probability_clear(width) for stamp in moments])


def spans(
    world: World,
    name: str,
    width: float,
    begin_ns: int,
    horizon_s: float,
    probability: float = 0.5,
) -> tuple[Span, ...]:
    """When, within ``horizon_s`` from a moment, a door may be passed with at least ``probability``.

    In steps of five minutes. Raises QueryError for an unknown door, or a width, a horizon or a
    probability that is none.
    """
    probability = checked_share(probability)
    stamps = _moments(world, begin_ns, horizon_s)
    chances = passable(world, name, width, stamps)
    out, since = [], None
    for i, good in enumerate([*(chances >= probability), False]):
        if good and since is None:
            since = i
        elif not good and since is not None:
            end = stamps[min(i, len(stamps) - 1)]
            out.append(Span(stamps[since], end, float(chances[since:i].mean())))
            since = None
    return tuple(out)


def wait(world: World, name: str, width: float, stamp_ns: int, horizon_s: float) -> Wait:
    """How long a robot that stands before a door from a moment on waits until it may pass.

    Needs the door's habits; without, a door is moved at the rate that the settings have.
    Raises QueryError for an unknown door, or a width or a horizon that is none.
    """
    _check_door(world, name)
    check_robot(width)
    _moments(world, stamp_ns, horizon_s)
    belief, habits = world.belief(name, stamp_ns), world.habits_of(name)
    filter_ = world.filter_of(name)
    if habits is None or not isinstance(filter_, LatticeFilter):
        return _by_settings(world, name, width, stamp_ns, horizon_s)
    site = habits.sites[name]
    clear = _clear_regions(world, name, width, region_of(filter_.distances, site.bounds))
    state = state_of(habits, filter_, belief, stamp_ns)
    end = stamp_ns + round(horizon_s * NANOSECONDS)
    return _wait(*waiting(habits.forecast(name), state, clear, stamp_ns, end))


def best_departure(
    world: World,
    doors: Sequence[tuple[str, float]],
    width: float,
    begin_ns: int,
    horizon_s: float,
) -> Departure:
    """The earliest moment to set off that is as good as any within ``horizon_s``, for a route.

    ``doors`` are those on the way, each with the seconds from the departure at which it is
    reached. They count as independent. Raises QueryError.
    """
    for name, seconds in doors:
        if not 0.0 <= seconds <= LONGEST_S:
            raise QueryError(
                f"'{name}' can't be reached {seconds} s after the departure; give 0 to "
                f"{LONGEST_S:g} s."
            )
    stamps = _moments(world, begin_ns, horizon_s)
    chance = np.ones(len(stamps))
    for name, seconds in doors:
        later = [stamp + round(seconds * NANOSECONDS) for stamp in stamps]
        chance *= passable(world, name, width, later)
    best = int(np.argmax(chance >= chance.max() - NEARLY))
    return Departure(stamps[best], float(chance[best]))


def _moments(world: World, begin_ns: int, horizon_s: float) -> list[int]:
    """Stamps in steps from a moment to the horizon. Raises QueryError."""
    begin_ns = world.moment(begin_ns)
    if not 0.0 <= horizon_s < math.inf:
        raise QueryError(f"A horizon of {horizon_s} s must be 0 or more, and finite.")
    count = math.ceil(horizon_s / STEP_S)
    if count >= MOST_MOMENTS:
        raise QueryError(f"A horizon of {horizon_s / 86400:g} days is too far; ask for a week.")
    steps = np.minimum(np.arange(count + 1) * STEP_S, horizon_s)
    return [begin_ns + round(step * NANOSECONDS) for step in steps.tolist()]


def _check_door(world: World, name: str) -> None:
    if not isinstance(world.filter_of(name), LatticeFilter):
        raise QueryError(f"'{name}' is no door; give one of those of the building.")


def _clear_regions(world: World, name: str, width: float, region: np.ndarray) -> BoolArray:
    """(r,) regions in most of which a robot may pass."""
    filter_ = world.filter_of(name)
    prior = filter_.prior(np.random.default_rng(0))
    clear = prior.clear_width.values >= width
    count = int(region.max()) + 1
    shares = np.bincount(region, weights=clear, minlength=count) / np.bincount(region)
    out = np.asarray(shares > 0.5)
    if clear.any() and not out.any():
        out[-1] = True
    return out


def _by_settings(world: World, name: str, width: float, stamp_ns: int, horizon_s: float) -> Wait:
    """Where a door that is in the way is moved once, it is as any that was moved."""
    filter_ = world.filter_of(name)
    assert isinstance(filter_, LatticeFilter)
    prior = filter_.prior(np.random.default_rng(0))
    good = float(filter_.rests[prior.clear_width.values >= width].sum())
    now = world.belief(name, stamp_ns).probability_clear(width)
    rate = filter_.settings.dynamics.moves_per_hour * good / SECONDS_PER_HOUR
    times = np.linspace(0.0, horizon_s, 1000)
    return _wait(times, (1.0 - now) * np.exp(-rate * times))


def _wait(times: FloatArray, alive: FloatArray) -> Wait:
    later = np.flatnonzero(alive <= 0.5)
    median = None
    if len(later):
        i = int(later[0])
        median = 0.0 if i == 0 else float(np.interp(0.5, alive[[i, i - 1]], times[[i, i - 1]]))
    return Wait(float(np.trapezoid(alive, times)), median, 1.0 - float(alive[-1]))
