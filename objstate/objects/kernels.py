"""The loops of the lattice filter over robot samples and states, compiled.

Beliefs of robot samples are rows: ``given`` (p, n) holds p(s | l) over n states in order.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner, njit
from objstate.geometry import BoolArray, FloatArray, IntArray

LEAST_EVIDENCE = 1e-250
TAIL_SIGMAS = 4.0  # at which a Gaussian is cut off
MOST_DECAY = 600.0  # exp(-600) is a float yet
TINY = 2.3e-308  # the least deviation; nothing is divided by zero
FOOT = 1e-3  # of the density at a peak, at which it ends
VALLEY = 2.0  # by which the density rises again beyond a peak's end
NEXT_TO_NOTHING = 40.0  # exp(-40) beside one
LEAST_ENDS = 1e-9  # times that a move ends meanwhile; one that goes on for less does not end
TURN = 2.0 * np.pi
ENDS_S, LEAVES_S, MOST_CELLS = range(3)  # of a swing: s until it ends and has left, cells a second

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_inner_sums = inner(nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
_compile_sums = njit(nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})


@_inner
def _taps(variance: float, most: int) -> Any:
    """What a random walk with a variance, in cells squared, leaves in place, and takes so many cells away.

    Its variance is met exactly by steps to the neighbours where it is below 1, and by a Gaussian where not.
    """
    reach = 1 if variance < 1.0 else min(int(np.ceil(TAIL_SIGMAS * np.sqrt(variance))), most)
    taps, total = np.empty(reach + 1), 0.0
    if variance < 1.0:
        taps[0], taps[1] = 1.0 - variance, variance / 2.0
        return taps
    for k in range(reach + 1):
        taps[k] = np.exp(-0.5 * k * k / variance)
        total += taps[k] if k == 0 else 2.0 * taps[k]
    for k in range(reach + 1):  # to divide the array takes longer to compile
        taps[k] /= total
    return taps


@_inner
def _pad(row: FloatArray, reach: int, wraps: bool, padded: FloatArray) -> None:
    """Let ``padded`` (n + 2 reach,) be a ``row`` (n,), and beyond its ends what is reflected or, where it ``wraps``, goes on."""
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
    """Weights ``to`` (n,) after a random walk of those of a ``row`` (n,), by ``taps`` (r + 1,), and others ``besides`` (n,).

    At the ends it is reflected, or goes on where the lattice ``wraps``. ``padded`` (n + 2 r,) is overwritten.
    """
    last, reach = row.shape[0] - 1, taps.shape[0] - 1
    if reach == 1:
        here, aside = taps[0], taps[1]
        for j in range(1, last):
            to[j] = here * row[j] + aside * (row[j - 1] + row[j + 1]) + besides[j]
        below, above = (row[last], row[0]) if wraps else (row[0], row[last])
        to[0] = here * row[0] + aside * (below + row[1]) + besides[0]
        to[last] = here * row[last] + aside * (row[last - 1] + above) + besides[last]
        return
    _pad(row, reach, wraps, padded)
    for j in range(last + 1):
        to[j] = taps[0] * row[j] + besides[j]
    for k in range(1, reach + 1):
        for j in range(last + 1):
            to[j] += taps[k] * (padded[reach + j - k] + padded[reach + j + k])


@_inner
def _clear(weights: FloatArray) -> None:
    """Let weights (n,) be zero; ``fill`` takes longer to compile."""
    for j in range(weights.shape[0]):
        weights[j] = 0.0


@_inner
def _normalize(weights: FloatArray) -> None:
    """Let weights (n,) sum to one."""
    total = 0.0
    for j in range(weights.shape[0]):
        total += weights[j]
    for j in range(weights.shape[0]):
        weights[j] /= total


@_inner
def _off(j: int, mean: float, first: float, cell: float, wraps: bool) -> Any:
    """How far a lattice's state ``j`` is off the mean, as in ``_moments``; directions the short way round."""
    off = first + cell * j - mean
    return off - TURN * np.floor((off + np.pi) / TURN) if wraps else off


@_inner
def _moments(weights: FloatArray, first: float, cell: float, wraps: bool) -> Any:
    """Mean and standard deviation of a lattice with weights (n,), each spread over its cell.

    The states are a ``cell`` apart from the ``first`` on; directions where the lattice ``wraps``.
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


@_compile
def moments(weights: FloatArray, first: float, cell: float, wraps: bool) -> Any:
    """``_moments``, for Python."""
    return _moments(weights, first, cell, wraps)


@_inner
def _moved(
    weights: FloatArray,
    swung: FloatArray,
    begun: float,
    seconds: float,
    swing: FloatArray,
    rest: FloatArray,
    wraps: bool,
    later: FloatArray,
    going: FloatArray,
) -> Any:
    """Of a lattice's ``weights`` (n,), what has been moved after a while, into ``later`` (n,); what it comes to comes back.

    That is what was being moved, a share ``swung`` (n,) or (1,), and of the others a share that has ``begun`` at any moment.
    By its ``swing`` (3,), it comes to rest at one rate, and at another gets where doors come to rest. Until then, it goes by
    at most 1, 2, 4, ... cells, up to a reach, each as often: doors are thrown, and led slowly. At the limits that
    is reflected, or goes on where the lattice ``wraps``. What has left is distributed as ``rest`` (n,). Into ``going`` (n,) goes what is being
    moved still.
    """
    count, orders, most = weights.shape[0], 0, 1
    ends, leaves = max(seconds / swing[ENDS_S], LEAST_ENDS), seconds / swing[LEAVES_S]
    near_s = -np.expm1(-ends - leaves) / (ends + leaves) * seconds  # on average
    reach = min(int(np.ceil(swing[MOST_CELLS] * near_s)), count)
    padded, below = np.empty(count + 2 * reach), np.zeros(count + 2 * reach + 1)
    sums, goes_on, nears, near_on = np.zeros(2), np.empty(2), np.empty(2), np.empty(2)
    either = ends + leaves
    goes_on[0], near_on[0] = np.exp(-ends), np.exp(-either)
    goes_on[1], near_on[1] = (1.0 - goes_on[0]) / ends, (1.0 - near_on[0]) / either
    stayed, ended = 1.0 - begun, ends / either
    never_left = stayed ** (1.0 - ended)  # however often it has been moved again
    nears[0] = near_on[0] + (1.0 - near_on[0]) * ended * never_left
    ended = (never_left - stayed) / begun if begun > 0.0 else ended
    nears[1] = near_on[1] + (1.0 - near_on[1]) * ended
    for j in range(count):
        share = swung[min(j, swung.shape[0] - 1)]
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


@_inner_sums
def _part(row: FloatArray, resting: FloatArray, to: FloatArray) -> Any:
    """The shares ``resting`` (n,) of a ``row`` (n,), into ``to`` (n,); their sum comes back."""
    total = 0.0
    for j in range(row.shape[0]):
        to[j] = row[j] * resting[j]
        total += to[j]
    return total


@_compile
def predict(
    given: FloatArray,
    weights: FloatArray,
    swung: FloatArray,
    forgotten: float,
    ancestors: IntArray,
    first: float,
    cell: float,
    wraps: bool,
    variance: float,
    begun: float,
    seconds: float,
    swing: FloatArray,
    rest: FloatArray,
    given_later: FloatArray,
    weights_later: FloatArray,
    swung_later: FloatArray,
) -> Any:
    """What rows ``given`` (p, n) hand on, and their marginal ``weights`` (n,), a while later.

    Into ``given_later`` (q, n) go the rows of ``ancestors`` (q,), but for a share ``forgotten`` that is the marginal's.
    What isn't being moved, in each state all but a share ``swung`` (n,) or (1,), and hasn't ``begun`` to be, takes a random walk
    with a ``variance``, in cells squared; the others move as in ``_moved``, and of each state a share ``swung_later`` (n,) still does.
    The marginal's mean and deviation come back; the lattice is as in ``_moments``.
    """
    count = weights.shape[0]
    taps = _taps(variance, count)
    besides, padded = np.empty(count), np.empty(count + 2 * taps.shape[0])
    resting, stays, kept = np.empty(count), np.empty(count), np.empty_like(taps)
    gone = _moved(weights, swung, begun, seconds, swing, rest, wraps, besides, swung_later)
    for j in range(count):
        resting[j] = 1.0 - swung[min(j, swung.shape[0] - 1)]
    for k in range(taps.shape[0]):
        taps[k] *= 1.0 - min(gone, 1.0)
    for q in range(ancestors.shape[0] + 1):  # the marginal first: rows take their share of it
        row = given[ancestors[q - 1]] if q > 0 else weights
        to = given_later[q - 1] if q > 0 else weights_later
        total = _part(row, resting, stays)
        for k in range(taps.shape[0]):
            kept[k] = taps[k] / total
        _walked(stays, kept, wraps, besides, padded, to)
        if q > 0:
            continue
        for j in range(count):
            besides[j] = (1.0 - forgotten) * besides[j] + forgotten * weights_later[j]
        for k in range(taps.shape[0]):
            taps[k] *= 1.0 - forgotten
    _normalize(weights_later)
    for j in range(count):
        swung_later[j] /= max(weights_later[j], TINY)
    return _moments(weights_later, first, cell, wraps)


@_inner
def _decay(exponent: float) -> Any:
    """exp(-exponent) of what isn't negative, by squaring, so that several are taken at a time.

    It is off by less than 1e-9 of itself up to 30, and by 1e-4 at 200; from ``MOST_DECAY`` on it is constant.
    """
    part = min(exponent, MOST_DECAY) / 1024.0
    higher = 1.0 / 24.0 - part * (1.0 / 120.0)
    value = 1.0 + part * (-1.0 + part * (0.5 + part * (-1.0 / 6.0 + part * higher)))
    for _ in range(10):
        value *= value
    return value


@_inner
def _lay(
    chosen: IntArray, values: FloatArray, whole: BoolArray, alike: bool, to: FloatArray
) -> None:
    """Let ``to`` (n,) be linear between ``values`` (k,) at ascending places ``chosen`` (k,).

    That is between two neither of which is ``whole`` (k,), if they are to be ``alike``, or else between all others.
    """
    for k in range(chosen.shape[0] - 1):
        if alike != (whole[k] or whole[k + 1]):
            begin, left = chosen[k], values[k]
            slope = (values[k + 1] - left) / (chosen[k + 1] - begin)
            for j in range(chosen[k + 1] - begin):
                to[begin + j] = left + slope * j


@_compile_sums
def condition(
    given: FloatArray,
    chosen: IntArray,
    whole: BoolArray,
    log_likelihood: FloatArray,
    robot: FloatArray,
    first: float,
    cell: float,
    wraps: bool,
    after: FloatArray,
    evidence: FloatArray,
    weights: FloatArray,
) -> Any:
    """Bayes' rule in every row of ``given`` (p, n), into ``after`` (p, n), with its log ``evidence`` (p,).

    ``log_likelihood`` (p, k) is known at the ascending states ``chosen`` (k,), the first
    and the last among them; between them the likelihood is linear. In states that aren't ``whole`` (k,) all rows have the same.
    The marginal ``weights`` (n,) are those of rows that count by ``robot`` (p,); their mean and deviation
    come back. The lattice is as in ``_moments``.
    """
    last, count, level = chosen.shape[0] - 1, given.shape[1], -np.inf
    likelihood, alike = np.empty(last + 1), np.empty(last + 1)
    for k in range(last + 1):
        level = level if whole[k] else max(level, log_likelihood[0, k])
    for k in range(last + 1):
        alike[k] = 0.0 if whole[k] else _decay(level - log_likelihood[0, k])
    factors, shape = np.empty(count), np.empty(count)  # that of what all rows have the same of
    _clear(shape)
    _clear(weights)
    _lay(chosen, alike, whole, True, shape)
    shape[chosen[last]] = alike[last]
    for p in range(given.shape[0]):
        top = level
        for k in range(last + 1):
            top = max(top, log_likelihood[p, k]) if whole[k] else top
        scale = _decay(top - level)
        for k in range(last + 1):
            own = _decay(top - log_likelihood[p, k])
            likelihood[k] = own if whole[k] else scale * alike[k]
        for j in range(count):
            factors[j] = scale * shape[j]
        _lay(chosen, likelihood, whole, False, factors)
        factors[chosen[last]] = likelihood[last]
        row, to, total = given[p], after[p], 0.0
        for j in range(count):
            to[j] = row[j] * factors[j]
            total += to[j]
        if total < LEAST_EVIDENCE:  # this row can't have read it: its pose is wrong, not its states
            evidence[p] = top + np.log(LEAST_EVIDENCE)
            for j in range(count):  # to assign a slice costs seconds of compiling
                to[j] = row[j]
            total = 1.0
        else:
            evidence[p] = top + np.log(total)
        share = 1.0 / total
        counts = robot[p] * share
        for j in range(count):
            weights[j] += counts * to[j]
            to[j] *= share
    _normalize(weights)
    return _moments(weights, first, cell, wraps)


@_inner
def _mix(given: FloatArray, shares: FloatArray, weights: FloatArray) -> None:
    """The marginal ``weights`` (n,) of rows ``given`` (p, n) with ``shares`` (p,) of any sum."""
    _clear(weights)
    for p in range(given.shape[0]):
        row, share = given[p], shares[p]
        for j in range(weights.shape[0]):
            weights[j] += share * row[j]
    _normalize(weights)


@_compile
def mixture(
    given: FloatArray,
    shares: FloatArray,
    first: float,
    cell: float,
    wraps: bool,
    weights: FloatArray,
) -> Any:
    """``_mix``, for Python; the mean and deviation of the marginal come back.

    The lattice is as in ``_moments``.
    """
    _mix(given, shares, weights)
    return _moments(weights, first, cell, wraps)


@_compile
def handed_on(given: FloatArray, marginal: FloatArray, share: float, ancestors: IntArray) -> Any:
    """Rows (q, n) of ``given`` (p, n) of the ancestors (q,), but for a share of the ``marginal`` (n,)."""
    out = np.empty((ancestors.shape[0], marginal.shape[0]))
    for q in range(ancestors.shape[0]):
        row, to = given[ancestors[q]], out[q]
        for j in range(marginal.shape[0]):
            to[j] = (1.0 - share) * row[j] + share * marginal[j]
    return out


@_inner_sums
def _disagreement(given: FloatArray, robot: FloatArray, off: FloatArray) -> Any:
    """The variance of the means of rows (p, m), which count by ``robot`` (p,), of any sum.

    The first n columns of ``given`` stand for states that are ``off`` (n,) the mean.
    """
    between, everyone = 0.0, 0.0
    for p in range(robot.shape[0]):
        total, mean, row = 0.0, 0.0, given[p]
        for j in range(off.shape[0]):
            total += row[j]
            mean += row[j] * off[j]
        between += robot[p] * (mean / total) ** 2
        everyone += robot[p]
    return between / everyone


@_inner
def _left(inherited: float, before: float, std: float) -> Any:
    """What is left of an ``inherited`` variance by a scan that takes a deviation from ``before`` to ``std``."""
    return inherited * min(std / max(before, TINY), 1.0) ** 4


@_compile
def apportion(
    given: FloatArray,
    robot: FloatArray,
    off: FloatArray,
    std: FloatArray,
    before: FloatArray,
    inherited: FloatArray,
    left: FloatArray,
    shared: FloatArray,
) -> None:
    """What is ``left`` (d,) of an ``inherited`` variance (d,) or (1,), and what is ``shared`` (d,) with that.

    A scan has taken deviations from ``before`` (d,) to ``std`` (d,). Shared is what the means of rows
    (p, m) disagree about, too: see ``_disagreement``, for each coordinate of ``off`` (n, d).
    """
    for k in range(std.shape[0]):
        left[k] = _left(inherited[min(k, inherited.shape[0] - 1)], before[k], std[k])
        shared[k] = left[k] + _disagreement(given, robot, off[:, k].copy())


@_compile
def settle(
    given: FloatArray,
    robot: FloatArray,
    first: float,
    cell: float,
    wraps: bool,
    before: float,
    inherited: float,
    weights: FloatArray,
) -> Any:
    """What a door's rows ``given`` (p, n) come to after a scan: ``mixture`` and ``apportion``.

    Rows count by ``robot`` (p,). Into ``weights`` (n,) goes their marginal; its mean and deviation come
    back, and what of its variance is shared and left.
    """
    _mix(given, robot, weights)
    mean, std = _moments(weights, first, cell, wraps)
    off = np.empty(weights.shape[0])
    for j in range(off.shape[0]):
        off[j] = _off(j, mean, first, cell, wraps)
    left = _left(inherited, before, std)
    return mean, std, left + _disagreement(given, robot, off), left


@_inner
def _bend(here: float, there: float) -> Any:
    """The smaller of two second differences; none where one bends the other way."""
    if here * there <= 0.0:
        return 0.0
    return here if abs(here) < abs(there) else there


@_inner
def _peak(weights: FloatArray, below: IntArray, above: IntArray) -> Any:
    """Which states (n,) of a lattice with weights (n,) lie about the heaviest one, up to a valley beside it.

    ``below`` and ``above`` (n,) are their neighbours.
    """
    top, is_near = 0, np.zeros(weights.shape[0], dtype=np.bool_)
    for j in range(weights.shape[0]):
        top = j if weights[j] > weights[top] else top
    is_near[top] = True
    for beside in (below, above):
        j, lowest = beside[top], weights[top]
        while not is_near[j] and FOOT * weights[top] < weights[j] < VALLEY * lowest:
            is_near[j], lowest = True, min(lowest, weights[j])
            j = beside[j]
    return is_near


@_inner
def _narrowed(weights: FloatArray, power: float, wraps: bool, parts: int) -> Any:
    """Weights (n,) of a lattice, to a ``power`` above one about the heaviest state; what lies elsewhere stays.

    Between two samples, the logarithm of the density is the parabola through them that bends like the
    straighter of both: at an edge of the belief none bulges beyond what it joins. Each cell is taken in ``parts``,
    and what a part has falls to the samples on both sides of it so that its mean stays: a
    narrow belief isn't drawn to the nearest sample.
    """
    count, top, highest = weights.shape[0], 0.0, -np.inf
    log, bend, out = np.empty(count), np.empty(count), np.zeros(count)
    below, above = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    exponents = np.empty((count, parts))
    for j in range(count):
        top = max(top, weights[j])
    for j in range(count):
        log[j] = np.log(max(weights[j] / top, LEAST_EVIDENCE))
        below[j] = j - 1 if j > 0 else (count - 1 if wraps else 1)  # limits reflect
        above[j] = j + 1 if j < count - 1 else (0 if wraps else count - 2)
    is_near, near, narrow = _peak(weights, below, above), 0.0, 0.0
    for j in range(count):
        bend[j] = log[below[j]] - 2.0 * log[j] + log[above[j]]
        near += weights[j] if is_near[j] else 0.0
    for j in range(count):
        if not is_near[j] or power * log[j] < -NEXT_TO_NOTHING:
            continue
        for k in range(parts):
            t = (k + 0.5) / parts - 0.5
            beside = above[j] if t > 0.0 else below[j]
            rise = abs(t) * (log[beside] - log[j])
            rise -= 0.5 * abs(t) * (1.0 - abs(t)) * _bend(bend[j], bend[beside])
            exponents[j, k] = power * (log[j] + rise)
            highest = max(highest, exponents[j, k])
    for j in range(count):
        if not is_near[j] or power * log[j] < -NEXT_TO_NOTHING:
            continue
        for k in range(parts):
            t = (k + 0.5) / parts - 0.5
            part = np.exp(exponents[j, k] - highest)
            narrow += part
            out[j] += (1.0 - abs(t)) * part
            out[above[j] if t > 0.0 else below[j]] += abs(t) * part
    for j in range(count):
        out[j] = near / narrow * out[j] + (0.0 if is_near[j] else weights[j])
    return out


@_inner
def _quantile(weights: FloatArray, first: float, cell: float, share: float) -> Any:
    """The state below which a share of a lattice's weight lies, each cell's spread over its width."""
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


@_compile
def interval(weights: FloatArray, first: float, cell: float, tail: float) -> Any:
    """``_interval``, for Python."""
    return _interval(weights, first, cell, tail)


@_compile
def widen(
    weights: FloatArray,
    power: float,
    parts: int,
    variance: float,
    first: float,
    cell: float,
    wraps: bool,
    tail: float,
    out: FloatArray,
) -> Any:
    """Weights (n,) of a lattice to a ``power`` from one on, in ``parts``, and after a random walk, into ``out`` (n,).

    The walk's ``variance`` is in cells squared. Mean and deviation come back, and what ``interval`` says;
    the lattice is as in ``_moments``.
    """
    count = weights.shape[0]
    taps = _taps(variance, count)
    narrowed = _narrowed(weights, power, wraps, parts) if power > 1.0 else weights
    besides, padded = np.empty(count), np.empty(count + 2 * taps.shape[0])
    _clear(besides)
    _walked(narrowed, taps, wraps, besides, padded, out)
    _normalize(out)
    return _moments(out, first, cell, wraps), _interval(out, first, cell, tail)


@_compile
def worth_casting(weights: FloatArray, negligible: float, fine: int, coarse: int) -> Any:
    """Indices (m,) of states that are worth casting, by their weights (n,), and which (m,) of them have weight.

    Those that have more than a ``negligible`` share of the largest, or a comb of at most ``fine`` over them;
    every ``coarse`` one of the others; the first and the last.
    """
    least, heavy, passed, count = 0.0, 0, 0, 0
    last = weights.shape[0] - 1
    chosen, whole = np.empty(last + 1, dtype=np.int64), np.empty(last + 1, dtype=np.bool_)
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
            chosen[count], whole[count] = j, is_heavy
            count += 1
    return chosen[:count], whole[:count]
