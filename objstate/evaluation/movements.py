"""Movements that a result found, beside the true ones."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation.states import Coordinate, TrueCourse
from objstate.evaluation.summary import ROTATIONS
from objstate.geometry import IntArray, wrapped
from objstate.recording.events import SAME, Event

if TYPE_CHECKING:
    import polars as pl

PAUSE_NS = 2_000_000_000  # between changes of which it is that the object rests
SLACK_NS = 1_000_000_000  # by which a movement may lie beside the interval that was told


@dataclass(frozen=True)
class MovementErrors:
    """True movements of one object, or of all, and those that were found."""

    object: str | None  # None: all objects together
    count: int  # true movements with a moment before and one after at which the object was observed
    found: int  # of these, those in whose time a movement is told
    false: int  # movements that are told in whose time there was none


def movement_errors(
    events: Iterable[Event], estimates: pl.DataFrame, courses: Mapping[Coordinate, TrueCourse]
) -> tuple[MovementErrors, ...]:
    """Of each object of which some movement is true or told, and of all together, last.

    Movements before an object's truth begins aren't compared. Empty where there are none.
    """
    told, observed = _told(events), _observed(estimates)
    by_object = defaultdict[str, list[tuple[str, TrueCourse]]](list)
    for (name, coordinate), course in sorted(courses.items()):
        by_object[name].append((coordinate, course))
    each = [
        _of_object(name, own, told.get(name, []), observed[name])
        for name, own in by_object.items()
        if name in observed
    ]
    some = [entry for entry in each if entry.count or entry.false]
    return (*some, together(some)) if some else ()


def together(entries: Sequence[MovementErrors]) -> MovementErrors:
    """The sum over objects or logs."""
    return MovementErrors(
        None,
        sum(entry.count for entry in entries),
        sum(entry.found for entry in entries),
        sum(entry.false for entry in entries),
    )


def _of_object(
    name: str,
    courses: Sequence[tuple[str, TrueCourse]],
    told: Sequence[tuple[int, int]],
    observed: IntArray,
) -> MovementErrors:
    begin = max(int(course.stamps_ns[0]) for _, course in courses)
    true = _movements(courses)
    told = [stretch for stretch in told if stretch[1] >= begin]
    seen = [(a, b) for a, b in true if observed[0] < a and observed[-1] > b]
    return MovementErrors(
        name,
        len(seen),
        sum(any(_overlap(one, other) for other in told) for one in seen),
        sum(not any(_overlap(one, other) for other in true) for one in told),
    )


def _overlap(one: tuple[int, int], other: tuple[int, int]) -> bool:
    return one[0] <= other[1] + SLACK_NS and other[0] <= one[1] + SLACK_NS


def _movements(courses: Sequence[tuple[str, TrueCourse]]) -> list[tuple[int, int]]:
    """From when to when an object moved; changes without a pause between them are one movement."""
    changes = np.unique(np.concatenate([_changes(*each) for each in courses]))
    if len(changes) == 0:
        return []
    cuts = np.flatnonzero(np.diff(changes) >= PAUSE_NS) + 1
    return [(int(part[0]), int(part[-1])) for part in np.split(changes, cuts)]


def _changes(coordinate: str, course: TrueCourse) -> IntArray:
    """The stamps at which a true value becomes another one."""
    turns, at, out = coordinate in ROTATIONS, float(course.values[0]), list[int]()
    same = SAME["angle" if turns else "offset"]
    for stamp, value in zip(course.stamps_ns.tolist(), course.values.tolist(), strict=True):
        if abs(wrapped(value - at) if turns else value - at) > same:
            out.append(stamp)
            at = value
    return np.array(out, dtype=np.int64)


def _told(events: Iterable[Event]) -> dict[str, list[tuple[int, int]]]:
    """The intervals of an object's movements, which have a row for each coordinate."""
    told = defaultdict[str, set[tuple[int, int]]](set)
    for event in events:
        told[event.object].add(event.stretch)
    return {name: sorted(stretches) for name, stretches in told.items()}


def _observed(estimates: pl.DataFrame) -> dict[str, IntArray]:
    """(n,) ascending stamps at which each object was observed, of those that were."""
    rows = estimates.filter("observed").sort("stamp")
    parts = rows.partition_by("object", as_dict=True)
    return {str(name): part["stamp"].to_numpy() for (name,), part in parts.items()}
