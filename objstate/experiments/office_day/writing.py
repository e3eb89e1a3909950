"""The folder of a comparison: every trial as a row, and pictures."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from objstate.experiments.office_day.comparison import COORDINATOR, Worth
from objstate.experiments.reproduction import DPI, check_plotting
from objstate.recording.results import result_folder

TRIALS, CURVES, PATHS = "trials.csv", "curves.png", "paths.png"
SHOWN = (COORDINATOR, "greedy nearest")  # whose paths are drawn, where they drive least
COLUMNS = ("strategy", "knob", "day", "hours", "m_per_hour", "entropy_nat", "right", "predicted_nat",
           "realized_nat", "tasks", "outcomes", "lost")  # fmt: skip


def write(found: Sequence[Worth], out: str | Path, *, overwrite: bool = False) -> None:
    """Write a comparison's folder. Raises ResultError, and SettingsError without matplotlib."""
    from objstate.experiments.office_day.pictures import draw_curves, draw_paths

    check_plotting()
    with result_folder(out, overwrite=overwrite) as folder:
        with (folder / TRIALS).open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(COLUMNS)
            writer.writerows(_row(each) for each in found)
        for name, figure in ((CURVES, draw_curves(found)), (PATHS, draw_paths(_shown(found)))):
            figure.savefig(folder / name, dpi=DPI, facecolor="white")


def _row(worth: Worth) -> tuple[object, ...]:
    trial = worth.trial
    outcomes = " ".join(f"{name}:{count}" for name, count in worth.outcomes.items())
    figures = (worth.distance, worth.entropy, worth.right, worth.predicted, worth.realized)
    return (
        trial.strategy,
        trial.knob,
        trial.seed,
        trial.hours,
        *(f"{figure:.4f}" for figure in figures),
        worth.tasks,
        outcomes,
        worth.lost,
    )


def _shown(found: Sequence[Worth]) -> list[Worth]:
    """Of each strategy shown the trial with the largest knob on the first day."""
    chosen = []
    for name in SHOWN:
        mine = [each for each in found if each.trial.strategy == name]
        first = min(each.trial.seed for each in mine)
        day = [each for each in mine if each.trial.seed == first]
        chosen.append(max(day, key=lambda each: each.trial.knob))
    return chosen
