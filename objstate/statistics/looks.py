"""What a batch saw of its doors: at which moments each was seen open, or closed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from objstate.evaluation import read_lost, within
from objstate.order import natural_key
from objstate.recording.batches import result_of, scan_batch
from objstate.statistics.two_state import Looks

if TYPE_CHECKING:
    import polars as pl

# From where on a door counts as open: about where somebody would say so.
OPEN_ABOVE_RAD, OPEN_ABOVE_M = math.radians(10.0), 0.1


@dataclass(frozen=True, eq=False)
class DoorLooks:
    """The looks at one door."""

    door: str
    looks: Looks  # those that decided
    undecided: int  # looks whose interval held both open and closed
    logs: int  # in which the door was looked at


@dataclass(frozen=True)
class OpenAbove:
    """From which state on a door counts as open."""

    angle: float = OPEN_ABOVE_RAD  # rad
    offset: float = OPEN_ABOVE_M  # m


def door_looks(folder: str | Path, above: OpenAbove, *, filtered: bool = False) -> list[DoorLooks]:
    """The looks at every door that a batch's scans bore on, by name.

    A look decides where the 90 % interval lies on one side of ``above``. What was estimated
    while the robot was lost doesn't count. Raises ResultError.
    """
    import polars as pl

    bounds = {"angle": above.angle, "offset": above.offset}
    seen = (
        scan_batch(folder, filtered=filtered)
        .filter(pl.col("observed") & pl.col("coordinate").is_in(list(bounds)))
        .select("log", "stamp", "object", "coordinate", "lower", "upper")
        .collect()
    )
    kept = [
        part.filter(~pl.Series(within(part["stamp"].to_numpy(), _lost(folder, log))))
        for (log,), part in seen.partition_by("log", as_dict=True).items()
    ]
    doors = pl.concat([seen.clear(), *kept]).partition_by("object", "coordinate", as_dict=True)
    return [
        _looks(door, part.sort("stamp"), bounds[coordinate])
        for (door, coordinate), part in sorted(
            doors.items(), key=lambda part: natural_key(part[0][0])
        )
    ]


def _lost(folder: str | Path, log: str) -> list[tuple[int, int]]:
    return list(read_lost(result_of(folder, log)))


def _looks(door: str, rows: pl.DataFrame, bound: float) -> DoorLooks:
    lower, upper = rows["lower"].to_numpy(), rows["upper"].to_numpy()
    decided = (lower > bound) | (upper <= bound)
    stamps = rows["stamp"].to_numpy().astype(np.int64)
    return DoorLooks(
        door=door,
        looks=Looks(stamps[decided], lower[decided] > bound),
        undecided=int((~decided).sum()),
        logs=rows["log"].n_unique(),
    )
