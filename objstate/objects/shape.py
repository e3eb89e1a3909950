"""An object's outline as the loops over mixtures take it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.objects import mixture_kernels as kernels
else:
    kernels = Later("objstate.objects.mixture_kernels")

SAME_CORNER = 1e-5  # m; closer ends of segments are one corner


def shape_of(segments: FloatArray, turn: float, slide: FloatArray) -> kernels.Shape:
    """The shape of segments (k, 4) m about the object's origin.

    Its state turns it and slides it along (2,).
    """
    along = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(along[:, 0], along[:, 1])
    segments, along, lengths = (each[lengths > 0.0] for each in (segments, along, lengths))
    corners, among = _parts(segments)
    return kernels.Shape(
        np.ascontiguousarray(segments),
        np.ascontiguousarray(np.column_stack([-along[:, 1], along[:, 0]]) / lengths[:, None]),
        corners,
        among,
        turn,
        slide,
    )


def _parts(segments: FloatArray) -> tuple[FloatArray, IntArray]:
    """Corners (m, 2) of segments (k, 4) by part, and the range of each segment's part (k, 2)."""
    ends = np.rint(segments.reshape(-1, 2) / SAME_CORNER).astype(np.int64)
    corners, which = np.unique(ends, axis=0, return_inverse=True)
    pairs = which.reshape(-1, 2)
    part = np.arange(len(corners))
    for _ in range(len(corners)):
        least = np.minimum(part[pairs[:, 0]], part[pairs[:, 1]])
        before = part.copy()
        np.minimum.at(part, pairs[:, 0], least)
        np.minimum.at(part, pairs[:, 1], least)
        if np.array_equal(part, before):
            break
    order = np.argsort(part, kind="stable")
    ranked = part[order]
    own = part[pairs[:, 0]]
    among = np.column_stack([np.searchsorted(ranked, own), np.searchsorted(ranked, own, "right")])
    return SAME_CORNER * corners[order].astype(float), np.ascontiguousarray(among)
