"""Doors that behave unlike themselves: whose share of time open has changed on some day."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, tzinfo

from objstate.order import natural_key
from objstate.report.document import section
from objstate.report.markup import Cell, element, table, text
from objstate.statistics import DoorStatistics
from objstate.statistics.change_points import Change, change_of_shares
from objstate.statistics.looks import DoorLooks
from objstate.statistics.shares import shares_by_day

TOLD = 0.5  # probability of a change from which on it is shown
SATURDAY = 5
EXPLAINED = (
    "Doors whose share of time open has probably changed once. All looks of a day count as one, "
    "and workdays and weekends are compared with their own."
)


@dataclass(frozen=True)
class DoneDoor:
    """A door's looks, and whether its use changed."""

    statistics: DoorStatistics
    change: Change | None
    day: date | None  # the first after the change


def done_door(looks: DoorLooks, statistics: DoorStatistics, zone: tzinfo) -> DoneDoor:
    """The door, by the days of a zone."""
    days, shares = shares_by_day(looks.looks, zone)
    change = change_of_shares(shares, [int(day.weekday() >= SATURDAY) for day in days])
    return DoneDoor(statistics, change, None if change is None else days[change.place])


def habits(doors: Sequence[DoneDoor], zone: tzinfo) -> str:
    """A row for each door that has probably changed, the most probable first."""
    found = [
        (each.change.probability, each, each.change, each.day)
        for each in doors
        if each.change is not None and each.change.probability > TOLD
    ]
    if not found:
        return ""
    found.sort(key=lambda row: (-row[0], natural_key(row[1].statistics.door)))
    rows: list[list[str | Cell]] = [
        [
            text(door.statistics.door),
            Cell(f"{probability:.0%}", round(probability, 6)),
            text(f"{day:%Y-%m-%d %a}"),
            f"{change.before:.0%} → {change.after:.0%}",
        ]
        for probability, door, change, day in found
    ]
    headings = ("door", "probably changed", f"from ({zone})", "open on how much of the days' looks")
    return section(
        "Doors unlike themselves",
        element("p", text(EXPLAINED)),
        table(headings, rows, "sortable filterable"),
    )
