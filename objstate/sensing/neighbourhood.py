"""The walls near a place, in groups sorted by distance, as the compiled loops take them."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.sensing.front_to_back import NearGroups, WallGroups

SIDE = (
    # m, side of the floor squares whose walls form a group; longer walls are groups of their own
    2.0
)
TILE = 1.0  # m, side of the floor squares for which groups are sorted once
KEPT = 256  # number of tiles kept


class Walls:
    """Wall segments (k, 4) in groups of neighbours, so that hidden groups are skipped quickly."""

    groups: WallGroups

    def __init__(self, segments: FloatArray) -> None:
        ends = segments.reshape(-1, 2, 2)
        group = _groups(ends)
        order = np.argsort(group, kind="stable")
        first = np.flatnonzero(np.diff(group[order], prepend=-1))
        middle, radii = _around(ends[order], first)
        starts, circles = np.append(first, len(segments)), np.hstack([middle, middle])
        self.groups = WallGroups(np.ascontiguousarray(segments[order]), starts, circles, radii)
        self._of_tile = lru_cache(maxsize=KEPT)(self._find)

    def near(self, places: FloatArray, reach: float) -> NearGroups:
        """All groups within ``reach`` m of each of some places (h, 2), and a few more."""
        steps = math.ceil(reach / TILE)  # small changes of the reach from scan to scan don't matter
        found = [
            self._of_tile(math.floor(x / TILE), math.floor(y / TILE), steps)
            for x, y in places.tolist()
        ]
        if len(found) == 1:
            return found[0]
        middles, ends, groups, distances = zip(*found, strict=True)
        return NearGroups(
            np.concatenate(middles),
            np.cumsum(np.concatenate(ends)),
            np.concatenate(groups),
            np.concatenate(distances),
        )

    def _find(self, column: int, row: int, steps: int) -> NearGroups:
        middle = TILE * np.array([column + 0.5, row + 0.5])
        away = np.hypot(*(self.groups.circles[:, :2] - middle).T) - self.groups.radii
        groups = np.flatnonzero(away <= TILE * (steps + math.sqrt(0.5)))
        groups = groups[np.argsort(away[groups], kind="stable")]
        return NearGroups(middle[None], np.array([len(groups)]), groups, away[groups])


def _groups(ends: FloatArray) -> IntArray:
    """The number (k,) of each segment's group; by its ends (k, 2, 2)."""
    square = np.floor(ends.mean(axis=1) / SIDE).astype(np.int64)
    _, group = np.unique(square, axis=0, return_inverse=True)
    is_long = np.hypot(*(ends[:, 1] - ends[:, 0]).T) > SIDE
    return np.where(is_long, len(ends) + np.arange(len(ends)), group.reshape(-1))


def _around(ends: FloatArray, first: IntArray) -> tuple[FloatArray, FloatArray]:
    """Middles (g, 2) and radii (g,) of circles round groups of segments (k, 2, 2)."""
    if len(first) == 0:
        return np.empty((0, 2)), np.empty(0)
    lower = np.minimum.reduceat(ends.min(axis=1), first)
    upper = np.maximum.reduceat(ends.max(axis=1), first)
    middle = (lower + upper) / 2
    counts = np.diff(np.append(first, len(ends)))
    off = ends - np.repeat(middle, counts, axis=0)[:, None]
    return middle, np.maximum.reduceat(np.hypot(off[..., 0], off[..., 1]).max(axis=1), first)
