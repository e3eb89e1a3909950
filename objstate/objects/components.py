"""Adding and merging components of a mixture over x, y, yaw; compiled."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray
from objstate.linear import ROOT_TAU, wrapped
from objstate.objects.mixture_kernels import ERRORS, ROBOT
from objstate.objects.sampling import alike

SAME_PLACE = 1.0  # nats of divergence below which a component merges with a heavier one
YAW, EAST, NORTH = 3, 4, 5  # indices of the errors

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def _difference(
    a: FloatArray, b: FloatArray, order: int, centre: FloatArray, out: FloatArray
) -> None:
    """From a place (3,) to another, or to its nearest equal heading, as errors (8,)."""
    x, y, yaw = alike(b, a[2], order, centre)
    out[YAW], out[EAST], out[NORTH] = wrapped(yaw - a[2]), x - a[0], y - a[1]


@_inner
def _inverse(matrix: FloatArray, out: FloatArray) -> Any:
    """The inverse of the block of yaw, x and y in a covariance (8, 8), and its determinant."""
    a, b, c = matrix[3, 3], matrix[3, 4], matrix[3, 5]
    d, e, f = matrix[4, 4], matrix[4, 5], matrix[5, 5]
    out[0, 0], out[0, 1], out[0, 2] = d * f - e * e, c * e - b * f, b * e - c * d
    out[1, 1], out[1, 2], out[2, 2] = a * f - c * c, b * c - a * e, a * d - b * b
    determinant = a * out[0, 0] + b * out[0, 1] + c * out[0, 2]
    for i in range(3):
        for j in range(i, 3):
            out[i, j] /= determinant
            out[j, i] = out[i, j]
    return determinant


@_inner
def _blend(
    share: float,
    off: FloatArray,
    other: FloatArray,
    place: FloatArray,
    robot: FloatArray,
    covariance: FloatArray,
) -> None:
    """Merge a Gaussian ``off`` (8,) of covariance ``other`` (8, 8) in, by a share of weight."""
    for a in range(ERRORS):
        for b in range(ERRORS):
            covariance[a, b] += share * (
                other[a, b] - covariance[a, b] + (1.0 - share) * off[a] * off[b]
            )
    for a in range(ROBOT):
        robot[a] += share * off[a]
    place[0] += share * off[EAST]
    place[1] += share * off[NORTH]
    place[2] = wrapped(place[2] + share * off[YAW])


@called_with("f f2 f2 f2 f1 f2 f2 f3")
@_compile
def arrive(
    weight: float,
    cells: FloatArray,
    spread: FloatArray,
    pose: FloatArray,
    weights: FloatArray,
    places: FloatArray,
    robots: FloatArray,
    covariances: FloatArray,
) -> None:
    """Add a weight to each of the cells (c, 3) with a covariance ``spread`` (3, 3) of x, y, yaw.

    What arrives has the covariance ``pose`` (3, 3) of the robot's errors. Weights (c,), places (c,
    3), the robot's errors (c, 3) and covariances (c, 8, 8) of the present components become those
    of both together.
    """
    if weight <= 0.0:
        return
    off, other = np.zeros(ERRORS), np.zeros((ERRORS, ERRORS))
    at = (EAST, NORTH, YAW)
    for a in range(3):
        for b in range(3):
            other[a, b] = pose[a, b]
            other[at[a], at[b]] = spread[a, b]
    for c in range(weights.shape[0]):
        total = weights[c] + weight
        share = weight / total
        for a in range(ROBOT):
            off[a] = -robots[c, a]
        off[EAST], off[NORTH] = cells[c, 0] - places[c, 0], cells[c, 1] - places[c, 1]
        off[YAW] = wrapped(cells[c, 2] - places[c, 2])
        _blend(share, off, other, places[c], robots[c], covariances[c])
        weights[c] = total


@called_with("f2 f1 f2 f3 f1 i f1 f1")
@_compile
def densities(
    proposed: FloatArray,
    weights: FloatArray,
    places: FloatArray,
    covariances: FloatArray,
    std: FloatArray,
    order: int,
    centre: FloatArray,
    out: FloatArray,
) -> None:
    """Density ``out`` (p,) at places (p, 3) of the components (c,) wider than deviations (3,)."""
    inverse, off = np.empty((3, 3)), np.empty(ERRORS)
    for p in range(proposed.shape[0]):
        out[p] = 0.0
    least = (std[0] * std[1] * std[2]) ** 2
    for c in range(weights.shape[0]):
        determinant = _inverse(covariances[c], inverse)
        if determinant < least:
            continue
        for p in range(proposed.shape[0]):
            _difference(places[c], proposed[p], order, centre, off)
            squared = 0.0
            for i in range(3):
                for j in range(3):
                    squared += off[3 + i] * inverse[i, j] * off[3 + j]
            peak = weights[c] / (ROOT_TAU**3 * math.sqrt(determinant))
            out[p] += peak * math.exp(-0.5 * squared)


@called_with("f1 f2 f2 f3 i f1 f")
@_compile
def merge(
    weights: FloatArray,
    places: FloatArray,
    robots: FloatArray,
    covariances: FloatArray,
    order: int,
    centre: FloatArray,
    least: float,
) -> None:
    """Merge components, except the first, with heavier ones at the same place.

    Merged ones get weight zero. Weights are (c,), places (c, 3), the robot's errors (c, 3) and
    covariances (c, 8, 8). Two are the same if the divergence of the lighter from the heavier one is
    below ``SAME_PLACE``. Components below a weight ``least`` take in no others.
    """
    inverse, off, ranks = np.empty((3, 3)), np.zeros(ERRORS), np.argsort(-weights)
    for first in range(ranks.shape[0]):
        i = ranks[first]
        if weights[i] < least:
            break
        if i == 0:
            continue
        for second in range(first + 1, ranks.shape[0]):
            j = ranks[second]
            if j == 0 or weights[j] <= 0.0:
                continue
            determinant = _inverse(covariances[i], inverse)
            _difference(places[i], places[j], order, centre, off)
            if abs(off[EAST]) + abs(off[NORTH]) > 1.0:
                continue
            trace = 0.0
            for a in range(3):
                for b in range(3):
                    spread = covariances[j, 3 + a, 3 + b] + off[3 + a] * off[3 + b]
                    trace += inverse[a, b] * spread
            if trace > 3.0 + 2.0 * SAME_PLACE + 60.0:
                continue
            own = _inverse(covariances[j], np.empty((3, 3)))
            if 0.5 * (trace - 3.0 + math.log(determinant / own)) > SAME_PLACE:
                continue
            for a in range(ROBOT):
                off[a] = robots[j, a] - robots[i, a]
            total = weights[i] + weights[j]
            _blend(weights[j] / total, off, covariances[j], places[i], robots[i], covariances[i])
            weights[i], weights[j] = total, 0.0


@called_with("f2 f2 f2 f1 b1")
@_compile
def meeting(
    circles: FloatArray,
    origins: FloatArray,
    directions: FloatArray,
    until: FloatArray,
    out: BoolArray,
) -> None:
    """Which beams, of origins and directions (n, 2), enter a circle (c, 3) before ranges (n,) m."""
    for i in range(origins.shape[0]):
        out[i] = False
        for c in range(circles.shape[0]):
            to_x, to_y = circles[c, 0] - origins[i, 0], circles[c, 1] - origins[i, 1]
            along = to_x * directions[i, 0] + to_y * directions[i, 1]
            across = to_x * directions[i, 1] - to_y * directions[i, 0]
            squared = circles[c, 2] * circles[c, 2] - across * across
            if squared > 0.0 and -math.sqrt(squared) < along < until[i] + math.sqrt(squared):
                out[i] = True
                break
