"""Habits in words that JSON has."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import asdict
from datetime import date
from typing import Any

import numpy as np

from objstate.building.model import Kind
from objstate.errors import WorldError
from objstate.geometry import FloatArray
from objstate.habits.calendar import Calendar
from objstate.habits.site import Site
from objstate.habits.summary import WeekHabit, season_of, week_habit, week_moves
from objstate.objects.doors import LatticeFilter
from objstate.order import natural_key
from objstate.world.habit_rows import calendar_of
from objstate.world.habitual import of_moves
from objstate.world.world import World

SAME_PLACE = 0.3  # m
NAMES = {
    2: ("closed", "open"),
    3: ("closed", "ajar", "open"),
    4: ("closed", "ajar", "open", "wide"),
}


def habit_words(world: World, names: Collection[str] | None = None) -> dict[str, dict[str, Any]]:
    """Of each door whose habits are known: regions, looks, and a week hour by hour.

    It is a week of the season in which the world learnt last. A door takes about a second.
    """
    chosen = world.objects if names is None else names
    return {name: _door(world, name) for name in chosen if world.habits_of(name) is not None}


def piece_words(world: World, names: Collection[str] | None = None) -> dict[str, dict[str, Any]]:
    """Of each piece of furniture whose habits are known: looks, places, and moves hour by hour."""
    chosen = world.objects if names is None else names
    return {name: _piece(world, name) for name in chosen if world.moves_of(name) is not None}


def looked_at_once(world: World) -> list[str]:
    """The objects of which one look is known, which tells nothing of how they are moved."""
    sites = [
        (name, site.looks)
        for habits in (world.habits, world.pieces)
        if habits is not None
        for name, site in habits.sites.items()
    ]
    return sorted((name for name, looks in sites if looks == 1), key=natural_key)


def season_word(world: World) -> str | None:
    """Of which season the words are: cold or warm; None where the settings have none."""
    calendar = calendar_of(world.settings.calendar)
    return season_of(calendar, _since(world, calendar))


def _piece(world: World, name: str) -> dict[str, Any]:
    assert world.pieces is not None
    site, week = world.pieces.sites[name], moves_of(world, name)
    stood = site.stood
    return {
        "looks": site.looks,
        "first_ns": site.first_ns,
        "last_ns": None if site.last is None else site.last.stamp_ns,
        "moves_per_day": asdict(week.moves_per_day),
        "places": [
            {
                "share": float(share),
                "state": dict(zip(("x", "y", "yaw"), map(float, middle), strict=True)),
                "std": dict(zip(("x", "y", "yaw"), map(float, variance**0.5), strict=True)),
                "also_of": _others_at(world, name, middle),
            }
            for share, middle, variance in zip(
                stood.weights, stood.middles, stood.variances, strict=True
            )
        ],
        "away": stood.away,
        "hours": [
            {"kind": hour.kind, "hour": hour.hour, "moves_per_hour": asdict(hour.moves_per_hour)}
            for hour in week.hours
        ],
    }


def _others_at(world: World, name: str, place: FloatArray) -> list[str]:
    """Pieces of the same form that stood at a place (3,), too."""
    assert world.pieces is not None
    sites, forms = world.pieces.sites, world.pieces.classes
    return [
        other
        for other, site in sorted(sites.items())
        if other != name
        and forms[other] == forms[name]
        and (np.hypot(*(site.middles - place)[:, :2].T) < SAME_PLACE).any()
    ]


def moves_of(world: World, name: str) -> WeekHabit:
    """A week of a piece of furniture. Raises WorldError where nothing is known."""
    habits = world.moves_of(name)
    if habits is None:
        raise WorldError(f"Nothing is known of the habits of '{name}'.")
    return week_moves(habits.forecast(name), _since(world, habits.calendar))


def week_of(world: World, name: str) -> WeekHabit:
    """A week of a door, of the season in which the world learnt last; about a second.

    Raises WorldError where nothing is known.
    """
    habits, filter_ = world.habits_of(name), world.filter_of(name)
    if habits is None or not isinstance(filter_, LatticeFilter):
        raise WorldError(f"Nothing is known of the habits of '{name}'.")
    since = _since(world, habits.calendar)
    moves = of_moves(habits, filter_, world.history(name))
    return week_habit(habits.forecast(name), since).moved_as(week_habit(moves, since))


def _since(world: World, calendar: Calendar) -> date:
    """The local date at which the world learnt last."""
    return calendar.local(world.latest_ns or 0).date()


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
