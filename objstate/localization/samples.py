"""Compiled operations of Monte Carlo localization on all samples of a belief."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray, IntArray
from objstate.linear import wrapped

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def _mean(poses: FloatArray, weights: FloatArray, mean: FloatArray) -> None:
    """The ``mean`` (3,) of poses (n, 3) with weights (n,); the yaw's is circular."""
    x, y, east, north = 0.0, 0.0, 0.0, 0.0
    for p in range(poses.shape[0]):
        x += weights[p] * poses[p, 0]
        y += weights[p] * poses[p, 1]
        east += weights[p] * np.cos(poses[p, 2])
        north += weights[p] * np.sin(poses[p, 2])
    mean[0], mean[1], mean[2] = x, y, np.arctan2(north, east)


@called_with("f2 f1 f1 f2")
@_compile
def moments(
    poses: FloatArray, weights: FloatArray, mean: FloatArray, covariance: FloatArray
) -> None:
    """The ``mean`` (3,) and ``covariance`` (3, 3) of poses (n, 3) with weights (n,)."""
    off = np.empty(3)
    _mean(poses, weights, mean)
    for row in range(3):
        for column in range(3):
            covariance[row, column] = 0.0
    for p in range(poses.shape[0]):
        off[0], off[1] = poses[p, 0] - mean[0], poses[p, 1] - mean[1]
        off[2] = wrapped(poses[p, 2] - mean[2])
        for row in range(3):
            for column in range(row + 1):
                covariance[row, column] += weights[p] * off[row] * off[column]
    for row in range(3):
        for column in range(row):
            covariance[column, row] = covariance[row, column]


@called_with("f2 f f f f f f2 f2")
@_compile
def moved(
    poses: FloatArray,
    length: float,
    bearing: float,
    turn: float,
    length_std: float,
    half_turn_std: float,
    noise: FloatArray,
    out: FloatArray,
) -> None:
    """Poses ``out`` (n, 3) after a step of some m towards a bearing and a turn; see ``motion``.

    ``noise`` (3, n), in standard deviations, is that of the half turn before, of the half turn
    after, and of the length.
    """
    for p in range(poses.shape[0]):
        heading = poses[p, 2] + half_turn_std * noise[0, p]
        driven = length + length_std * noise[2, p]
        out[p, 0] = poses[p, 0] + driven * np.cos(heading + bearing)
        out[p, 1] = poses[p, 1] + driven * np.sin(heading + bearing)
        out[p, 2] = wrapped(heading + (turn + half_turn_std * noise[1, p]))


@called_with("f2 f1")
@_compile
def cells(poses: FloatArray, sides: FloatArray) -> Any:
    """Numbers (n,) that identify the grid cells in which poses (n, 3) lie.

    The cells have the ``sides`` (3,), and the poses' mean lies in the middle of one.
    """
    count = poses.shape[0]
    evenly, places, first, last = np.empty(count), np.empty((count, 3)), np.empty(3), np.empty(3)
    for p in range(count):
        evenly[p] = 1.0 / count
    for axis in range(3):
        first[axis], last[axis] = 0.0, 0.0
    mean = np.empty(3)
    _mean(poses, evenly, mean)
    for p in range(count):
        places[p, 0] = np.rint((poses[p, 0] - mean[0]) / sides[0])
        places[p, 1] = np.rint((poses[p, 1] - mean[1]) / sides[1])
        places[p, 2] = np.rint(wrapped(poses[p, 2] - mean[2]) / sides[2])
        for axis in range(3):
            first[axis] = min(first[axis], places[p, axis])
            last[axis] = max(last[axis], places[p, axis])
    numbers = np.empty(count, dtype=np.int64)
    columns, rows = last[0] - first[0] + 1.0, last[1] - first[1] + 1.0
    for p in range(count):
        layer = rows * (places[p, 2] - first[2])
        row = columns * (places[p, 1] - first[1] + layer)
        numbers[p] = np.int64(places[p, 0] - first[0] + row)
    return numbers


@_maker
def _narrow_root(root: FloatArray, width: float, sides: FloatArray) -> Any:
    """The root (3, 3) of a covariance times a width, limited to a cell of ``sides`` (3,)."""
    out, widest = np.empty((3, 3)), 1.0
    for axis in range(3):
        reach = 0.0
        for column in range(3):
            out[axis, column] = width * root[axis, column]
            reach += abs(out[axis, column])
        widest = max(widest, reach / sides[axis])
    for axis in range(3):
        for column in range(3):
            out[axis, column] /= widest
    return out


@called_with("f2 i1 f2 f2 f f1")
@_compile
def copies(
    poses: FloatArray,
    ancestors: IntArray,
    noise: FloatArray,
    root: FloatArray,
    width: float,
    sides: FloatArray,
) -> Any:
    """Copies (m, 3) of the poses (n, 3) that are ancestors (m,), spread by a kernel.

    The kernel has the covariance's ``root`` (3, 3) times ``width``, but is no wider than a cell of
    ``sides`` (3,). The noise (m, 3) is in standard deviations.
    """
    out, root = np.empty((ancestors.shape[0], 3)), _narrow_root(root, width, sides)
    for k in range(ancestors.shape[0]):
        for axis in range(3):
            out[k, axis] = poses[ancestors[k], axis]
            for column in range(3):
                out[k, axis] += root[axis, column] * noise[k, column]
        out[k, 2] = wrapped(out[k, 2])
    return out
