"""``objstate inspect``"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from objstate.cli.building_tables import describe_building
from objstate.cli.calibration_table import describe_calibration
from objstate.cli.console import print_parts, print_problems, print_text
from objstate.cli.json_values import json_values
from objstate.cli.log_tables import describe_log
from objstate.cli.options import AsJson, Mounts
from objstate.cli.parsing import check_height, parse_mounts
from objstate.errors import BuildingError, SettingsError
from objstate.kinds import BATCH, DATABASE, DOORS, LOG, MAP, SCENE, TRUTH, is_a, kind_of

if TYPE_CHECKING:
    from rich.table import Table

EXAMPLES = """\b
Examples:
  objstate inspect drive.mcap
  objstate inspect part1.bag part2.bag
  objstate inspect drive.mcap --building office.urdf
  objstate inspect office.urdf --json
  objstate inspect out/drive
"""

READERS = {  # the commands for what isn't inspected
    BATCH: "see `objstate statistics` and `objstate report`",
    MAP: "make a building of it: `objstate building from-map`, or `objstate building learn`",
    SCENE: "see `objstate simulate`",
    TRUTH: "see `objstate evaluate`",
    DOORS: "see `objstate building from-map`",
}
RUN = "run.json"  # that shows a result's folder
BUILDING_ENDINGS = (".urdf", ".xacro")
BYTES_TO_TELL = 256  # bytes from a file's start that show whether it is XML
BYTE_ORDER_MARK = b"\xef\xbb\xbf"


def inspect(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="LOG|URDF|RESULT",
            help="A log, a drive's logs, a building, or a result's folder.",
        ),
    ],
    mount: Mounts = None,
    height: Annotated[float, typer.Option(help="Of the laser above a building's floor, m.")] = 0.3,
    building: Annotated[
        Path | None,
        typer.Option(metavar="URDF", help="Of a log: calibrate its lasers in this building, too."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Show the content of a log or a building, and its problems.

    The kind is recognized by the content. Problems are no failure. Of a result with a grid, the
    obstacles that are not in the building are listed.
    """
    if len(paths) == 1 and (paths[0] / RUN).is_file():
        _inspect_result(paths[0], as_json)
    elif any(map(_is_building, paths)):
        _inspect_building(paths, height, as_json)
    else:
        _inspect_log(paths, mount or [], building, as_json)


def _inspect_log(
    paths: Sequence[Path], mounts: Sequence[str], building: Path | None, as_json: bool
) -> None:
    from objstate.logs import inspect_log

    for path in paths:
        _check_is_log(path)
    summary = inspect_log(paths, mounts=parse_mounts(mounts))
    if building is None:
        _print(summary, describe_log(summary), summary.problems, as_json)
        return
    from objstate.run import RunOptions
    from objstate.run.calibrating import calibrate_log

    found = calibrate_log(paths, building, RunOptions(mounts=parse_mounts(mounts)))
    described = chain(describe_log(summary), describe_calibration(found))
    problems = [*summary.problems, *(new for new in found.warnings if new not in summary.problems)]
    both = {"log": summary, "calibration": found}
    _print(both if as_json else summary, described, problems, as_json)


def _check_is_log(path: Path) -> None:
    """Raise SettingsError for what is known to be something that other commands read."""
    kind = kind_of(path)
    if kind is None or is_a(kind, LOG) or kind == DATABASE:
        return
    cure = READERS.get(kind, "give a log, a building or the folder of a result")
    raise SettingsError(f"{path} is {kind}, which isn't inspected; {cure}.")


def _inspect_result(folder: Path, as_json: bool) -> None:
    from objstate.cli.candidates_table import candidates_table
    from objstate.recording.candidates import read_candidates

    found = read_candidates(folder)
    nothing = f"{folder}: no obstacles are known that are not in the building."
    if as_json:
        print_text(json.dumps(json_values({"candidates": found}), indent=2))
    else:
        print_parts([candidates_table(found)] if found else [nothing])


def _inspect_building(paths: Sequence[Path], height: float, as_json: bool) -> None:
    from objstate.building import inspect_building

    check_height(height)
    if len(paths) > 1:
        raise BuildingError(
            f"{', '.join(map(str, paths))}: give one building alone, or logs alone."
        )
    summary = inspect_building(paths[0], height)
    _print(summary, describe_building(summary), summary.problems, as_json)


def _is_building(path: Path) -> bool:
    """Whether a file is XML by its first bytes, or called a building; or a folder holds such."""
    if path.is_dir():  # a URDF may lie in a bag's folder as well
        from objstate.logs.containers import ENDINGS
        from objstate.logs.rosbag2 import STORAGE_NAMES

        endings = {each.suffix for each in path.iterdir()}
        of_logs = endings.intersection((*ENDINGS, *STORAGE_NAMES))
        return not of_logs and not endings.isdisjoint(BUILDING_ENDINGS)
    if not path.is_file():
        return path.suffix in BUILDING_ENDINGS
    with path.open("rb") as file:
        start = file.read(BYTES_TO_TELL)
    is_xml = start.removeprefix(BYTE_ORDER_MARK).lstrip().startswith(b"<")
    return is_xml or path.suffix in BUILDING_ENDINGS


def _print(
    summary: Any, description: Iterable[str | Table], problems: Sequence[str], as_json: bool
) -> None:
    if as_json:
        print_text(json.dumps(json_values(summary), indent=2))
        return
    print_parts(description)
    print_problems(problems)
