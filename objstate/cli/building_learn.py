"""``objstate building learn``"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_table, print_text
from objstate.cli.options import Config, GlobalStart, InitialPose, Mounts, Overwrite, Quiet, Topics
from objstate.cli.parsing import parse_mounts, parse_pose, split_topics
from objstate.cli.progress import progress_bar

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.discovery import Candidate

EXAMPLES = """\b
Examples:
  objstate building learn monday.mcap tuesday.mcap --map map.yaml --out building
  objstate building edit building --drive monday.mcap
\b
What is written to the folder:
  building.urdf   walls of the map without the leaves drawn into it, and the probable doors
  doors.csv       all candidates, with probabilities and standard deviations
  learn.json      the drives, and of each candidate the angles at which it was seen
"""


def learn(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG", help="A drive; more drives tell more.")
    ],
    map_yaml: Annotated[
        Path, typer.Option("--map", metavar="MAP", help="A ROS map, YAML, that the drives fit.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    config: Config = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of all random numbers.")] = 0,
    initial_pose: InitialPose = None,
    global_start: GlobalStart = False,
    topics: Topics = None,
    mount: Mounts = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Find the doors of a building in its map and in drives.

    Each drive is localized in the map. Where its walls open, in the map or in a drive, a door is
    weighed against an opening without a leaf, walls as they are drawn, and things that stand
    about. Doors that stand differently in several drives are told best; one that is always closed,
    and flush with its wall, can't be found.
    """
    from objstate.config import load_settings
    from objstate.discovery import learn_doors
    from objstate.run import RunOptions

    options = RunOptions(
        settings=load_settings(config),
        seed=seed,
        initial_pose=None if initial_pose is None else parse_pose(initial_pose),
        global_start=global_start,
        topics=split_topics(topics or []),
        mounts=parse_mounts(mount or []),
    )
    with progress_bar("Learning doors", quiet) as report:
        learnt = learn_doors(logs, map_yaml, out, options, overwrite=overwrite, on_progress=report)
    if learnt.candidates:
        print_table(_table(learnt.candidates))
    else:
        print_text("No doors found.")
    print_text(f"Written: {learnt.urdf}")


def _table(candidates: Sequence[Candidate]) -> Table:
    """A candidate in a row."""
    from objstate.cli.tables import new_table

    numbers = ("probability", "hinge x (m)", "y (m)", "± (m)", "bearing (deg)", "± (deg)", "width (m)", "± (m)", "opens", "seen at (deg)")  # fmt: skip
    table = new_table(f"{len(candidates)} candidates", ("door",), numbers)
    for each in candidates:
        table.add_row(each.door.name, *_cells(each))
    return table


def _cells(each: Candidate) -> Iterator[str]:
    door = each.door
    yield f"{each.probability:.3f}"
    yield from (f"{value:z.2f}" for value in door.hinge)
    yield f"{each.hinge_deviation:.3f}"
    yield f"{math.degrees(door.closed_bearing):z.1f}"
    yield f"{math.degrees(each.bearing_std):.1f}"
    yield f"{door.width:.2f}"
    yield f"{each.width_std:.3f}"
    yield "ccw" if door.sense > 0 else "cw"
    yield " ".join(f"{math.degrees(angle):.0f}" for angle in each.angles)
