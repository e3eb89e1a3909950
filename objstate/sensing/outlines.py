"""The outlines of a building's walls and objects at the heights of its level lasers."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.building.outline import outline
from objstate.building.visible import visible
from objstate.geometry import FloatArray, IntArray
from objstate.sensing import sweeps
from objstate.sensing.level import UncertainObject, flat, moves_in_plane
from objstate.sensing.neighbourhood import Walls
from objstate.sensing.sweeps import Scenery

SCENERIES_KEPT = 64
HINGES_KEPT = 4096  # number of doors whose hinges are cached
TOUCHING = 1e-6  # m within which ends of segments are one corner
ABREAST = 200  # most poses from which ranges are cast side by side
SPREAD = 1.0  # m, largest side of the rectangle in which these stand


class Stand(NamedTuple):
    """Robot poses as the kernels take them, in parts with similar views."""

    poses: FloatArray  # (p, 4) x, y, cosine and sine of the yaw
    parts: Sequence[slice | IntArray]  # of poses that stand close together with similar headings

    @staticmethod
    def of(poses: FloatArray) -> Stand:
        """Of poses (p, 3)."""
        placed = np.empty((len(poses), 4))
        left, bottom, right, top = sweeps.stand(poses, placed)
        if len(poses) <= ABREAST and max(right - left, top - bottom) <= SPREAD:
            return Stand(placed, [slice(None)])
        columns, rows = np.floor((poses[:, :2] - [left, bottom]) / SPREAD).T
        order = np.lexsort((poses[:, 2], rows, columns))
        ends = np.flatnonzero(np.abs(np.diff(columns[order])) + np.abs(np.diff(rows[order]))) + 1
        bounds, parts = [0, *ends.tolist(), len(order)], list[slice | IntArray]()
        for begin, end in pairwise(bounds):
            close = order[begin:end]
            few = len(close) <= ABREAST
            parts += [close] if few else np.array_split(close, -(-len(close) // ABREAST))
        return Stand(placed, parts)

    def each(self, of: Callable[..., FloatArray], *also: FloatArray) -> FloatArray:
        """The results (p, ...) of ``of`` for the poses, and for ``also`` (p, ...), part by part."""
        if len(self.parts) == 1:
            return of(self.poses, *also)
        found = [of(self.poses[part], *(each[part] for each in also)) for part in self.parts]
        out = np.empty((len(self.poses), *found[0].shape[1:]))
        for part, each in zip(self.parts, found, strict=True):
            out[part] = each
        return out


@dataclass(frozen=True, eq=False)
class ObjectOutline:
    """The outline of an object in a level scan."""

    segments: FloatArray  # (k, 4)
    # number of first segments that form closed loops, clockwise, with all others inside
    rim: int = 0


class LevelOutlines:
    """Outlines of a building's walls and objects at the heights of its level lasers.

    ``walls`` gives the walls in a laser's plane at a height, m; ``of_object`` the outline of an
    object, by its name, at a height; ``scenery`` the objects (k,) of localization in a laser's
    plane at a height. All are cached.
    """

    walls: Callable[[float], Walls]
    of_object: Callable[[str, float], ObjectOutline]
    scenery: Callable[[tuple[UncertainObject, ...], float], Scenery]

    def __init__(self, building: Building) -> None:
        self._take(building)
        self.hold = all(moves_in_plane(item) for item in building.objects.values())
        self._walls_at = cache(lambda height: flat(visible(outline(building.walls, height))))
        self.walls = cache(lambda height: Walls(self._walls_at(height)))
        self._stand: tuple[FloatArray, Stand] | None = None  # the last one, with its poses (p, 3)

    def with_object(self, item: MovableObject) -> LevelOutlines:
        """The same building with one object at another place."""
        other = copy(self)
        other._take(self._building.with_object(item))
        return other

    def _take(self, building: Building) -> None:
        """Set the building's objects, of which nothing is cached yet."""
        self._building = building
        self.of_object = cache(partial(_outline_of, building))
        together = lru_cache(maxsize=SCENERIES_KEPT)(partial(_together, self.of_object))
        self.scenery = lru_cache(maxsize=SCENERIES_KEPT)(partial(_scenery_of, building, together))

    def stand(self, poses: FloatArray) -> Stand:
        """Robot poses (p, 3) as the kernels take them, cached."""
        if len(poses) == 1:
            return Stand.of(poses)
        if self._stand is None or self._stand[0] is not poses:
            self._stand = poses, Stand.of(poses)
        return self._stand[1]

    def walls_at(self, height: float) -> FloatArray:
        """All wall segments (k, 4) in a laser's plane at a height, m."""
        return self._walls_at(height)

    def placements(self, name: str, states: FloatArray) -> FloatArray:
        """Placements (s, 4) of an object's outline in states (s, d), relative to its home."""
        out = np.empty((len(states), 4))
        _place(self._building[name], states, out)
        return out


def _outline_of(building: Building, name: str, height: float) -> ObjectOutline:
    """Outline of an object at a height, about its origin in its home state."""
    item = building[name]
    home = item.transforms(item.home[None])[0]
    return _rimmed(outline(item.mesh.moved(home), height) - home[:2, 3])


def _together(
    outline_of: Callable[[str, float], ObjectOutline], names: tuple[str, ...], height: float
) -> tuple[FloatArray, IntArray, IntArray]:
    """Segments (k, 4) of all objects in turn, with their ends (j,) and the sizes of rims (j,)."""
    outlines = [outline_of(name, height) for name in names]
    segments = [each.segments for each in outlines]
    ends = np.array(list(accumulate(map(len, segments))), dtype=np.int64)
    rims = np.array([each.rim for each in outlines], dtype=np.int64)
    return np.concatenate([np.empty((0, 4)), *segments]), ends, rims


def _scenery_of(
    building: Building,
    together: Callable[[tuple[str, ...], float], tuple[FloatArray, IntArray, IntArray]],
    objects: tuple[UncertainObject, ...],
    height: float,
) -> Scenery:
    """The objects of localization, in a laser's plane."""
    outlines = together(tuple([each.name for each in objects]), height)
    ends = list(accumulate([len(each.states) for each in objects], initial=0))
    placements, shares = np.empty((ends[-1], 4)), np.empty(ends[-1])
    for each, start, end in zip(objects, ends, ends[1:], strict=False):
        _place(building[each.name], each.states, placements[start:end])
        shares[start:end] = each.shares
    return Scenery(*outlines, placements, np.array(ends[1:], dtype=np.int64), shares)


def _place(item: MovableObject, states: FloatArray, out: FloatArray) -> None:
    """Positions and turns ``out`` (s, 4) of the link's frame relative to the home state."""
    if item.kind is Kind.PLANAR:
        sweeps.with_trigonometry(states, item.home[2], out)
    elif item.kind is Kind.HINGED:
        sweeps.hinged(*_hinge(item), states, out)
    else:
        out[:, :2] = item.origin[:2, 3] + states * item.direction[:2]
        out[:, 2:] = 1.0, 0.0


@lru_cache(maxsize=HINGES_KEPT)
def _hinge(item: MovableObject) -> tuple[float, float, float, float]:
    """Where a hinge is, m; the direction in which the leaf turns, 1 or -1; its home state, rad."""
    x, y = item.hinge.tolist()
    return x, y, math.copysign(1.0, item.direction[2]), float(item.home[0])


def _rimmed(segments: FloatArray) -> ObjectOutline:
    """The outline of segments (k, 2, 2), its rim first; loose segments leave it without a rim."""
    import shapely

    lines = shapely.unary_union(shapely.linestrings(segments), grid_size=TOUCHING)
    filled = shapely.unary_union(shapely.polygonize([lines]))
    if filled.is_empty or not shapely.difference(lines, filled).is_empty:
        return ObjectOutline(flat(segments))
    solids = shapely.get_parts(shapely.simplify(filled, TOUCHING))
    loops = [shapely.get_coordinates(shapely.get_exterior_ring(solid)) for solid in solids]
    clockwise = [
        loop[::-1] if shapely.is_ccw(shapely.linearrings(loop)) else loop for loop in loops
    ]
    rim = np.concatenate([np.stack([loop[:-1], loop[1:]], axis=1) for loop in clockwise])
    within = shapely.get_parts(shapely.difference(lines, shapely.boundary(filled)))
    rest = [
        np.stack([line[:-1], line[1:]], axis=1) for line in map(shapely.get_coordinates, within)
    ]
    return ObjectOutline(flat(np.concatenate([rim, *rest])), len(rim))
