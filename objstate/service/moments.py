"""Times as requests give them."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta

from objstate.service.problems import Problem

CURE = "Give RFC 3339, as 2026-11-23T12:00:00Z, or whole nanoseconds since 1970."
EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def parse_moment(text: str) -> int:
    """The nanoseconds since 1970 that a text means. Raises Problem."""
    try:
        return int(text)
    except ValueError:
        return _of_rfc3339(text)


def _of_rfc3339(text: str) -> int:
    try:
        when = datetime.fromisoformat(text.replace(" ", "+"))  # a plus in a query means a space
    except ValueError as error:
        raise Problem(422, f"'{text}' is not a time.", CURE) from error
    if when.tzinfo is None:
        raise Problem(422, f"The time '{text}' has no offset.", CURE)
    return (when - EPOCH) // timedelta(microseconds=1) * 1000


def words_of(stamp_ns: int) -> str:
    """A moment in RFC 3339, to the microsecond."""
    when = EPOCH + timedelta(microseconds=stamp_ns // 1000)
    return when.isoformat().replace("+00:00", "Z")
