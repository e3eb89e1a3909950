"""``objstate reproduce schulz2001``"""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text
from objstate.cli.experiment_tables import print_experiment
from objstate.cli.options import Overwrite, Quiet
from objstate.cli.progress import progress_bar

EXAMPLES = """\b
Examples:
  objstate reproduce schulz2001 --out out/schulz2001
  objstate reproduce schulz2001 --out out/doors --only doors --seeds 3
"""


class Schulz2001(StrEnum):
    """The experiments of one paper."""

    DOORS = "doors"
    MOVABLE = "movable"
    DESKS = "desks"


def schulz2001(
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Drives of each experiment.")] = 20,
    first_seed: Annotated[int, typer.Option(metavar="N", min=0, help="The seeds begin here.")] = 1,
    only: Annotated[
        list[Schulz2001] | None,
        typer.Option(metavar="NAME", help="doors, movable or desks. Repeatable; default: all."),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Processes; default: one for each core.")
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Schulz and Burgard 2001: doors at 70 cm/s, a U-shaped object that is turned, shifted desks.

    Prints the tables beside the paper's figures. DIR gets them too, with every final estimate and
    pictures like the paper's Figs. 3, 6 and 8.
    """
    from objstate.experiments import reproduce
    from objstate.experiments.schulz2001 import EXPERIMENTS, TITLE

    chosen = {name: each for name, each in EXPERIMENTS.items() if name in (only or EXPERIMENTS)}
    with progress_bar("Reproducing", quiet) as report:
        result = reproduce(
            chosen,
            TITLE,
            out,
            range(first_seed, first_seed + seeds),
            workers=workers,
            overwrite=overwrite,
            on_progress=report,
        )
    for table in result.tables:
        print_experiment(table)
    print_text(f"Written: {result.folder}, with tables.md, finals.csv and pictures")
