"""``objstate building learn``"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from objstate.cli.console import print_notice, print_parts, print_text, print_warnings
from objstate.cli.learnt_tables import describe_found, describe_refined
from objstate.cli.options import Config, GlobalStart, InitialPose, Mounts, Overwrite, Quiet, Topics
from objstate.cli.parsing import parse_mounts, parse_pose, split_topics
from objstate.cli.progress import progress_bar
from objstate.errors import SettingsError

if TYPE_CHECKING:
    from objstate.run import RunOptions

EXAMPLES = """\b
Examples:
  objstate building learn monday.mcap tuesday.mcap --map map.yaml --out building
  objstate building edit building --drive monday.mcap
  objstate building learn *.mcap --building office.urdf --out better
\b
What is written to the folder:
  *.urdf          walls of the map without the leaves drawn into it, and the probable doors;
                  or the building with its walls and doors where they are
  doors.csv       candidates from 5 % on, with their standard deviations (--map)
  learn.json      the drives, and what each told
  calibration.yaml, report.html   the lasers' mountings, and pictures (--building)
"""


def learn(
    logs: Annotated[
        list[Path], typer.Argument(metavar="LOG", help="A drive; more drives tell more.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    map_yaml: Annotated[
        Path | None,
        typer.Option("--map", metavar="MAP", help="Find doors in a ROS map, YAML."),
    ] = None,
    building: Annotated[
        Path | None,
        typer.Option(
            metavar="URDF",
            help="Learn where a building's walls and doors are; its folder will do.",
        ),
    ] = None,
    jobs: Annotated[
        int | None,
        typer.Option(metavar="N", min=1, help="Processes at a time. Default: one a core."),
    ] = None,
    config: Config = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of all random numbers.")] = 0,
    initial_pose: InitialPose = None,
    global_start: GlobalStart = False,
    topics: Topics = None,
    mount: Mounts = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Learn a building from drives: its doors in a map, or where its walls and doors are.

    With --map, each drive is localized in the map. Where its walls open, in the map or in a drive,
    a door is weighed against an opening without a leaf, walls as they are drawn, and things that
    stand about. Doors that stand differently in several drives are told best; one that is always
    closed, and flush with its wall, can't be found.

    With --building, walls, lasers, hinges, closed bearings and fixed furniture are adjusted to all
    drives, which are of one robot. Estimates start from their deviations. Apply the mountings with
    --calibration. A folder that was learnt of the same building before is gone on from. With --map,
    all drives are given at once.
    """
    from objstate.config import load_settings
    from objstate.discovery import learn_doors
    from objstate.run import RunOptions

    if map_yaml is None and building is None:
        raise SettingsError(
            "Give --map to find doors, or --building to learn where walls and doors are."
        )
    if map_yaml is not None and building is not None:
        raise SettingsError(
            "--map finds doors in a map, --building learns where those of a building are; leave one "
            "of them out."
        )

    options = RunOptions(
        settings=load_settings(config),
        seed=seed,
        initial_pose=None if initial_pose is None else parse_pose(initial_pose),
        global_start=global_start,
        topics=split_topics(topics or []),
        mounts=parse_mounts(mount or []),
    )
    if building is not None:
        _refine(logs, building, out, options, jobs, overwrite=overwrite, quiet=quiet)
        return
    assert map_yaml is not None
    with progress_bar("Learning doors", quiet) as report:
        learnt = learn_doors(
            logs, map_yaml, out, options, jobs=jobs, overwrite=overwrite, on_progress=report
        )
    print_warnings(learnt.warnings, quiet)
    print_parts(describe_found(learnt))
    print_text(f"Written: {learnt.urdf}")


def _refine(
    logs: Sequence[Path],
    building: Path,
    out: Path,
    options: RunOptions,
    jobs: int | None,
    *,
    overwrite: bool,
    quiet: bool,
) -> None:
    """Learn where a building's walls and doors are."""
    from objstate.discovery import refine_building

    with progress_bar("Learning from drives", quiet) as report:
        refined = refine_building(
            logs,
            building,
            out,
            options,
            jobs=jobs,
            overwrite=overwrite,
            on_progress=None if report is None else lambda share: report(share, 0.0),
        )
    print_warnings(refined.warnings, quiet)
    print_parts(describe_refined(refined))
    for log in refined.left_out:
        print_notice(f"{log} contradicts all others, and is left out; is it of this building?")
    print_text(f"Written: {refined.urdf}")
