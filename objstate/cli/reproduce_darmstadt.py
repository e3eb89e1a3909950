"""``objstate reproduce darmstadt``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text
from objstate.cli.experiment_tables import print_experiment
from objstate.cli.options import Overwrite, Quiet
from objstate.cli.progress import progress_bar


def darmstadt(
    out: Annotated[
        Path | None, typer.Option(metavar="DIR", help="A folder to write: tables and pictures.")
    ] = None,
    seeds: Annotated[int, typer.Option(metavar="N", min=1, help="Runs of each kind.")] = 10,
    only: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="One experiment alone; repeatable."),
    ] = None,
    processes: Annotated[
        int, typer.Option(metavar="N", min=1, help="Cores to use; the result is the same.")
    ] = 2,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Chapter 7 of the Darmstadt Dribblers' thesis: a grid that ages, and gaze by its entropy.

    A robot with a camera on its head watches a soccer field with poles, obstacles and a ball.
    Tables have the thesis' figures beside those measured here, with intervals over seeds.
    """
    from objstate.experiments.darmstadt import reproduce

    with progress_bar("Reproducing", quiet) as report:
        result = reproduce(
            range(seeds),
            out=out,
            only=only or (),
            processes=processes,
            overwrite=overwrite,
            on_progress=report,
        )
    for table in result.tables:
        print_experiment(table)
    if out is not None:
        print_text(f"Written: {out}, with tables.md and pictures")
