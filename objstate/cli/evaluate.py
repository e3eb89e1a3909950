"""``objstate evaluate``"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.tables import new_table, percent

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.evaluation import CoordinateErrors, Distances, Evaluation, StateErrors

EXAMPLES = """\b
Examples:
  objstate evaluate out/corridor --truth logs/corridor.truth.csv
  objstate evaluate out/corridor --truth logs/corridor.truth.csv \\
      --path logs/corridor.path.tum --json out/corridor.errors.json
"""

LEGEND = (
    "Absolute errors; bias is estimate minus truth. <5, <10: % of errors of at most 5 and\n"
    "10 deg or cm. in 90%: % of truths inside the 90 % intervals."
)


def evaluate(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A result of estimate.")],
    truth: Annotated[
        Path,
        typer.Option(
            metavar="CSV", help="True states: stamp,object,coordinate,value (ns; rad, m)."
        ),
    ],
    path: Annotated[Path | None, typer.Option(metavar="TUM", help="The robot's true path.")] = None,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help="Write the figures here too.")
    ] = None,
) -> None:
    """Compare a result with the truth.

    Prints the errors of every object, how often the truth lies inside the 90 % intervals, and the
    error of the robot itself.
    """
    from objstate.evaluation import evaluate as evaluate_result

    evaluation = evaluate_result(folder, truth, path)
    if json_file is not None:
        json_file.write_text(json.dumps(evaluation.to_dict(), indent=2) + "\n", encoding="utf-8")
    _print(evaluation)


def _print(evaluation: Evaluation) -> None:
    entries = (*evaluation.objects, *evaluation.overall)
    final = [(entry, entry.final) for entry in entries]
    updates = [(entry, entry.updates) for entry in entries]
    print_table(_state_table("When last observed, before each change and at the end", final))
    print_table(_state_table("At every update that observed the object", updates))
    print_text(LEGEND)
    if evaluation.robot is not None:
        robot = _robot_table(evaluation.robot.count)
        robot.add_row("position (m)", *_distances(evaluation.robot.position, 1.0, decimals=3))
        robot.add_row("yaw (deg)", *_distances(evaluation.robot.yaw, 180 / math.pi, decimals=2))
        print_table(robot)
    _print_names("Without truth", evaluation.without_truth)
    _print_names("Never observed", evaluation.never_observed)
    _print_names("Never estimated", evaluation.never_estimated)


def _state_table(
    title: str, entries: Iterable[tuple[CoordinateErrors, StateErrors | None]]
) -> Table:
    numbers = ("n", "mean", "median", "p90", "bias", "<5", "<10", "in 90%")
    table = new_table(title, ("object", "state"), numbers)
    for entry, errors in entries:
        if errors is not None:
            table.add_row(entry.object or "all", *_state_cells(entry, errors))
    return table


def _state_cells(entry: CoordinateErrors, errors: StateErrors) -> list[str]:
    unit, scale = ("deg", 180 / math.pi) if entry.unit == "rad" else ("cm", 100.0)
    lengths = (errors.mean, errors.median, errors.p90, errors.bias)
    shares = (errors.within_near, errors.within_far, errors.coverage)
    return [
        f"{entry.coordinate} ({unit})",
        str(errors.count),
        *(f"{scale * length:.1f}" for length in lengths),
        *map(percent, shares),
    ]


def _robot_table(count: int) -> Table:
    return new_table(
        f"The robot itself, {count} poses", ("error",), ("mean", "median", "p90", "at the end")
    )


def _distances(distances: Distances, scale: float, decimals: int) -> list[str]:
    figures = (distances.mean, distances.median, distances.p90, distances.end)
    return [f"{scale * figure:.{decimals}f}" for figure in figures]


def _print_names(label: str, names: tuple[str, ...]) -> None:
    if names:
        print_text(f"{label}: {', '.join(names)}")
