"""The passage that a door leaves free."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from objstate.building.model import Kind, MovableObject
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, invert

LATTICES_KEPT = 32_768  # number of lattices whose widths are cached, some 1 kB each


@lru_cache(maxsize=LATTICES_KEPT)
def lattice_clear_widths(
    item: MovableObject, first: float, last: float, count: int, length: float
) -> FloatArray:
    """``clear_widths`` (n,) at evenly spaced states, cached."""
    widths = clear_widths(item, np.linspace(first, last, count)[:, None], length)
    widths.flags.writeable = False
    return widths


def clear_widths(item: MovableObject, states: FloatArray, length: float = 0.0) -> FloatArray:
    """Free passage (n,) in m that a door's leaf leaves in states (n, 1).

    It is the distance from the latch-side jamb, where the leaf's edge lies when the
    door is closed (state zero), to the leaf: the diameter of the largest disc that
    passes between the two. A thin leaf of width w that is open by an angle leaves
    w sin(angle) up to 90 degrees, and w beyond. A sliding door leaves as much as it
    has been slid.

    With a ``length`` in m it is the passage for a rectangle of that length, which drives
    straight through, at a right angle to the doorway, until its tail is in the doorway,
    and only then turns: what the leaf leaves between it and the jamb as far as the
    robot reaches. Of a thin leaf open by less than 90 degrees that is
    w - min(w cos(angle), length / tan(angle)), and never more than a disc has.

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
    closed = item.transforms(item.home[None])[0]
    jamb = np.array([*_far_edge(leaf), 0.0, 1.0])
    for_disc = _distance_to_polygon((invert(item.transforms(states)) @ closed @ jamb)[:, :2], leaf)
    if length == 0.0:
        return for_disc
    opened = invert(closed) @ item.transforms(states)
    corners = leaf @ opened[:, :2, :2].swapaxes(1, 2) + opened[:, None, :2, 3]
    return np.minimum(for_disc, _straight_widths(corners, jamb[:2], length))


def _straight_widths(corners: FloatArray, jamb: FloatArray, reach: float) -> FloatArray:
    """Widths (n,) between the jamb (2,) and leaves (n, k, 2), within ``reach`` of the doorway.

    The doorway is the line from the hinge, at the origin, to the jamb.
    """
    width = float(np.hypot(*jamb))
    along = jamb / width
    x, y = corners @ along, corners @ np.array([-along[1], along[0]])  # (n, k): along, across
    next_x, next_y = np.roll(x, -1, axis=1), np.roll(y, -1, axis=1)
    places = [np.where(np.abs(y) <= reach, x, -np.inf)]
    for limit in (-reach, reach):  # where edges of the leaf leave the strip around the doorway
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (limit - y) / (next_y - y)
            crossing = x + share * (next_x - x)
        places.append(np.where((share >= 0.0) & (share <= 1.0), crossing, -np.inf))
    return np.asarray((width - np.concatenate(places, axis=1).max(axis=1)).clip(0.0, width))


def _in_plan(item: MovableObject) -> FloatArray:
    """(2,) direction in which a sliding leaf moves, in its own frame, seen from above."""
    return np.asarray(item.axis[:2] / max(float(np.hypot(*item.axis[:2])), 1e-9))


def _outline_from_above(item: MovableObject) -> FloatArray:
    """Convex outline (k, 2) of the leaf in its own frame, counter-clockwise."""
    from scipy.spatial import ConvexHull

    plan = item.mesh.vertices[:, :2]
    return np.asarray(plan[ConvexHull(plan).vertices])


def _far_edge(leaf: FloatArray) -> FloatArray:
    """(2,) the middle of the edge at the latch."""
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
