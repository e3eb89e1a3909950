"""What a world believes, for people."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import TYPE_CHECKING

from objstate.cli.state_table import figure, label, span
from objstate.cli.tables import new_table, percent
from objstate.order import natural_key

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.objects import ObjectBelief

CALENDAR_FROM_NS = 100_000_000 * 10**9  # a stamp from here on (1973) is one of the calendar


def moment(stamp_ns: int | None) -> str:
    """A time as people read it: of the calendar, in UTC, or in seconds of a simulation."""
    if stamp_ns is None:
        return "never"
    if stamp_ns < CALENDAR_FROM_NS:
        return f"{stamp_ns / 1e9:.1f} s"
    return datetime.fromtimestamp(stamp_ns // 10**9, UTC).strftime("%Y-%m-%d %H:%M:%S")


def world_table(title: str, beliefs: Sequence[ObjectBelief]) -> Table:
    """Each coordinate of each object with its 90 % interval and when it was last seen.

    Where there is furniture, also how probably it is there at all.
    """
    shows_presence = any(belief.item.kind.value == "planar" for belief in beliefs)
    there = ("there (%)",) if shows_presence else ()
    numbers = ("estimate", "90 % interval", *there, "last seen")
    table = new_table(title, ("object", "state"), numbers)
    for belief in sorted(beliefs, key=lambda belief: natural_key(belief.item.name)):
        presence = [percent(belief.presence)] if shows_presence else []
        for row in belief.estimates(None):
            figures = (figure(row.coordinate, row.value), span(row), *presence)
            seen = moment(belief.last_observed_ns)
            table.add_row(row.object, label(row.coordinate), *figures, seen)
    return table


def history_table(title: str, beliefs: Iterable[ObjectBelief]) -> Table:
    """What was learnt of one object, in time order."""
    table = new_table(title, ("when", "state"), ("estimate", "90 % interval"))
    for belief in beliefs:
        for row in belief.estimates(None):
            state, middle = label(row.coordinate), figure(row.coordinate, row.value)
            table.add_row(moment(row.stamp_ns), state, middle, span(row))
    return table
