"""Every ray against every segment, compiled."""

from __future__ import annotations

import numpy as np

from objstate.compiling import njit
from objstate.geometry import FloatArray

SLACK = 1e-9  # m by which a ray may pass an end of a segment and still hit


@njit(nogil=True, error_model="numpy")
def cast(rays: FloatArray, segments: FloatArray) -> FloatArray:
    """Distances (n,) along rays (n, 4), each an origin and a unit vector, to segments (k, 4)."""
    out = np.full(rays.shape[0], np.inf)
    for i in range(rays.shape[0]):
        x, y, dx, dy = rays[i, 0], rays[i, 1], rays[i, 2], rays[i, 3]
        for k in range(segments.shape[0]):
            ax, ay = segments[k, 0] - x, segments[k, 1] - y
            bx, by = segments[k, 2] - x, segments[k, 3] - y
            left, right = dx * ay - dy * ax, dx * by - dy * bx  # m aside of the ray
            if min(left, right) > SLACK or max(left, right) < -SLACK or left == right:
                continue
            share = min(max(left / (left - right), 0.0), 1.0)
            distance = dx * (ax + share * (bx - ax)) + dy * (ay + share * (by - ay))
            if 0.0 <= distance < out[i]:
                out[i] = distance
    return out
