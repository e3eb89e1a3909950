"""Local time as habits know it: quarters of hours, and kinds of days.

Rates are constant within a cell, a quarter of an hour. Which quarter of which kind of local day a
cell is follows from its start by the time zone, so that a day on which clocks are changed has four
cells less, or more.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, timedelta, tzinfo
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from objstate.geometry import FloatArray, IntArray

CELL_S = 900
PER_DAY = 86400 // CELL_S  # cells of a day on which no clock is changed
NANOSECONDS = 10**9
CELL_NS = CELL_S * NANOSECONDS
WEEKEND = (5, 6)  # of the days of the week from 0, Monday
# The kind of a day is a sum of these: on free days, weekends and holidays, few people are expected,
# and on warm ones, where a calendar has seasons, doors stand open that are shut in winter.
WORKING, FREE, WARM = 0, 1, 2
DAYS_KEPT = 1 << 14  # 45 years: a stretch longer than is kept would never be found again


class Season(NamedTuple):
    """A part of each year, by months and days; over new year where it ends before it begins."""

    first: tuple[int, int]
    last: tuple[int, int]  # which is included

    def has(self, day: date) -> bool:
        """Whether a date lies in it."""
        at = (day.month, day.day)
        if self.first <= self.last:
            return self.first <= at <= self.last
        return at >= self.first or at <= self.last


ALWAYS, NEVER = Season((1, 1), (12, 31)), Season((13, 1), (13, 1))  # there is no 13th month


@dataclass(frozen=True)
class Calendar:
    """By which clock a building lives, on which dates it rests, and when it is warm."""

    zone: tzinfo = UTC
    holidays: frozenset[date] = field(default=frozenset())
    warm: Season | None = None  # None: habits have no seasons

    @property
    def seasons(self) -> bool:
        """Whether days are told apart by season."""
        return self.warm is not None

    def is_warm(self, day: date) -> bool:
        """Whether a date lies in the warm season."""
        return self.warm is not None and self.warm.has(day)

    def kind(self, day: date) -> int:
        """The sum of FREE and WARM as far as they hold."""
        free = day.weekday() in WEEKEND or day in self.holidays
        return (FREE if free else WORKING) + (WARM if self.is_warm(day) else 0)

    def usual(self, day: date) -> Calendar:
        """A calendar without holidays, on which it is always the season of a date."""
        warm = None if self.warm is None else ALWAYS if self.is_warm(day) else NEVER
        return replace(self, holidays=frozenset(), warm=warm)

    def keys(self, first: int, last: int) -> IntArray:
        """(last - first,) the key of each cell, ``kind * PER_DAY + quarter``.

        Cells are counted from 1970 in quarters of hours; ``last`` is left out.
        """
        return np.concatenate(
            [
                _keys_of_day(self, day)[max(first - day * PER_DAY, 0) : last - day * PER_DAY]
                for day in range(first // PER_DAY, -(-last // PER_DAY))
            ]
            or [np.empty(0, dtype=np.int64)]
        )

    def key(self, cell: int) -> int:
        """The key of one cell."""
        return int(_keys_of_day(self, cell // PER_DAY)[cell % PER_DAY])

    def key_at(self, stamp_ns: int) -> int:
        """The key of the cell of a moment."""
        return self.key(stamp_ns // (CELL_S * NANOSECONDS))

    def seconds_by_key(self, begin_ns: int, end_ns: int) -> FloatArray:
        """(k,) how much of a stretch of time lies in cells of each key."""
        first, last = begin_ns // CELL_NS, end_ns // CELL_NS
        ends = np.arange(first, last + 2) * CELL_NS
        seconds = np.diff(np.clip(ends, begin_ns, end_ns)) / NANOSECONDS
        by_key = np.bincount(
            self.keys(first, last + 1), seconds, minlength=kinds(self.seasons) * PER_DAY
        )
        return np.asarray(by_key, dtype=float)

    def local(self, stamp_ns: int) -> datetime:
        """A moment by the clock."""
        return datetime.fromtimestamp(stamp_ns / NANOSECONDS, self.zone)

    def days(self, begin_ns: int, end_ns: int) -> Iterator[tuple[date, int, int]]:
        """Local dates with their first and last nanoseconds, clipped to a stretch of time."""
        day = self.local(begin_ns).date()
        while True:
            since, until = _midnight_ns(self, day), _midnight_ns(self, day + timedelta(days=1))
            if since >= end_ns:
                return
            yield day, max(since, begin_ns), min(until, end_ns)
            day += timedelta(days=1)


def kinds(seasons: bool) -> int:
    """How many kinds of days there are, with seasons or without."""
    return 4 if seasons else 2


@lru_cache(maxsize=DAYS_KEPT)
def _keys_of_day(calendar: Calendar, day: int) -> IntArray:
    """(PER_DAY,) keys of the cells of a day of UTC."""
    begin = datetime(1970, 1, 1, tzinfo=UTC) + timedelta(days=day)
    out = np.empty(PER_DAY, dtype=np.int64)
    for cell in range(PER_DAY):
        local = (begin + timedelta(seconds=cell * CELL_S)).astimezone(calendar.zone)
        quarter = (local.hour * 3600 + local.minute * 60) // CELL_S
        out[cell] = calendar.kind(local.date()) * PER_DAY + quarter
    return out


def _midnight_ns(calendar: Calendar, day: date) -> int:
    local = datetime(day.year, day.month, day.day, tzinfo=calendar.zone)
    return int(local.timestamp()) * NANOSECONDS
