"""Options that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text
from objstate.cli.parsing import CLOCK_OFFSET, MOUNT, POSE

# exit code: results were written, and say why they are no success
NOT_TO_BE_RELIED_ON = 3

Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing result.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar, no warnings.")]
AsJson = Annotated[bool, typer.Option("--json", help="The same for programs.")]
LogPaths = Annotated[
    list[Path],
    typer.Argument(metavar="LOG", help="A log or bag folder; several are one drive in parts."),
]
Config = Annotated[Path | None, typer.Option(metavar="YAML", help="Settings. Default: built in.")]
InitialPose = Annotated[
    str | None, typer.Option(metavar="X,Y,YAW", help=f"Where the robot starts: {POSE}.")
]
GlobalStart = Annotated[
    bool, typer.Option("--global", help="The robot may start anywhere in the building.")
]
From = Annotated[
    float | None,
    typer.Option(
        "--from", metavar="T", help="Begin there: seconds from the log's start, or since 1970."
    ),
]
To = Annotated[float | None, typer.Option("--to", metavar="T", help="End there, likewise.")]
Topics = Annotated[
    list[str] | None,
    typer.Option(metavar="TOPIC", help="Read only these; repeat, or separate by commas."),
]
Mounts = Annotated[
    list[str] | None,
    typer.Option(
        "--mount", metavar="FRAME=...", help=f"Where a laser is mounted: {MOUNT}. Repeatable."
    ),
]
CalibrationFile = Annotated[
    Path | None,
    typer.Option(
        "--calibration",
        metavar="YAML",
        help="Mountings and clocks that `calibrate` or `building learn` wrote.",
    ),
]
ClockOffsets = Annotated[
    list[str] | None,
    typer.Option(
        "--clock-offset",
        metavar="FRAME=...",
        help=f"How far a laser's clock is ahead of the odometry's: {CLOCK_OFFSET}. Repeatable.",
    ),
]


def help_when_alone(context: typer.Context) -> None:
    """Show the help of a group of commands that is called without one."""
    if context.invoked_subcommand is None:
        print_text(context.get_help())
