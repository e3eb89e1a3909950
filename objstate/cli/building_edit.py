"""``objstate building edit``"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_notice, print_text, print_warnings
from objstate.cli.options import GlobalStart, InitialPose, Quiet
from objstate.cli.parsing import parse_pose
from objstate.cli.progress import progress_bar

EXAMPLES = """\b
Examples:
  objstate building edit building
  objstate building edit map.yaml --drive drive1.mcap --drive drive2.mcap --out building
  objstate building edit office.urdf --drive out/monday --static page.html --out better
"""


def edit(
    source: Annotated[
        Path,
        typer.Argument(metavar="BUILDING", help="A building's folder or URDF, or a map, YAML."),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR", help="Where it is saved. Default: the folder, if objstate wrote it."
        ),
    ] = None,
    drive: Annotated[
        list[Path] | None,
        typer.Option(
            metavar="LOG",
            help="A log, or a result of estimate, whose scans are shown; also several.",
        ),
    ] = None,
    initial_pose: InitialPose = None,
    global_start: GlobalStart = False,
    candidates: Annotated[
        Path | None,
        typer.Option(metavar="CSV", help="A table of doors, with probabilities to decide on."),
    ] = None,
    static: Annotated[
        Path | None,
        typer.Option(metavar="HTML", help="Write the page, which then downloads its table."),
    ] = None,
    port: Annotated[int, typer.Option(help="On this machine only; 0 takes a free one.")] = 0,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
    ] = True,
    quiet: Quiet = False,
) -> None:
    """Edit doors in the browser, over the scans of drives.

    Drag hinges and free edges, flip sides, add doors by three clicks, accept or reject candidates
    by keys. Each change is saved at once: the building, doors.csv, and what was decided. The page
    is served to this machine only.
    """
    from objstate.editing import edit_page, serve, subject_of
    from objstate.editing.drives import points_of
    from objstate.outputs import write_text
    from objstate.run import RunOptions

    run = RunOptions(
        initial_pose=None if initial_pose is None else parse_pose(initial_pose),
        global_start=global_start,
    )
    subject = subject_of(source, out, candidates)
    print_warnings(subject.warnings, quiet)
    doubts: list[str] = []
    with progress_bar("Reading drives", quiet or not drive) as report:
        points = points_of(drive or (), subject.building, run, report, doubts.append)
    print_warnings(doubts, quiet)
    subject = replace(subject, warnings=(*subject.warnings, *doubts))
    if static is not None:
        write_text(static, edit_page(subject, points))
        print_text(f"Written: {static}")
        return

    def ready(address: str) -> None:
        print_notice(f"{address} (Ctrl-C ends it); saved to {subject.out}")
        if browser:
            import webbrowser

            webbrowser.open(address)

    serve(subject, points, port, ready)
