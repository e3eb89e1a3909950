"""Habits in words that JSON has."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import Any

import numpy as np

from objstate.building.model import Kind
from objstate.errors import WorldError
from objstate.geometry import FloatArray
from objstate.habits.site import Site
from objstate.habits.summary import WeekHabit, week_habit, week_moves
from objstate.world.world import World

SAME_PLACE = 0.3  # m
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


def piece_words(world: World) -> dict[str, dict[str, Any]]:
    """Of each piece of furniture whose habits are known: looks, places, and moves hour by hour."""
    return {name: _piece(world, name) for name in world.objects if world.moves_of(name) is not None}


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
    return week_moves(habits.forecast(name).rates)


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
