"""``objstate estimate``"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from objstate.cli.candidates_table import candidates_table
from objstate.cli.console import (
    log_to_terminal,
    print_errors,
    print_names,
    print_parts,
    print_table,
    print_text,
    print_warnings,
)
from objstate.cli.error_tables import robot_table
from objstate.cli.extras import Extras, calibration_from
from objstate.cli.live import live_view
from objstate.cli.options import (
    NOT_TO_BE_RELIED_ON,
    CalibrationFile,
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
from objstate.cli.sharing import share_out_compiling
from objstate.cli.state_table import events_table, state_table
from objstate.errors import TruthError

if TYPE_CHECKING:
    from objstate.records import Path as RobotPath
    from objstate.records import TrueState
    from objstate.run import RunResult
    from objstate.run.memory import WorldUse

EXAMPLES = """\b
Examples:
  objstate estimate drive.mcap --building office.urdf --out out/drive
  objstate estimate drive.mcap --building office.urdf --out out/drive --world world.db
  objstate estimate part1.bag part2.bag --building office.urdf --out out/b \\
      --initial-pose 3.2,-1,90deg --mount laser=0.25,0,0.3,0,0,0
  objstate estimate drive.mcap --building map.yaml --learn-building --out out/drive
\b
DIR gets:
  estimates.parquet   every state after every update, with its 90 % interval
  smoothed.parquet    the same states given the whole log
  events.parquet      when objects were moved, and from where to where
  posteriors.parquet  histograms of beliefs about objects near the robot, each second
  scans.parquet       a few beams of a scan each second, for pictures
  trajectory.tum      the robot's path
  run.json            settings, counts, timings, warnings
  estimates.mcap      with --mcap: the run as a scene for Foxglove and RViz, and its
                      Foxglove layout, estimates.foxglove.json
  clutter.parquet     with --grid: obstacles that are not in the building, and the map
                      at the end, grid.yaml and grid.pgm;
                      candidates.json: obstacles that stay and may be objects
  calibration.yaml    with --calibrate;  dynamics.yaml  with --learn-dynamics
  building/           with --learn-building: the building that was used, adjusted to the log,
                      and the one with the doors found, if a map was given
"""


def estimate(
    logs: LogPaths,
    building: Annotated[
        Path,
        typer.Option(
            metavar="URDF",
            help="The building, or its folder. Joints are objects. With --learn-building also a map.",
        ),
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="The folder to write.")],
    config: Config = None,
    seed: Annotated[
        int,
        typer.Option(
            metavar="N", min=0, help="Seed of all random numbers; same seed, same result."
        ),
    ] = 0,
    belief: Annotated[
        Literal["own", "recorded"],
        typer.Option(help="Localize the robot, or use the belief that the log holds."),
    ] = "own",
    inference: Annotated[
        Literal["joint", "marginal"] | None,
        typer.Option(
            help="Objects with the errors of robot and building, or the paper's. Default: joint."
        ),
    ] = None,
    initial_pose: InitialPose = None,
    global_start: GlobalStart = False,
    start: From = None,
    end: To = None,
    topics: Topics = None,
    mount: Mounts = None,
    clock_offset: ClockOffsets = None,
    calibration: CalibrationFile = None,
    calibrate: Annotated[
        bool,
        typer.Option("--calibrate", help="Calibrate by the log first, and use the result."),
    ] = False,
    learn_building: Annotated[
        bool,
        typer.Option(
            "--learn-building",
            help="Find doors in a map, adjust walls, doors and lasers by the log first.",
        ),
    ] = False,
    learn_dynamics: Annotated[
        bool,
        typer.Option(
            "--learn-dynamics", help="Also write dynamics.yaml: how often objects are moved here."
        ),
    ] = False,
    truth: Annotated[
        Path | None, typer.Option(metavar="CSV", help="True states, to show beside the estimates.")
    ] = None,
    path: Annotated[
        Path | None, typer.Option(metavar="TUM", help="The robot's true path, to compare with.")
    ] = None,
    world: Annotated[
        str | None,
        typer.Option(
            metavar="WORLD",
            help="Start from its beliefs, and from where it has walls, doors and lasers; add what is "
            "learnt. A file, or postgresql://...",
        ),
    ] = None,
    mcap: Annotated[
        bool, typer.Option("--mcap", help="Write the run as a scene for Foxglove and RViz, too.")
    ] = False,
    grid: Annotated[
        bool,
        typer.Option("--grid", help="Also map obstacles that are not in the building."),
    ] = False,
    live: Annotated[
        bool, typer.Option("--live", help="Show the doors in view while it runs.")
    ] = False,
    overwrite: Overwrite = False,
    quiet: Quiet = False,
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Report each step.")] = False,
) -> None:
    """Estimate the state of every object in a building from a log.

    The robot's start is --initial-pose, or /initialpose in the log, or --global. The exit code is 3
    if the result was written but isn't reliable, for example because the robot was lost.
    """
    from objstate.config import load_settings
    from objstate.recording.results import check_result_folder
    from objstate.recording.tables import read_truth
    from objstate.recording.tum import read_tum
    from objstate.run import FILES, GRID_FILES, LAYOUT, SCENE, RunOptions, estimate_log

    if verbose:
        log_to_terminal()
    check_span(start, end)
    check_result_folder(out, overwrite=overwrite)
    true_states = None if truth is None else read_truth(truth)
    true_path = None if path is None else read_tum(path)
    mounts, clock_offsets = calibration_from(calibration, anew=calibrate)
    options = RunOptions(
        settings=load_settings(config).with_inference(inference),
        seed=seed,
        belief=belief,
        initial_pose=None if initial_pose is None else parse_pose(initial_pose),
        global_start=global_start,
        start=start,
        end=end,
        topics=split_topics(topics or []),
        mounts=mounts | parse_mounts(mount or []),
        clock_offsets=clock_offsets | parse_clock_offsets(clock_offset or []),
    )
    share_out_compiling()
    extras = Extras(calibrate, learn_dynamics, learn_building)
    read, options = extras.prepare(logs, building, out, options, quiet)
    with live_view(live) as view, progress_bar("Estimating", quiet or live) as report:
        result = estimate_log(
            logs,
            read,
            out,
            options,
            world=world,
            overwrite=overwrite,
            on_progress=report if view is None else view.report,
            observers=() if view is None else (view,),
            truth=truth,
            true_path=path,
            mcap=mcap,
            grid=grid,
            on_finish=lambda folder, model, result: extras.write(folder, model, options, result),
        )
    doubts = result.warnings[len(result.failures) :]
    print_errors(result.failures)
    print_warnings((*doubts, *_doubts_of_truth(result, true_states)), quiet)
    print_parts(extras.describe())
    scene = (SCENE, LAYOUT) if mcap else ()
    mapped = [name for name in GRID_FILES if (result.folder / name).exists()]
    _print(result, true_states, true_path, (*FILES, *scene, *mapped, *extras.files))
    if result.failures:
        raise typer.Exit(NOT_TO_BE_RELIED_ON)


def _doubts_of_truth(result: RunResult, true_states: list[TrueState] | None) -> list[str]:
    """Whether the truth is that of another building, or its stamps are in another unit."""
    from objstate.recording.tables import check_truth_times, unknown_names

    if true_states is None:
        return []
    if not {state.object for state in true_states} & set(result.objects):
        return ["The truth names none of the building's objects. Is it that of another building?"]
    try:
        end_ns = result.begin_ns + round(result.log_seconds * 1e9)
        check_truth_times(true_states, result.begin_ns, end_ns)
    except TruthError as error:
        return [str(error)]
    return unknown_names(true_states, result.objects)


def _told(world: WorldUse) -> str:
    """The world's part in the run."""
    knew = f"World {world.location}: knew {world.known} objects when the log began"
    if world.surveyed:
        knew += f", and walls by {world.surveyed} drive{'s' if world.surveyed != 1 else ''}"
    if world.had_the_log:
        return f"{knew}; it has this log already, and was not changed."
    if world.unreliable:
        return f"{knew}; learnt nothing, since the result isn't reliable."
    learnt = f"{knew}; learnt {world.added} beliefs."
    if world.contradicts:
        learnt += " Walls or hinges contradict all earlier drives, and weren't kept."
    return learnt


def _print(
    result: RunResult,
    true_states: list[TrueState] | None,
    true_path: RobotPath | None,
    files: Sequence[str],
) -> None:
    from objstate.evaluation import compare_paths, latest_states
    from objstate.recording.candidates import read_candidates
    from objstate.recording.events import read_events
    from objstate.recording.tables import read_states
    from objstate.recording.tum import TRAJECTORY, read_tum

    estimates = read_states(result.folder)
    states = latest_states(estimates, true_states or (), result.lost_ns, result.symmetry)
    if states:
        print_table(state_table(states, result.begin_ns, with_truth=true_states is not None))
    events = read_events(result.folder)
    if events:
        print_table(events_table(events, result.begin_ns))
        if any(event.has_returned for event in events):
            print_text("A door that ends where it began stood elsewhere in between.")
    candidates = read_candidates(result.folder)
    if candidates:
        print_table(candidates_table(candidates))
    known, in_view = {state.estimate.object for state in states}, set(estimates["object"])
    print_names("Never in view", set(result.objects) - in_view)
    print_names("In view only while the robot was lost", in_view - known)
    print_text(
        f"{result.log_seconds:.0f} s of log in {result.elapsed_seconds:.1f} s, "
        f"{result.log_seconds / result.elapsed_seconds:.0f} x real time."
    )
    if result.world is not None:
        print_text(_told(result.world))
    print_text(f"Written: {', '.join(str(result.folder / name) for name in files)}")
    if true_path is not None:  # last, as it may fail where the paths share no time
        print_table(robot_table(compare_paths(read_tum(result.folder / TRAJECTORY), true_path)))
