"""Intersections of rays and segments, compiled: every ray with every segment."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray

SLACK = 1e-9  # m by which a ray may pass an end of a segment and still hit


@inner(nogil=True, error_model="numpy")
def hit(x: float, y: float, dx: float, dy: float, segment: FloatArray) -> Any:
    """Distance along a ray from x, y, in a unit direction, to a segment (4,); inf if it misses."""
    ax, ay = segment[0] - x, segment[1] - y
    bx, by = segment[2] - x, segment[3] - y
    left, right = dx * ay - dy * ax, dx * by - dy * bx  # m to the side of the ray
    if min(left, right) > SLACK or max(left, right) < -SLACK or left == right:
        return np.inf
    share = min(max(left / (left - right), 0.0), 1.0)
    distance = dx * (ax + share * (bx - ax)) + dy * (ay + share * (by - ay))
    return distance if distance >= 0.0 else np.inf


@called_with("f2 f2")
@njit(nogil=True, error_model="numpy")
def cast(rays: FloatArray, segments: FloatArray) -> FloatArray:
    """Distances (n,) along rays (n, 4), each an origin and a unit vector, to segments (k, 4)."""
    out = np.full(rays.shape[0], np.inf)
    for i in range(rays.shape[0]):
        for k in range(segments.shape[0]):
            distance = hit(rays[i, 0], rays[i, 1], rays[i, 2], rays[i, 3], segments[k])
            out[i] = min(out[i], distance)
    return out
