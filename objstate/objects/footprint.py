"""The floor that an object covers, seen from above."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.geometry import FloatArray, invert

if TYPE_CHECKING:
    from shapely import Geometry

OBJECTS_KEPT = 4096  # number of objects whose silhouettes are cached
SLIVER = 1e-9  # m^2; smaller triangles are upright and cover nothing


@lru_cache(maxsize=OBJECTS_KEPT)
def silhouette(item: MovableObject) -> Geometry:
    """The floor that an object covers in its home state, in the building's frame; a prepared shape.

    Sheets without thickness, and the free floor within a U-shaped object, keep their form.
    """
    import shapely

    mesh = item.mesh.moved(item.transforms(item.home[None])[0])
    corners = mesh.vertices[mesh.faces][:, :, :2]
    triangles = shapely.polygons(corners)
    lying = triangles[shapely.area(triangles) > SLIVER]
    if len(lying):
        shape = shapely.union_all(lying)
    else:
        shape = shapely.union_all(shapely.linestrings(corners))
    shapely.prepare(shape)
    return shape


@lru_cache(maxsize=OBJECTS_KEPT)
def hull_from_above(item: MovableObject) -> FloatArray:
    """Corners (k, 2) of the convex hull of the silhouette in the home state."""
    import shapely

    return np.asarray(shapely.get_coordinates(silhouette(item).convex_hull))


@lru_cache(maxsize=OBJECTS_KEPT)
def reach(item: MovableObject) -> tuple[FloatArray, FloatArray]:
    """Two corners (2,) of a box around all that a door can cover; of furniture, at its place."""
    hull, ends = hull_from_above(item), np.array([[item.lower], [item.upper]])
    if item.kind is Kind.SLIDING:
        corners = footprint(item, ends)
        return corners.min(axis=0), corners.max(axis=0)
    middle = (item.home if item.kind is Kind.PLANAR else item.origin[:, 3])[:2]
    radius = float(np.linalg.norm(hull - middle, axis=1).max())
    about = np.zeros(2) if item.kind is Kind.PLANAR else middle
    return about - radius, about + radius


def motions(item: MovableObject, states: FloatArray) -> FloatArray:
    """Transforms (n, 4, 4) that take the object from its home state to states (n, d)."""
    return np.asarray(item.transforms(states) @ invert(item.transforms(item.home[None])[0]))


def footprint(item: MovableObject, states: FloatArray) -> FloatArray:
    """The smallest convex polygon (k, 2), counter-clockwise, around an object in states (n, d).

    Exact for what turns about a vertical axis or moves on the floor.
    """
    from scipy.spatial import ConvexHull

    moved = motions(item, states)
    corners = hull_from_above(item) @ moved[:, :2, :2].swapaxes(1, 2) + moved[:, None, :2, 3]
    points = corners.reshape(-1, 2)
    return np.asarray(points[ConvexHull(points).vertices])
