"""``objstate report``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text

EXAMPLES = """\b
Examples:
  objstate report out/corridor --open
  objstate report out/corridor --truth logs/corridor.truth.csv --out corridor.html
"""


def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A result of estimate.")],
    out: Annotated[
        Path | None, typer.Option(metavar="HTML", help="The file. Default: DIR/report.html.")
    ] = None,
    building: Annotated[
        Path | None, typer.Option(metavar="URDF", help="Default: the one that the result names.")
    ] = None,
    truth: Annotated[
        Path | None, typer.Option(metavar="CSV", help="True states. Default: those of estimate.")
    ] = None,
    path: Annotated[
        Path | None, typer.Option(metavar="TUM", help="The robot's true path, likewise.")
    ] = None,
    open_: Annotated[bool, typer.Option("--open", help="Show it in the browser.")] = False,
) -> None:
    """Write a page that shows a result: one HTML file that needs no server and no network.

    It shows the plan with every object at its estimated state at any moment, what was believed of
    each object over time, the errors where there is truth, warnings and settings.
    """
    from objstate.report import write_report

    page = write_report(folder, out, building=building, truth=truth, true_path=path)
    print_text(f"Written: {page}")
    if open_:
        import webbrowser

        webbrowser.open(page.absolute().as_uri())
