"""One log of a batch as a job for a worker process."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from objstate.batch.addresses import fetched
from objstate.batch.delivery import pack, unpack
from objstate.batch.process import Report
from objstate.building.model import Building
from objstate.recording.batches import BatchLog
from objstate.recording.mirror import send_result
from objstate.recording.summary import read_summary, write_summary
from objstate.run import BuildingInput, RunOptions, RunResult, estimate_log
from objstate.storage import is_remote


@dataclass(frozen=True, eq=False)
class Context:
    """What many logs share; it travels to each worker once."""

    buildings: Mapping[str, BuildingInput]  # by address
    options: Mapping[int, RunOptions]  # by number


@dataclass(frozen=True)
class Job:
    """One log, and where its result goes."""

    name: str
    log: str  # path or URL
    building: str  # of the context
    options: int  # of the context
    out: str
    truth: str | None = None
    path: str | None = None  # the robot's true path


def run_job(context: Context, job: Job, report: Report) -> None:
    """Estimate one log. Raises what ``estimate_log`` raises, and LogError for a log out of reach."""
    building, options = context.buildings[job.building], context.options[job.options]
    log = BatchLog(job.name, job.log, job.building, job.truth, job.path)

    def estimate(read_from: Path, out: str | Path) -> None:
        def finish(folder: Path, model: Building, result: RunResult) -> None:
            from objstate.batch.beside import write_parts  # it takes half the package to load

            write_parts(folder, log, read_from, model)

        estimate_log(
            [read_from],
            building,
            out,
            options,
            overwrite=True,
            on_progress=report,
            on_finish=finish,
        )

    if not is_remote(job.log) and not is_remote(job.out):
        estimate(Path(job.log), job.out)
        return
    with tempfile.TemporaryDirectory() as here:
        made = Path(here) / "result"
        if is_remote(job.log):
            read_from = fetched(job.log, Path(here))
            estimate(read_from, made)
            _name_the_source(made, read_from, job.log)
        else:
            estimate(Path(job.log), made)
        if is_remote(job.out):
            send_result(made, job.out)
        else:
            unpack(pack(made), Path(job.out))


def _name_the_source(folder: Path, fetched_to: Path, address: str) -> None:
    """Say in ``run.json`` where the log came from, instead of where it lay meanwhile."""
    summary = read_summary(folder)
    for file in summary["inputs"]["logs"]:
        file["path"] = file["path"].replace(str(fetched_to), address, 1)
    write_summary(folder, summary)
