"""Errors of a run's estimates beside the least that they could have been."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.bound.drive import Bounds, bounds_of
from objstate.building import load_building
from objstate.errors import TruthError
from objstate.evaluation.lost import Stretches, read_lost
from objstate.evaluation.states import Comparison, Coordinate, compare_all, true_courses
from objstate.evaluation.summary import unit_of
from objstate.geometry import FloatArray
from objstate.recording.tables import read_estimates, read_truth
from objstate.records import TrueState
from objstate.simulation.drive import SCENE, Simulation
from objstate.simulation.scene import load_scene

if TYPE_CHECKING:
    import polars as pl

MEDIAN_OF_NORMAL = 0.67449  # of the absolute value, standard deviations


@dataclass(frozen=True)
class BoundErrors:
    """Final errors of one coordinate, of one object or of all, beside their bound."""

    object: str | None  # None: all objects together
    coordinate: str
    unit: str  # rad or m
    count: int  # errors: the last observed estimate before each change and the end
    error: float  # root of the mean square
    bound: float  # root of the mean square
    ratio: float  # error by bound
    # Median of each error by its own bound, 1 where all are as the bound has it; one
    # wrong object among many doesn't change it.
    typical_ratio: float


@dataclass(frozen=True)
class BoundEvaluation:
    """How far a run stayed from the Cramér-Rao bound."""

    objects: tuple[BoundErrors, ...]
    overall: tuple[BoundErrors, ...]  # one for each kind of coordinate

    def to_dict(self) -> dict[str, Any]:
        """The same as plain dictionaries and lists, for JSON; rad and m."""
        return asdict(self)


def evaluate_bound(folder: str | Path, truth: str | Path) -> BoundEvaluation:
    """Hold a result's final errors against the Cramér-Rao bound of its simulated drive.

    ``folder`` is the result, ``truth`` the ``truth.csv`` of the simulation, beside
    which ``scene.yaml`` lies; the building must be as it was. Raises TruthError where
    it is no simulation's or another one's, and whatever ``evaluate`` raises.
    """
    simulation, states = _simulation(Path(truth)), read_truth(truth)
    if not _same(states, simulation.truth()):
        raise TruthError(
            f"{truth} isn't what {Path(truth).with_name(SCENE)} makes, or the building has changed "
            "since; make both anew with `objstate simulate`."
        )
    bounds = bounds_of(simulation)
    return compare_with_bounds(read_estimates(folder), states, bounds, read_lost(folder))


def compare_with_bounds(
    estimates: pl.DataFrame, truth: Iterable[TrueState], bounds: Bounds, lost: Stretches = ()
) -> BoundEvaluation:
    """Final errors of estimates (columns as in ``estimates.parquet``) beside their bounds."""
    compared = compare_all(estimates, true_courses(truth), lost)
    finals = {key: _final(comparison, bounds, key) for key, comparison in compared.items()}
    finals = {key: final for key, final in finals.items() if len(final)}
    kinds = sorted({coordinate for _, coordinate in finals})
    return BoundEvaluation(
        objects=tuple(bound_errors(*key, [finals[key]]) for key in sorted(finals)),
        overall=tuple(
            bound_errors(None, kind, [part for (_, own), part in finals.items() if own == kind])
            for kind in kinds
        ),
    )


def bound_errors(name: str | None, coordinate: str, finals: Sequence[FloatArray]) -> BoundErrors:
    """The summary of errors and bounds (n, 2) in the coordinate's unit, at least one."""
    errors, bounds = np.concatenate(finals).T
    error, bound = (float(np.sqrt(np.mean(values**2))) for values in (errors, bounds))
    return BoundErrors(
        object=name,
        coordinate=coordinate,
        unit=unit_of(coordinate),
        count=len(errors),
        error=error,
        bound=bound,
        ratio=error / bound,
        typical_ratio=float(np.median(np.abs(errors) / bounds)) / MEDIAN_OF_NORMAL,
    )


def _final(comparison: Comparison, bounds: Bounds, coordinate: Coordinate) -> FloatArray:
    """(n, 2) the final errors of a coordinate, each with its bound."""
    chosen = comparison.final
    limits = bounds.at(coordinate, comparison.stamps_ns[chosen])
    return np.column_stack([comparison.errors[chosen], limits])


def _simulation(truth: Path) -> Simulation:
    """The simulation that a truth comes from, by the scene beside it."""
    path = truth.with_name(SCENE)
    if not path.is_file():
        raise TruthError(
            f"There is no {SCENE} beside {truth}: only a simulated drive has a bound. Give the "
            "truth.csv in the folder that `objstate simulate` wrote."
        )
    scene = load_scene(path)
    return Simulation(scene, load_building(scene.building))


def _same(told: Sequence[TrueState], made: Iterable[TrueState]) -> bool:
    return list(told) == list(made)
