"""Rotational symmetry: a square table has four equal headings."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.building.model import Mesh
from objstate.building.outline import outline
from objstate.geometry import FloatArray, wrap

HIGHEST_ORDER = 64  # of what has sides and corners
ROUND = 360  # the order of a round object: its heading is known to half a degree at best
SAME_CORNER = 2e-3  # m by which corners may differ and still be one
SECTIONS = 16  # heights at most at which a mesh is cut


@dataclass(frozen=True, eq=False)
class Symmetry:
    """An object looks the same after every turn by 360 / ``order`` degrees about its centre."""

    order: int
    centre: FloatArray = field(repr=False)  # (2,) m, seen from the object's origin at yaw 0

    def nearest(self, states: FloatArray, yaw: float) -> FloatArray:
        """Of the equal states of each state (n, 3), those whose yaw is nearest to ``yaw`` rad."""
        if self.order == 1:
            return states
        part = 2.0 * np.pi / self.order
        return self._turned(states, -part * np.round(wrap(states[:, 2] - yaw) / part))

    def equals(self, states: FloatArray) -> FloatArray:
        """(order, n, 3) all states that look like each of the states (n, 3), themselves first."""
        turns = 2.0 * np.pi / self.order * np.arange(self.order)
        return np.stack([self._turned(states, np.full(len(states), turn)) for turn in turns])

    def _turned(self, states: FloatArray, turns: FloatArray) -> FloatArray:
        """States (n, 3) turned about the centre by ``turns`` (n,)."""
        yaws = states[:, 2] + turns
        middle = states[:, :2] + _rotated(self.centre, states[:, 2])
        return np.column_stack([middle - _rotated(self.centre, yaws), wrap(yaws)])


def symmetry_of(mesh: Mesh) -> Symmetry:
    """The symmetry of a mesh about a vertical axis, by the corners of its horizontal sections.

    The mesh stands upright at yaw 0, its origin in the object's. Order 1: none. A round table is
    ``ROUND``, however many facets its top and its foot are made of.
    """
    corners = _corners(mesh)
    if len(corners) == 0:
        return Symmetry(1, np.zeros(2))
    centre = corners[:, :2].mean(axis=0)
    if _is_round(corners - [*centre, 0.0]):
        return Symmetry(ROUND, centre)
    for order in range(HIGHEST_ORDER, 1, -1):
        if _maps_onto_itself(corners - [*centre, 0.0], 2.0 * np.pi / order):
            return Symmetry(order, centre)
    return Symmetry(1, centre)


def _corners(mesh: Mesh) -> FloatArray:
    """(c, 3) m, the corners of sections between all levels at which the mesh changes."""
    levels = np.unique(np.round(mesh.vertices[:, 2], 4))
    heights = (levels[1:] + levels[:-1]) / 2.0
    chosen = np.unique(np.linspace(0, len(heights) - 1, min(SECTIONS, len(heights))).astype(int))
    cuts = []
    for height in heights[chosen]:
        ends = outline(mesh, float(height)).reshape(-1, 2)
        ends = np.unique(np.round(ends, 4), axis=0)
        cuts.append(np.column_stack([ends, np.full(len(ends), height)]))
    return np.concatenate([np.empty((0, 3)), *cuts])


def _is_round(corners: FloatArray) -> bool:
    """Whether corners (c, 3) about their centre lie, at each height, all round on circles."""
    for height in np.unique(corners[:, 2]):
        x, y = corners[corners[:, 2] == height, :2].T
        radii = np.hypot(x, y)
        outwards = np.argsort(radii)
        steps = np.flatnonzero(np.diff(radii[outwards]) > SAME_CORNER) + 1
        for circle in np.split(outwards, steps):
            around = np.sort(np.arctan2(y[circle], x[circle]))
            gap = np.diff(around, append=around[0] + 2.0 * np.pi).max()
            radius, least = radii[circle].max(), radii[circle].min()
            if radius - least * np.cos(min(gap, np.pi) / 2.0) > SAME_CORNER:  # a chord's middle
                return False
    return True


def _maps_onto_itself(corners: FloatArray, turn: float) -> bool:
    """Whether corners (c, 3) about their centre come to lie on corners after a turn."""
    from scipy.spatial import cKDTree

    turned = corners.copy()
    turned[:, :2] = _rotated(corners[:, :2], np.full(len(corners), turn))
    distance, _ = cKDTree(corners).query(turned)
    return bool(distance.max() <= SAME_CORNER)


def _rotated(points: FloatArray, angles: FloatArray) -> FloatArray:
    """Points (2,) or (n, 2) turned by angles (n,)."""
    cos, sin = np.cos(angles), np.sin(angles)
    x, y = points[..., 0], points[..., 1]
    return np.column_stack([cos * x - sin * y, sin * x + cos * y])
