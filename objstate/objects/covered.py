"""The cells of a grid that an object covers under its belief (Darmstadt, section 6.1.5)."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from objstate.building.model import MovableObject
from objstate.geometry import FloatArray
from objstate.grid import Drawing, Layout, expected_occupancy
from objstate.objects.belief import ObjectBelief
from objstate.objects.footprint import OBJECTS_KEPT, motions, silhouette

LEAST_DRAWN = 1e-4  # weight below which a state isn't drawn


def covered(
    layout: Layout, belief: ObjectBelief, margin: float = 0.0, most: int | None = None
) -> Drawing:
    """The probability for each cell that an object touches it, or comes within a margin, m.

    It is that under the posterior over all states, absence included. Of more than ``most`` states
    that many are drawn, a systematic sample, which is faster and accurate to their share.
    """
    weights = belief.presence * belief.weights.values
    kept = np.flatnonzero(weights > LEAST_DRAWN)
    weights = weights[kept]
    if most is not None and len(kept) > most:
        total = float(weights.sum())
        evenly = (np.arange(most) + 0.5) / most * total
        kept = kept[np.minimum(np.searchsorted(np.cumsum(weights), evenly), len(kept) - 1)]
        weights = np.full(most, total / most)
    moved = motions(belief.item, belief.states[kept])
    outline = _outline(belief.item, margin)
    outlines = outline @ moved[:, :2, :2].swapaxes(1, 2) + moved[:, None, :2, 3]
    drawn = expected_occupancy(layout, list(outlines), weights)
    return Drawing(layout, drawn.where, np.minimum(drawn.values, np.float32(1.0)))


@lru_cache(maxsize=OBJECTS_KEPT)
def _outline(item: MovableObject, margin: float) -> FloatArray:
    """Corners (k, 2) of the convex hull of what an object covers in its home state, widened."""
    import shapely

    hull = silhouette(item).convex_hull.buffer(margin, join_style="mitre")
    return np.asarray(shapely.get_coordinates(hull))
