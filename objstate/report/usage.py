"""How doors are used, over the logs of a batch."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from objstate.report.markup import element, table, text

if TYPE_CHECKING:
    from objstate.statistics import DoorStatistics, Interval, Share

HEADINGS = (
    "door", "logs", "looks", "open", "open by hour", "by weekday", "stays open", "stays closed",
    "moves a day",
)  # fmt: skip
EXPLAINED = (
    "Share of time open, how long a door stays as it is, and how often it is moved: medians with 90 % "
    "intervals, which are the wider the fewer looks there were and the closer they came. Hours (from "
    "midnight, UTC) and weekdays (from Monday) are the darker the more of their looks saw the door "
    "open; where nobody looked they are empty."
)
HOURS, DAYS = 24, 7
SPANS = ((86400.0, "d"), (3600.0, "h"), (60.0, "min"), (0.0, "s"))
FOR_EVER = 1e9  # s; nobody waits longer


def usage(doors: Sequence[DoorStatistics]) -> str:
    """The table of doors, a row each."""
    return element("p", text(EXPLAINED)) + table(HEADINGS, map(_row, doors))


def _row(door: DoorStatistics) -> list[str]:
    return [
        text(door.door),
        str(door.logs),
        str(door.looks),
        _interval(door.share_open, lambda share: f"{share:.0%}"),
        _cells(door.by_hour, HOURS),
        _cells(door.by_weekday, DAYS),
        _interval(door.open_spell, _span),
        _interval(door.closed_spell, _span),
        _interval(door.moves_per_day, _short),
    ]


def _interval(interval: Interval, shown: Callable[[float], str]) -> str:
    value, lower, upper = map(shown, (interval.value, interval.lower, interval.upper))
    return text(f"{value} ({lower} to {upper})")


def _cells(shares: Sequence[Share], count: int) -> str:
    """A square for each hour or day, filled by the share open."""
    known = {share.key: share for share in shares}
    squares = [
        element(
            "rect",
            element("title", text(_said(key, known.get(key)))),
            x=key,
            width=1,
            height=1,
            class_=None if key in known else "unknown",
            fill_opacity=f"{known[key].share.value:.2f}" if key in known else None,
        )
        for key in range(count)
    ]
    return element(
        "svg", *squares, viewBox=f"0 0 {count} 1", preserveAspectRatio="none", class_="hours"
    )


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
