"""Where furniture can stand: not in walls, nor in other furniture.

A place at which these would reach a depth d into a piece is possible with the probability 2 Phi(-d /
sigma) that they, or the piece's outline, are off by so much. See docs/model/furniture.md.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.model import MovableObject
from objstate.building.outline import outline
from objstate.geometry import FloatArray, IntArray, compose
from objstate.lazy import Later
from objstate.objects.footprint import OBJECTS_KEPT, silhouette

if TYPE_CHECKING:
    from shapely import Geometry

    from objstate.objects import components
else:
    components = Later("objstate.objects.components")

SPACING = 0.04  # m between points of walls
TILE = 0.5  # m, side of the squares by which these points are found
OUTLINE_STD = 0.01  # m by which parts of a piece's outline are off its model
LAYER = 0.05  # m, between sections of a piece
CELL = 0.01  # m, side of the cells in which depths within a piece are known


class Floor(NamedTuple):
    """Points of walls at one height, see ``components.Ground``."""

    points: FloatArray
    first: IntArray
    corner: FloatArray

    @staticmethod
    def of(walls: FloatArray) -> Floor:
        """Points along segments (k, 4)."""
        along = walls[:, 2:] - walls[:, :2]
        steps = np.ceil(np.hypot(along[:, 0], along[:, 1]) / SPACING).astype(np.int64)
        of = np.repeat(np.arange(len(walls)), steps + 1)
        number = np.arange(len(of)) - np.repeat(np.cumsum(steps + 1) - steps - 1, steps + 1)
        points = walls[of, :2] + (number / np.maximum(steps[of], 1))[:, None] * along[of]
        corner = points.min(axis=0) if len(points) else np.zeros(2)
        tiles = ((points - corner) / TILE).astype(np.int64)
        columns, rows = (tiles.max(axis=0, initial=0) + 1).tolist()
        flat = tiles[:, 1] * columns + tiles[:, 0]
        past = np.cumsum(np.bincount(flat, minlength=rows * columns)).reshape(rows, columns)
        first = np.column_stack([np.concatenate([[0], past[:-1, -1]]), past])
        order = np.argsort(flat, kind="stable")
        return Floor(np.ascontiguousarray(points[order]), np.ascontiguousarray(first), corner)


def half_height(item: MovableObject) -> float:
    """m above the floor, at which walls are cut for a piece."""
    heights = item.upright_mesh.vertices[:, 2]
    return float(item.origin[2, 3] + 0.5 * (heights.min() + heights.max()))


def ground_of(item: MovableObject, floor: Floor, reach: float) -> components.Ground:
    """Where a piece of some ``reach`` m from its origin can stand.

    Walls that lie within it at its modelled place don't count.
    """
    import shapely

    depths, middle = _depths(item)
    counts = ~shapely.contains(silhouette(item), shapely.points(floor.points))
    return components.Ground(*floor, counts, depths, middle, TILE, CELL, reach)


class Core(NamedTuple):
    """The largest circle that a section of a piece holds."""

    middle: FloatArray  # (2,) m, about the piece's origin at yaw 0
    radius: float  # m


@lru_cache(maxsize=OBJECTS_KEPT)
def cores(item: MovableObject) -> Mapping[int, Core]:
    """The cores of a piece's sections, by the number of their layers above the floor."""
    import shapely

    mesh, floor = item.upright_mesh, item.origin[2, 3]
    heights = mesh.vertices[:, 2] + floor
    found, before, core = dict[int, Core](), np.empty((0, 2, 2)), None
    for layer in range(int(heights.min() / LAYER), int(heights.max() / LAYER) + 1):
        sides = outline(mesh, (layer + 0.5) * LAYER - floor)
        if not np.array_equal(sides, before):
            parts = shapely.polygonize([shapely.union_all(shapely.linestrings(sides))])
            core, before = _core(shapely.union_all(parts)), sides
        if core is not None:
            found[layer] = core
    return found


def _core(section: Geometry) -> Core | None:
    """The core of a section; None of one without area."""
    import shapely

    if section.area == 0.0:
        return None
    (x, y), (to_x, to_y) = shapely.maximum_inscribed_circle(section).coords
    return Core(np.array([x, y]), math.hypot(to_x - x, to_y - y))


@lru_cache(maxsize=OBJECTS_KEPT)
def collision(one: MovableObject, other: MovableObject) -> tuple[Core, Core] | None:
    """The cores of two pieces in the layer in which they keep farthest apart; None: in none."""
    a, b = cores(one), cores(other)
    layers = a.keys() & b.keys()
    widest = max(layers, key=lambda k: (a[k].radius + b[k].radius, -k), default=None)
    return None if widest is None else (a[widest], b[widest])


def bodies(
    item: MovableObject, others: Iterable[tuple[MovableObject, FloatArray, float]]
) -> FloatArray:
    """(m, 6) what keeps a piece from the places of others, see ``components.possible``.

    Others have a place (3,) and a probability of being there.
    """
    rows = []
    for other, place, presence in others:
        pair = collision(item, other)
        if pair is not None:
            own, its = pair
            x, y, _ = compose(place, np.append(its.middle, 0.0))
            rows.append((*own.middle, x, y, own.radius + its.radius, presence))
    return np.array(rows).reshape(-1, 6)


NO_WALLS = Floor.of(np.empty((0, 4)))


@lru_cache(maxsize=OBJECTS_KEPT)
def _depths(item: MovableObject) -> tuple[FloatArray, FloatArray]:
    """m by which points on a grid lie within a piece, and the first one (2,)."""
    import shapely

    x, y, yaw = item.home
    back = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
    shape = shapely.transform(silhouette(item), lambda points: (points - (x, y)) @ back)
    shapely.prepare(shape)
    low_x, low_y, high_x, high_y = shape.bounds
    across, up = np.arange(low_x, high_x + CELL, CELL), np.arange(low_y, high_y + CELL, CELL)
    points = shapely.points(*np.meshgrid(across, up))
    inside = shapely.contains(shape, points)
    depths = np.where(inside, shapely.distance(points, shape.boundary), 0.0)
    return depths, np.array([low_x, low_y])
