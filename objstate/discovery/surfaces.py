"""Where beams meet the walls of a map, which lie where readings show them; compiled.

A map's cells and straightened outlines are a few centimetres off, and lean. All looks share that,
so that a leaf in place of a wall would explain a thousand readings better than the wall where the
map has it. Beams are as in ``kernels``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.discovery.kernels import (
    DIRECTION_X,
    DIRECTION_Y,
    ORIGIN_X,
    ORIGIN_Y,
    PAST,
    PER_SIGMA,
    RANGE,
)
from objstate.geometry import FloatArray, IntArray

STEEP = 0.15  # sine of the incidence below which a beam doesn't tell where a surface lies
SURFACE_STD = 0.03  # m, prior deviation of a surface's middle, and of its ends beside that
SURFACE_REACH = 0.12  # m from where the map has a surface, within which readings are of it

_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})


@called_with("f2 f2 f f1 i1")
@_compile
def cast(
    beams: FloatArray, segments: FloatArray, aside: float, out: FloatArray, met: IntArray
) -> None:
    """Distance ``out`` (n,) to the nearest of segments (k, 4), from x, y to x, y; inf beyond the disc.

    Beams are moved ``aside`` to their left, m. ``met`` (n,) gets the number of the segment, or -1.
    """
    for j in range(beams.shape[1]):
        dx, dy = beams[DIRECTION_X, j], beams[DIRECTION_Y, j]
        ox, oy = beams[ORIGIN_X, j] - aside * dy, beams[ORIGIN_Y, j] + aside * dx
        nearest, number = np.inf, -1
        for k in range(segments.shape[0]):
            ax, ay = segments[k, 0] - ox, segments[k, 1] - oy
            ux, uy = segments[k, 2] - segments[k, 0], segments[k, 3] - segments[k, 1]
            cross, side = dx * uy - dy * ux, ax * dy - ay * dx
            if side * (cross - side) < 0.0 or abs(cross) < 1e-12:
                continue  # both ends are on the same side of the beam
            along = (ax * uy - ay * ux) / cross
            if 0.0 < along < nearest:
                nearest, number = along, k
        within = nearest < beams[PAST, j]
        out[j], met[j] = (nearest, number) if within else (np.inf, -1)


@_inner
def _where(beams: FloatArray, j: int, segment: FloatArray, way: float, aside: float) -> Any:
    """Where on a segment beam ``j`` is after a ``way``, from -1/2 to 1/2, and the sine of incidence."""
    ux, uy = segment[2] - segment[0], segment[3] - segment[1]
    length = max(np.hypot(ux, uy), 1e-9)
    dx, dy = beams[DIRECTION_X, j], beams[DIRECTION_Y, j]
    x = beams[ORIGIN_X, j] - aside * dy + way * dx - segment[0]
    y = beams[ORIGIN_Y, j] + aside * dx + way * dy - segment[1]
    return (x * ux + y * uy) / (length * length) - 0.5, abs(dx * uy - dy * ux) / length


@called_with("f2 f2 f1 i1 f1 f1 f2")
@_compile
def offsets(
    beams: FloatArray,
    segments: FloatArray,
    expected: FloatArray,
    met: IntArray,
    weights: FloatArray,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """How far segments (k, 4) lie behind where the map has them: ``out`` (k, 2) m, middle and slope.

    By least squares of the readings that ``met`` (n,) them at the distances ``expected`` (n,), which
    count by ``weights`` (n,). The slope is the change over the segment's length.
    """
    sums = np.zeros((segments.shape[0], 5))
    for j in range(beams.shape[1]):
        k = met[j]
        if k < 0 or not beams[RANGE, j] < np.inf:
            continue
        place, sine = _where(beams, j, segments[k], expected[j], 0.0)
        off = (beams[RANGE, j] - expected[j]) * sine
        if abs(off) > SURFACE_REACH or sine < STEEP:
            continue
        weight = weights[j] * (model[PER_SIGMA] / sine) ** 2
        sums[k, 0] += weight
        sums[k, 1] += weight * place
        sums[k, 2] += weight * place * place
        sums[k, 3] += weight * off
        sums[k, 4] += weight * off * place
    prior = 1.0 / (SURFACE_STD * SURFACE_STD)
    for k in range(segments.shape[0]):
        a, b, d = sums[k, 0] + prior, sums[k, 1], sums[k, 2] + prior
        determinant = a * d - b * b
        out[k, 0] = (d * sums[k, 3] - b * sums[k, 4]) / determinant
        out[k, 1] = (a * sums[k, 4] - b * sums[k, 3]) / determinant


@called_with("f2 f2 f i1 f2 f1")
@_compile
def displace(
    beams: FloatArray,
    segments: FloatArray,
    aside: float,
    met: IntArray,
    off: FloatArray,
    out: FloatArray,
) -> None:
    """Change the distances ``out`` (n,) to what they are if segments (k, 4) are ``off`` (k, 2)."""
    for j in range(beams.shape[1]):
        k = met[j]
        if k >= 0:
            place, sine = _where(beams, j, segments[k], out[j], aside)
            out[j] += (off[k, 0] + place * off[k, 1]) / max(sine, STEEP)
