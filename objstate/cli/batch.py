"""``objstate batch``"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from objstate.cli.batch_progress import batch_progress
from objstate.cli.console import print_text, print_warnings
from objstate.cli.error_tables import UNITS
from objstate.cli.extras import calibration_from
from objstate.cli.options import (
    NOT_TO_BE_RELIED_ON,
    CalibrationFile,
    Config,
    GlobalStart,
    Mounts,
    Quiet,
    Topics,
)
from objstate.cli.parsing import POSE, parse_mounts, parse_pose, split_topics
from objstate.cli.tables import percent

if TYPE_CHECKING:
    import polars as pl

    from objstate.batch import BatchResult

NOT_ALL_WENT_WELL = 1
LOGS_SHOWN = 10  # whose warnings are printed

EXAMPLES = """\b
Examples:
  objstate batch drives/ --building office.urdf --out out/all --truth drives/
  objstate batch 'drives/2026-*/*.mcap' --building office.urdf --out out/year --workers 8
  objstate batch manifest.csv --out out/all --scheduler tcp://10.0.0.1:8786
\b
A manifest has a row for each log, and these columns, of which only the first is required:
  log, name, building, truth, path, settings, initial_pose, global, seed, robot
\b
DIR gets:
  logs/NAME/            each log's result, as estimate writes it
  estimates.parquet/    all estimates, some dozen logs in a file
  smoothed.parquet/     the same states, given each whole log
  events.parquet/       when objects were moved
  summary.parquet       a row per log: how it ended, counts, warnings, errors
  timings.parquet       a row per log: time, speed, memory
"""


def batch(
    logs: Annotated[
        list[str],
        typer.Argument(metavar="LOGS", help="Files, folders, patterns, URLs, or a manifest."),
    ],
    out: Annotated[
        str, typer.Option(metavar="DIR", help="The folder to write, or go on with; or a URL.")
    ],
    building: Annotated[
        str | None, typer.Option(metavar="URDF", help="The building, where no manifest names one.")
    ] = None,
    truth: Annotated[
        str | None,
        typer.Option(metavar="DIR|CSV", help="True states: one table, or a folder of them."),
    ] = None,
    config: Config = None,
    seed: Annotated[
        int, typer.Option(metavar="N", min=0, help="Of all random numbers, of every log.")
    ] = 0,
    belief: Annotated[
        Literal["own", "recorded"],
        typer.Option(help="Localize the robot here, or take the belief that the logs hold."),
    ] = "own",
    initial_pose: Annotated[
        str | None, typer.Option(metavar="X,Y,YAW", help=f"Where every drive starts: {POSE}.")
    ] = None,
    global_start: GlobalStart = False,
    topics: Topics = None,
    mount: Mounts = None,
    calibration: CalibrationFile = None,
    workers: Annotated[
        int | None, typer.Option(metavar="N", min=1, help="Processes. Default: one per core.")
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Of Dask, tcp://... or its scheduler file: run the logs there."
        ),
    ] = None,
    time_limit: Annotated[
        float | None,
        typer.Option(metavar="S", min=0, help="Seconds for one log; 0: no limit. Default: 3600."),
    ] = None,
    retry_failed: Annotated[
        bool, typer.Option("--retry-failed", help="Run logs again that failed before.")
    ] = False,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Make results anew that were made otherwise.")
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Estimate many logs, one process each.

    A log that fails, hangs or crashes costs nothing but itself. Called again with the same DIR,
    it does only what is missing. The exit code is 0 when every log is done, 1 when one isn't, and 3
    when all are but the robot was lost for most of one, so that its estimates aren't reliable.
    """
    from objstate.batch import BatchOptions, gather, run_batch
    from objstate.batch.options import DEFAULT_TIME_LIMIT
    from objstate.config import load_settings
    from objstate.recording.batches import read_summary_table
    from objstate.recording.mirror import mirrored
    from objstate.report import REPORT, write_batch_report
    from objstate.run import RunOptions

    mounts, clock_offsets = calibration_from(calibration)
    options = RunOptions(
        settings=load_settings(config),
        seed=seed,
        belief=belief,
        initial_pose=None if initial_pose is None else parse_pose(initial_pose),
        global_start=global_start,
        topics=split_topics(topics or []),
        mounts=mounts | parse_mounts(mount or []),
        clock_offsets=clock_offsets,
    )
    requested = gather(logs, building, truth, options)
    if truth is not None:
        without = [each.log.log for each in requested if each.log.truth is None]
        print_warnings([f"{truth} holds no truth for {log}." for log in without], quiet)
    with mirrored(out) as folder:
        with batch_progress(quiet) as (on_start, on_event):
            result = run_batch(
                requested,
                folder,
                BatchOptions(
                    workers=workers or _cores(),
                    scheduler=scheduler,
                    time_limit=DEFAULT_TIME_LIMIT if time_limit is None else time_limit or None,
                    retry_failed=retry_failed,
                    overwrite=overwrite,
                ),
                on_start,
                on_event,
            )
        summary = read_summary_table(folder)
        has_report = not result.has_changed and (folder / REPORT).is_file()
        if not has_report and any(outcome.status == "done" for outcome in result.outcomes):
            write_batch_report(folder)
        print_warnings(_warnings(summary), quiet)
        lost = mostly_lost(summary)
        _print(result, summary, lost, out)
    if result.failed:
        raise typer.Exit(NOT_ALL_WENT_WELL)
    if lost:
        raise typer.Exit(NOT_TO_BE_RELIED_ON)


def _cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0))


def _warnings(summary: pl.DataFrame) -> list[str]:
    """Warnings of logs that are done, for the first such logs."""
    from objstate.recording.batches import SUMMARY_TABLE

    doubtful = [
        (name, [*(warnings or ()), *([problem] if problem else [])])
        for name, warnings, problem in summary.select("log", "warnings", "truth_problem").rows()
        if warnings or problem
    ]
    told = [f"{name}: {warning}" for name, own in doubtful[:LOGS_SHOWN] for warning in own]
    more = len(doubtful) - LOGS_SHOWN
    return [*told, *([f"{more} more logs have warnings; see {SUMMARY_TABLE}."] if more > 0 else [])]


def mostly_lost(summary: pl.DataFrame) -> dict[str, float]:
    """The share in which the robot was lost, of the logs whose estimates aren't reliable by it."""
    from objstate.run.doubts import MOST_LOST

    rows = summary.select("log", "lost_seconds", "log_seconds").drop_nulls().rows()
    shares = {name: lost / seconds for name, lost, seconds in rows if seconds > 0.0}
    return {name: share for name, share in shares.items() if share > MOST_LOST}


def _errors(summary: pl.DataFrame) -> Iterator[str]:
    """The errors over all logs with a truth, a line for each kind of coordinate."""
    from objstate.evaluation.summary import unit_of
    from objstate.recording.tables import KNOWN_COORDINATES

    for coordinate in KNOWN_COORDINATES:
        columns = [f"{coordinate}_{what}" for what in ("count", "error", "coverage")]
        known = summary.select(columns).drop_nulls()
        if known.is_empty():
            continue
        counts, errors, coverages = (known[column].to_numpy() for column in columns)
        unit, factor = UNITS[unit_of(coordinate)]
        yield (
            f"{coordinate}: {counts.sum()} final estimates, mean error "
            f"{factor * (counts @ errors) / counts.sum():.1f} {unit}, "
            f"{percent(counts @ coverages / counts.sum())} % of truths in the 90 % intervals"
        )


def _print(result: BatchResult, summary: pl.DataFrame, lost: Mapping[str, float], out: str) -> None:
    for outcome in result.failed:
        print_text(f"{outcome.name}: {outcome.status}. {outcome.reason or ''}".rstrip())
    for name, share in lost.items():
        print_text(
            f"{name}: not reliable. The robot was probably lost for {percent(share)} % of it."
        )
    counts = Counter(outcome.status for outcome in result.outcomes)
    told = ", ".join(f"{count} {status}" for status, count in counts.most_common())
    number = len(result.outcomes)
    print_text(f"{number} log{'' if number == 1 else 's'}: {told}.")
    for line in _errors(summary):
        print_text(line)
    print_text(f"Written: {out}")
