"""Habits in a world's database: one row per door, brought up to date by each drive."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from sqlalchemy import Connection, delete, insert, select

from objstate.config import CalendarSettings, Settings
from objstate.habits.building import Habits
from objstate.habits.calendar import Calendar
from objstate.habits.model import Known
from objstate.habits.site import Site, fitted_site
from objstate.objects import ObjectBelief, ObjectFilter
from objstate.objects.doors import LatticeFilter
from objstate.packing import pack, unpack
from objstate.world.habitual import (
    class_of,
    first_bounds,
    found_bounds,
    has_habits,
    region_looks,
)
from objstate.world.schema import HABITS

FIRST_FIT = 64  # looks from which on habits are fitted to all of them, again when twice as many


def calendar_of(settings: CalendarSettings) -> Calendar:
    """By which clock and holidays habits are told."""
    return Calendar(settings.zone, frozenset(settings.holidays))


def read_habits(
    connection: Connection,
    settings: Settings,
    filters: dict[str, ObjectFilter],
    *,
    only: bool = False,
) -> Habits | None:
    """The habits of doors, of which those that were learnt by another calendar are left out; None: no row.

    With ``only`` no others are read than those of the ``filters``, which are few.
    """
    text = settings.calendar.model_dump_json()
    query = select(HABITS.c.object, HABITS.c.site).where(HABITS.c.calendar == text)
    rows = connection.execute(query.where(HABITS.c.object.in_(filters)) if only else query).all()
    sites, classes = {}, {}
    for name, packed in rows:
        filter_ = filters.get(name)
        if isinstance(filter_, LatticeFilter):
            sites[name], classes[name] = unpack_site(packed, name), class_of(filter_)
    return Habits(calendar_of(settings.calendar), sites, classes) if sites else None


def learn(
    connection: Connection,
    settings: Settings,
    filters: dict[str, ObjectFilter],
    beliefs: Iterable[ObjectBelief],
) -> list[str]:
    """Let the habits take in what a drive taught; the doors whose habits are to be fitted anew."""
    calendar, of_door = calendar_of(settings.calendar), dict[str, list[ObjectBelief]]()
    for belief in beliefs:
        of_door.setdefault(belief.item.name, []).append(belief)
    due = []
    for name, seen in of_door.items():
        filter_ = filters[name]
        if not (isinstance(filter_, LatticeFilter) and has_habits(filter_)):
            continue
        row = connection.execute(
            select(HABITS.c.calendar, HABITS.c.site).where(HABITS.c.object == name)
        ).first()
        if row is not None and row[0] != settings.calendar.model_dump_json():
            due.append(name)
            continue
        site = Site.empty(first_bounds(filter_)) if row is None else unpack_site(row[1], name)
        looks, rests = region_looks(filter_, site.bounds, seen)
        site = site.with_looks(calendar, looks, rests)
        _write(connection, settings, name, site)
        if site.looks >= max(FIRST_FIT, 2 * site.fitted):
            due.append(name)
    return due


def refit(
    connection: Connection,
    settings: Settings,
    filter_: LatticeFilter,
    beliefs: Sequence[ObjectBelief],
) -> None:
    """Fit a door's habits to all of its history, with regions that it tells of."""
    bounds = found_bounds(filter_, beliefs)
    looks, rests = region_looks(filter_, bounds, beliefs)
    site = fitted_site(bounds, calendar_of(settings.calendar), looks, rests)
    _write(connection, settings, filter_.item.name, site)


def _write(connection: Connection, settings: Settings, name: str, site: Site) -> None:
    connection.execute(delete(HABITS).where(HABITS.c.object == name))
    row = {
        "object": name,
        "calendar": settings.calendar.model_dump_json(),
        "site": pack_site(site),
    }
    connection.execute(insert(HABITS), [row])


def pack_site(site: Site) -> bytes:
    """A site as bytes; the root of its precision in single ones."""
    words: dict[str, Any] = {
        "bounds": site.bounds,
        "looks": site.looks,
        "fitted": site.fitted,
        "first_ns": site.first_ns,
        "last_ns": None if site.last is None else site.last.stamp_ns,
    }
    arrays = {
        "pull": np.asarray(site.pull, dtype="<f8"),
        "root": np.asarray(site.root, dtype="<f4"),
        "rests": np.asarray(site.rests, dtype="<f4"),
        "state": np.zeros(0) if site.last is None else np.asarray(site.last.state, dtype="<f8"),
    }
    return pack(words, arrays)


def unpack_site(packed: bytes, name: str) -> Site:
    """The site that was packed. Raises WorldError for damage."""
    words, arrays = unpack(packed, f"The habits of '{name}'")
    pull = arrays["pull"].astype(float)
    last = words["last_ns"]
    return Site(
        tuple(words["bounds"]),
        pull,
        arrays["root"].astype(float).reshape(-1, len(pull)),
        arrays["rests"].astype(float),
        words["looks"],
        words["fitted"],
        words["first_ns"],
        None if last is None else Known(last, arrays["state"].astype(float)),
    )
