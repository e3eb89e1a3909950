"""``objstate evaluate``"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.batch_tables import (
    calibration_table,
    difference_table,
    group_tables,
    overall_table,
)
from objstate.cli.console import print_names, print_table, print_text, print_warnings
from objstate.cli.error_tables import (
    BOUND_LEGEND,
    LEGEND,
    MOVEMENTS_LEGEND,
    ROBOT_LEGEND,
    bound_table,
    errors_table,
    movements_table,
    robot_table,
)
from objstate.cli.json_values import JSON_HELP, json_values, write_json
from objstate.cli.options import Quiet
from objstate.cli.progress import progress_bar
from objstate.errors import ResultError, SettingsError
from objstate.kinds import RESULT, instead

if TYPE_CHECKING:
    from objstate.bound import BoundEvaluation
    from objstate.evaluation import Evaluation, MovementErrors
    from objstate.evaluation.batch import BatchEvaluation

EXAMPLES = """\b
Examples:
  objstate evaluate out/corridor --truth logs/corridor.truth.csv
  objstate evaluate out/corridor --truth logs/corridor.truth.csv \\
      --path logs/corridor.path.tum --json out/corridor.errors.json
  objstate evaluate out/corridor --path reference.tum --align
  objstate evaluate out/batch --against out/other_settings
  objstate evaluate out/office --truth out/drive/truth.csv --bound
"""


def evaluate(
    folder: Annotated[
        str, typer.Argument(metavar="DIR", help="A result of estimate, or a batch, or its URL.")
    ],
    truth: Annotated[
        Path | None,
        typer.Option(
            metavar="CSV",
            help="True states: stamp,object,coordinate,value (ns; rad, m). A batch has its own.",
        ),
    ] = None,
    path: Annotated[Path | None, typer.Option(metavar="TUM", help="The robot's true path.")] = None,
    align: Annotated[
        bool,
        typer.Option(
            "--align", help="Move and turn the path onto the true one first, as evo does."
        ),
    ] = False,
    against: Annotated[
        str | None, typer.Option(metavar="DIR2", help="A result of the same logs, to compare.")
    ] = None,
    bound: Annotated[
        bool,
        typer.Option(
            "--bound",
            help="How far from the Cramer-Rao bound; for drives that simulate made (needs the "
            "scene.yaml beside the truth).",
        ),
    ] = False,
    filtered: Annotated[
        bool,
        typer.Option(
            "--filtered",
            help="Take what the robot would have known then, not what the whole log says.",
        ),
    ] = False,
    json_file: Annotated[
        Path | None, typer.Option("--json", metavar="FILE", help=JSON_HELP)
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Compare a result, or a batch, with the truth: states, movements, and the robot's path.

    Prints errors and how often the truth lies inside the 90 % intervals: of every object and of
    the robot; of a batch, and with --against, by object, class, distance, incidence angle, beams
    and time since last seen. --against adds paired differences, DIR minus DIR2.
    """
    from objstate.recording.batches import REPORT, is_batch
    from objstate.recording.mirror import mirrored

    with ExitStack() as mirrors:
        home = mirrors.enter_context(mirrored(folder, only=(REPORT,)))
        other = (
            None if against is None else mirrors.enter_context(mirrored(against, only=(REPORT,)))
        )
        if against is None and not is_batch(home):
            if align and path is None:
                raise SettingsError("--align is for the robot's path; give it with --path TUM.")
            _evaluate_result(home, truth, path, align, json_file, bound, quiet, filtered)
        elif path is not None or align or bound:
            raise SettingsError(
                "--path, --align and --bound are for one result alone; leave them out here."
            )
        else:
            _evaluate_batch(home, truth, other, json_file, quiet, filtered)


def _evaluate_result(
    folder: Path,
    truth: Path | None,
    path: Path | None,
    align: bool,
    json_file: Path | None,
    bound: bool,
    quiet: bool,
    filtered: bool,
) -> None:
    from objstate.evaluation import evaluate as evaluate_result

    if not folder.is_dir():
        raise ResultError(
            instead(folder, RESULT)
            or f"{folder} is no folder; give one that `objstate estimate` wrote."
        )
    if truth is None and (path is None or bound):
        raise SettingsError(
            f"{folder} is one result; say with --truth CSV what is true of its objects"
            f"{'.' if bound else ', or with --path TUM of the robot.'}"
        )
    evaluation = evaluate_result(folder, truth, path, align, filtered=filtered)
    print_warnings(evaluation.notes, quiet)
    limit = _limit(folder, truth) if bound and truth is not None else None
    figures = json_values(evaluation) | ({} if limit is None else {"bound": limit.to_dict()})
    if write_json(json_file, figures):
        return
    if truth is not None:
        _print(evaluation)
    if evaluation.robot is not None:
        print_table(robot_table(evaluation.robot))
        print_text(ROBOT_LEGEND)
    if limit is not None and limit.objects:
        print_table(bound_table((*limit.objects, *limit.overall)))
        print_text(BOUND_LEGEND)


def _evaluate_batch(
    folder: Path,
    truth: Path | None,
    against: Path | None,
    json_file: Path | None,
    quiet: bool,
    filtered: bool,
) -> None:
    from objstate.evaluation.batch import evaluate_batch

    with progress_bar("Evaluating", quiet) as report:
        evaluation = evaluate_batch(
            folder,
            truth,
            against,
            None if report is None else lambda done, count: report(done / count, 0.0),
            filtered=filtered,
        )
    print_warnings(evaluation.notes, quiet)
    if not write_json(json_file, evaluation):
        _print_batch(evaluation)


def _print_batch(evaluation: BatchEvaluation) -> None:
    for table in group_tables(evaluation.groups):
        print_table(table)
    print_table(overall_table(evaluation))
    print_text(LEGEND)
    if evaluation.movements is not None:
        _print_movements([evaluation.movements])
    for calibration in evaluation.calibration:
        print_table(calibration_table(calibration))
    if evaluation.against:
        print_table(difference_table(evaluation.against))
    print_names("Without truth", evaluation.without_truth)
    print_names("Without result", evaluation.without_result)


def _print_movements(entries: Iterable[MovementErrors]) -> None:
    print_table(movements_table(entries))
    print_text(MOVEMENTS_LEGEND)


def _limit(folder: Path, truth: Path) -> BoundEvaluation:
    from objstate.bound import evaluate_bound

    return evaluate_bound(folder, truth)


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
    if evaluation.movements:
        _print_movements(evaluation.movements)
    print_names("Without truth", evaluation.without_truth)
    print_names("Never observed", evaluation.never_observed)
    print_names("Observed only before the truth begins", evaluation.before_truth)
    print_names("Never estimated", evaluation.never_estimated)
