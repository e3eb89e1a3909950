"""The beams that enter the circles within which objects are, whatever their states; compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray

SPREAD_SIGMAS = 3.0  # standard deviations within which samples of a belief lie

_compile = njit(nogil=True, error_model="numpy")
_inner = inner(nogil=True, error_model="numpy")


@_inner
def comes_within(circle: FloatArray, x: float, y: float, distance: float) -> Any:
    """Whether a circle (3,) comes within a distance of a place."""
    east, north, reach = circle[0] - x, circle[1] - y, circle[2] + distance
    return east * east + north * north <= reach * reach


@_inner
def seen_from(
    circle: FloatArray,
    at_x: float,
    at_y: float,
    cos: float,
    sin: float,
    position_std: float,
    yaw_std: float,
) -> Any:
    """Middle and radius of a circle (3,) in a robot's frame, widened by the robot's uncertainty."""
    east, north = circle[0] - at_x, circle[1] - at_y
    x, y = cos * east + sin * north, cos * north - sin * east
    return x, y, circle[2] + SPREAD_SIGMAS * (position_std + yaw_std * np.hypot(x, y))


@_inner
def crossing(x: float, y: float, radius: float, dx: float, dy: float) -> Any:
    """Ranges at which a beam in a direction enters and leaves a circle about x, y, from its origin.

    Both are inf where it misses it.
    """
    along, across = x * dx + y * dy, x * dy - y * dx
    squared = radius * radius - across * across
    half = np.sqrt(max(squared, 0.0))
    enters = (squared >= 0.0) & (along + half > 0.0)
    return max(along - half, 0.0) if enters else np.inf, along + half if enters else np.inf


@called_with("f2 f f f")
@_compile
def within(circles: FloatArray, x: float, y: float, distance: float) -> Any:
    """Indices of the circles (m, 3), x, y and radius, within a distance of a place, and these."""
    found, count = np.empty(circles.shape[0], dtype=np.int64), 0
    for k in range(circles.shape[0]):
        found[count] = k
        count += comes_within(circles[k], x, y, distance)
    near = np.empty((count, 3))
    for k in range(count):
        for part in range(3):
            near[k, part] = circles[found[k], part]
    return found[:count], near


@called_with("f2 f1 f f f2 f2 f1")
@_compile
def crossings(
    circles: FloatArray,
    pose: FloatArray,
    position_std: float,
    yaw_std: float,
    origins: FloatArray,
    directions: FloatArray,
    level: FloatArray,
) -> Any:
    """Ranges (2, m, n) at which each beam enters and leaves each circle (m, 3); inf where it misses it.

    Beams have ``origins`` (n, 3) in the frame of the robot at a ``pose`` (3,), ``directions`` (n,
    2) seen from above, and a share ``level`` (n,) of their ranges. The circles are widened by the
    robot's uncertainty.
    """
    out = np.empty((2, circles.shape[0], origins.shape[0]))
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(circles.shape[0]):
        x, y, radius = seen_from(circles[k], pose[0], pose[1], cos, sin, position_std, yaw_std)
        for i in range(origins.shape[0]):
            to_x, to_y = x - origins[i, 0], y - origins[i, 1]
            entered, left = crossing(to_x, to_y, radius, directions[i, 0], directions[i, 1])
            out[0, k, i], out[1, k, i] = entered / level[i], left / level[i]
    return out


@called_with("f2 f f f f2 b1")
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
        if not comes_within(circles[k], x, y, distance):
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


@called_with("f2 f1 f f f f2 f2 f1 b1 f1")
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
) -> Any:
    """Indices of circles (m, 3) that beams enter before the walls, as far as these are known.

    Of the circles those within a ``distance``, of the beams those chosen, ``beams`` (n,), which
    meet the ``walls`` (k,). For other arguments see ``entries``.
    """
    found, count = np.empty(circles.shape[0], dtype=np.int64), 0
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(circles.shape[0]):
        if not comes_within(circles[k], pose[0], pose[1], distance):
            continue
        x, y, radius = seen_from(circles[k], pose[0], pose[1], cos, sin, position_std, yaw_std)
        chosen = 0
        for i in range(beams.shape[0]):
            if not beams[i]:
                continue
            to_x, to_y = x - origins[i, 0], y - origins[i, 1]
            entered, _ = crossing(to_x, to_y, radius, directions[i, 0], directions[i, 1])
            if entered / level[i] < walls[chosen] + SPREAD_SIGMAS * position_std:
                found[count] = k
                count += 1
                break
            chosen += 1
    return found[:count]


@called_with("b1 i")
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
