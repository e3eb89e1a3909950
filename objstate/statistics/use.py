"""The use of a door, also at hours without looks, by its habits.

Robots look at the hours at which they drive. Habits are those of a process, so that the uncertainty
about the other hours is in the interval (``objstate.habits``).
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import tzinfo

import numpy as np

from objstate.habits.calendar import Calendar
from objstate.habits.design import Design
from objstate.habits.forecast import Forecast
from objstate.habits.levels import fit_levels
from objstate.habits.looks import RegionLooks
from objstate.habits.shares import paths
from objstate.statistics.summed import Summed
from objstate.statistics.two_state import Interval, interval_of

FITTED = 1000  # most looks, the latest, by which habits are fitted; paths go through all
FEW = 16  # draws of doors with more looks, of which little is unknown
DRAWS = 64  # of habits, with a path each
LEAST_S = 7 * 86400.0  # s, a week from the first look on, if looks end earlier


@dataclass(frozen=True)
class Use:
    """From the first look at a door to the last, and over a week at least."""

    share_open: Interval  # of all time
    share_open_seen: Interval  # of the hours of working and of free days with looks
    moves_per_day: Interval


def use_of(looks: Summed, zone: tzinfo) -> Use:
    """A door's use by looks, at least one: the first and the last of each minute."""
    design, calendar = Design(2), Calendar(zone)
    later = looks.last_ns > looks.first_ns
    stamps_ns = np.concatenate([looks.first_ns, looks.last_ns[later]])
    open_ = np.concatenate([looks.first_open, looks.last_open[later]])
    order = np.argsort(stamps_ns, kind="stable")
    seen = RegionLooks.certain(stamps_ns[order], open_[order].astype(np.int64), 2)
    after = fit_levels(design, calendar, seen.part(slice(-FITTED, None)))
    draws = DRAWS if len(seen) <= FITTED else FEW
    sampled = paths(Forecast(design, calendar, after, draws), seen, LEAST_S)
    every = np.ones(len(sampled.keys), dtype=bool)
    return Use(
        share_open=interval_of(sampled.share(1, every)),
        share_open_seen=interval_of(sampled.share(1, sampled.seen)),
        moves_per_day=interval_of(sampled.moves(every)),
    )
