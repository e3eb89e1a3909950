"""``objstate reproduce elfring2012``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text
from objstate.cli.experiment_tables import print_experiment
from objstate.cli.options import Overwrite, Quiet
from objstate.cli.progress import progress_bar


def elfring2012(
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="A folder to write: tables, verifications, pictures."),
    ] = None,
    shuffles: Annotated[
        int, typer.Option(metavar="N", min=1, help="Of each kind: speed and occlusion.")
    ] = 200,
    speeds: Annotated[
        list[float] | None,
        typer.Option(
            "--speed",
            metavar="M/S",
            min=0.05,
            max=3.0,
            help="Of cups; bins are twice as fast. Repeatable; default: 0.25, 0.5 and 1.",
        ),
    ] = None,
    trials: Annotated[int, typer.Option(metavar="N", min=1, help="Of each falsification.")] = 200,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of the table that is drawn.")] = 0,
    processes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Cores to use; the result is the same.")
    ] = 2,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Section IV of Elfring et al. 2012: a table with an outdated model, and the game of cups.

    A book, three green cups and a red one that is gone are verified as well as the task asks, first
    for exploring the room, then while identical cups are shuffled. Then many shuffles, by speed, by
    what hides the cups and by how readings are associated, and many falsifications.
    """
    from objstate.experiments.elfring2012 import SPEEDS, reproduce, stages_at

    with progress_bar("Reproducing", quiet) as report:
        result = reproduce(
            shuffles,
            trials,
            out=out,
            seed=seed,
            stages=stages_at(speeds or SPEEDS),
            processes=processes,
            overwrite=overwrite,
            on_progress=report,
        )
    for table in result.tables:
        print_experiment(table)
    spent = 1000.0 * result.exploration.seconds_per_check
    print_text(
        f"A check of an object took {spent:.2f} ms of processor time; in the paper about 1 ms."
    )
    if out is not None:
        print_text(f"Written: {out}, with tables.md, verifications.csv and pictures")
