"""Options that several commands share."""

from __future__ import annotations

from typing import Annotated

import typer

from objstate.cli.console import print_text
from objstate.cli.parsing import CLOCK_OFFSET, MOUNT

Overwrite = Annotated[bool, typer.Option("--overwrite", help="Replace an existing result.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress bar, no warnings.")]
AsJson = Annotated[bool, typer.Option("--json", help="The same for programs.")]
Mounts = Annotated[
    list[str] | None,
    typer.Option(
        "--mount", metavar="FRAME=...", help=f"Where a laser is mounted: {MOUNT}. Repeatable."
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
