"""``objstate convert``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.console import print_text, print_warnings
from objstate.cli.options import Overwrite, Quiet

EXAMPLES = """\b
Examples:
  objstate convert fr079.log.gz fr079.mcap
  objstate convert drive.bag drive.log --format carmen
"""


def convert(
    source: Annotated[Path, typer.Argument(metavar="IN", help="A log file or bag folder.")],
    target: Annotated[Path, typer.Argument(metavar="OUT", help="The log to write.")],
    log_format: Annotated[
        str | None,
        typer.Option(
            "--format",
            help="mcap, bag, rosbag2, rosbag2-mcap or carmen. Default: by the ending of OUT.",
        ),
    ] = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Write a log in another format.

    Between MCAP, rosbag1, rosbag2 and CARMEN text; what the other format has no place for is named
    in a warning.
    """
    from objstate.conversion import convert as convert_log

    result = convert_log(source, target, format=log_format, overwrite=overwrite)
    print_warnings(result.warnings, quiet)
    for topic, count in sorted(result.counts.items()):
        print_text(f"{count:8d}  {topic}")
    print_text(f"Written: {target}")
