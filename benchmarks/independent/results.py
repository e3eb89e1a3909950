"""A drive's truth and a result folder, read and measured."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from benchmarks.independent import metrics
from benchmarks.independent.metrics import Door, Durations, Estimates, Robot, Value
from benchmarks.smoothing import Told, told_by
from objstate.evaluation.states import true_courses
from objstate.recording.tables import read_truth as read_courses

TABLES = ("estimates", "smoothed")  # Parquet files of a result that are measured, where they exist
TRAJECTORIES = {"estimates": "trajectory.tum", "smoothed": "smoothed.tum"}


@dataclass(frozen=True)
class Measured:
    """What one table of one drive came to."""

    scenario: str
    seed: int
    table: str
    finals: list[Value]
    after_ends: list[Value]
    sure_and_wrong: Durations
    misclassified: Durations | None  # closed or not, of all doors in view
    ajar_misclassified: Durations | None  # the same of doors that are closed or ajar
    robot: Robot
    seconds: float  # of the run
    movements: Told | None = None  # of the smoothed table

    @property
    def key(self) -> tuple[str, int, str]:
        """What it is paired by."""
        return self.scenario, self.seed, self.table


def measure(scenario: str, seed: int, drive: Path, result: Path, seconds: float) -> list[Measured]:
    """Every table of a result folder against the truth of its drive."""
    facts = json.loads((drive / "facts.json").read_text(encoding="utf-8"))
    truth, courses = read_truth(drive, facts), true_courses(read_courses(drive / "truth.csv"))
    ends = [(str(name), int(stamp)) for name, stamp in facts["ends"]]
    lost = _lost(json.loads((result / "run.json").read_text(encoding="utf-8")), facts["end"])
    measured = []
    for table in TABLES:
        if not (result / f"{table}.parquet").exists():
            continue
        estimates = read_estimates(result / f"{table}.parquet", lost)
        path = result / TRAJECTORIES[table]
        if not path.exists():
            path = result / TRAJECTORIES["estimates"]
        measured.append(
            Measured(
                scenario=scenario,
                seed=seed,
                table=table,
                finals=metrics.final_values(truth, estimates),
                after_ends=metrics.values_after_ends(truth, estimates, ends),
                sure_and_wrong=metrics.sure_and_wrong(truth, estimates, facts["end"]),
                misclassified=metrics.misclassified(truth, estimates, facts["end"]),
                ajar_misclassified=metrics.misclassified(
                    truth, estimates, facts["end"], metrics.AJAR
                ),
                robot=metrics.robot(*read_path(path), *read_path(drive / "path.tum"), lost),
                seconds=seconds,
                movements=told_by(result, courses) if table == "smoothed" else None,
            )
        )
    return measured


def read_truth(drive: Path, facts: dict[str, Any]) -> dict[str, Door]:
    """The doors of a drive."""
    rows = pl.read_csv(drive / "truth.csv").sort("stamp")
    seen = np.load(drive / "seen.npz")
    doors = {}
    for number, name in enumerate(facts["doors"]):
        of_door = rows.filter(pl.col("object") == name)
        stamps, angles = of_door["stamp"].to_numpy(), of_door["value"].to_numpy()
        views = seen["stamps"][seen["beams"][:, number] >= metrics.BEAMS_IN_VIEW]
        doors[name] = Door(stamps, angles, tuple(facts["limits"][name]), views)
    return doors


def read_estimates(path: Path, lost: Iterable[tuple[int, int]] = ()) -> dict[str, Estimates]:
    """The rows of a table that scans bore on, by door; none of while the robot was lost."""
    rows = pl.read_parquet(path).filter(pl.col("coordinate") == "angle")
    if "observed" in rows.columns:
        rows = rows.filter(pl.col("observed"))
    for begin, until in lost:
        rows = rows.filter(~pl.col("stamp").is_between(begin, until))
    value = "median" if "median" in rows.columns else "mean"  # of an earlier version
    doors = {}
    for name in rows["object"].unique().sort():
        of_door = rows.filter(pl.col("object") == name).sort("stamp", maintain_order=True)
        columns = [of_door[column].to_numpy() for column in ("stamp", value, "lower", "upper")]
        closed = of_door["p_closed"].to_numpy() if "p_closed" in rows.columns else None
        doors[name] = Estimates(*columns, closed)
    return doors


def read_path(path: Path) -> tuple[metrics.Ints, metrics.Floats]:
    """Stamps and positions (n, 2) of a TUM file."""
    stamps, positions = [], []
    for line in path.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            fields = line.split()
            seconds, _, rest = fields[0].partition(".")
            stamps.append(int(seconds) * metrics.SECOND + int(f"{rest:0<9}"[:9]))
            positions.append((float(fields[1]), float(fields[2])))
    return np.array(stamps, np.int64), np.array(positions).reshape(-1, 2)


def _lost(run: dict[str, Any], end: int) -> list[tuple[int, int]]:
    """When the run says that the robot was lost."""
    return [
        (int(begin), end if until is None else int(until))
        for begin, until in run.get("lost_ns", [])
    ]


def to_json(drives: Iterable[Measured]) -> str:
    """Drives as JSON, which :func:`from_json` reads."""
    return json.dumps([asdict(drive) for drive in drives], indent=1)


def from_json(text: str) -> list[Measured]:
    """Drives of a JSON text."""
    return [_drive(item) for item in json.loads(text)]


def _drive(item: dict[str, Any]) -> Measured:
    values = {name: [Value(**value) for value in item[name]] for name in ("finals", "after_ends")}
    shares = {
        name: None if item[name] is None else Durations(**item[name])
        for name in ("sure_and_wrong", "misclassified", "ajar_misclassified")
    }
    localized = Durations(**item["robot"]["localized"])
    robot = Robot(item["robot"]["error"], localized)
    told = item.get("movements")  # none in files of earlier versions
    movements = None if told is None else Told(**told)
    return Measured(**{**item, **values, **shares, "robot": robot, "movements": movements})
