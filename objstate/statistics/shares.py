"""The share of time open within hours of the day and days of the week."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import date, datetime, tzinfo

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.statistics.summed import Summed
from objstate.statistics.two_state import LEVEL, Interval, Memory

QUARTER = 15  # minutes
MOST_BLOCKS = 1000  # blocks of looks, of which every pair is compared


@dataclass(frozen=True)
class Share:
    """The share of some time in which a door was open, by the looks within it."""

    key: int  # hour of the day from 0, or day of the week from 0, Monday
    looks: int
    independent: float  # equivalent number of independent looks
    share: Interval


def share_open(key: int, looks: Summed, door: Memory) -> Share:
    """The share of time open by looks, at least one.

    The mean of n looks with the correlations ``c(|t_i - t_k|)`` varies as much as that of ``n^2 /
    sum_ik c`` independent ones. The interval is that of the Beta distribution after that many with
    Jeffreys' prior; it reaches to 0 where the door was never seen open, and to 1 where never closed
    (Brown, Cai and DasGupta 2001, Statistical Science 16, section 4.1).
    """
    from scipy.stats import beta

    seconds, means = _blocks(looks)
    count = len(means) ** 2 / float(door.after(np.abs(seconds[:, None] - seconds)).sum())
    mean, tail = float(means.mean()), (1 - LEVEL) / 2
    lower, median, upper = beta.ppf(
        [tail, 0.5, 1 - tail], count * mean + 0.5, count * (1 - mean) + 0.5
    )
    interval = Interval(
        float(median), float(lower) if mean > 0 else 0.0, float(upper) if mean < 1 else 1.0
    )
    return Share(key, len(looks), count, interval)


def shares_by(
    looks: Summed, door: Memory, key_of: Callable[[datetime], int], zone: tzinfo
) -> tuple[Share, ...]:
    """The shares of the times with equal ``key_of``, without those that have no looks.

    Time zones differ by whole quarters of an hour, so that all of a quarter has one key.
    """
    keys = _keys(looks, key_of, zone)
    return tuple(share_open(int(key), looks.chosen(keys == key), door) for key in np.unique(keys))


def shares_by_day(looks: Summed, zone: tzinfo) -> tuple[list[date], FloatArray]:
    """The days (d,) with looks at a door, and the share of each day's looks that saw it open."""
    ordinals, place = np.unique(_keys(looks, datetime.toordinal, zone), return_inverse=True)
    open_, count = (np.bincount(place, weights=each) for each in (looks.open, looks.counts))
    return [date.fromordinal(int(each)) for each in ordinals], open_ / np.maximum(count, 1)


def _keys(looks: Summed, key_of: Callable[[datetime], int], zone: tzinfo) -> IntArray:
    """(m,) the key of each minute."""
    quarters, place = np.unique(looks.minutes // QUARTER, return_inverse=True)
    begins = (60 * QUARTER * quarters).tolist()
    keys = [key_of(datetime.fromtimestamp(begin, zone)) for begin in begins]
    return np.array(keys, dtype=np.int64)[place]


def _blocks(looks: Summed) -> tuple[FloatArray, FloatArray]:
    """Looks at about the same time as one: times (b,) in s since the first, and means (b,)."""
    length = 1  # minutes
    while len(blocks := np.unique(looks.minutes // length)) > MOST_BLOCKS:
        length *= 2
    block = np.searchsorted(blocks, looks.minutes // length)
    begins = 60.0 * (looks.minutes - looks.minutes[0])
    times, open_, count = (
        np.bincount(block, weights=values)
        for values in (begins * looks.counts + looks.seconds, looks.open, looks.counts)
    )
    return times / count, open_ / count
