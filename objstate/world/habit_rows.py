"""Habits in a world's database: one row per object, brought up to date by each drive."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import Connection, delete, insert, select

from objstate.config import CalendarSettings, Settings
from objstate.habits.building import DoorHabits, Habits, PieceHabits, S, doors
from objstate.habits.calendar import Calendar, Season
from objstate.habits.factor import F, Factor
from objstate.habits.model import Known
from objstate.habits.moves import MoveDesign
from objstate.habits.piece import PieceSite, Sighting
from objstate.habits.site import Site, fitted_site
from objstate.objects import ObjectBelief, ObjectFilter
from objstate.objects.doors import LatticeFilter
from objstate.objects.furniture import SampleFilter
from objstate.packing import pack, unpack
from objstate.world.habitual import (
    class_of,
    first_bounds,
    found_bounds,
    has_habits,
    region_looks,
)
from objstate.world.moving import elsewhere, form_of, has_moves, sightings
from objstate.world.schema import HABITS


def calendar_of(settings: CalendarSettings) -> Calendar:
    """By which clock, holidays and seasons habits are told."""
    warm = None if settings.warm is None else Season(*settings.warm.days)
    return Calendar(settings.zone, frozenset(settings.holidays), warm)


@dataclass(frozen=True, eq=False)
class Learnt:
    """What a world knows of habits; None: of nothing of the kind."""

    doors: DoorHabits | None = None
    pieces: PieceHabits | None = None

    def also(self, newer: Learnt) -> Learnt:
        """With what is newer of some objects."""
        return Learnt(_with(self.doors, newer.doors), _with(self.pieces, newer.pieces))


def read_habits(
    connection: Connection,
    settings: Settings,
    filters: Mapping[str, ObjectFilter],
    *,
    only: bool = False,
) -> Learnt:
    """The habits of objects, of which those that were learnt by another calendar are left out.

    With ``only`` no others are read than those of the ``filters``, which are few.
    """
    text = settings.calendar.model_dump_json()
    query = select(HABITS.c.object, HABITS.c.site).where(HABITS.c.calendar == text)
    rows = connection.execute(query.where(HABITS.c.object.in_(filters)) if only else query).all()
    sites, pieces = dict[str, Site](), dict[str, PieceSite]()
    classes, forms = dict[str, str](), dict[str, str]()
    calendar = calendar_of(settings.calendar)
    seasons = calendar.seasons
    for name, packed in rows:
        filter_ = filters.get(name)
        if isinstance(filter_, LatticeFilter):
            sites[name], classes[name] = unpack_site(packed, name, seasons), class_of(filter_)
        elif isinstance(filter_, SampleFilter):
            pieces[name], forms[name] = unpack_piece(packed, name, seasons), form_of(filter_)
    return Learnt(
        DoorHabits(calendar, sites, classes, doors) if sites else None,
        PieceHabits(calendar, pieces, forms, MoveDesign) if pieces else None,
    )


def _with(known: Habits[S, F] | None, newer: Habits[S, F] | None) -> Habits[S, F] | None:
    if known is None or newer is None:
        return known or newer
    return known.with_sites(newer.sites, newer.classes)


def learn(
    connection: Connection,
    settings: Settings,
    filters: Mapping[str, ObjectFilter],
    beliefs: Iterable[ObjectBelief],
) -> list[str]:
    """Let the habits take in what a drive taught; the objects whose habits are to be fitted anew."""
    of_object = dict[str, list[ObjectBelief]]()
    for belief in beliefs:
        of_object.setdefault(belief.item.name, []).append(belief)
    due = []
    for name, seen in of_object.items():
        filter_ = filters[name]
        if not (has_habits(filter_) or has_moves(filter_)):
            continue
        row = connection.execute(
            select(HABITS.c.calendar, HABITS.c.site).where(HABITS.c.object == name)
        ).first()
        if row is not None and row[0] != settings.calendar.model_dump_json():
            due.append(name)
            continue
        packed = None if row is None else row[1]
        site = _grown(calendar_of(settings.calendar), filter_, packed, seen)
        _write(connection, settings, name, site)
        if site.due:
            due.append(name)
    return due


def _grown(
    calendar: Calendar,
    filter_: LatticeFilter | SampleFilter,
    packed: bytes | None,
    seen: Sequence[ObjectBelief],
) -> Site | PieceSite:
    """The site of an object after a drive's beliefs."""
    name, seasons = filter_.item.name, calendar.seasons
    if isinstance(filter_, SampleFilter):
        piece = PieceSite.empty(seasons) if packed is None else unpack_piece(packed, name, seasons)
        nearest = filter_.item.symmetry.nearest
        return piece.with_looks(calendar, sightings(seen), elsewhere(filter_), nearest)
    if packed is None:
        site = Site.empty(first_bounds(filter_), seasons)
    else:
        site = unpack_site(packed, name, seasons)
    return site.with_looks(calendar, *region_looks(filter_, site.bounds, seen))


def refit(
    connection: Connection,
    settings: Settings,
    filter_: LatticeFilter | SampleFilter,
    beliefs: Sequence[ObjectBelief],
) -> None:
    """Fit an object's habits to all of its history; a door's with regions that it tells of."""
    calendar = calendar_of(settings.calendar)
    site: Site | PieceSite
    if isinstance(filter_, SampleFilter):
        nearest = filter_.item.symmetry.nearest
        site = PieceSite.fitted_to(calendar, sightings(beliefs), elsewhere(filter_), nearest)
    else:
        bounds = found_bounds(filter_, beliefs)
        site = fitted_site(bounds, calendar, *region_looks(filter_, bounds, beliefs))
    _write(connection, settings, filter_.item.name, site)


def _write(connection: Connection, settings: Settings, name: str, site: Site | PieceSite) -> None:
    connection.execute(delete(HABITS).where(HABITS.c.object == name))
    row = {
        "object": name,
        "calendar": settings.calendar.model_dump_json(),
        "site": pack_site(site) if isinstance(site, Site) else pack_piece(site),
    }
    connection.execute(insert(HABITS), [row])


def pack_site(site: Site) -> bytes:
    """A door's site as bytes; the root of its precision in single ones."""
    last = site.last
    words = _words(site) | {
        "bounds": site.bounds,
        "last_ns": None if last is None else last.stamp_ns,
    }
    arrays = _arrays(site) | {
        "rests": np.asarray(site.rests, dtype="<f4"),
        "state": np.zeros(0) if last is None else np.asarray(last.state, dtype="<f8"),
    }
    return pack(words, arrays)


def unpack_site(packed: bytes, name: str, seasons: bool = False) -> Site:
    """The site that was packed, of a calendar with seasons or without. Raises WorldError for damage."""
    words, arrays = unpack(packed, f"The habits of '{name}'")
    last = words["last_ns"]
    return Site(
        **_factor(words, arrays),
        bounds=tuple(words["bounds"]),
        rests=arrays["rests"].astype(float),
        seasons=seasons,
        last=None if last is None else Known(last, arrays["state"].astype(float)),
    )


def pack_piece(site: PieceSite) -> bytes:
    """A piece's site as bytes."""
    last = site.last
    words = _words(site) | {"taken": site.taken, "last_ns": None if last is None else last.stamp_ns}
    arrays = _arrays(site) | {
        each: np.asarray(getattr(site, each), dtype="<f8")
        for each in ("middles", "squares", "arrivals")
    }
    nothing = np.empty(0)
    state = None if last is None else last.state
    arrays["state"] = np.asarray(nothing if state is None else state, dtype="<f8")
    arrays["variance"] = np.asarray(nothing if last is None else last.variance, dtype="<f8")
    return pack(words, arrays)


def unpack_piece(packed: bytes, name: str, seasons: bool = False) -> PieceSite:
    """The site that was packed, as ``unpack_site``. Raises WorldError for damage."""
    words, arrays = unpack(packed, f"The habits of '{name}'")
    state, last = arrays["state"].astype(float), words["last_ns"]
    seen = state if len(state) else None
    return PieceSite(
        **_factor(words, arrays),
        middles=arrays["middles"].astype(float).reshape(-1, 3),
        squares=arrays["squares"].astype(float).reshape(-1, 3),
        arrivals=arrays["arrivals"].astype(float),
        taken=words["taken"],
        seasons=seasons,
        last=None if last is None else Sighting(last, seen, arrays["variance"].astype(float)),
    )


def _words(site: Factor[Any]) -> dict[str, Any]:
    return {"looks": site.looks, "fitted": site.fitted, "first_ns": site.first_ns}


def _arrays(site: Factor[Any]) -> dict[str, NDArray[Any]]:
    return {"pull": np.asarray(site.pull, dtype="<f8"), "root": np.asarray(site.root, dtype="<f4")}


def _factor(words: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> dict[str, Any]:
    """The fields of a factor."""
    pull = arrays["pull"].astype(float)
    root = arrays["root"].astype(float).reshape(-1, len(pull))
    counts = {each: words[each] for each in ("looks", "fitted", "first_ns")}
    return {"pull": pull, "root": root, **counts}
