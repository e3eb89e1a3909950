"""``objstate report``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text
from objstate.cli.parsing import parse_zone
from objstate.errors import SettingsError

LARGEST_RADIUS = 5.0  # m; a larger one was meant in another unit

EXAMPLES = """\b
Examples:
  objstate report out/corridor --open
  objstate report out/corridor --truth logs/corridor.truth.csv --out corridor.html
  objstate report out/year --each --timezone Europe/Berlin
"""


def report(
    folder: Annotated[
        str, typer.Argument(metavar="DIR", help="A result of estimate, or a batch, or its URL.")
    ],
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
    each: Annotated[
        bool, typer.Option("--each", help="Of a batch: write each log's page, too, and link them.")
    ] = False,
    timezone: Annotated[
        str, typer.Option(metavar="ZONE", help="Whose dates and hours, e.g. Europe/Berlin.")
    ] = "UTC",
    robot_radius: Annotated[
        float | None,
        typer.Option(metavar="M", help="Draw the robot so large. Default: as a mark of no size."),
    ] = None,
    filtered: Annotated[
        bool,
        typer.Option(
            "--filtered",
            help="Show what the robot would have known then, not what the whole log says.",
        ),
    ] = False,
    open_: Annotated[bool, typer.Option("--open", help="Show it in the browser.")] = False,
) -> None:
    """Write a page that shows a result: one HTML file that needs no server and no network.

    It shows the plan with the scan and every object at its estimated state at any moment, what was
    believed of each object over time, the errors where there is truth, warnings and settings. Of a
    batch it shows the logs, each building over all of them, and how doors are used.
    """
    from objstate.outputs import as_url, is_url
    from objstate.recording.batches import REPORT, is_batch
    from objstate.recording.mirror import mirrored
    from objstate.report import write_batch_report, write_report

    zone = parse_zone(timezone)
    if robot_radius is not None and not 0.0 < robot_radius < LARGEST_RADIUS:
        raise SettingsError(
            f"--robot-radius {robot_radius:g} is no robot's; give metres, as in 0.25."
        )
    with mirrored(folder, only=(REPORT,)) as home:
        if is_batch(home):
            _refuse("the batch names its logs' truths", truth=truth, path=path)
            page = write_batch_report(
                home,
                out,
                building=building,
                each=each,
                zone=zone,
                robot_radius=robot_radius,
                filtered=filtered,
            )
        else:
            _refuse(f"{folder} is no batch", each=each or None)
            page = write_report(
                home,
                out,
                building=building,
                truth=truth,
                true_path=path,
                zone=zone,
                robot_radius=robot_radius,
                filtered=filtered,
            )
        if is_url(folder) and out is None:
            page = Path(f"{folder}/{REPORT}")
    print_text(f"Written: {as_url(page) if is_url(page) else page}")
    if open_ and not is_url(page):
        import webbrowser

        webbrowser.open(page.absolute().as_uri())


def _refuse(reason: str, **options: object) -> None:
    """Raise SettingsError where an option is given that means nothing here."""
    for name, value in options.items():
        if value is not None:
            raise SettingsError(f"--{name} has no meaning here: {reason}; leave it out.")
