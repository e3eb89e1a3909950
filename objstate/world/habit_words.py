"""Habits in words that JSON has."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

from objstate.building.model import Kind
from objstate.errors import WorldError
from objstate.habits.site import Site
from objstate.habits.summary import WeekHabit, week_habit
from objstate.world.world import World

NAMES = {
    2: ("closed", "open"),
    3: ("closed", "ajar", "open"),
    4: ("closed", "ajar", "open", "wide"),
}


def habit_words(world: World) -> dict[str, dict[str, Any]]:
    """Of each door whose habits are known: regions, looks, and a week hour by hour."""
    if world.habits is None:
        return {}
    return {name: _door(world, name) for name in world.objects if world.habits_of(name) is not None}


def week_of(world: World, name: str) -> WeekHabit:
    """A week of a door, that in which the world learnt last. Raises WorldError where nothing is known."""
    habits = world.habits_of(name)
    if habits is None:
        raise WorldError(f"Nothing is known of the habits of '{name}'.")
    since = habits.calendar.local(world.latest_ns or 0).date()
    return week_habit(habits.forecast(name), since)


def region_names(world: World, name: str) -> tuple[str, ...]:
    """What the regions of a door are called, from the closed one on."""
    return NAMES[len(_site(world, name).bounds) + 1]


def _site(world: World, name: str) -> Site:
    assert world.habits is not None
    return world.habits.sites[name]


def _door(world: World, name: str) -> dict[str, Any]:
    site, week = _site(world, name), week_of(world, name)
    hinged = world.objects[name].kind is Kind.HINGED
    return {
        "class": world.objects[name].kind.value,
        "regions": list(region_names(world, name)),
        "bounds_deg" if hinged else "bounds_m": [
            math.degrees(bound) if hinged else bound for bound in site.bounds
        ],
        "looks": site.looks,
        "first_ns": site.first_ns,
        "last_ns": None if site.last is None else site.last.stamp_ns,
        "shares": [asdict(share) for share in week.shares],
        "moves_per_day": asdict(week.moves_per_day),
        "hours": [asdict(hour) for hour in week.hours],
    }
