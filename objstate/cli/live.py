"""``estimate --live``: the doors in view while a run goes on, on stderr."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from objstate.cli.console import error_console
from objstate.cli.tables import new_table
from objstate.errors import SettingsError

if TYPE_CHECKING:
    from rich.console import RenderableType
    from rich.text import Text

    from objstate.building.model import MovableObject
    from objstate.estimator import Estimator
    from objstate.records import Estimate, Record

REFRESH = 8  # times a second, of the terminal's clock
IN_VIEW_NS = 2_000_000_000  # ns; a door is in view for this long after a beam reached it
BAR = 36  # characters from the lower to the upper limit


class LiveView:
    """What the terminal shows; as an observer of the run it only remembers."""

    def __init__(self) -> None:
        self._began = time.monotonic()
        self._share, self._seconds = 0.0, 0.0
        self._now_ns = 0
        self._doors: dict[str, MovableObject] = {}
        self._latest: dict[str, Estimate] = {}
        self._seen_ns: dict[str, int] = {}

    def note(self, record: Record, estimator: Estimator, estimates: Sequence[Estimate]) -> None:
        """Remember what is believed of doors."""
        self._doors = self._doors or doors_of(estimator)
        self._now_ns = record.stamp_ns
        for estimate in estimates:
            if estimate.object in self._doors:
                self._latest[estimate.object] = estimate
                if estimate.observed:
                    self._seen_ns[estimate.object] = estimate.stamp_ns

    def report(self, share: float, seconds: float) -> None:
        """Remember how far the log has been read."""
        self._share, self._seconds = share, seconds

    def __rich__(self) -> RenderableType:
        speed = self._seconds / max(time.monotonic() - self._began, 1e-3)
        title = f"{self._seconds:.0f} s, {self._share:.0%} of the log, {speed:.0f} x real time"
        table = new_table(title, ("door", "closed to open"), ("state", "90 % interval"))
        for name in self._in_view():
            table.add_row(*door_cells(self._doors[name], self._latest[name]))
        return table

    def _in_view(self) -> list[str]:
        """The doors on which a beam bore lately, in the building's order."""
        since = self._now_ns - IN_VIEW_NS
        return [name for name in self._doors if self._seen_ns.get(name, since) > since]


@contextmanager
def live_view(asked: bool) -> Iterator[LiveView | None]:
    """A view that the terminal shows until the block ends; None where it wasn't asked for.

    Raises SettingsError where there is no terminal to show it.
    """
    if not asked:
        yield None
        return
    if not sys.stderr.isatty():
        raise SettingsError(
            "--live shows its bars on a terminal, and stderr is none; leave it out."
        )
    from rich.live import Live

    view = LiveView()
    console = error_console()
    with Live(view, console=console, refresh_per_second=REFRESH, transient=True):
        yield view


def doors_of(estimator: Estimator) -> dict[str, MovableObject]:
    """The building's doors by name: what has one coordinate between limits."""
    items = estimator.building.objects.items()
    return {name: item for name, item in items if item.upper > item.lower}


def door_cells(door: MovableObject, estimate: Estimate) -> list[str | Text]:
    """One row: name, bar, estimate, interval."""
    from objstate.evaluation.units import UNITS

    unit, factor, decimals = UNITS[estimate.coordinate]
    middle, lower, upper = (
        f"{factor * value:z.{decimals}f}"
        for value in (estimate.value, estimate.lower, estimate.upper)
    )
    return [door.name, bar(door, estimate), f"{middle} {unit}", f"{lower} to {upper}"]


def bar(door: MovableObject, estimate: Estimate) -> Text:
    """The interval as a stroke and the estimate as a knob, between the door's limits."""
    from rich.text import Text

    def column(value: float) -> int:
        share = (value - door.lower) / (door.upper - door.lower)
        return min(BAR - 1, max(0, int(share * BAR)))

    first, last, knob = (column(v) for v in (estimate.lower, estimate.upper, estimate.value))
    drawn = Text("─" * BAR, style="dim")
    stroke = Text("━" * (last - first + 1), style="yellow")
    drawn = drawn[:first] + stroke + drawn[last + 1 :]
    return drawn[:knob] + Text("●", style="bold red") + drawn[knob + 1 :]
