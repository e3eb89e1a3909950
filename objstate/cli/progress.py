"""A progress bar on stderr: the share of the log done, and the speed relative to real time."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from objstate.cli.console import error_console
from objstate.cli.plain import plain_line
from objstate.compiling import when_compiling

COMPILING = "Compiling the inner loops, once after an install: up to half a minute."

WORTH_TELLING = 3.0  # s of compiling; a loop that only rare logs need takes less

STEP = 0.2  # s between two pictures of the bar; drawing one takes as long as a scan or two

Report = Callable[[float, float], None]  # share done from 0 to 1, seconds of the log done


@contextmanager
def progress_bar(label: str, quiet: bool) -> Iterator[Report | None]:
    """A bar to report to; None where it would not be seen: quiet, or stderr is no terminal."""
    if not quiet:
        when_compiling(lambda: error_console().print(COMPILING), after=WORTH_TELLING)
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeRemainingColumn,
    )

    begin = shown = time.monotonic()
    columns = (
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        TaskProgressColumn(),
        TextColumn("{task.fields[speed]}"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=error_console(), transient=True, auto_refresh=False) as bar:
        task = bar.add_task(plain_line(label), total=1.0, speed="")

        def report(share: float, log_seconds: float) -> None:
            nonlocal shown
            now = time.monotonic()
            if now - shown < STEP:
                return
            shown, speed = now, log_seconds / (now - begin)
            bar.update(task, completed=share, speed=f"{speed:.0f} x real time", refresh=True)

        yield report
