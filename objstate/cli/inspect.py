"""``objstate inspect``"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.json_values import json_values
from objstate.cli.log_tables import describe_log
from objstate.cli.options import Mounts
from objstate.cli.parsing import parse_mounts

EXAMPLES = """\b
Examples:
  objstate inspect drive.mcap
  objstate inspect part1.bag part2.bag
  objstate inspect office.urdf --json
"""


def inspect(
    paths: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...|URDF", help="A log, a drive's logs, or a building."),
    ],
    mount: Mounts = None,
    as_json: Annotated[bool, typer.Option("--json", help="The same for programs.")] = False,
) -> None:
    """Show what is in a log or a building, and what is wrong with it.

    Which of both it is shows in the content, not in the name.
    """
    from objstate.logs import inspect_log

    summary = inspect_log(paths, mounts=parse_mounts(mount or []))
    if as_json:
        print_text(json.dumps(json_values(summary), indent=2))
        return
    for part in describe_log(summary):
        if isinstance(part, str):
            print_text(part)
        else:
            print_table(part)
    _print_problems(summary.problems)


def _print_problems(problems: Sequence[str]) -> None:
    print_text("Problems:" if problems else "No problems found.")
    for problem in problems:
        print_text(f"- {problem}")
