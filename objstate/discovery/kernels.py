"""How likely beams are for a doorway with its leaf at many angles, compiled.

Beams (9, n) have the rows below. Only what they meet within a disc about the doorway counts: a
beam that passes the disc says no more than that, so nothing has to be known of what lies behind.
Within the disc, something may stand where the map knows nothing, from ``UNKNOWN`` m on.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import BoolArray, FloatArray, IntArray

ORIGIN_X, ORIGIN_Y, DIRECTION_X, DIRECTION_Y, RANGE, PAST, REACH, SHORT, UNKNOWN, _ROWS = range(10)
HIT, PER_SIGMA, PEAK, RANDOM, MISSING = range(5)  # of the beam model
LEAST_CROSS = 0.05  # sine of the incidence below which a beam doesn't tell of a surface
UNDRAWN = 0.5  # probability that something stands where the map knows nothing
LEAST_UNKNOWN = 2  # cells in a row: maps leave single ones out
SOFT = 0.03  # m over which a leaf's edges fade: a beam's width, and where the robot was

_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def density(beams: FloatArray, j: int, expected: float, model: FloatArray) -> Any:
    """Of beam ``j`` where something is expected at a distance; infinity where nothing is in the disc."""
    measured, past, unknown = beams[RANGE, j], beams[PAST, j], beams[UNKNOWN, j]
    drawn = 1.0 - UNDRAWN if unknown < expected else 1.0
    rest = model[RANDOM] * max(1.0 - past / beams[REACH, j], 0.0) + model[MISSING]
    if measured >= past:
        return rest + (drawn * model[HIT] if expected == np.inf else 0.0)
    floor = model[RANDOM] / beams[REACH, j] + (beams[SHORT, j] if measured < expected else 0.0)
    if unknown < measured and unknown < expected:
        floor += model[HIT] * UNDRAWN / (past - unknown)
    if expected == np.inf:
        return floor
    off = (measured - expected) * model[PER_SIGMA]
    return floor + drawn * model[PEAK] * np.exp(-0.5 * off * off)


@_compile
def enter_unknown(
    beams: FloatArray, known: BoolArray, corner: FloatArray, cells: float, out: FloatArray
) -> None:
    """Distance ``out`` (n,) from which on a map knows nothing; inf beyond the disc.

    ``known`` are its cells (rows, columns), ``corner`` (3,) its pose, ``cells`` how many a metre has.
    """
    cos, sin = np.cos(corner[2]) * cells, np.sin(corner[2]) * cells
    rows, columns = known.shape
    for j in range(beams.shape[1]):
        x, y = beams[ORIGIN_X, j] - corner[0], beams[ORIGIN_Y, j] - corner[1]
        dx, dy = beams[DIRECTION_X, j], beams[DIRECTION_Y, j]
        out[j] = np.inf
        blank = 0
        for step in range(int(beams[PAST, j] * cells)):
            way = step / cells
            px, py = x + way * dx, y + way * dy
            column, row = int(np.floor(px * cos + py * sin)), int(np.floor(py * cos - px * sin))
            inside = 0 <= row < rows and 0 <= column < columns
            blank = 0 if inside and known[row, column] else blank + 1
            if blank > LEAST_UNKNOWN:
                out[j] = way - LEAST_UNKNOWN / cells
                break


@_compile
def cast(beams: FloatArray, segments: FloatArray, out: FloatArray) -> None:
    """Distance ``out`` (n,) to the nearest of segments (k, 4), from x, y to x, y; inf beyond the disc."""
    for j in range(beams.shape[1]):
        ox, oy = beams[ORIGIN_X, j], beams[ORIGIN_Y, j]
        dx, dy = beams[DIRECTION_X, j], beams[DIRECTION_Y, j]
        nearest = np.inf
        for k in range(segments.shape[0]):
            ax, ay = segments[k, 0] - ox, segments[k, 1] - oy
            ux, uy = segments[k, 2] - segments[k, 0], segments[k, 3] - segments[k, 1]
            cross = dx * uy - dy * ux
            if abs(cross) < 1e-12:
                continue
            along = (ax * uy - ay * ux) / cross
            share = (ax * dy - ay * dx) / cross
            if 0.0 <= share <= 1.0 and 0.0 < along < nearest:
                nearest = along
        out[j] = nearest if nearest < beams[PAST, j] else np.inf


@_compile
def background_log_likelihood(
    beams: FloatArray, expected: FloatArray, group: IntArray, model: FloatArray, out: FloatArray
) -> None:
    """Sum into ``out`` (groups,) the log-densities of beams for what is expected (n,)."""
    for j in range(beams.shape[1]):
        out[group[j]] += np.log(density(beams, j, expected[j], model))


@_compile
def leaf_gain(
    beams: FloatArray,
    expected: FloatArray,
    group: IntArray,
    leaves: FloatArray,
    half: float,
    model: FloatArray,
    out: FloatArray,
) -> None:
    """By how much a leaf makes the beams of each group likelier: ``out`` (leaves, groups), to be zero.

    ``leaves`` (m, 4) are its hinge, bearing and width; it is ``half`` m thick to either side.
    Without it (n,) is ``expected``.
    """
    count = leaves.shape[0]
    along_x, along_y = np.cos(leaves[:, 2]), np.sin(leaves[:, 2])
    for j in range(beams.shape[1]):
        ox, oy = beams[ORIGIN_X, j], beams[ORIGIN_Y, j]
        dx, dy = beams[DIRECTION_X, j], beams[DIRECTION_Y, j]
        nearest = min(expected[j], beams[PAST, j])
        without = -1.0
        for m in range(count):
            ux, uy = along_x[m], along_y[m]
            ax, ay = leaves[m, 0] - ox, leaves[m, 1] - oy
            aside, width = ax * dy - ay * dx, leaves[m, 3]
            if abs(aside) > width + SOFT:
                continue
            cross = dx * uy - dy * ux
            if abs(cross) < LEAST_CROSS:
                continue
            place = aside / cross
            met = min(place, width - place) * abs(cross) / SOFT + 0.5
            if met <= 0.0:
                continue
            along = (ax * uy - ay * ux) / cross - half / abs(cross)
            if along <= 0.0 or along >= nearest:
                continue
            met = min(met, 1.0)
            if without < 0.0:
                without = density(beams, j, expected[j], model)
            there = density(beams, j, along, model)
            out[m, group[j]] += np.log(met * there / without + 1.0 - met)


@_compile
def nearest_line(
    ends: FloatArray,
    directions: FloatArray,
    lines: FloatArray,
    near: float,
    steep: float,
    of: IntArray,
    aside: FloatArray,
) -> None:
    """The nearest line within ``near`` m of where beams end that meet it steeply; ``of`` (n,) else stays.

    ``ends`` (n, 2) and ``directions`` (n, 2) are of beams, ``lines`` (k, 5) start, unit vector and
    length; ``aside`` (n,) gets how far to the line's left a beam ends, m.
    """
    for j in range(len(ends)):
        nearest = near
        for k in range(len(lines)):
            x, y = ends[j, 0] - lines[k, 0], ends[j, 1] - lines[k, 1]
            ux, uy, length = lines[k, 2], lines[k, 3], lines[k, 4]
            off = ux * y - uy * x
            if not abs(off) < nearest:
                continue
            place = ux * x + uy * y
            if not 0.0 < place < length:
                continue
            if abs(ux * directions[j, 1] - uy * directions[j, 0]) <= steep:
                continue
            nearest, of[j], aside[j] = abs(off), k, off
