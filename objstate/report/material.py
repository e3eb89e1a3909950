"""The material of a report: everything in a result folder, and the files that it names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from objstate.building import load_building
from objstate.building.digest import geometry_digest
from objstate.building.model import Building
from objstate.errors import ResultError
from objstate.evaluation.lost import Stretches, read_lost, within
from objstate.lazy import lazy
from objstate.recording.candidates import Found, read_candidates
from objstate.recording.events import Event, read_events
from objstate.recording.grids import read_clutter
from objstate.recording.posteriors import read_posteriors
from objstate.recording.scans import read_scans
from objstate.recording.summary import SUMMARY, read_summary
from objstate.recording.tables import read_states, read_truth
from objstate.recording.tum import TRAJECTORY, read_tum
from objstate.records import Path as RobotPath
from objstate.records import TrueState
from objstate.report.course import Course

if TYPE_CHECKING:
    import polars as pl


@dataclass(frozen=True, eq=False)
class Material:
    """One result, read in full."""

    folder: Path
    summary: Mapping[str, Any]  # run.json
    building: Building
    estimates: pl.DataFrame
    posteriors: pl.DataFrame
    path: RobotPath
    lost: Stretches
    clutter: pl.DataFrame  # without rows in results that mapped none
    candidates: tuple[Found, ...] = ()  # for objects, where the result has a grid
    truth: list[TrueState] | None = None
    true_path: RobotPath | None = None
    scans: pl.DataFrame | None = None  # none in results that kept none
    events: tuple[Event, ...] = ()  # movements, where the result has them
    doubts: tuple[str, ...] = ()  # warnings about the material itself

    @property
    def begin_ns(self) -> int:
        """The stamp from which seconds count."""
        return int(self.summary["begin_ns"])

    @property
    def duration(self) -> float:
        """Seconds of log."""
        return float(self.summary["timings"]["log_seconds"])

    @lazy
    def looks(self) -> pl.DataFrame:
        """The estimates that a page shows: observed ones, and those before the first of them.

        As with ``latest_states``, estimates that were withdrawn because the robot was lost are left
        out.
        """
        import polars as pl

        stood = self.estimates.filter(~within(self.estimates["stamp"].to_numpy(), self.lost))
        first = pl.col("stamp").filter("observed").min().over("object")
        return stood.filter(pl.col("observed") | (pl.col("stamp") < first).fill_null(True))

    @property
    def symmetry(self) -> Mapping[str, int]:
        """The orders of those objects that look the same after some turns."""
        return dict(self.summary.get("symmetry", {}))

    @property
    def laser_height(self) -> float:
        """Where the plan cuts the building, m: the height of the lowest laser."""
        return min(map(float, self.summary["laser_heights"].values()))

    @property
    def course(self) -> Course:
        """The robot's way."""
        searching = bool(self.summary["options"].get("global_start")) and len(self.lost) > 0
        return Course(self.path, self.lost, searching, self.begin_ns, self.duration)


def read_material(
    folder: str | Path,
    building: str | Path | None = None,
    truth: str | Path | None = None,
    true_path: str | Path | None = None,
    *,
    filtered: bool = False,
) -> Material:
    """Read a result folder and the building and truth that its ``run.json`` names.

    States are the smoothed ones, or with ``filtered`` those that could be known at the time. Files
    given here are used instead. A truth that the result names but that is gone becomes a warning; a
    building that is gone is an error. Raises ResultError, BuildingError and TruthError.
    """
    folder = Path(folder)
    summary = read_summary(folder)
    missing = {"begin_ns", "timings", "laser_heights", "inputs", "options"} - summary.keys()
    if missing:
        raise ResultError(
            f"{folder / SUMMARY} lacks {', '.join(sorted(missing))}; make the result anew with "
            "`objstate estimate`."
        )
    inputs, doubts = summary["inputs"], []
    model = load_building(Path(building) if building else _building(folder, inputs["building"]))
    if not set(summary["objects"]) <= set(model.objects):
        raise ResultError(
            f"{model.source or building} is not the building of {folder}: it lacks "
            f"{', '.join(sorted(set(summary['objects']) - set(model.objects)))}; give the right "
            "one with --building."
        )
    if geometry_digest(model) != inputs["building"]["geometry_sha256"]:
        doubts.append(f"{model.source} has changed since the run; the plan may not fit it.")
    states_file = truth or _found(folder, inputs.get("truth"), doubts)
    path_file = true_path or _found(folder, inputs.get("true_path"), doubts)
    return Material(
        folder=folder,
        summary=summary,
        building=model,
        estimates=read_states(folder, filtered=filtered),
        posteriors=read_posteriors(folder),
        path=read_tum(folder / TRAJECTORY),
        scans=read_scans(folder),
        clutter=read_clutter(folder),
        candidates=tuple(read_candidates(folder)),
        events=_events(folder, doubts),
        lost=read_lost(folder),
        truth=None if states_file is None else read_truth(states_file),
        true_path=None if path_file is None else read_tum(path_file),
        doubts=tuple(doubts),
    )


def _events(folder: Path, doubts: list[str]) -> tuple[Event, ...]:
    """The movements; a warning where they can't be read."""
    try:
        return tuple(read_events(folder))
    except ResultError as error:
        doubts.append(str(error))
        return ()


def _building(folder: Path, described: Mapping[str, Any]) -> Path:
    found = _look_for(folder, described)
    if found is None:
        raise ResultError(
            f"The building of {folder}, {described['path']}, is gone or was moved; say where it is "
            "with --building."
        )
    return found


def _found(folder: Path, described: Mapping[str, Any] | None, doubts: list[str]) -> Path | None:
    """A file with the truth, if the result names one; a warning where it is gone."""
    if described is None:
        return None
    found = _look_for(folder, described)
    if found is None:
        doubts.append(f"{described['path']}, which held the truth, is gone or was moved.")
    return found


def _look_for(folder: Path, described: Mapping[str, Any]) -> Path | None:
    """An input, where it lay as seen from the result, or as its path was typed."""
    places = [folder / described.get("from_result", described["path"]), Path(described["path"])]
    return next((place for place in places if place.is_file()), None)
