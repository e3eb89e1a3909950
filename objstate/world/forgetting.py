"""The rule by which a world's history is thinned as it ages.

Of a history that is younger than ``all_days`` every belief is kept, of an older one up to
``hourly_days`` the last of each hour of an object, and of what is older still the last of each day.
The newest belief of an object is always kept, however old. So answers about the present and about
any kept moment stay the same, and an older moment is answered by a belief that is at most an hour,
or a day, older.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from objstate.errors import WorldError

if TYPE_CHECKING:
    from sqlalchemy import Delete

HOUR_NS, DAY_NS = 3600 * 10**9, 86400 * 10**9


@dataclass(frozen=True)
class Thinning:
    """How old a history may become before it is thinned."""

    all_days: float = 30.0
    hourly_days: float = 365.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.all_days <= self.hourly_days:
            raise WorldError(
                f"History can't be kept whole for {self.all_days:g} days and by the hour for "
                f"{self.hourly_days:g}; neither may be below zero, nor the second below the first."
            )


def thinned(rule: Thinning, now_ns: int) -> list[Delete]:
    """What removes the beliefs that the rule doesn't keep at a moment."""
    hourly_ns = now_ns - int(rule.all_days * DAY_NS)
    daily_ns = now_ns - int(rule.hourly_days * DAY_NS)
    return [_but_the_last(HOUR_NS, daily_ns, hourly_ns), _but_the_last(DAY_NS, None, daily_ns)]


def _but_the_last(span_ns: int, since_ns: int | None, before_ns: int) -> Delete:
    """Of the beliefs of a stretch, all but each object's last in every ``span_ns``."""
    from sqlalchemy import delete, exists

    from objstate.world.schema import BELIEFS

    b, later = BELIEFS.c, BELIEFS.alias("later")
    within = [b.stamp_ns < before_ns]
    if since_ns is not None:
        within.append(b.stamp_ns >= since_ns)
    followed = exists().where(
        later.c.object == b.object,
        later.c.stamp_ns > b.stamp_ns,
        later.c.stamp_ns < (b.stamp_ns // span_ns + 1) * span_ns,
    )
    return delete(BELIEFS).where(*within, followed)
