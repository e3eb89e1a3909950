"""Times of a part of a log, as users give them."""

from __future__ import annotations

# s; a time from here on (the year 1973) is one of the calendar, a smaller one counts from
# the log's start
EPOCH_FROM = 1e8

# s, the year 5138; a later time was given in milliseconds or nanoseconds
LATEST = 1e11


def stamp_at(seconds: float, origin_ns: int) -> int:
    """The stamp, ns, of a time that is given from the log's origin or of the calendar."""
    return round(seconds * 1e9) + (origin_ns if seconds < EPOCH_FROM else 0)
