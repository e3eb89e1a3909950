"""An object's outline as the loops over mixtures take it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.objects import mixture_kernels as kernels
else:
    kernels = Later("objstate.objects.mixture_kernels")

FACING = 0.9  # cosine between a leaf's face and the way across it from which on it is one
SAME_CORNER = 1e-5  # m; closer ends of segments are one corner
# m from the free edge of a leaf between which a lever handle lies, how far it sticks out, and the
# width of a leaf from which on it may have one
HANDLE, HANDLE_DEPTH, LEAST_WIDTH = (0.04, 0.18), 0.055, 0.5


def shape_of(
    segments: FloatArray, turn: float, slide: FloatArray, *, is_leaf: bool = False
) -> kernels.Shape:
    """The shape of segments (k, 4) m about the object's origin.

    Its state turns it and slides it along (2,). A leaf that hangs at the origin may have a handle.
    """
    along = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(along[:, 0], along[:, 1])
    segments = segments[lengths > 0.0]
    corners, among = _parts(segments)
    handle = _handle(corners) if is_leaf else np.empty((0, 4))
    return kernels.Shape(
        np.ascontiguousarray(segments),
        _normals(segments),
        _faces(segments) if is_leaf and len(segments) else np.zeros(len(segments)),
        corners,
        among,
        turn,
        slide,
        handle,
        _normals(handle),
        _circle_about(handle),
    )


def static_of(shape: kernels.Shape, part_std: float) -> FloatArray:
    """(3,) variances of x, y and yaw at which an outline is seen whose parts are off their places.

    Each part has an independent error with the deviation ``part_std`` m, in either direction; the
    outline is fitted to their middles by least squares.
    """
    ranges = np.unique(shape.among, axis=0)
    middles = np.array([shape.corners[first:past].mean(axis=0) for first, past in ranges.tolist()])
    if len(middles) == 0:
        return np.zeros(3)
    of_place = part_std**2 / len(middles)
    squares = float(((middles - middles.mean(axis=0)) ** 2).sum())
    return np.array([of_place, of_place, part_std**2 / squares if squares > 0.0 else 0.0])


def _normals(segments: FloatArray) -> FloatArray:
    """(k, 2) unit normals of segments (k, 4)."""
    along = segments[:, 2:] - segments[:, :2]
    lengths = np.hypot(along[:, 0], along[:, 1])
    return np.ascontiguousarray(np.column_stack([-along[:, 1], along[:, 0]]) / lengths[:, None])


def _circle_about(segments: FloatArray) -> FloatArray:
    """(3,) x, y and radius of a circle that holds segments (k, 4)."""
    ends = segments.reshape(-1, 2)
    if len(ends) == 0:
        return np.zeros(3)
    middle = 0.5 * (ends.min(axis=0) + ends.max(axis=0))
    return np.append(middle, 1.000001 * np.hypot(*(ends - middle).T).max())  # rounding


def _faces(segments: FloatArray) -> FloatArray:
    """(k,) m along its normal by which each segment of a leaf is off, for each m of thickness.

    Both faces of a leaf that is thicker than modelled lie outwards by half of the difference.
    """
    _, across = _axes(segments.reshape(-1, 2))
    middles = 0.5 * (segments[:, :2] + segments[:, 2:]) @ across
    leaning = _normals(segments) @ across
    outwards = 0.5 * np.sign(middles - 0.5 * (middles.min() + middles.max()))
    return np.where(np.abs(leaning) > FACING, outwards * leaning, 0.0)


def _axes(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Unit vectors (2,) along a leaf that hangs at the origin, and across; by corners (m, 2)."""
    away = np.hypot(corners[:, 0], corners[:, 1])
    far = corners[away > away.max() - 0.01].mean(axis=0)
    along = far / np.hypot(*far)
    return along, np.array([-along[1], along[0]])


def _handle(corners: FloatArray) -> FloatArray:
    """(8, 4) the outlines of a lever handle on both faces of a leaf that hangs at the origin.

    None, (0, 4), on what has no corners or is too narrow.
    """
    if np.hypot(corners[:, 0], corners[:, 1]).max(initial=0.0) < LEAST_WIDTH:
        return np.empty((0, 4))
    along, across = _axes(corners)
    width, faces = float((corners @ along).max()), corners @ across
    near, end = width - HANDLE[1], width - HANDLE[0]
    out = []
    for face, tip in (
        (faces.min(), faces.min() - HANDLE_DEPTH),
        (faces.max(), faces.max() + HANDLE_DEPTH),
    ):
        ring = [
            u * along + v * across for u, v in ((near, face), (near, tip), (end, tip), (end, face))
        ]
        out += [np.concatenate(pair) for pair in pairwise(ring)]
    return np.array(out)


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
