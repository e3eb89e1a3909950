"""Statistics of doors over the logs of a batch."""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from datetime import UTC, datetime, tzinfo
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from objstate.statistics.looks import DoorLooks, OpenAbove, door_looks
from objstate.statistics.shares import Share, shares_by
from objstate.statistics.two_state import Interval, memory
from objstate.statistics.use import use_of

SEED = 0  # of the samples of a posterior, so that equal looks give equal figures


@dataclass(frozen=True)
class DoorStatistics:
    """The use of a door, as far as a robot that looked now and then can determine."""

    door: str
    logs: int  # logs with looks at it
    looks: int  # number that decided whether it was open
    undecided: int  # that didn't
    first_ns: int  # of the decided looks
    last_ns: int
    moves_seen: int  # number of neighbouring looks of which one saw it open and one closed
    share_open: Interval  # of all time
    share_open_seen: Interval  # of the hours of working and of free days with looks
    open_spell: Interval  # s that it stays open
    closed_spell: Interval  # s that it stays closed
    moves_per_day: Interval  # openings and closings
    by_hour: tuple[Share, ...]  # of the day
    by_weekday: tuple[Share, ...]

    def to_dict(self) -> dict[str, Any]:
        """The same as plain dictionaries and lists, for JSON."""
        return asdict(self)


def door_statistics(
    folder: str | Path,
    above: OpenAbove | None = None,
    zone: tzinfo = UTC,
    *,
    filtered: bool = False,
) -> tuple[DoorStatistics, ...]:
    """The statistics of every door of a batch with a decided look, by name.

    ``above`` is the angle or offset from which on a door counts as open, ``zone`` the time zone of
    hours and days. The states are the smoothed ones, or with ``filtered`` those that could be known
    at the time. Raises ResultError for a folder that is no batch, or has no estimates.
    """
    found = door_looks(folder, above or OpenAbove(), filtered=filtered)
    return statistics_of_all([each for each in found if len(each.looks)], zone)


def statistics_of_all(seen: Iterable[DoorLooks], zone: tzinfo = UTC) -> tuple[DoorStatistics, ...]:
    """The statistics of doors with decided looks; most of the work is compiled and runs in threads."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return tuple(pool.map(partial(statistics_of, zone=zone), seen))


def statistics_of(seen: DoorLooks, zone: tzinfo = UTC) -> DoorStatistics:
    """The statistics of one door with at least one decided look."""
    looks = seen.looks
    known = memory(looks, np.random.default_rng(SEED))
    use = use_of(looks, zone)
    return DoorStatistics(
        door=seen.door,
        logs=seen.logs,
        looks=len(looks),
        undecided=seen.undecided,
        first_ns=int(looks.first_ns[0]),
        last_ns=int(looks.last_ns.max()),
        moves_seen=looks.moves_seen,
        share_open=use.share_open,
        share_open_seen=use.share_open_seen,
        open_spell=known.open_spell,
        closed_spell=known.closed_spell,
        moves_per_day=use.moves_per_day,
        by_hour=shares_by(looks, known, _hour, zone),
        by_weekday=shares_by(looks, known, datetime.weekday, zone),
    )


def _hour(time: datetime) -> int:
    return time.hour
