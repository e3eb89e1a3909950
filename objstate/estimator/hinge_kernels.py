"""How the readings about a door lie on its leaf, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import FloatArray

STOPPED = 0.15  # m short of a wall, by which something has stopped a beam
ASIDE = 0.15  # m from the leaf within which a reading may be one of it
BEYOND = 0.05  # m past the leaf's edges, likewise
POINTS = 5  # readings of the leaf that a line needs
SPAN = 0.25  # m along the leaf that they must cover
NEAR, FAR, RIGHT, LEFT = range(4)  # sides of a leaf: along from the hinge, and across

_compile = njit(nogil=True, error_model="numpy")
_inner = inner(nogil=True, error_model="numpy")


@_inner
def _from_swing(x: float, y: float, half: float, reach: float) -> Any:
    """Distance from a sector about the x axis, of so many rad to each side and a radius of ``reach`` m."""
    distance = np.hypot(x, y)
    beyond = max(abs(np.arctan2(y, x)) - half, 0.0)
    along = min(max(distance * np.cos(beyond), 0.0), reach)  # of the leaf in its nearest state
    return np.hypot(distance * np.cos(beyond) - along, distance * np.sin(beyond))


@_inner
def _line(lever: FloatArray, off: FloatArray, count: int) -> Any:
    """By how much a line through so many readings passes the hinge, and the deviation of that, m.

    They are ``off`` (n,) the leaf's side at levers (n,) along it.
    """
    middle, aside, squares, both, rest = 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(count):
        middle += lever[k] / count
        aside += off[k] / count
    for k in range(count):
        squares += (lever[k] - middle) ** 2
        both += (lever[k] - middle) * off[k]
    slope = both / squares
    aside -= slope * middle
    for k in range(count):
        rest += (off[k] - aside - slope * lever[k]) ** 2
    variance = rest / (count - 2) * (1.0 / count + middle * middle / squares)
    return aside, np.sqrt(variance)


@_compile
def look(
    ranges: FloatArray,
    walls: FloatArray,
    origins: FloatArray,
    directions: FloatArray,
    pose: FloatArray,
    hinge: FloatArray,
    outwards: FloatArray,
    half: float,
    reach: float,
    most: float,
    angle: float,
    joint: FloatArray,
    turns: FloatArray,
    sides: FloatArray,
) -> Any:
    """What stopped beams (n,) short of the ``walls`` (n,) within ``most`` m of a door's swing, against its leaf.

    Beams begin at ``origins`` (n, 3) with ``directions`` (n, 3) from a robot at a pose (3,). The swing is a sector about
    the ``hinge`` (2,), ``half`` to each side of the first column of ``outwards`` (2, 2), up to ``reach`` m. The leaf
    is open by an ``angle`` about its ``joint`` (2,): its directions along and across are the columns of the first of ``turns`` (3, 2, 2),
    and of the others as much as the angle's sine and cosine say. ``sides`` (4,) are where it ends. There come back how many beams that were and how many of them the leaf didn't stop; m by which
    a line through the others passes the hinge, its deviation, and m along the leaf that they cover.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    by_sin, by_cos = np.sin(angle), np.cos(angle)
    along_x = turns[0, 0, 0] + by_sin * turns[1, 0, 0] + by_cos * turns[2, 0, 0]
    along_y = turns[0, 1, 0] + by_sin * turns[1, 1, 0] + by_cos * turns[2, 1, 0]
    across_x = turns[0, 0, 1] + by_sin * turns[1, 0, 1] + by_cos * turns[2, 0, 1]
    across_y = turns[0, 1, 1] + by_sin * turns[1, 1, 1] + by_cos * turns[2, 1, 1]
    eye = (pose[0] - joint[0]) * across_x + (pose[1] - joint[1]) * across_y
    side = sides[LEFT] if eye > (sides[RIGHT] + sides[LEFT]) / 2.0 else sides[RIGHT]
    lever, off = np.empty(ranges.shape[0]), np.empty(ranges.shape[0])
    stopped, on, least, largest = 0, 0, np.inf, -np.inf
    for i in range(ranges.shape[0]):
        if not ranges[i] < walls[i] - STOPPED:
            continue
        x = origins[i, 0] + ranges[i] * directions[i, 0]
        y = origins[i, 1] + ranges[i] * directions[i, 1]
        x, y = pose[0] + cos * x - sin * y, pose[1] + sin * x + cos * y
        east, north = x - hinge[0], y - hinge[1]
        ahead = east * outwards[0, 0] + north * outwards[1, 0]
        aside = east * outwards[0, 1] + north * outwards[1, 1]
        if _from_swing(ahead, aside, half, reach) > most:
            continue
        stopped += 1
        east, north = x - joint[0], y - joint[1]
        lever[on] = east * along_x + north * along_y
        off[on] = east * across_x + north * across_y - side
        is_within = sides[NEAR] - BEYOND <= lever[on] <= sides[FAR] + BEYOND
        if abs(off[on]) <= ASIDE and is_within:
            least, largest = min(least, lever[on]), max(largest, lever[on])
            on += 1
    if on < POINTS or largest - least < SPAN:
        return stopped, stopped - on if stopped >= POINTS else 0, 0.0, np.inf, 0.0
    aside, std = _line(lever, off, on)
    return stopped, stopped - on, aside, std, largest - least
