"""Which beams may reach which objects, and how the walls explain what they read; compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import BoolArray, FloatArray

SPREAD_SIGMAS = 3.0  # how far samples of a belief stray from its mean

_compile = njit(nogil=True, error_model="numpy")
_inner = inner(nogil=True, error_model="numpy")


@_inner
def _comes_within(circle: FloatArray, x: float, y: float, distance: float) -> Any:
    """Whether a circle (3,) comes within a distance of a place."""
    east, north, reach = circle[0] - x, circle[1] - y, circle[2] + distance
    return east * east + north * north <= reach * reach


@_compile
def within(circles: FloatArray, x: float, y: float, distance: float) -> Any:
    """Which of the circles (m, 3), x, y and radius, come within a distance of a place: their numbers, and they themselves."""
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
    """Range (m, n) at which each beam enters each circle (m, 3); inf where it passes by.

    Beams have ``origins`` (n, 3) in the frame of the robot at a ``pose`` (3,), ``directions`` (n, 2) seen from
    above, and a share ``level`` (n,) of their ranges. The circles are widened by what the robot may be off.
    """
    out = np.empty((circles.shape[0], origins.shape[0]))
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for k in range(circles.shape[0]):
        east, north = circles[k, 0] - pose[0], circles[k, 1] - pose[1]
        x, y = cos * east + sin * north, cos * north - sin * east
        strayed = SPREAD_SIGMAS * (position_std + yaw_std * np.hypot(x, y))
        radius = circles[k, 2] + strayed
        for i in range(origins.shape[0]):
            to_x, to_y = x - origins[i, 0], y - origins[i, 1]
            along = to_x * directions[i, 0] + to_y * directions[i, 1]
            aside = to_x * directions[i, 1] - to_y * directions[i, 0]
            squared = radius * radius - aside * aside
            half = np.sqrt(max(squared, 0.0))
            enters = (squared >= 0.0) & (along + half > 0.0)
            out[k, i] = max(along - half, 0.0) / level[i] if enters else np.inf
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
    """Which of the circles (m, 3) come within a distance of a place, which of these are entered, and by which beams.

    The first two are numbers; of the beams (n,), those count that are chosen and enter one of the circles, at ranges (m, n).
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
def reached(entered: FloatArray, beams: BoolArray, walls: FloatArray, margin: float) -> Any:
    """Which objects, by number, some of the beams (n,) enter before they are a margin, m, past the walls (n,).

    They are entered at ranges (m, n) m.
    """
    found, count = np.empty(entered.shape[0], dtype=np.int64), 0
    for k in range(entered.shape[0]):
        is_reached = False
        for i in range(beams.shape[0]):
            is_reached |= beams[i] & (entered[k, i] < walls[i] + margin)
        found[count] = k
        count += is_reached
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
