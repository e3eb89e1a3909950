"""The beams that may reach objects, and how walls explain their readings; compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import BoolArray, FloatArray

SPREAD_SIGMAS = 3.0  # standard deviations within which samples of a belief lie

_compile = njit(nogil=True, error_model="numpy")
_inner = inner(nogil=True, error_model="numpy")


@_inner
def _comes_within(circle: FloatArray, x: float, y: float, distance: float) -> Any:
    """Whether a circle (3,) comes within a distance of a place."""
    east, north, reach = circle[0] - x, circle[1] - y, circle[2] + distance
    return east * east + north * north <= reach * reach


@_inner
def _from(
    circle: FloatArray,
    pose: FloatArray,
    cos: float,
    sin: float,
    position_std: float,
    yaw_std: float,
) -> Any:
    """Middle and radius of a circle (3,) in a robot's frame, widened by the robot's uncertainty."""
    east, north = circle[0] - pose[0], circle[1] - pose[1]
    x, y = cos * east + sin * north, cos * north - sin * east
    return x, y, circle[2] + SPREAD_SIGMAS * (position_std + yaw_std * np.hypot(x, y))


@_inner
def _entered(
    x: float, y: float, radius: float, origin: FloatArray, direction: FloatArray, level: float
) -> Any:
    """Range at which a beam enters a circle; inf where it misses it."""
    to_x, to_y = x - origin[0], y - origin[1]
    along = to_x * direction[0] + to_y * direction[1]
    aside = to_x * direction[1] - to_y * direction[0]
    squared = radius * radius - aside * aside
    half = np.sqrt(max(squared, 0.0))
    enters = (squared >= 0.0) & (along + half > 0.0)
    return max(along - half, 0.0) / level if enters else np.inf


@_compile
def within(circles: FloatArray, x: float, y: float, distance: float) -> Any:
    """Indices of the circles (m, 3), x, y and radius, within a distance of a place, and these."""
    found, count = np.empty(circles.shape[0], dtype=np.int64), 0
    for k in range(circles.shape[0]):
        found[count] = k
        count += _comes_within(circles[k], x, y, distance)
    near = np.empty((count, 3))
    for k in range(count):
        for part in range(3):
            near[k, part] = circles[found[k], part]
    return found[:count], near


@_compile
def entries(
    circles: FloatArray,
    pose: FloatArray,
    position_std: float,
    yaw_std: float,
    origins: FloatArray,
    directions: FloatArray,
    level: FloatArray,
) -> Any:
    """Range (m, n) at which each beam enters each circle (m, 3); inf where it misses it.

    Beams have ``origins`` (n, 3) in the frame of the robot at a ``pose`` (3,), ``directions`` (n,
    2) seen from above, and a share ``level`` (n,) of their ranges. The circles are widened by the
    robot's uncertainty.
    """
    out = np.empty((circles.shape[0], origins.shape[0]))
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(circles.shape[0]):
        x, y, radius = _from(circles[k], pose, cos, sin, position_std, yaw_std)
        for i in range(origins.shape[0]):
            out[k, i] = _entered(x, y, radius, origins[i], directions[i], level[i])
    return out


@_compile
def near(
    circles: FloatArray,
    x: float,
    y: float,
    distance: float,
    entered: FloatArray,
    beams: BoolArray,
) -> Any:
    """The circles (m, 3) within a distance of a place, those entered, and the beams that enter.

    Circles are given by index. Of the beams (n,), the chosen ones count that enter a circle, at
    ranges (m, n).
    """
    found, count = np.empty((2, circles.shape[0]), dtype=np.int64), 0
    enters, some = np.zeros(beams.shape[0], dtype=np.bool_), 0
    for k in range(circles.shape[0]):
        if not _comes_within(circles[k], x, y, distance):
            continue
        found[0, count] = found[1, some] = k
        is_entered = False
        for i in range(beams.shape[0]):
            meets = beams[i] & (entered[k, i] < np.inf)
            enters[i] |= meets
            is_entered |= meets
        count += 1
        some += is_entered
    return found[0, :count], found[1, :some], enters


@_compile
def seen(
    circles: FloatArray,
    pose: FloatArray,
    position_std: float,
    yaw_std: float,
    distance: float,
    origins: FloatArray,
    directions: FloatArray,
    level: FloatArray,
    beams: BoolArray,
    walls: FloatArray,
    margin: float,
) -> Any:
    """Indices of circles (m, 3) that beams enter at most a margin, m, behind the walls.

    Of the circles those within a ``distance``, of the beams those chosen, ``beams`` (n,), which
    meet the ``walls`` (k,). For other arguments see ``entries``.
    """
    found, count = np.empty(circles.shape[0], dtype=np.int64), 0
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(circles.shape[0]):
        if not _comes_within(circles[k], pose[0], pose[1], distance):
            continue
        x, y, radius = _from(circles[k], pose, cos, sin, position_std, yaw_std)
        chosen = 0
        for i in range(beams.shape[0]):
            if not beams[i]:
                continue
            entered = _entered(x, y, radius, origins[i], directions[i], level[i])
            if entered < walls[chosen] + margin:
                found[count] = k
                count += 1
                break
            chosen += 1
    return found[:count]


@_compile
def evenly_spread(beams: BoolArray, most: int) -> Any:
    """At most ``most`` of the chosen beams (n,), evenly spread among them."""
    last, kept = -1, np.empty(beams.shape[0], dtype=np.bool_)
    for i in range(beams.shape[0]):
        kept[i] = False
        last += beams[i]
    if last < most:
        return beams
    rank, step = 0, 0  # of the chosen beams, and of those that are kept
    for i in range(beams.shape[0]):
        if beams[i]:
            next_rank = (2 * step * last + most - 1) // (2 * max(most - 1, 1))
            if step < most and rank == next_rank:
                kept[i] = True
                step += 1
            rank += 1
    return kept
