"""Loops over states x, y, yaw of furniture with equal headings; compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import TURN, BoolArray, FloatArray
from objstate.linear import wrapped

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_compile_nearest = njit(
    nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nnan", "nsz"}
)
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


# --- where samples are --------------------------------------------------------------


@_inner
def alike(state: FloatArray, yaw: float, order: int, centre: FloatArray) -> Any:
    """Of the states that look like one (3,), the one with the yaw nearest to another.

    By ``Symmetry``.
    """
    if order == 1:
        return state[0], state[1], state[2]
    part = TURN / order
    turn = -part * np.round(wrapped(state[2] - yaw) / part)
    c, s, to_c, to_s = (
        np.cos(state[2]),
        np.sin(state[2]),
        np.cos(state[2] + turn),
        np.sin(state[2] + turn),
    )
    x = state[0] + (c - to_c) * centre[0] - (s - to_s) * centre[1]
    y = state[1] + (s - to_s) * centre[0] + (c - to_c) * centre[1]
    return x, y, wrapped(state[2] + turn)


@called_with("f2 f1 f i f1 f1 f1")
@_compile
def moments(
    states: FloatArray,
    weights: FloatArray,
    home: float,
    order: int,
    centre: FloatArray,
    mean: FloatArray,
    std: FloatArray,
) -> None:
    """Mean (3,) and standard deviations (3,) of states (n, 3), with equal headings folded.

    Their weights may have any sum. The yaw is a circular mean; of equal headings, the nearest to
    ``home`` rad counts.
    """
    total, east, north = 0.0, 0.0, 0.0
    for j in range(weights.shape[0]):
        turned = order * (states[j, 2] - home)
        total += weights[j]
        east += weights[j] * np.cos(turned)
        north += weights[j] * np.sin(turned)
    mean[0], mean[1] = 0.0, 0.0
    mean[2] = wrapped(home + np.arctan2(north, east) / order)
    for j in range(weights.shape[0]):
        x, y, _ = alike(states[j], mean[2], order, centre)
        mean[0] += weights[j] * x / total
        mean[1] += weights[j] * y / total
    std.fill(0.0)
    for j in range(weights.shape[0]):
        x, y, yaw = alike(states[j], mean[2], order, centre)
        std[0] += weights[j] * (x - mean[0]) ** 2 / total
        std[1] += weights[j] * (y - mean[1]) ** 2 / total
        std[2] += weights[j] * wrapped(yaw - mean[2]) ** 2 / total
    for axis in range(3):
        std[axis] = np.sqrt(std[axis])


@called_with("f2 f1 i f1 f2")
@_compile
def offsets(
    states: FloatArray, place: FloatArray, order: int, centre: FloatArray, out: FloatArray
) -> None:
    """From a place (3,) to states (n, 3), or to their nearest equal headings: ``out`` (n, 3)."""
    for j in range(states.shape[0]):
        x, y, yaw = alike(states[j], place[2], order, centre)
        out[j, 0], out[j, 1] = x - place[0], y - place[1]
        out[j, 2] = wrapped(yaw - place[2])


@called_with("f2 f2 f2 f b2")
@_compile_nearest
def lie_on(
    states: FloatArray, points: FloatArray, ends: FloatArray, within: float, out: BoolArray
) -> None:
    """Which ends of beams (m, 2) lie ``within`` m of an outline's points (q, 2): ``out`` (s, m).

    The outline stands in states (s, 3).
    """
    for k in range(states.shape[0]):
        cos, sin = np.cos(states[k, 2]), np.sin(states[k, 2])
        for i in range(ends.shape[0]):
            dx, dy = ends[i, 0] - states[k, 0], ends[i, 1] - states[k, 1]
            x, y, least = cos * dx + sin * dy, cos * dy - sin * dx, np.inf
            for q in range(points.shape[1]):
                least = min(least, (points[0, q] - x) ** 2 + (points[1, q] - y) ** 2)
            out[k, i] = least <= within * within
