"""``objstate inspect``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """\b
Examples:
  objstate inspect drive.mcap
  objstate inspect office.urdf --json
"""


def inspect(
    path: Annotated[Path, typer.Argument(metavar="LOG|URDF", help="A log or a building.")],
) -> None:
    """Show what is in a log or a building, and what is wrong with it."""
