"""The part of a page that compares with the truth."""

from __future__ import annotations

from collections.abc import Sequence

from objstate.evaluation import (
    CoordinateErrors,
    Evaluation,
    LatestState,
    RobotErrors,
    compare_paths,
    evaluate_states,
)
from objstate.evaluation.units import UNITS
from objstate.report.charts import calibration_chart, error_chart
from objstate.report.coverage import Coverage, coverages
from objstate.report.judgement import tolerances
from objstate.report.markup import Cell, element, table, text
from objstate.report.material import Material

EXPLAINED = (
    "Each curve counts all updates that observed an object and whose truth is known. On the dashed "
    "line, intervals are as wide as they should be; below it they are too narrow, above it wider "
    "than needed. Updates of one visit have much in common, so a few objects can bend a curve."
)
HEADINGS = ("state", "updates", "mean error", "median", "90 % below", "bias", "in 90 %")


def accuracy(material: Material, latest: Sequence[LatestState]) -> str:
    """Errors, calibration, and the robot's own error; nothing where there is no truth."""
    parts = [_of_robot(material)]
    if any(state.truth is not None for state in latest) and material.truth is not None:
        evaluation = evaluate_states(
            material.estimates, material.truth, material.lost, material.symmetry
        )
        parts += [
            _table(evaluation),
            charts(coverages(material.estimates, material.truth, material.lost, material.symmetry)),
        ]
    found = "".join(parts)
    return element("section", element("h2", "Beside the truth"), found) if found else ""


def _of_robot(material: Material) -> str:
    if material.true_path is None:
        return ""
    errors: RobotErrors = compare_paths(material.path, material.true_path)
    return element(
        "p",
        text(
            f"The robot itself: {100 * errors.position.mean:.1f} cm off on average, "
            f"{100 * errors.position.p90:.1f} cm or less at 90 % of its {errors.count} poses, "
            f"{100 * errors.position.end:.1f} cm at the end."
        ),
    )


def _table(evaluation: Evaluation) -> str:
    worst_first = sorted(evaluation.objects, key=_rank)
    rows = [row for row in map(_row, (*evaluation.overall, *worst_first)) if row]
    return table(HEADINGS, rows, "sortable filterable")


def _rank(entry: CoordinateErrors) -> float:
    """By the mean error in tolerances, the worst first."""
    near, _ = tolerances(entry.coordinate)
    return -entry.updates.mean / near if entry.updates else 0.0


def _row(entry: CoordinateErrors) -> list[str | Cell]:
    errors = entry.updates
    if errors is None:
        return []
    unit, factor, _ = UNITS[entry.coordinate]
    if unit == "m":
        unit, factor = "cm", 100.0
    figures = (errors.mean, errors.median, errors.p90, errors.bias)
    return [
        text(f"{entry.object or 'all'}, {entry.coordinate} ({unit})"),
        str(errors.count),
        *(_error(entry.coordinate, value, f"{factor * value:z.2f}") for value in figures),
        f"{errors.coverage:.0%}",
    ]


def _error(coordinate: str, value: float, shown: str) -> Cell:
    """An error, marked where a person would call it wrong."""
    _, far = tolerances(coordinate)
    return Cell(shown, class_="wrong" if abs(value) > far else None)


def charts(found: Sequence[Coverage]) -> str:
    """A calibration curve and a histogram of errors for each kind of coordinate, explained."""
    drawn = [
        element(
            "figure",
            chart(coverage),
            element("figcaption", text(_caption(label, coverage))),
            class_="figure",
            data_name=f"{label} of {coverage.kind}",
        )
        for coverage in found
        if coverage.count
        for label, chart in (("Calibration", calibration_chart), ("Errors", error_chart))
    ]
    return element("p", text(EXPLAINED)) + element("div", *drawn, class_="charts")


def _caption(label: str, coverage: Coverage) -> str:
    return f"{label} of {coverage.kind}, {coverage.count} updates"
