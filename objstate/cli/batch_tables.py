"""The tables of a batch's evaluation."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from typing import TYPE_CHECKING

from objstate.cli.error_tables import NUMBERS, UNITS, error_cells
from objstate.cli.tables import new_table, percent

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.evaluation import Calibration, Difference, Group
    from objstate.evaluation.batch import BatchEvaluation


def overall_table(evaluation: BatchEvaluation) -> Table:
    """All logs together."""
    table = new_table(f"All {evaluation.logs} logs", ("estimates", "state"), NUMBERS)
    for entry in evaluation.overall:
        for label, errors in (("final", entry.final), ("all updates", entry.updates)):
            if errors is not None:
                table.add_row(label, *error_cells(entry.coordinate, entry.unit, errors))
    return table


def group_tables(groups: Sequence[Group]) -> Iterator[Table]:
    """A table for each condition."""
    for condition, members in groupby(groups, key=lambda group: group.condition):
        table = new_table(f"By {condition}", (condition, "state"), NUMBERS)
        for group in members:
            table.add_row(group.label, *error_cells(group.coordinate, group.unit, group.errors))
        yield table


def calibration_table(calibration: Calibration) -> Table:
    """How often the truth lay in intervals of each level."""
    table = new_table(
        f"Calibration of {calibration.coordinate}, {calibration.count} final estimates",
        ("intervals",),
        ("level", "holds the truth", "90 % interval of that"),
    )
    named = [("as recorded", calibration.recorded)]
    for name, each in (*named, *(("mean and std", level) for level in calibration.levels)):
        bounds = f"{percent(each.lower)} to {percent(each.upper)}"
        table.add_row(name, percent(each.level), percent(each.share), bounds)
    return table


def difference_table(differences: Sequence[Difference]) -> Table:
    """The first result minus the second."""
    table = new_table(
        f"Paired differences over {differences[0].units} logs or objects, final estimates",
        ("state", "measure"),
        ("pairs", "this", "other", "difference", "95 % interval"),
    )
    for each in differences:
        unit, factor = UNITS.get(each.unit, ("%", 100.0))

        def figure(value: float, factor: float = factor) -> str:
            return f"{factor * value:z.2f}"

        table.add_row(
            each.coordinate,
            f"{each.measure} ({unit})",
            str(each.pairs),
            *map(figure, (each.this, each.other, each.difference)),
            f"{figure(each.lower)} to {figure(each.upper)}",
        )
    return table
