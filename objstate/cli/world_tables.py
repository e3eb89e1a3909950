"""What a world believes, for people."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import datetime
from typing import TYPE_CHECKING

from objstate.cli.state_table import figure, label, span
from objstate.cli.tables import new_table, percent
from objstate.order import natural_key

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.config import CalendarSettings
    from objstate.objects import ObjectBelief
    from objstate.world import Snapshot

CALENDAR_FROM_NS = 100_000_000 * 10**9  # a stamp from here on (1973) is one of the calendar


def world_table(snapshot: Snapshot) -> Table:
    """Each coordinate of each object with its 90 % interval and when it was last seen.

    Where there is furniture, also how probably it is there at all.
    """
    beliefs, calendar = [snapshot[name] for name in snapshot], snapshot.world.settings.calendar
    shows_presence = any(belief.item.kind.value == "planar" for belief in beliefs)
    there = ("there (%)",) if shows_presence else ()
    numbers = ("estimate", "90 % interval", *there, "last seen")
    table = new_table(_heading(snapshot), ("object", "state"), numbers)
    for belief in sorted(beliefs, key=lambda belief: natural_key(belief.item.name)):
        presence = [percent(belief.presence)] if shows_presence else []
        for row in belief.estimates(None):
            figures = (figure(row.coordinate, row.value), span(row), *presence)
            seen = _moment(belief.last_observed_ns, calendar)
            table.add_row(row.object, label(row.coordinate), *figures, seen)
    return table


def history_table(name: str, beliefs: Iterable[ObjectBelief], calendar: CalendarSettings) -> Table:
    """What was learnt of one object, in time order."""
    when = f"when ({calendar.timezone})"
    table = new_table(name, (when, "state"), ("estimate", "90 % interval"))
    for belief in beliefs:
        for row in belief.estimates(None):
            state, middle = label(row.coordinate), figure(row.coordinate, row.value)
            table.add_row(_moment(row.stamp_ns, calendar), state, middle, span(row))
    return table


def _heading(snapshot: Snapshot) -> str:
    """Of which moment a table is, and of which zone its times are."""
    stamp_ns, calendar = snapshot.stamp_ns, snapshot.world.settings.calendar
    if stamp_ns == 0 and snapshot.world.latest_ns is None:
        return "Nothing was learnt yet: the priors"
    zone = "" if stamp_ns < CALENDAR_FROM_NS else f" ({calendar.timezone})"
    return f"At {_moment(stamp_ns, calendar)}{zone}"


def _moment(stamp_ns: int | None, calendar: CalendarSettings) -> str:
    """A time as people read it: of the calendar, or in seconds of a simulation."""
    if stamp_ns is None:
        return "never"
    if stamp_ns < CALENDAR_FROM_NS:
        return f"{stamp_ns / 1e9:.1f} s"
    return datetime.fromtimestamp(stamp_ns // 10**9, calendar.zone).strftime("%Y-%m-%d %H:%M:%S")
