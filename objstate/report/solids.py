"""Where a plane cuts a mesh: the areas inside it."""

from __future__ import annotations

import numpy as np

from objstate.building.model import Mesh
from objstate.geometry import FloatArray, IntArray

GRID = 1e-4  # m: corners so near to each other are one
SIMPLER = (
    1e-3  # m: corners by which an edge bends less are left out; finer than a page's centimetre
)
LEAST_AREA = 1e-6  # m²; less is round-off


def solid_areas(mesh: Mesh, height: float) -> list[FloatArray]:
    """Rings (k, 2) m around the solid parts of the section at ``height``, holes included.

    Filled by the even-odd rule they are the parts about which the oriented section winds. Sheets
    that close nothing have no area.
    """
    import shapely

    segments = oriented_section(mesh, height)
    if not len(segments):
        return []
    lines = shapely.linestrings(segments)
    noded = shapely.union_all(lines[shapely.length(lines) > GRID], grid_size=GRID)
    cells = shapely.get_parts(shapely.polygonize([noded]))
    cells = cells[shapely.area(cells) > LEAST_AREA]
    if not len(cells):
        return []
    inside = shapely.get_coordinates(shapely.point_on_surface(cells))
    solid = cells[windings(inside, segments) != 0]
    areas = shapely.get_parts([shapely.simplify(shapely.union_all(solid), SIMPLER)])
    return [
        shapely.get_coordinates(ring)
        for area in areas
        if area.geom_type == "Polygon"
        for ring in shapely.get_rings([area])
    ]


def oriented_section(mesh: Mesh, height: float) -> FloatArray:
    """Segments (k, 2, 2) m of the plane z = ``height``, the mesh's inside to the left of each.

    A vertex in the plane counts as above it.
    """
    above = mesh.vertices[:, 2] - height
    is_above = above >= 0.0
    first, second, third = is_above[mesh.faces.T]
    cut = (first != second) | (second != third)
    lone = np.where(second == third, 0, np.where(first == third, 1, 2))[cut]
    faces, rows = mesh.faces[cut], np.arange(len(lone))
    tip = faces[rows, lone]
    others = np.column_stack([faces[rows, (lone + 1) % 3], faces[rows, (lone + 2) % 3]])
    share = above[tip, None] / (above[tip, None] - above[others])
    start, end = mesh.vertices[tip, None, :2], mesh.vertices[others, :2]
    found = start + share[..., None] * (end - start)
    return np.asarray(np.where(is_above[tip][:, None, None], found, found[:, ::-1]))


def windings(points: FloatArray, segments: FloatArray) -> IntArray:
    """(n,) how often oriented segments (k, 2, 2) wind about points (n, 2), by rays towards +x."""
    import shapely

    rays = np.stack([points, points], axis=1)
    rays[:, 1, 0] = max(float(segments[..., 0].max()), float(points[:, 0].max())) + 1.0
    tree = shapely.STRtree(shapely.linestrings(segments))
    ray, segment = tree.query(shapely.linestrings(rays))
    (ax, ay), (bx, by) = segments[segment, 0].T, segments[segment, 1].T
    x, y = points[ray].T
    rises, falls = (ay <= y) & (by > y), (by <= y) & (ay > y)
    with np.errstate(divide="ignore", invalid="ignore"):
        beyond = ax + (y - ay) / (by - ay) * (bx - ax) > x
    turns = beyond * (rises.astype(float) - falls)
    return np.bincount(ray, turns, len(points)).astype(np.int64)
