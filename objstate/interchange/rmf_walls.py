"""The lines that Open-RMF draws a building's walls about, so that they reach up to their faces."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray
from objstate.interchange.to_map import NARROW

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

WALL_THICKNESS = 0.1  # m, as rmf_building_map_tools draws walls
INSET = WALL_THICKNESS / 2 - 1e-3  # m; so walls of just that thickness keep an inside
NEAR = 1e-4  # m, by which geometry is rounded


def wall_lines(faces: FloatArray, leaves: Sequence[FloatArray]) -> FloatArray:
    """Lines (n, 2, 2) m about which walls are drawn whose faces (k, 2, 2) a laser sees.

    Where walls are thick enough, lines lie within them, half a thickness from their faces. About
    the faces of thinner walls, walls come out thicker. Lines end where walls about them would reach
    into a doorway, in which a closed leaf (2, 2) m stands.
    """
    from shapely import MultiLineString, line_merge, unary_union

    drawn = unary_union(MultiLineString(list(faces)))
    inner = _inside(drawn).buffer(-INSET, join_style="mitre")
    thin = drawn.difference(inner.buffer(INSET + NEAR, join_style="mitre"))
    lines = unary_union([inner.boundary, thin]).difference(_doorways(leaves))
    merged = line_merge(lines) if lines.geom_type == "MultiLineString" else lines
    pieces = [
        np.stack([points[:-1], points[1:]], axis=1)
        for line in getattr(merged, "geoms", [merged])
        if len(points := np.array(line.simplify(NEAR).coords)) > 1
    ]
    return np.concatenate(pieces) if pieces else np.empty((0, 2, 2))


def _inside(faces: BaseGeometry) -> BaseGeometry:
    """The insides of walls: the spaces between faces that are nowhere wider than a wall."""
    from shapely import unary_union
    from shapely.ops import polygonize

    return unary_union([space for space in polygonize(faces) if space.buffer(-NARROW / 2).is_empty])


def _doorways(leaves: Sequence[FloatArray]) -> BaseGeometry:
    """About closed leaves, the region in which lines would be drawn as walls in a doorway."""
    from shapely import MultiLineString

    return MultiLineString(list(leaves)).buffer(INSET - NEAR, cap_style="square")
