"""Rests: intervals in which an object was watched and did not move.

Estimates within one interval are not independent, and an object that is being moved passes through
many states. So rests, and the waits between them, are counted instead of estimates.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import MovableObject
from objstate.geometry import BoolArray, FloatArray, IntArray, wrap

if TYPE_CHECKING:
    import polars as pl

DIRECTIONS = ("angle", "yaw")
# rad and m; an estimate less certain than this says too little of where the object is
SETTLED = {"direction": np.radians(5.0), "length": 0.05}
# rad and m by which estimates of an object that stands still differ, hinges and walls being off
ALIKE = {"direction": np.radians(3.0), "length": 0.03}
SIGMAS = 3.0  # deviations by which estimates may differ and still be of one state
LEAST_PRESENCE = 0.5  # probability; furniture that is less probable has no place
LONGEST_BLINK = 5.0  # s without a sight after which a rest is taken to have ended
SHORTEST_REST = 2.0  # s; a shorter stay that is seen to end was on the way elsewhere


@dataclass(frozen=True, eq=False)
class Rest:
    """An object stood in one state from one moment to another, and was watched."""

    begin_ns: int
    end_ns: int
    state: FloatArray  # (d,)
    std: FloatArray  # (d,)

    @property
    def seconds(self) -> float:
        """How long it was watched."""
        return (self.end_ns - self.begin_ns) / 1e9


@dataclass(frozen=True, eq=False)
class _Sights:
    """Certain estimates of one object, in time order."""

    stamps_ns: IntArray  # (n,)
    states: FloatArray  # (n, d)
    stds: FloatArray  # (n, d)


def alike(item: MovableObject) -> FloatArray:
    """(d,) by how much estimates of one state differ beside their own deviations."""
    return np.array([ALIKE[_unit(name)] for name in item.coordinates])


def difference(item: MovableObject, a: FloatArray, b: FloatArray) -> FloatArray:
    """States ``a`` minus ``b`` (..., d); directions that wrap the short way round."""
    turning = np.array([name == "yaw" or item.wraps for name in item.coordinates])
    return np.asarray(np.where(turning, wrap(a - b), a - b))


def rests_of(estimates: pl.DataFrame, item: MovableObject) -> list[Rest]:
    """The rests of one object, in time order, from its rows of ``estimates.parquet``."""
    sights = _sights(estimates, item)
    if not len(sights.stamps_ns):
        return []
    starts = [0]
    for k in range(1, len(sights.stamps_ns)):
        if _ends(sights, item, starts[-1], k):
            starts.append(k)
    bounds = zip(starts, [*starts[1:], len(sights.stamps_ns)], strict=True)
    return _without_passing([_rest(sights, begin, end) for begin, end in bounds])


def _sights(estimates: pl.DataFrame, item: MovableObject) -> _Sights:
    import polars as pl

    rows = estimates.filter((pl.col("object") == item.name) & pl.col("observed"))
    rows = rows.filter(~pl.col("lost") & (pl.col("presence") >= LEAST_PRESENCE))
    by_coordinate = [rows.filter(pl.col("coordinate") == name) for name in item.coordinates]
    states = np.column_stack([part["median"].to_numpy() for part in by_coordinate])
    stds = np.column_stack([part["std"].to_numpy() for part in by_coordinate])
    certain = (stds <= [SETTLED[_unit(name)] for name in item.coordinates]).all(axis=1)
    stamps = by_coordinate[0]["stamp"].to_numpy()[certain]
    order = np.argsort(stamps, kind="stable")
    return _Sights(stamps[order], states[certain][order], stds[certain][order])


def _ends(sights: _Sights, item: MovableObject, first: int, k: int) -> BoolArray | bool:
    """Whether the rest that began with sight ``first`` is over at sight ``k``."""
    if (sights.stamps_ns[k] - sights.stamps_ns[k - 1]) / 1e9 > LONGEST_BLINK:
        return True
    middle = (first + k - 1) // 2
    off = np.abs(difference(item, sights.states[k], sights.states[middle]))
    return bool((off > alike(item) + SIGMAS * np.hypot(sights.stds[k], sights.stds[middle])).any())


def _rest(sights: _Sights, begin: int, end: int) -> Rest:
    """The rest of sights from ``begin`` to before ``end``; its last state has seen most."""
    return Rest(
        begin_ns=int(sights.stamps_ns[begin]),
        end_ns=int(sights.stamps_ns[end - 1]),
        state=sights.states[end - 1],
        std=sights.stds[end - 1],
    )


def _without_passing(rests: Sequence[Rest]) -> list[Rest]:
    """Without the short stays of an object on its way."""
    kept = []
    for rest, after in zip(rests, [*rests[1:], None], strict=True):
        seen_to_end = after is not None and after.begin_ns - rest.end_ns < SHORTEST_REST * 1e9
        if not (seen_to_end and rest.seconds < SHORTEST_REST):
            kept.append(rest)
    return kept


def _unit(coordinate: str) -> str:
    return "direction" if coordinate in DIRECTIONS else "length"
