"""How far a batch is: bars on a terminal, else a line for each log that ends."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from objstate.cli.console import error_console, print_notice
from objstate.cli.plain import plain_line

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

    from objstate.batch import Event, Leftover

OnStart = Callable[["Leftover"], None]
OnEvent = Callable[["Event"], None]


@contextmanager
def batch_progress(quiet: bool) -> Iterator[tuple[OnStart, OnEvent]]:
    """What to call when a batch starts, and at each event of it."""
    if quiet:
        yield _nothing, _nothing
    elif not sys.stderr.isatty():
        lines = Lines()
        yield lines.start, lines.tell
    else:
        from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=error_console(), transient=True) as progress:
            bars = Bars(progress)
            yield bars.start, bars.tell


def _nothing(_: object) -> None:
    pass


def opening(leftover: Leftover) -> list[str]:
    """What a start finds in the folder, in words."""
    told = [f"{len(leftover.jobs)} logs to run"]
    if leftover.finished:
        told.append(f"{len(leftover.finished)} are done")
    if leftover.given_up:
        told.append(f"{len(leftover.given_up)} failed before (--retry-failed runs them again)")
    lines = [", ".join(told) + "."]
    if leftover.anew:
        names = ", ".join(leftover.anew)
        lines.append(f"Made anew, as the log or the options are not the same: {names}")
    return lines


class Lines:
    """A line on stderr for each log that ends."""

    def __init__(self) -> None:
        self._count = 0
        self._ended = 0
        self._begin = time.monotonic()

    def start(self, leftover: Leftover) -> None:
        """Print what is to be done."""
        self._count = len(leftover.jobs)
        self._begin = time.monotonic()
        for line in opening(leftover):
            print_notice(line)

    def tell(self, event: Event) -> None:
        """Say that a log has ended, or that none can be run."""
        from objstate.batch import Connected, Ended, Waiting

        if isinstance(event, Waiting):
            print(event.reason, file=sys.stderr)
        if isinstance(event, Connected):
            print_notice(f"The cluster's page: {event.dashboard}")
        if not isinstance(event, Ended):
            return
        self._ended += 1
        each = (time.monotonic() - self._begin) / self._ended
        left = _duration(each * (self._count - self._ended))
        outcome = event.outcome
        print_notice(f"{self._ended}/{self._count} {outcome.name}: {outcome.status}, {left} left")


class Bars:
    """A bar for the whole, and one for each log that runs."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._whole = progress.add_task("", total=None)
        self._running: dict[str, TaskID] = {}
        self._shares: dict[str, float] = {}
        self._ended = 0
        self._count = 0

    def start(self, leftover: Leftover) -> None:
        """Print what is to be done."""
        self._count = len(leftover.jobs)
        for line in opening(leftover):
            self._progress.console.print(line)
        self._progress.update(self._whole, total=self._count)

    def tell(self, event: Event) -> None:
        """Move the bars."""
        from objstate.batch import Began, Connected, Ended, Progressed, Waiting

        match event:
            case Began(name):
                self._forget(name)
                self._running[name] = self._progress.add_task(plain_line(name), total=1.0)
            case Progressed(name, share, _) if name in self._running:
                self._shares[name] = share
                self._progress.update(self._running[name], completed=share)
            case Waiting(reason):
                self._progress.console.print(reason, markup=False)
            case Connected(dashboard):
                self._progress.console.print(f"The cluster's page: {dashboard}", markup=False)
            case Ended(outcome):
                self._forget(outcome.name)
                self._ended += 1
                if outcome.status != "done":
                    self._progress.console.print(f"{outcome.name}: {outcome.status}")
        done = self._ended + sum(self._shares.values())
        text = f"{self._ended} of {self._count} logs"
        self._progress.update(self._whole, completed=done, description=text)

    def _forget(self, name: str) -> None:
        self._shares.pop(name, None)
        if name in self._running:
            self._progress.remove_task(self._running.pop(name))


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02d}:{rest:02d}"
