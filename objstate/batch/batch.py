"""From many recorded logs to one batch folder."""

from __future__ import annotations

import fcntl
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, replace
from pathlib import Path

from objstate.batch.cluster import run_on_cluster
from objstate.batch.combine import Combined, combine
from objstate.batch.events import Ended, Event, OnEvent
from objstate.batch.jobs import run_job
from objstate.batch.leftover import Leftover, OnStart, plan
from objstate.batch.options import BatchOptions
from objstate.batch.pool import run_here
from objstate.batch.request import Requested, named
from objstate.errors import OutageError, ResultError
from objstate.outputs import WORKSHOP, make_folder, refuse_url, remove_folder, sweep
from objstate.recording.batches import (
    LOGS,
    OUTCOMES,
    BatchLog,
    Outcome,
    is_batch,
    read_logs,
    write_logs,
)
from objstate.recording.index import INDEX, REMOTE, open_index, settled
from objstate.recording.mirror import Mirror, mirrored

LOCK = ".lock"  # held while a batch runs


@dataclass(frozen=True)
class BatchResult:
    """What a batch came to, logs of earlier starts included."""

    folder: Path
    outcomes: tuple[Outcome, ...]  # of every log that was begun, by name
    ran: tuple[str, ...]  # the logs that this start ran to their end
    has_changed: bool  # the combined tables aren't those of the start before

    @property
    def failed(self) -> list[Outcome]:
        """How the logs ended that aren't done."""
        return [outcome for outcome in self.outcomes if outcome.status != "done"]


def run_batch(
    requested: Sequence[Requested],
    out: str | Path,
    options: BatchOptions | None = None,
    on_start: OnStart | None = None,
    on_event: OnEvent | None = None,
) -> BatchResult:
    """Run every log of ``requested`` whose result isn't in the folder ``out`` yet.

    A log that fails, hangs or kills its worker costs nothing but itself. Broken off, by
    KeyboardInterrupt too, the folder holds what is finished, whole, and its combined
    tables. A result in ``out`` that was made otherwise than asked now is refused, or made
    anew with ``options.overwrite``; one whose log has changed is made anew. The old one
    stays until the new one is complete. Raises ResultError, BuildingError, LogError and
    SettingsError before anything is begun; and OutageError, where a full disk or the like
    stops the batch: what isn't finished then counts as not run.
    """
    options = options or BatchOptions()
    with mirrored(out) as folder:
        return replace(_run(requested, folder, options, on_start, on_event), folder=Path(out))


def _run(
    requested: Sequence[Requested],
    folder: Path,
    options: BatchOptions,
    on_start: OnStart | None,
    on_event: OnEvent | None,
) -> BatchResult:
    """The batch in a folder of this machine, or in a mirror of one elsewhere."""
    mirror = Mirror.of(folder)
    with _opened(folder), open_index(folder) as index:
        known = {log.log: log for log in read_logs(folder)} if is_batch(folder) else {}
        wanted = named(requested, known.values())
        logs = known | {each.log.log: each.log for each in wanted}
        entries = settled(index, folder, logs.values())
        leftover = plan(wanted, folder, entries, options)
        if logs != known:
            write_logs(folder, logs.values())
        _drop_old_notes(folder)
        index.forget([job.name for job in leftover.jobs])
        if on_start is not None:
            on_start(leftover)
        ran: list[str] = []
        try:
            with closing(_events(leftover, options)) as events:
                for event in events:
                    if isinstance(event, Ended):
                        index.note([event.outcome])
                        if mirror is not None:
                            if event.outcome.status == "done":
                                mirror.expect(event.outcome.name)
                            mirror.send_if_due(
                                lambda: combine(folder, logs.values(), compacted=False)
                            )
                        ran.append(event.outcome.name)
                    if on_event is not None:
                        on_event(event)
        except OutageError as error:
            _sweep(folder)
            with suppress(OutageError):  # the same again, most likely
                _settle(folder, logs.values(), mirror, compacted=False)
            count = len(leftover.jobs) - len(ran)
            raise type(error)(f"{error} The batch has stopped; {_told(count)}") from error
        except BaseException:
            _sweep(folder)
            _settle(folder, logs.values(), mirror, compacted=False)
            raise
        _sweep(folder)
        combined = _settle(folder, logs.values(), mirror, compacted=True)
        return BatchResult(folder, combined.outcomes, tuple(ran), combined.has_changed)


def _settle(
    folder: Path, logs: Iterable[BatchLog], mirror: Mirror | None, *, compacted: bool
) -> Combined:
    """Write the tables over all that has been finished."""
    if mirror is not None:
        mirror.take_in_expected()
    return combine(folder, logs, compacted=compacted)


def _drop_old_notes(folder: Path) -> None:
    """The index has taken up what batches of earlier versions noted in a file for each log."""
    remove_folder(folder / OUTCOMES)


def _told(count: int) -> str:
    logs = "1 log was" if count == 1 else f"{count} logs were"
    return f"{logs} not run: the same command again goes on from there."


def _events(leftover: Leftover, options: BatchOptions) -> Generator[Event]:
    """What happens while the jobs are run, here or on a cluster."""
    context, jobs = leftover.context, leftover.jobs
    if options.scheduler is None or not jobs:
        return run_here(run_job, context, jobs, options.workers, options.time_limit)
    return run_on_cluster(run_job, context, jobs, options.scheduler, options.time_limit)


@contextmanager
def _opened(folder: Path) -> Iterator[None]:
    """Hold a batch folder alone; it is made where there is none. Raises ResultError."""
    refuse_url(folder)
    if folder.exists() and not is_batch(folder) and not _is_bare(folder):
        raise ResultError(f"{folder} is no batch of objstate; choose another name for it.")
    make_folder(folder / LOGS)
    try:
        file = (folder / LOCK).open("w")
    except OSError as error:
        raise ResultError(
            f"Can't write in {folder}: {error.strerror}; choose another place."
        ) from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise ResultError(f"Another batch is at work in {folder}; wait for it.") from error
        _sweep(folder)
        yield


def _is_bare(folder: Path) -> bool:
    """Whether nobody keeps anything in a folder: a batch that never began may have been opened."""
    if not folder.is_dir():
        return False
    names = {each.name for each in folder.iterdir()}
    return {name for name in names if not name.startswith(WORKSHOP)} <= {LOGS, LOCK, REMOTE, INDEX}


def _sweep(folder: Path) -> None:
    """Remove what processes left half done when they were killed."""
    for each in (folder, folder / LOGS):
        sweep(each)
