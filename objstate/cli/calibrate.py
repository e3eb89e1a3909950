"""``objstate calibrate``"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from objstate.cli.calibration_table import describe_calibration
from objstate.cli.console import print_parts, print_text, print_warnings
from objstate.cli.options import (
    ClockOffsets,
    Config,
    From,
    GlobalStart,
    InitialPose,
    LogPaths,
    Mounts,
    Overwrite,
    Quiet,
    To,
    Topics,
)
from objstate.cli.parsing import (
    check_span,
    parse_clock_offsets,
    parse_mounts,
    parse_pose,
    split_topics,
)
from objstate.cli.progress import progress_bar

EXAMPLES = """\b
Examples:
  objstate calibrate drive.mcap --building office.urdf
  objstate calibrate drive.mcap --building office.urdf --out calibration.yaml
  objstate estimate drive.mcap --building office.urdf --out out/drive \\
      --calibration calibration.yaml
"""


def calibrate(
    logs: LogPaths,
    building: Annotated[Path, typer.Option(metavar="URDF", help="The building.")],
    out: Annotated[
        Path | None, typer.Option(metavar="YAML", help="The file to write, for --calibration.")
    ] = None,
    config: Config = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Of all random numbers.")] = 0,
    initial_pose: InitialPose = None,
    global_start: GlobalStart = False,
    start: From = None,
    end: To = None,
    topics: Topics = None,
    mount: Mounts = None,
    clock_offset: ClockOffsets = None,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
) -> None:
    """Estimate from a log where its lasers are mounted, and how their clocks run.

    Corrections are to the mountings that the log (or --mount) gives, and to the odometry's clock.
    Corrections that the drive doesn't determine are reported and left out: turns determine places
    and clocks, straight lines directions.
    """
    from objstate.calibration import write_calibration
    from objstate.config import load_settings
    from objstate.outputs import whole
    from objstate.run import RunOptions
    from objstate.run.calibrating import calibrate_log

    check_span(start, end)
    options = RunOptions(
        settings=load_settings(config),
        seed=seed,
        initial_pose=None if initial_pose is None else parse_pose(initial_pose),
        global_start=global_start,
        start=start,
        end=end,
        topics=split_topics(topics or []),
        mounts=parse_mounts(mount or []),
        clock_offsets=parse_clock_offsets(clock_offset or []),
    )
    with progress_bar("Calibrating", quiet) as report:
        if out is None:
            found = calibrate_log(logs, building, options, on_progress=report)
        else:
            with whole(out, overwrite=overwrite) as file:
                found = calibrate_log(logs, building, options, on_progress=report)
                write_calibration(file, found)
    print_warnings(found.warnings, quiet)
    print_parts(describe_calibration(found))
    if out is not None:
        print_text(f"Written: {out}")
