"""The piece of wall that each beam meets, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray, IntArray

GRAZING = 0.12  # cosine of incidence below which a range has no information about a wall

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def met(x: float, y: float, dx: float, dy: float, segment: FloatArray, normal: FloatArray) -> Any:
    """Distance along a unit ray to a segment (4,) with a unit normal (2,); inf if it misses."""
    ax, ay = segment[0] - x, segment[1] - y
    bx, by = segment[2] - x, segment[3] - y
    if (dx * ay - dy * ax > 0.0) == (dx * by - dy * bx > 0.0):
        return np.inf
    distance = (normal[0] * ax + normal[1] * ay) / (normal[0] * dx + normal[1] * dy)
    return distance if distance >= 0.0 else np.inf


@called_with("f2 f2 i1 f2 f2 f1 i1")
@_compile
def meet(
    pieces: FloatArray,
    normals: FloatArray,
    among: IntArray,
    origins: FloatArray,
    directions: FloatArray,
    ranges: FloatArray,
    numbers: IntArray,
) -> None:
    """The nearest of some pieces (k, 4) for each beam: ``ranges`` (n,) and ``numbers`` (n,).

    inf and -1 where there is none.
    """
    for i in range(origins.shape[0]):
        nearest, number = np.inf, -1
        x, y, dx, dy = origins[i, 0], origins[i, 1], directions[i, 0], directions[i, 1]
        for m in range(among.shape[0]):
            k = among[m]
            distance = met(x, y, dx, dy, pieces[k], normals[k])
            if distance < nearest:
                nearest, number = distance, k
        ranges[i], numbers[i] = nearest, number
