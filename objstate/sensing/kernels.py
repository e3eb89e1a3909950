"""The loops over robot samples, states, segments and beams, compiled.

Everything here is level: a laser that sweeps a horizontal plane sees walls and
objects as outlines, lists of segments. A segment is projected onto the range of
beams that it covers, and each of those keeps the nearest hit. Beams are sorted
by bearing in the robot's frame and may each have an origin of their own.

Rays are given as columns of one array, so that a kernel takes few arguments:
``beams`` (n, 6): bearing, direction x and y, origin x and y relative to the
sweep's centre, measured range. ``sweep`` (3,): centre x and y in the robot's
frame, and the largest distance of an origin from it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from objstate.geometry import BoolArray, FloatArray

BEARING, DIRECTION_X, DIRECTION_Y, ORIGIN_X, ORIGIN_Y, MEASURED = range(6)
CENTRE_X, CENTRE_Y, SPREAD = range(3)
Z_HIT, Z_SHORT, Z_MAX, Z_RAND, SIGMA_HIT, LAMBDA_SHORT, RANGE_MAX, GAUSSIAN = range(8)

SLACK = 1e-9  # m or rad by which a beam may pass an end of a segment and still hit it
FAR_SIGMAS = 8.0  # beyond it the Gaussian is zero beside any share of random readings

_compile = njit(cache=True, nogil=True, error_model="numpy")


@_compile
def log_likelihood(measured: float, expected: float, model: FloatArray) -> Any:
    """log p(d | d-hat) of one beam: AMCL's four-part mixture, or the paper's Gaussian.

    A missing return (inf) is an event of its own, with a probability and no density.
    """
    range_max = model[RANGE_MAX]
    if model[GAUSSIAN] > 0.0:
        off = (min(measured, range_max) - min(expected, range_max)) / model[SIGMA_HIT]
        return -0.5 * off * off - np.log(model[SIGMA_HIT] * np.sqrt(2.0 * np.pi))
    if measured == np.inf:
        return np.log(model[Z_MAX] + (model[Z_HIT] if expected >= range_max else 0.0))
    p = model[Z_RAND] / range_max
    off = abs(measured - expected) / model[SIGMA_HIT]
    if off < FAR_SIGMAS:
        peak = model[Z_HIT] / (model[SIGMA_HIT] * np.sqrt(2.0 * np.pi))
        p += peak * np.exp(-0.5 * off * off)
    if measured < expected:
        p += model[Z_SHORT] * model[LAMBDA_SHORT] * np.exp(-model[LAMBDA_SHORT] * measured)
    return np.log(p)


@_compile
def log_likelihoods(
    measured: FloatArray, expected: FloatArray, model: FloatArray, out: FloatArray
) -> None:
    """log p(d_i | d-hat_i) of each beam: measured (n,), expected (m, n), out (m, n)."""
    for row in range(expected.shape[0]):
        for i in range(expected.shape[1]):
            out[row, i] = log_likelihood(measured[i], expected[row, i], model)


@_compile
def _first_at_or_after(bearing: float, beams: FloatArray) -> int:
    """Index of the first beam whose bearing is not below ``bearing``."""
    low, high = 0, beams.shape[0]
    while low < high:
        middle = (low + high) // 2
        if beams[middle, BEARING] < bearing:
            low = middle + 1
        else:
            high = middle
    return low


@_compile
def _hit(
    first: int,
    last: int,
    ax: float,
    ay: float,
    ex: float,
    ey: float,
    beams: FloatArray,
    nearest: FloatArray,
) -> None:
    """Let beams first..last keep the nearer of what they have and the segment from a along e."""
    slack = SLACK / (abs(ex) + abs(ey))
    for i in range(first, last):
        dx, dy = beams[i, DIRECTION_X], beams[i, DIRECTION_Y]
        turn = dx * ey - dy * ex
        fx, fy = ax - beams[i, ORIGIN_X], ay - beams[i, ORIGIN_Y]
        distance = (fx * ey - fy * ex) / turn
        along = (fx * dy - fy * dx) / turn
        if -slack <= along <= 1.0 + slack and 0.0 <= distance < nearest[i]:
            nearest[i] = distance


@_compile
def _project(
    ax: float,
    ay: float,
    bx: float,
    by: float,
    beams: FloatArray,
    spread: float,
    nearest: FloatArray,
) -> tuple[int, int]:
    """Project one segment, given relative to the sweep's centre; return the beams it may touch.

    The returned bounds (first, last) cover all touched beams; where the segment
    lies across the bearing of pi they are those of the whole sweep.
    """
    count = beams.shape[0]
    ex, ey = bx - ax, by - ay
    cross = ax * by - ay * bx
    length_squared = ex * ex + ey * ey
    if length_squared == 0.0:
        return count, 0
    along = min(max(-(ax * ex + ay * ey) / length_squared, 0.0), 1.0)
    gap = np.sqrt((ax + along * ex) ** 2 + (ay + along * ey) ** 2)
    if gap <= spread + SLACK:
        _hit(0, count, ax, ay, ex, ey, beams, nearest)
        return 0, count
    start, end = np.arctan2(ay, ax), np.arctan2(by, bx)
    if cross < 0.0:
        start, end = end, start
    margin = SLACK
    if spread > 0.0:  # origins off the centre see the ends at other bearings
        margin += np.arcsin(spread / gap)
    start, end = start - margin, end + margin
    if start < -np.pi or end > np.pi or end < start:
        if start < -np.pi:
            start += 2.0 * np.pi
        if end > np.pi:
            end -= 2.0 * np.pi
        _hit(_first_at_or_after(start, beams), count, ax, ay, ex, ey, beams, nearest)
        _hit(0, _first_at_or_after(end, beams), ax, ay, ex, ey, beams, nearest)
        return 0, count
    first, last = _first_at_or_after(start, beams), _first_at_or_after(end, beams)
    _hit(first, last, ax, ay, ex, ey, beams, nearest)
    return first, last


@_compile
def _project_outline(
    outline: FloatArray,
    cos: float,
    sin: float,
    x: float,
    y: float,
    beams: FloatArray,
    spread: float,
    nearest: FloatArray,
) -> tuple[int, int]:
    """Project an outline (k, 4) that is turned by an angle and moved; beams it may touch."""
    first, last = beams.shape[0], 0
    for k in range(outline.shape[0]):
        ax, ay, bx, by = outline[k, 0], outline[k, 1], outline[k, 2], outline[k, 3]
        begin, end = _project(
            x + cos * ax - sin * ay,
            y + sin * ax + cos * ay,
            x + cos * bx - sin * by,
            y + sin * bx + cos * by,
            beams,
            spread,
            nearest,
        )
        first, last = min(first, begin), max(last, end)
    return first, last


@_compile
def _into_sweep(
    pose: FloatArray, placement: FloatArray, sweep: FloatArray
) -> tuple[float, float, float, float]:
    """Placement (x, y, yaw) in the building seen from the sweep's centre: cos, sin, x, y."""
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    dx, dy = placement[0] - pose[0], placement[1] - pose[1]
    turn = placement[2] - pose[2]
    return (
        np.cos(turn),
        np.sin(turn),
        cos * dx + sin * dy - sweep[CENTRE_X],
        -sin * dx + cos * dy - sweep[CENTRE_Y],
    )


@_compile
def cast(
    poses: FloatArray,
    placements: FloatArray,
    outline: FloatArray,
    beams: FloatArray,
    sweep: FloatArray,
    out: FloatArray,
) -> None:
    """Ranges ``out`` (p, s, n) from poses (p, 3) to an outline (k, 4) in placements (s, 3).

    Each beam keeps what ``out`` held where that is nearer.
    """
    for p in range(poses.shape[0]):
        for s in range(placements.shape[0]):
            cos, sin, x, y = _into_sweep(poses[p], placements[s], sweep)
            _project_outline(outline, cos, sin, x, y, beams, sweep[SPREAD], out[p, s])


@_compile
def object_log_likelihood(
    poses: FloatArray,
    placements: FloatArray,
    outline: FloatArray,
    background: FloatArray,
    beams: FloatArray,
    sweep: FloatArray,
    model: FloatArray,
    out: FloatArray,
    bears: BoolArray,
) -> None:
    """Change in log p(o | s, l) that an object makes, over the background alone: ``out`` (p, s).

    ``background`` (p, n) is what the beams read without the object. Beams that it
    doesn't touch contribute the same to every state (section 3 of Schulz and
    Burgard 2001) and are left out. ``bears`` (n,) is set where a beam touches the
    object in some state and isn't stopped before reaching it.
    """
    count = beams.shape[0]
    nearest = np.full(count, np.inf)
    without = np.empty(count)
    near = FAR_SIGMAS / 2.0 * model[SIGMA_HIT]
    for p in range(poses.shape[0]):
        without[:] = np.nan
        for s in range(placements.shape[0]):
            cos, sin, x, y = _into_sweep(poses[p], placements[s], sweep)
            first, last = _project_outline(outline, cos, sin, x, y, beams, sweep[SPREAD], nearest)
            change = 0.0
            for i in range(first, last):
                expected = nearest[i]
                nearest[i] = np.inf
                if expected >= background[p, i] or expected >= model[RANGE_MAX]:
                    continue
                measured = beams[i, MEASURED]
                if np.isnan(without[i]):
                    without[i] = log_likelihood(measured, background[p, i], model)
                change += log_likelihood(measured, expected, model) - without[i]
                bears[i] |= measured > expected - near
            out[p, s] = change


@_compile
def mix_object(
    poses: FloatArray,
    placements: FloatArray,
    shares: FloatArray,
    outline: FloatArray,
    background: FloatArray,
    beams: FloatArray,
    sweep: FloatArray,
    model: FloatArray,
    likelihood: FloatArray,
) -> None:
    """Average the likelihood (p, n) of each beam over an object's uncertain placement.

    ``shares`` (s,) are the weights of ``placements`` (s, 3). Where the object in a
    placement is nearer than the background (p, n), it is what the beam should
    read; else the beam keeps the likelihood it had.
    """
    count = beams.shape[0]
    nearest = np.full(count, np.inf)
    mixed = np.empty(count)
    kept = np.empty(count)
    for p in range(poses.shape[0]):
        mixed[:] = 0.0
        kept[:] = 1.0
        touched_first, touched_last = count, 0
        for s in range(placements.shape[0]):
            cos, sin, x, y = _into_sweep(poses[p], placements[s], sweep)
            first, last = _project_outline(outline, cos, sin, x, y, beams, sweep[SPREAD], nearest)
            for i in range(first, last):
                expected = nearest[i]
                nearest[i] = np.inf
                if expected < background[p, i]:
                    mixed[i] += shares[s] * np.exp(
                        log_likelihood(beams[i, MEASURED], expected, model)
                    )
                    kept[i] -= shares[s]
            touched_first, touched_last = min(touched_first, first), max(touched_last, last)
        for i in range(touched_first, touched_last):
            likelihood[p, i] = max(kept[i], 0.0) * likelihood[p, i] + mixed[i]
