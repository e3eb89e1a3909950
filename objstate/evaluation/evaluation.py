"""A result folder against the truth."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.errors import ResultError, TruthError
from objstate.evaluation.lost import Stretches, read_lost
from objstate.evaluation.movements import MovementErrors, movement_errors
from objstate.evaluation.robot import RobotErrors, compare_paths
from objstate.evaluation.states import (
    Comparison,
    Coordinate,
    compare_all,
    true_courses,
)
from objstate.evaluation.summary import StateErrors, summarize_states, unit_of
from objstate.evaluation.symmetry import read_symmetry
from objstate.order import natural_key
from objstate.recording.events import read_events
from objstate.recording.summary import read_summary
from objstate.recording.tables import check_truth_times, read_states, read_truth, unknown_names
from objstate.recording.tum import read_path, read_tum
from objstate.records import TrueState

if TYPE_CHECKING:
    import polars as pl

NAMES_SHOWN = 5  # most names in a list


@dataclass(frozen=True)
class CoordinateErrors:
    """Errors of one coordinate, of one object or of all objects that have it."""

    object: str | None  # None: all objects together
    coordinate: str
    unit: str  # rad or m
    updates: StateErrors | None  # over all updates that observed the object
    final: StateErrors | None  # over the last one before each change and the end that stood


@dataclass(frozen=True)
class Evaluation:
    """How well a run's estimates and its path agree with the truth."""

    objects: tuple[CoordinateErrors, ...]
    overall: tuple[CoordinateErrors, ...]  # one for each kind of coordinate
    without_truth: tuple[str, ...]  # objects that were estimated, but whose truth is unknown
    never_observed: tuple[str, ...]  # objects with truth and estimates, but without an observation
    before_truth: tuple[str, ...]  # objects that were observed, but only before their truth begins
    never_estimated: tuple[str, ...]  # objects with truth and no estimate
    robot: RobotErrors | None
    notes: tuple[str, ...] = ()  # names of the truth that the building doesn't have
    movements: tuple[MovementErrors, ...] = ()  # of each object that has some; of all, last

    def to_dict(self) -> dict[str, Any]:
        """The same as plain dictionaries and lists, for JSON; rad and m."""
        return asdict(self)


def evaluate(
    folder: str | Path,
    truth: str | Path | None = None,
    path: str | Path | None = None,
    align: bool = False,
    *,
    filtered: bool = False,
) -> Evaluation:
    """Compare the result in ``folder`` with true states (CSV) and the true path (TUM), where given.

    An object is evaluated at the updates that observed it, from the first stamp of its truth on;
    what was taken back because the robot was lost counts among the updates, but not as final. Its
    states are those given the whole log, where the result has them, or with ``filtered`` those that
    the robot would have known then; then movements aren't compared. ``align`` moves the estimated
    path onto the true one first.
    Raises ResultError for a folder that holds no result and TruthError for a truth that can't be
    used or has no object of the result.
    """
    if truth is None:
        evaluation = Evaluation((), (), (), (), (), (), None)
    else:
        estimates, states = read_states(folder, filtered=filtered), read_truth(truth)
        evaluation = evaluate_states(
            estimates,
            states,
            read_lost(folder),
            read_symmetry(folder),
            source=str(truth),
        )
        notes = unknown_names(states, read_summary(folder)["objects"])
        events = [] if filtered else read_events(folder)
        moved = () if filtered else movement_errors(events, estimates, true_courses(states))
        evaluation = replace(evaluation, notes=tuple(notes), movements=moved)
    if path is None:
        return evaluation
    robot = compare_paths(read_path(folder), read_tum(path), align)
    return replace(evaluation, robot=robot)


def evaluate_states(
    estimates: pl.DataFrame,
    truth: Iterable[TrueState],
    lost: Stretches = (),
    symmetry: Mapping[str, int] | None = None,
    *,
    source: str = "The truth",
) -> Evaluation:
    """The errors of estimates (columns as in ``estimates.parquet``) against true states.

    Headings of objects with some order of ``symmetry`` are compared modulo 360 degrees / order.

    Raises TruthError where they share no coordinate of any object, and ResultError where
    there are no estimates.
    """
    truth = list(truth)
    estimated = set(estimates.select("object", "coordinate").unique().rows())
    courses = true_courses(truth)
    if not estimated:
        raise ResultError("The result holds no estimates: no scan was near an object.")
    if estimated.isdisjoint(courses):
        raise TruthError(
            f"{source} has none of this result's objects: it has {_listed(courses)}, the "
            f"result has {_listed(estimated)}; use the truth of the same building."
        )
    stamps = estimates["stamp"].to_numpy()
    check_truth_times(truth, int(stamps.min()), int(stamps.max()), source)
    compared = compare_all(estimates, courses, lost, symmetry or {})
    known, true, observed = (_objects(keys) for keys in (estimated, courses, compared))
    in_time = _objects(key for key, comparison in compared.items() if len(comparison.errors))
    return Evaluation(
        objects=tuple(_errors(*key, [compared[key]]) for key in sorted(compared, key=_by_name)),
        overall=_overall(compared),
        without_truth=_ordered(known - true),
        never_observed=_ordered((known & true) - observed),
        before_truth=_ordered(observed - in_time),
        never_estimated=_ordered(true - known),
        robot=None,
    )


def _overall(compared: Mapping[Coordinate, Comparison]) -> tuple[CoordinateErrors, ...]:
    """All objects together, one entry for each kind of coordinate."""
    kinds = sorted({coordinate for _, coordinate in compared})
    return tuple(
        _errors(None, kind, [part for (_, own), part in compared.items() if own == kind])
        for kind in kinds
    )


def _errors(name: str | None, coordinate: str, parts: Sequence[Comparison]) -> CoordinateErrors:
    errors = np.concatenate([part.errors for part in parts])
    inside = np.concatenate([part.inside for part in parts])
    final = np.concatenate([part.final for part in parts])
    return CoordinateErrors(
        object=name,
        coordinate=coordinate,
        unit=unit_of(coordinate),
        updates=summarize_states(coordinate, errors, inside),
        final=summarize_states(coordinate, errors[final], inside[final]),
    )


def _objects(keys: Iterable[Coordinate]) -> set[str]:
    return {name for name, _ in keys}


def _ordered(names: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(names, key=natural_key))


def _by_name(key: Coordinate) -> tuple[object, ...]:
    return (natural_key(key[0]), key[1])


def _listed(keys: Iterable[Coordinate]) -> str:
    names = [f"{name} ({coordinate})" for name, coordinate in sorted(keys, key=_by_name)]
    more = ["..."] if len(names) > NAMES_SHOWN else []
    return ", ".join([*names[:NAMES_SHOWN], *more]) or "none"
