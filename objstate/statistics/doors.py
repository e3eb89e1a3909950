"""Statistics of doors over the logs of a batch."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import UTC, datetime, tzinfo
from pathlib import Path
from typing import Any

import numpy as np

from objstate.statistics.looks import DoorLooks, OpenAbove, door_looks
from objstate.statistics.shares import Share, shares_by
from objstate.statistics.two_state import Interval, memory
from objstate.statistics.use import use_of

SEED = 0  # of the samples of a posterior, so that the same looks give the same figures


@dataclass(frozen=True)
class DoorStatistics:
    """How a door is used, as far as a robot that looked now and then can tell."""

    door: str
    logs: int  # in which it was looked at
    looks: int  # that told whether it was open
    undecided: int  # that didn't
    first_ns: int  # of the looks that told
    last_ns: int
    moves_seen: int  # neighbouring looks of which one saw it open and one closed
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
    """The statistics of every door of a batch that some look decided on, by name.

    ``above`` says what counts as open, ``zone`` by which clock hours and days are told.
    The states are those given the whole log, or with ``filtered`` those that the robot would have
    known then.
    Raises ResultError for a folder that is no batch, or has no estimates.
    """
    found = door_looks(folder, above or OpenAbove(), filtered=filtered)
    return tuple(statistics_of(each, zone) for each in found if len(each.looks))


def statistics_of(seen: DoorLooks, zone: tzinfo = UTC) -> DoorStatistics:
    """What the looks at one door, at least one that decided, tell of it."""
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
