"""The passage that a door leaves free: what a planner asks before it drives through."""

from __future__ import annotations

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, invert


def clear_widths(item: MovableObject, states: FloatArray) -> FloatArray:
    """Free passage (n,) in m that a door's leaf leaves in states (n, 1).

    It is the distance from the latch-side jamb, where the leaf's edge lies when the
    door is closed (state zero), to the leaf: the diameter of the largest disc that
    passes between the two. A thin leaf of width w that is open by an angle leaves
    w sin(angle) up to 90 degrees, and w beyond. A sliding door leaves as much as it
    has been slid.

    Raises BuildingError for furniture, which closes no passage of its own.
    """
    if item.kind is Kind.PLANAR:
        raise BuildingError(
            f"Object '{item.name}' stands on the floor and is no door; it has no clear width."
        )
    leaf = _outline_from_above(item)
    if item.kind is Kind.SLIDING:
        along = leaf @ _in_plan(item)
        return np.asarray(np.abs(states[:, 0] - item.home[0]).clip(max=np.ptp(along)))
    back = invert(item.transforms(states)) @ item.transforms(item.home[None])[0]
    jamb = np.array([*_far_edge(leaf), 0.0, 1.0])
    return _distance_to_polygon((back @ jamb)[:, :2], leaf)


def _in_plan(item: MovableObject) -> FloatArray:
    """(2,) the way a sliding leaf goes, in its own frame, seen from above."""
    return np.asarray(item.axis[:2] / max(float(np.hypot(*item.axis[:2])), 1e-9))


def _outline_from_above(item: MovableObject) -> FloatArray:
    """Convex outline (k, 2) of the leaf in its own frame, counter-clockwise."""
    from scipy.spatial import ConvexHull

    plan = item.mesh.vertices[:, :2]
    return np.asarray(plan[ConvexHull(plan).vertices])


def _far_edge(leaf: FloatArray) -> FloatArray:
    """(2,) the middle of the edge that lies at the latch: as far as the leaf goes, along its middle."""
    middle = leaf.mean(axis=0)
    away = middle / np.hypot(*middle)
    return np.asarray(away * (leaf @ away).max())


def _distance_to_polygon(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Distances (n,) of points (n, 2) from a convex counter-clockwise polygon (k, 2); 0 inside."""
    start, along = corners, np.roll(corners, -1, axis=0) - corners
    off = points[:, None] - start  # (n, k, 2)
    share = ((off * along).sum(axis=2) / (along**2).sum(axis=1)).clip(0.0, 1.0)
    distance = np.linalg.norm(off - share[..., None] * along, axis=2).min(axis=1)
    left = along[:, 0] * off[..., 1] - along[:, 1] * off[..., 0] >= 0.0
    return np.asarray(np.where(left.all(axis=1), 0.0, distance))
