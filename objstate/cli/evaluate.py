"""``objstate evaluate``"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_names, print_table, print_text
from objstate.cli.error_tables import (
    BOUND_LEGEND,
    LEGEND,
    bound_table,
    errors_table,
    robot_table,
)
from objstate.errors import ResultError

if TYPE_CHECKING:
    from objstate.bound import BoundEvaluation
    from objstate.evaluation import Evaluation

EXAMPLES = """\b
Examples:
  objstate evaluate out/corridor --truth logs/corridor.truth.csv
  objstate evaluate out/corridor --truth logs/corridor.truth.csv \\
      --path logs/corridor.path.tum --json out/corridor.errors.json
  objstate evaluate out/office --truth out/drive/truth.csv --bound
"""


def evaluate(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A result of estimate.")],
    truth: Annotated[
        Path,
        typer.Option(
            metavar="CSV", help="True states: stamp,object,coordinate,value (ns; rad, m)."
        ),
    ],
    path: Annotated[Path | None, typer.Option(metavar="TUM", help="The robot's true path.")] = None,
    bound: Annotated[
        bool,
        typer.Option(
            "--bound",
            help="How far from the Cramer-Rao bound; for drives that simulate made (needs the "
            "scene.yaml beside the truth).",
        ),
    ] = False,
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
    limit = _limit(folder, truth) if bound else None
    if json_file is not None:
        _write_json(json_file, evaluation, limit)
    _print(evaluation)
    if limit is not None and limit.objects:
        print_table(bound_table((*limit.objects, *limit.overall)))
        print_text(BOUND_LEGEND)


def _limit(folder: Path, truth: Path) -> BoundEvaluation:
    from objstate.bound import evaluate_bound

    return evaluate_bound(folder, truth)


def _write_json(file: Path, evaluation: Evaluation, limit: BoundEvaluation | None) -> None:
    figures = evaluation.to_dict() | ({} if limit is None else {"bound": limit.to_dict()})
    try:
        file.write_text(json.dumps(figures, indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise ResultError(
            f"Can't write {file}: {error.strerror}; choose another place for --json."
        ) from error


def _print(evaluation: Evaluation) -> None:
    entries = (*evaluation.objects, *evaluation.overall)
    if any(entry.updates for entry in entries):
        final = ((entry, entry.final) for entry in entries)
        updates = ((entry, entry.updates) for entry in entries)
        print_table(errors_table("When last observed, before each change and at the end", final))
        print_table(errors_table("At every update that observed the object", updates))
        print_text(LEGEND)
    else:
        print_text("No object was observed while its true state is known.")
    if evaluation.robot is not None:
        print_table(robot_table(evaluation.robot))
    print_names("Without truth", evaluation.without_truth)
    print_names("Never observed", evaluation.never_observed)
    print_names("Observed only before the truth begins", evaluation.before_truth)
    print_names("Never estimated", evaluation.never_estimated)
