"""``objstate reproduce maintenance``"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.options import Overwrite
from objstate.cli.tables import new_table, percent

if TYPE_CHECKING:
    from collections.abc import Sequence

    from rich.table import Table

    from objstate.experiments.office_day import Worth


def maintenance(
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="A folder to write: all trials, and pictures."),
    ] = None,
    hours: Annotated[float, typer.Option(metavar="H", min=0.5, help="Of each day.")] = 2.0,
    days: Annotated[int, typer.Option(metavar="N", min=1, help="Days of each setting.")] = 3,
    processes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Cores to use; the result is the same.")
    ] = 2,
    overwrite: Overwrite = False,
) -> None:
    """Some working hours in an office of 30 doors and 20 chests that are moved now and then.

    The coordinator is compared with a fixed round, oldest first, greedy nearest and random looks,
    each with different amounts of driving. The robot localizes by its own filter.
    """
    from objstate.experiments.office_day import compare, write

    found = compare(hours, days, processes)
    print_table(_trials(found))
    print_table(_savings(found))
    if out is not None:
        write(found, out, overwrite=overwrite)
        print_text(f"Written: {out}, with trials.csv and pictures")


def _savings(found: Sequence[Worth]) -> Table:
    from objstate.experiments.office_day import savings

    numbers = ("alpha", "m/h", "others' best", "saved %")
    table = new_table("Driving saved where all know the same", ("equal", "best other"), numbers)
    for what, measure in (
        ("total entropy", lambda worth: worth.entropy),
        ("right doors", lambda worth: worth.right),
    ):
        for each in savings(found, measure):
            others = (f"{each.best:.0f}", percent(each.share)) if each.strategy else ("-", "-")
            table.add_row(what, each.strategy, f"{each.knob:g}", f"{each.own:.0f}", *others)
    return table


def _trials(found: Sequence[Worth]) -> Table:
    numbers = ("knob", "day", "m/h", "entropy", "right %", "predicted", "realized", "tasks")
    table = new_table("Strategies", ("strategy", "outcomes"), numbers)
    for each in found:
        outcomes = ", ".join(f"{count} {name}" for name, count in each.outcomes.items())
        predicted = f"{each.predicted:.0f}" if each.predicted else ""
        realized = f"{each.realized:.0f}" if each.predicted else ""
        table.add_row(
            each.trial.strategy,
            outcomes,
            f"{each.trial.knob:g}",
            str(each.trial.seed),
            f"{each.distance:.0f}",
            f"{each.entropy:.1f}",
            percent(each.right),
            predicted,
            realized,
            str(each.tasks),
        )
    return table
