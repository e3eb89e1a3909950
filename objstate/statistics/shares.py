"""The share of time open within hours of the day and days of the week."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from datetime import datetime, tzinfo

import numpy as np

from objstate.statistics.two_state import LEVEL, SHORTEST_MEMORY, Interval, Looks, Memory

MOST_BLOCKS = 1000  # of looks, among which every pair is compared


@dataclass(frozen=True)
class Share:
    """How much of some time a door was open, by the looks that fell into it."""

    key: int  # hour of the day from 0, or day of the week from 0, Monday
    looks: int
    independent: float  # how many looks far apart would tell as much
    share: Interval


def share_open(key: int, looks: Looks, door: Memory) -> Share:
    """The share of time open by looks, at least one.

    The mean of n looks with the correlations ``c(|t_i - t_k|)`` varies as much as that of
    ``n^2 / sum_ik c`` independent ones. The interval is that of the Beta distribution after
    so many with Jeffreys' prior; it reaches to 0 where the door was never seen open, and to
    1 where never closed (Brown, Cai and DasGupta 2001, Statistical Science 16, section 4.1).
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
    looks: Looks, door: Memory, key_of: Callable[[datetime], int], zone: tzinfo
) -> tuple[Share, ...]:
    """The shares of the times that ``key_of`` tells apart, those without looks left out."""
    keys = np.array([key_of(datetime.fromtimestamp(s / 1e9, zone)) for s in looks.stamps_ns])
    return tuple(
        share_open(int(key), Looks(looks.stamps_ns[keys == key], looks.open[keys == key]), door)
        for key in np.unique(keys)
    )


def _blocks(looks: Looks) -> tuple[np.ndarray, np.ndarray]:
    """Looks at about the same time as one: their times (b,) in s, and their mean (b,)."""
    seconds = (looks.stamps_ns - looks.stamps_ns[0]) / 1e9
    length = SHORTEST_MEMORY
    while len(np.unique(seconds // length)) > MOST_BLOCKS:
        length *= 2
    _, block, count = np.unique(seconds // length, return_inverse=True, return_counts=True)
    times, open_ = (np.bincount(block, weights=values) for values in (seconds, looks.open))
    return times / count, open_ / count
