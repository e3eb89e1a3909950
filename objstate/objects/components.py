"""Adding, merging and bounding components of a mixture over x, y, yaw; compiled."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from objstate.compiling import called_with, inner, njit, record
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.linear import ROOT_2, ROOT_TAU, wrapped
from objstate.objects.mixture_kernels import ERRORS, ROBOT
from objstate.objects.sampling import alike

SAME_PLACE = 1.0  # nats of divergence below which a component merges with a heavier one
YAW, EAST, NORTH = 3, 4, 5  # indices of the errors
NARROW = 0.01  # m, deviation up to which a place counts as one
LEAST_POSSIBLE = 1e-30  # probability that is left of an impossible place

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@record("ground", "f2 i2 f1 b1 f2 f1 f f f")
class Ground(NamedTuple):
    """Points of walls, and how deep points lie within what a piece covers, seen from above."""

    points: FloatArray  # (n, 2) m, those of a square tile together
    first: IntArray  # (rows, columns + 1) the first point of each tile of a row, and past the last
    corner: FloatArray  # (2,) m, lower corner of the first tile
    counts: BoolArray  # (n,) points that the piece can't hold
    depths: FloatArray  # (rows, columns) m, 0 outside
    middle: FloatArray  # (2,) m, middle of the first of these cells, about the piece's origin
    tile: float  # m, side of a tile
    cell: float  # m, side of a cell
    reach: float  # m from the piece's origin within which all that it covers lies


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


@called_with("f1 f2 f2 f2 f1 f2 f2 f3")
@_compile
def arrive(
    arriving: FloatArray,
    cells: FloatArray,
    spread: FloatArray,
    pose: FloatArray,
    weights: FloatArray,
    places: FloatArray,
    robots: FloatArray,
    covariances: FloatArray,
) -> None:
    """Add a weight ``arriving`` (c,) to cells (c, 3) of a covariance ``spread`` (3, 3) of x, y, yaw.

    What arrives has the covariance ``pose`` (3, 3) of the robot's errors. Weights (c,), places (c,
    3), the robot's errors (c, 3) and covariances (c, 8, 8) of the present components become those
    of both together.
    """
    off, other = np.zeros(ERRORS), np.zeros((ERRORS, ERRORS))
    at = (EAST, NORTH, YAW)
    for a in range(3):
        for b in range(3):
            other[a, b] = pose[a, b]
            other[at[a], at[b]] = spread[a, b]
    for c in range(weights.shape[0]):
        total = weights[c] + arriving[c]
        if arriving[c] <= 0.0:
            continue
        share = arriving[c] / total
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


@_inner
def _deepest(x: float, y: float, yaw: float, ground: Ground) -> Any:
    """m by which points of walls reach into a piece at a place; those that don't count don't."""
    cos, sin, deepest = math.cos(yaw), math.sin(yaw), 0.0
    rows, columns = ground.first.shape[0], ground.first.shape[1] - 1
    low = max(math.floor((x - ground.reach - ground.corner[0]) / ground.tile), 0)
    high = min(math.floor((x + ground.reach - ground.corner[0]) / ground.tile), columns - 1)
    bottom = max(math.floor((y - ground.reach - ground.corner[1]) / ground.tile), 0)
    top = min(math.floor((y + ground.reach - ground.corner[1]) / ground.tile), rows - 1)
    for row in range(bottom, top + 1):
        if low > high:
            break
        for k in range(ground.first[row, low], ground.first[row, high + 1]):
            if not ground.counts[k]:
                continue
            off_x, off_y = ground.points[k, 0] - x, ground.points[k, 1] - y
            own_x = cos * off_x + sin * off_y - ground.middle[0]
            own_y = cos * off_y - sin * off_x - ground.middle[1]
            i = math.floor(own_y / ground.cell + 0.5)
            j = math.floor(own_x / ground.cell + 0.5)
            if 0 <= i < ground.depths.shape[0] and 0 <= j < ground.depths.shape[1]:
                deepest = max(deepest, ground.depths[i, j])
    return deepest


@_inner
def _alone(x: float, y: float, yaw: float, bodies: FloatArray, std: float) -> Any:
    """Probability that no other body takes a place, see ``possible``."""
    cos, sin, out = math.cos(yaw), math.sin(yaw), 1.0
    for k in range(bodies.shape[0]):
        own_x, own_y = bodies[k, 0], bodies[k, 1]
        off_x = x + cos * own_x - sin * own_y - bodies[k, 2]
        off_y = y + sin * own_x + cos * own_y - bodies[k, 3]
        deep = max(bodies[k, 4] - math.hypot(off_x, off_y), 0.0)
        out *= 1.0 - bodies[k, 5] * (1.0 - math.erfc(deep / (ROOT_2 * std)))
    return out


@called_with("f2 f3 ground f2 f f1")
@_compile
def possible(
    places: FloatArray,
    covariances: FloatArray,
    ground: Ground,
    bodies: FloatArray,
    std: float,
    out: FloatArray,
) -> None:
    """Probability ``out`` (c,) that the piece can stand in components at places (c, 3).

    The mean over their Gaussians, of covariances (c, 8, 8), of the probability that walls and other
    bodies aren't where they reach into the piece, if they are off by a deviation ``std`` m. It is
    taken by the Gauss-Hermite rule of three points along either axis of the position. Of each of
    the ``bodies`` (m, 6), a point x, y of the piece, about its origin at yaw 0, is farther than a
    distance m from a place x, y, if it is there with a probability.
    """
    for c in range(places.shape[0]):
        xx, xy, yy = (
            covariances[c, EAST, EAST],
            covariances[c, EAST, NORTH],
            covariances[c, NORTH, NORTH],
        )
        half, mean = 0.5 * (xx - yy), 0.5 * (xx + yy)
        root, turn = math.hypot(half, xy), 0.5 * math.atan2(xy, half)
        axis_x, axis_y = math.cos(turn), math.sin(turn)
        long, short = math.sqrt(3.0 * (mean + root)), math.sqrt(3.0 * max(mean - root, 0.0))
        total = 0.0
        for a in range(-1, 2):
            for b in range(-1, 2):
                weight = (1.0 / 6.0 if a else 2.0 / 3.0) * (1.0 / 6.0 if b else 2.0 / 3.0)
                if a != 0 and long < NARROW:
                    continue
                if b != 0 and short < NARROW:
                    continue
                weight *= 1.5 if long < NARROW else 1.0
                weight *= 1.5 if short < NARROW else 1.0
                x = places[c, 0] + a * long * axis_x - b * short * axis_y
                y = places[c, 1] + a * long * axis_y + b * short * axis_x
                deep = _deepest(x, y, places[c, 2], ground)
                alone = _alone(x, y, places[c, 2], bodies, std)
                total += weight * alone * math.erfc(deep / (ROOT_2 * std))
        out[c] = max(total, LEAST_POSSIBLE)
