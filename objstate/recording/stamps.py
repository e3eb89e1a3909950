"""Times that were written in another unit than the one that a file has."""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction

PER_SECOND = {"seconds": 1, "milliseconds": 10**3, "microseconds": 10**6, "nanoseconds": 10**9}
CALENDAR_FROM = 10**8  # s since 1970, the year 1973; smaller numbers count from some start
CALENDAR_TO = 10**11  # s since 1970, the year 5138
DAY_NS = 86_400 * 10**9
SHORTEST_NS = 10**6  # states are known to begin to a millisecond at best


def unit_of_number(value: Fraction) -> tuple[str, int]:
    """The unit in which a number is a time of the calendar, and how many of it make a second.

    Nanoseconds for a number that is none in any unit.
    """
    for unit, per_second in PER_SECOND.items():
        if CALENDAR_FROM * per_second <= abs(value) < CALENDAR_TO * per_second:
            return unit, per_second
    return "nanoseconds", PER_SECOND["nanoseconds"]


def mistaken_unit(stamps: Collection[int], begin_ns: int, end_ns: int) -> str | None:
    """The unit in which stamps, taken as nanoseconds, would be times of a log, as they are not now.

    None where they may be nanoseconds: one of them, zero apart, lies within the log, or in no unit
    does one. Of the calendar, a day before the log and after it counts as within, as states are
    true from before on; of a clock that starts at zero, single stamps prove nothing.
    """
    told = {stamp for stamp in stamps if stamp}
    of_calendar = begin_ns >= CALENDAR_FROM * 10**9
    margin = DAY_NS if of_calendar else 0
    if not told or (len(told) == 1 and not of_calendar):
        return None
    first, last = max(begin_ns - margin, SHORTEST_NS), end_ns + margin
    fitting = [
        unit
        for unit, per_second in PER_SECOND.items()
        if any(first <= stamp * (10**9 // per_second) <= last for stamp in told)
    ]
    return fitting[0] if fitting and "nanoseconds" not in fitting else None
