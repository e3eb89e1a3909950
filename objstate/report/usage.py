"""How doors are used, over the logs of a batch."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from objstate.report.markup import Cell, element, table, text

if TYPE_CHECKING:
    from objstate.statistics import DoorStatistics, Interval, Share

HEADINGS = (
    "door", "logs", "looks", "open", "open by hour", "by weekday", "stays open", "stays closed",
    "moves a day",
)  # fmt: skip
EXPLAINED = (
    "Share of time open, how long a door stays as it is, and how often it is moved: medians with "
    "90 % intervals, which are wider with fewer looks and with looks close together. Of each hour "
    "(from midnight, {zone}) and weekday (from Monday) the bar spans the 90 % interval of the "
    "share open, from never below to always on top, and the line is its median: a tall bar means "
    "great uncertainty. Hours without looks have none."
)
HOURS, DAYS = 24, 7
HOUR_MARKS = ("0", "6", "12", "18")
DAY_MARKS = ("M", "T", "W", "T", "F", "S", "S")
CELL, TALL = 9, 36  # px of an hour or a day
DAY_CELL = 14
TICK = 1.5  # px, half of the median's line
SPANS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"), (0.0, "s"))
FOR_EVER = 1e9  # s; longer than anyone waits


def usage(doors: Sequence[DoorStatistics], zone: str = "UTC") -> str:
    """The table of doors, a row each; ``zone`` names the clock of hours and days."""
    explained = element("p", text(EXPLAINED.format(zone=zone)))
    return explained + table(HEADINGS, map(_row, doors), "sortable filterable usage")


def _row(door: DoorStatistics) -> list[str | Cell]:
    return [
        text(door.door),
        str(door.logs),
        str(door.looks),
        _interval(door.share_open, lambda share: f"{share:.0%}"),
        Cell(_cells(door.by_hour, HOURS, CELL, HOUR_MARKS), door.share_open.value),
        Cell(_cells(door.by_weekday, DAYS, DAY_CELL, DAY_MARKS), door.share_open.value),
        _interval(door.open_spell, _span),
        _interval(door.closed_spell, _span),
        _interval(door.moves_per_day, _short),
    ]


def _interval(interval: Interval, shown: Callable[[float], str]) -> Cell:
    value, lower, upper = map(shown, (interval.value, interval.lower, interval.upper))
    markup = text(value) + element("small", text(f"{lower} to {upper}"))
    return Cell(markup, min(interval.value, FOR_EVER))


def _cells(shares: Sequence[Share], count: int, width: int, marks: Sequence[str]) -> str:
    """For each hour or day the interval of the share open as a bar, and its median as a line."""
    known = {share.key: share for share in shares}
    parts = [element("path", d=f"M0,{TALL}H{count * width}M0,0H{count * width}", class_="frame")]
    for key in range(count):
        if key in known:
            interval = known[key].share
            top, bottom = (TALL * (1.0 - share) for share in (interval.upper, interval.lower))
            middle = TALL * (1.0 - interval.value)
            parts += [
                element("rect", x=key * width + 1, y=f"{top:.1f}", width=width - 2,
                        height=f"{max(bottom - top, 1.0):.1f}", class_="span"),
                element("rect", x=key * width + 1, y=f"{middle - TICK:.1f}", width=width - 2,
                        height=2 * TICK, class_="median"),
            ]  # fmt: skip
        told = element("title", text(_said(key, known.get(key))))
        parts.append(element("rect", told, x=key * width, y=0, width=width, height=TALL,
                             class_="touch"))  # fmt: skip
    parts += [
        element("text", text(mark), x=k * count * width / len(marks) + 1, y=TALL + 11)
        for k, mark in enumerate(marks)
    ]
    return element(
        "svg", *parts, viewBox=f"0 -2 {count * width} {TALL + 16}", width=count * width,
        height=TALL + 16, class_="hours",
    )  # fmt: skip


def _said(key: int, share: Share | None) -> str:
    if share is None:
        return f"{key}: no look"
    interval = share.share
    return (
        f"{key}: open {interval.value:.0%} ({interval.lower:.0%} to {interval.upper:.0%}), "
        f"{share.looks} looks"
    )


def _span(seconds: float) -> str:
    if not math.isfinite(seconds) or seconds > FOR_EVER:
        return "for ever"
    length, unit = next((length, unit) for length, unit in SPANS if seconds >= length)
    return f"{_short(seconds / (length or 1.0))} {unit}"


def _short(value: float) -> str:
    """Two digits, without an exponent."""
    return f"{value:.2g}" if value < 100 else f"{value:.0f}"
