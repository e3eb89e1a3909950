"""``objstate reproduce maintenance``"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.tables import new_table, percent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from objstate.experiments.office_day import Worth


def maintenance(
    hours: Annotated[float, typer.Option(metavar="H", min=0.5, help="Of each day.")] = 8.0,
    days: Annotated[int, typer.Option(metavar="N", min=1, help="Days of each setting.")] = 1,
    processes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Cores to use; the result is the same.")
    ] = 2,
) -> None:
    """A working day in an office of 30 doors and 20 chests that are moved now and then.

    The coordinator against a fixed round, oldest first, greedy nearest and random looks, each with
    more and with less driving. The robot localizes by its own filter.
    """
    from objstate.experiments.office_day import compare, saving

    found = compare(hours, days, processes)
    print_table(_trials(found))
    for what, measure in (
        ("total entropy", lambda worth: worth.entropy),
        ("share of right doors", lambda worth: worth.right),
    ):
        print_text(f"Driving saved at equal {what}: {percent(saving(found, measure))} %")


def _trials(found: Sequence[Worth]) -> Table:
    numbers = ("knob", "m/h", "entropy", "right %", "predicted", "realized", "tasks")
    table = new_table("Strategies", ("strategy", "outcomes"), numbers)
    for each in found:
        outcomes = ", ".join(f"{count} {name}" for name, count in each.outcomes.items())
        predicted = f"{each.predicted:.0f}" if each.predicted else ""
        realized = f"{each.realized:.0f}" if each.predicted else ""
        table.add_row(
            each.trial.strategy,
            outcomes,
            f"{each.trial.knob:g}",
            f"{each.distance:.0f}",
            f"{each.entropy:.1f}",
            percent(each.right),
            predicted,
            realized,
            str(each.tasks),
        )
    return table
