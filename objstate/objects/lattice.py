"""The loops of the lattice filter over robot samples and states, compiled."""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray, IntArray
from objstate.linear import wrapped

LEAST_EVIDENCE = 1e-250
TAIL_SIGMAS = 4.0  # deviations at which a Gaussian is cut off
MOST_DECAY = 600.0  # largest exponent; exp(-600) doesn't underflow
TINY = 2.3e-308  # the least deviation, against division by zero
LEAST_ENDS = 1e-9  # expected number of ends below which a move doesn't end
# of a swing: s until it ends and until it leaves, cells a second
ENDS_S, LEAVES_S, MOST_CELLS = range(3)

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})
_compile_sums = njit(nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})


@_maker
def _taps(variance: float, most: int) -> Any:
    """The kernel of a random walk with a variance in cells squared, by distance in cells.

    The variance is met exactly: below 1 by steps to the neighbours, otherwise by a Gaussian.
    """
    reach = 1 if variance < 1.0 else min(int(np.ceil(TAIL_SIGMAS * np.sqrt(variance))), most)
    taps, total = np.empty(reach + 1), 0.0
    if variance < 1.0:
        taps[0], taps[1] = 1.0 - variance, variance / 2.0
        return taps
    for k in range(reach + 1):
        taps[k] = np.exp(-0.5 * k * k / variance)
        total += taps[k] if k == 0 else 2.0 * taps[k]
    for k in range(reach + 1):  # dividing the array takes longer to compile
        taps[k] /= total
    return taps


@_inner
def _pad(row: FloatArray, reach: int, wraps: bool, padded: FloatArray) -> None:
    """Fill ``padded`` (n + 2 reach,) with a ``row`` (n,), reflected or wrapped at its ends."""
    last = row.shape[0] - 1
    for j in range(last + 1):
        padded[reach + j] = row[j]
    for k in range(reach):
        padded[reach - 1 - k] = row[last - k] if wraps else row[k]
        padded[reach + last + 1 + k] = row[k] if wraps else row[last - k]


@_inner
def _walked(
    row: FloatArray,
    taps: FloatArray,
    wraps: bool,
    besides: FloatArray,
    padded: FloatArray,
    to: FloatArray,
) -> None:
    """Weights ``to`` (n,) after a random walk of a ``row`` (n,) by ``taps`` (r + 1,).

    Others ``besides`` (n,) are added. At the ends the walk is reflected, or wrapped where the
    lattice ``wraps``. ``padded`` (n + 2 r,) is overwritten.
    """
    last, reach = row.shape[0] - 1, taps.shape[0] - 1
    if reach == 1:
        here, beside = taps[0], taps[1]
        for j in range(1, last):
            to[j] = here * row[j] + beside * (row[j - 1] + row[j + 1]) + besides[j]
        below, above = (row[last], row[0]) if wraps else (row[0], row[last])
        to[0] = here * row[0] + beside * (below + row[1]) + besides[0]
        to[last] = here * row[last] + beside * (row[last - 1] + above) + besides[last]
        return
    _pad(row, reach, wraps, padded)
    for j in range(last + 1):
        to[j] = taps[0] * row[j] + besides[j]
    for k in range(1, reach + 1):
        for j in range(last + 1):
            to[j] += taps[k] * (padded[reach + j - k] + padded[reach + j + k])


@_inner
def _clear(weights: FloatArray) -> None:
    """Set weights (n,) to zero; ``fill`` takes longer to compile."""
    for j in range(weights.shape[0]):
        weights[j] = 0.0


@_inner
def _normalize(weights: FloatArray) -> None:
    """Normalize weights (n,)."""
    total = 0.0
    for j in range(weights.shape[0]):
        total += weights[j]
    for j in range(weights.shape[0]):
        weights[j] /= total


@_inner
def _off(j: int, mean: float, first: float, cell: float, wraps: bool) -> Any:
    """The distance of a lattice's state ``j`` from the mean; of directions the shorter way."""
    off = first + cell * j - mean
    return wrapped(off) if wraps else off


@_inner
def _moments(weights: FloatArray, first: float, cell: float, wraps: bool) -> Any:
    """Mean and standard deviation of a lattice with weights (n,), each spread over its cell.

    The states are a ``cell`` apart, starting at ``first``; directions where the lattice ``wraps``.
    """
    mean, variance, east, north = 0.0, 0.0, 0.0, 0.0
    for j in range(weights.shape[0]):
        mean += weights[j] * j
    mean = first + cell * mean
    if wraps:
        for j in range(weights.shape[0]):
            east += weights[j] * np.cos(first + cell * j)
            north += weights[j] * np.sin(first + cell * j)
        mean = np.arctan2(north, east)
    for j in range(weights.shape[0]):
        off = _off(j, mean, first, cell, wraps)
        variance += weights[j] * off * off
    return mean, np.sqrt(variance + cell * cell / 12.0)


@called_with("f1 f f b")
@_compile
def moments(weights: FloatArray, first: float, cell: float, wraps: bool) -> Any:
    """``_moments``, for Python."""
    return _moments(weights, first, cell, wraps)


@_maker
def _moved(
    weights: FloatArray,
    p_moving: FloatArray,
    begun: float,
    seconds: float,
    swing: FloatArray,
    rest: FloatArray,
    wraps: bool,
    later: FloatArray,
    going: FloatArray,
) -> Any:
    """Prediction of the moving part of a lattice's ``weights`` (n,); its weight is returned.

    Moving are a share ``p_moving`` (n,) or (1,), and of the others a share that has ``begun`` at any
    moment. By its ``swing`` (3,), a door comes to rest at one rate, and reaches the distribution
    ``rest`` (n,) at another. Until then it moves by at most 1, 2, 4, ... cells, up to a reach, with
    equal probabilities: doors are thrown and led slowly. At the limits that is reflected, or
    wrapped where the lattice ``wraps``. ``later`` (n,) is the result, and ``going`` (n,) its part
    that still moves.
    """
    count, orders, most = weights.shape[0], 0, 1
    ends, leaves = max(seconds / swing[ENDS_S], LEAST_ENDS), seconds / swing[LEAVES_S]
    near_s = -np.expm1(-ends - leaves) / (ends + leaves) * seconds  # mean duration
    reach = min(int(np.ceil(swing[MOST_CELLS] * near_s)), count)
    padded, below = np.empty(count + 2 * reach), np.zeros(count + 2 * reach + 1)
    sums, goes_on, nears, near_on = np.zeros(2), np.empty(2), np.empty(2), np.empty(2)
    either = ends + leaves
    goes_on[0], near_on[0] = np.exp(-ends), np.exp(-either)
    goes_on[1], near_on[1] = (1.0 - goes_on[0]) / ends, (1.0 - near_on[0]) / either
    stayed, ended = 1.0 - begun, ends / either
    never_left = stayed ** (1.0 - ended)  # including further moves
    nears[0] = near_on[0] + (1.0 - near_on[0]) * ended * never_left
    ended = (never_left - stayed) / begun if begun > 0.0 else ended
    nears[1] = near_on[1] + (1.0 - near_on[1]) * ended
    for j in range(count):
        share = p_moving[min(j, p_moving.shape[0] - 1)]
        before, since = weights[j] * share, weights[j] * (1.0 - share) * begun
        later[j] = nears[0] * before + nears[1] * since
        sums[0] += before
        sums[1] += since
    near = nears[0] * sums[0] + nears[1] * sums[1]
    on = near_on[0] * sums[0] + near_on[1] * sums[1]
    gone, share_on = sums[0] + sums[1], on / max(near, TINY)
    far = max(gone - near, 0.0)
    far_on = max(goes_on[0] * sums[0] + goes_on[1] * sums[1] - on, 0.0)
    _pad(later, reach, wraps, padded)
    for j in range(padded.shape[0]):
        below[j + 1] = below[j] + padded[j]
    _clear(later)
    while most <= reach:
        orders, most = orders + 1, 2 * most
    for order in range(orders):
        most = 2**order
        share = 1.0 / (orders * (2 * most + 1))
        for j in range(count):
            within = below[reach + j + most + 1] - below[reach + j - most]
            later[j] += share * max(within, 0.0)
    for j in range(count):
        going[j] = share_on * later[j] + far_on * rest[j]
        later[j] += far * rest[j]
    return gone


@called_with("f1 f1 f f b f f f f1 f1 f1 f1")
@_compile
def predict(
    weights: FloatArray,
    p_moving: FloatArray,
    first: float,
    cell: float,
    wraps: bool,
    variance: float,
    begun: float,
    seconds: float,
    swing: FloatArray,
    rest: FloatArray,
    later: FloatArray,
    p_moving_later: FloatArray,
) -> Any:
    """Prediction of a lattice's ``weights`` (n,), into ``later`` (n,).

    The resting part, in each state all but a share ``p_moving`` (n,) or (1,), that hasn't ``begun`` to
    move, takes a random walk with a ``variance`` in cells squared, except at the limits: a latched
    door stands still. The rest moves as in ``_moved``, and of each state a share ``p_moving_later``
    (n,) still does. Mean and deviation are returned; the lattice is as in ``_moments``.
    """
    count, total = weights.shape[0], 0.0
    taps = _taps(variance, count)
    moved, padded, stays = np.empty(count), np.empty(count + 2 * taps.shape[0]), np.empty(count)
    gone = _moved(weights, p_moving, begun, seconds, swing, rest, wraps, moved, p_moving_later)
    for j in range(count):
        stays[j] = weights[j] * (1.0 - p_moving[min(j, p_moving.shape[0] - 1)])
        total += stays[j]
    left = (1.0 - min(gone, 1.0)) / max(total, TINY)
    for k in range(taps.shape[0]):
        taps[k] *= left
    if not wraps:
        for limit in (0, count - 1):
            moved[limit] += left * stays[limit]
            stays[limit] = 0.0
    _walked(stays, taps, wraps, moved, padded, later)
    _normalize(later)
    for j in range(count):
        p_moving_later[j] /= max(later[j], TINY)
    return _moments(later, first, cell, wraps)


@_inner
def _decay(exponent: float) -> Any:
    """exp(-exponent) of a non-negative number by squaring, so that several are computed at a time.

    The relative error is below 1e-9 up to 30, and 1e-4 at 200; from ``MOST_DECAY`` on it is
    constant.
    """
    part = min(exponent, MOST_DECAY) / 1024.0
    higher = 1.0 / 24.0 - part * (1.0 / 120.0)
    value = 1.0 + part * (-1.0 + part * (0.5 + part * (-1.0 / 6.0 + part * higher)))
    for _ in range(10):
        value *= value
    return value


@_inner
def _lay(chosen: IntArray, values: FloatArray, to: FloatArray) -> None:
    """Interpolate ``to`` (n,) between ``values`` (k,) at ascending places ``chosen`` (k,)."""
    for k in range(chosen.shape[0] - 1):
        begin, left = chosen[k], values[k]
        slope = (values[k + 1] - left) / (chosen[k + 1] - begin)
        for j in range(chosen[k + 1] - begin):
            to[begin + j] = left + slope * j
    to[chosen[-1]] = values[-1]


@called_with("f1 i1 f2 f1 f f b f1 f1")
@_compile_sums
def condition(
    prior: FloatArray,
    chosen: IntArray,
    log_likelihood: FloatArray,
    robot: FloatArray,
    first: float,
    cell: float,
    wraps: bool,
    evidence: FloatArray,
    weights: FloatArray,
) -> Any:
    """Bayes' rule for a ``prior`` (n,) by each robot sample, and its log ``evidence`` (p,).

    ``log_likelihood`` (p, k) is known at the ascending states ``chosen`` (k,), the first and the
    last among them; between them the likelihood is interpolated. The marginal ``weights`` (n,) are
    those over robot samples that count by ``robot`` (p,); their mean and deviation are returned.
    The lattice is as in ``_moments``.
    """
    last, count = chosen.shape[0], prior.shape[0]
    likelihood, row = np.empty(last), np.empty(count)
    _clear(weights)
    for p in range(robot.shape[0]):
        top, total = -np.inf, 0.0
        for k in range(last):
            top = max(top, log_likelihood[p, k])
        for k in range(last):
            likelihood[k] = _decay(top - log_likelihood[p, k])
        _lay(chosen, likelihood, row)
        for j in range(count):
            row[j] *= prior[j]
            total += row[j]
        if total < LEAST_EVIDENCE:  # the pose is wrong, not the states
            evidence[p] = top + np.log(LEAST_EVIDENCE)
            for j in range(count):  # assigning a slice costs seconds of compiling
                row[j] = prior[j]
            total = 1.0
        else:
            evidence[p] = top + np.log(total)
        for j in range(count):
            weights[j] += robot[p] / total * row[j]
    _normalize(weights)
    return _moments(weights, first, cell, wraps)


@_inner
def _quantile(weights: FloatArray, first: float, cell: float, share: float) -> Any:
    """The state below which a share of a lattice's weight lies, spread over the cells."""
    before, last = 0.0, weights.shape[0] - 1
    for j in range(last + 1):
        if before + weights[j] >= share and weights[j] > 0.0:
            return first + cell * (j + (share - before) / weights[j] - 0.5)
        before += weights[j]
    return first + cell * (last + 0.5)


@_inner
def _interval(weights: FloatArray, first: float, cell: float, tail: float) -> Any:
    """The states below which a ``tail`` of a lattice's weight (n,) lies, and all but a tail."""
    lower = _quantile(weights, first, cell, tail)
    return lower, _quantile(weights, first, cell, 1.0 - tail)


@called_with("f1 f f f")
@_compile
def interval(weights: FloatArray, first: float, cell: float, tail: float) -> Any:
    """``_interval``, for Python."""
    return _interval(weights, first, cell, tail)


@called_with("f1 f i i")
@_compile
def worth_casting(weights: FloatArray, negligible: float, fine: int, coarse: int) -> Any:
    """Indices (m,) of the states to cast, by their weights (n,).

    Those with more than a ``negligible`` share of the largest weight, or a regular selection of at
    most ``fine`` of them; every ``coarse`` one of the others; the first and the last.
    """
    least, heavy, passed, count = 0.0, 0, 0, 0
    last = weights.shape[0] - 1
    chosen = np.empty(last + 1, dtype=np.int64)
    for j in range(last + 1):
        least = max(least, negligible * weights[j])
    for j in range(last + 1):
        heavy += weights[j] > least
    every = (heavy + fine - 1) // fine
    for j in range(last + 1):
        is_heavy = weights[j] > least
        passed += is_heavy
        is_next = passed % every == 0 if is_heavy else j % coarse == 0
        if is_next or j in (0, last):
            chosen[count] = j
            count += 1
    return chosen[:count]
