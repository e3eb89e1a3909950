"""A door's state under other priors of its static errors, and on a lattice; compiled.

A Gaussian prior N(0, v) of some errors is exchanged for a narrower one by multiplying each
component by the ratio of both, a Gaussian with the difference of their precisions.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray
from objstate.linear import ROOT_2, ROOT_TAU
from objstate.objects.mixture_kernels import ORIGIN, STATE, ZERO

LEAST_WEIGHT = 1e-7  # relative weight below which a component is left off a lattice
SIGMAS = 6.0  # deviations beyond which a Gaussian is zero
NARROWEST = 1e-3  # least deviation of a Gaussian on a lattice, in its cells
OUTSIDE = 1e-9  # probability within a lattice below which a Gaussian lies beyond its end
TABLED, PER_DEVIATION = 6.5, 48.0  # deviations up to which ``BELOW`` goes; its steps per deviation


def _below_each(deviations: FloatArray) -> FloatArray:
    """(n, 2) the normal distribution function, and its increase over a step by the density."""
    table = np.empty((len(deviations), 2))
    for k, off in enumerate(deviations.tolist()):
        table[k, 0] = 0.5 * math.erfc(-off / ROOT_2)
        table[k, 1] = math.exp(-0.5 * off * off) / (ROOT_TAU * PER_DEVIATION)
    return table


BELOW = _below_each(np.arange(-TABLED, TABLED + 2.0 / PER_DEVIATION, 1.0 / PER_DEVIATION))

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def _factor_of_one(mean: float, variance: float, gained: float, precision: float) -> Any:
    """Log integral of a Gaussian times the ratio of two priors of different precision.

    That is log1p(precision prior) for the prior itself, which has ``gained`` it.
    """
    inside = 1.0 + precision * variance
    return 0.5 * (gained - math.log(inside) - precision * mean * mean / inside)


@_inner
def _factor_of_two(
    mean: FloatArray, covariance: FloatArray, gained: float, precision: float
) -> Any:
    """The same for the origin's two errors.

    Also the matrix 1 + precision covariance, and its inverse times the mean.
    """
    x, y = mean[ORIGIN], mean[ORIGIN + 1]
    a = 1.0 + precision * covariance[ORIGIN, ORIGIN]
    b = precision * covariance[ORIGIN, ORIGIN + 1]
    d = 1.0 + precision * covariance[ORIGIN + 1, ORIGIN + 1]
    determinant = a * d - b * b
    pulled_x, pulled_y = (d * x - b * y) / determinant, (a * y - b * x) / determinant
    spent = precision * (x * pulled_x + y * pulled_y)
    log = gained - 0.5 * (math.log(determinant) + spent)
    return log, a / determinant, b / determinant, d / determinant, pulled_x, pulled_y


@called_with("f1 f2 f3 b f f1 f")
@_compile
def evidence_under(
    weights: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    of_origin: bool,
    prior: float,
    precisions: FloatArray,
    least: float,
) -> Any:
    """log p(z) (k,), up to a constant, under other prior variances of origin or zero.

    The errors had priors N(0, prior); the precisions of the new ones are larger by ``precisions``
    (k,). Components of weights (c,) above the ``least`` count.
    """
    out, count = np.empty(precisions.shape[0]), weights.shape[0]
    logs, log_weights = np.empty(count), np.empty(count)
    for c in range(count):
        log_weights[c] = math.log(weights[c]) if weights[c] > least else -np.inf
    for k in range(precisions.shape[0]):
        largest, gained = -np.inf, math.log1p(precisions[k] * prior)
        for c in range(count):
            logs[c] = log_weights[c]
            if log_weights[c] > -np.inf:
                if of_origin:
                    logs[c] += _factor_of_two(means[c], covariances[c], gained, precisions[k])[0]
                else:
                    mean, variance = means[c, ZERO], covariances[c, ZERO, ZERO]
                    logs[c] += _factor_of_one(mean, variance, gained, precisions[k])
            largest = max(largest, logs[c])
        total = 0.0
        for c in range(count):
            total += math.exp(logs[c] - largest)
        out[k] = largest + math.log(total)
    return out


@called_with("f2 f2 f2 f3 f1 f1 f2 f4 f2 f2")
@_compile
def exchange(
    resting: FloatArray,
    moving: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    states: FloatArray,
    priors: FloatArray,
    others: FloatArray,
    weights: FloatArray,
    state_means: FloatArray,
    state_variances: FloatArray,
) -> None:
    """Components' weights and states under each of ``others`` (k, 2), variances of origin and zero.

    They had the ``priors`` (2,); one of 0 stays. ``resting`` and ``moving`` (p, c) are weights under
    each of some paces, ``weights`` (2, k, p, c) what they become. The middles of the components are
    ``states`` (c,); ``state_means`` and ``state_variances`` (k, c) are those of the state there.
    """
    count, paces = states.shape[0], resting.shape[0]
    factors, largest = np.empty(count), np.empty(paces)
    for k in range(others.shape[0]):
        by_origin = 1.0 / others[k, 0] - 1.0 / priors[0] if priors[0] > 0.0 else 0.0
        by_zero = 1.0 / others[k, 1] - 1.0 / priors[1] if priors[1] > 0.0 else 0.0
        of_origin, of_zeros = math.log1p(by_origin * priors[0]), math.log1p(by_zero * priors[1])
        largest[:] = -np.inf
        for c in range(count):
            mean, covariance, log = means[c], covariances[c], 0.0
            state, zero = mean[STATE], mean[ZERO]
            of_state, of_zero = covariance[STATE, STATE], covariance[ZERO, ZERO]
            of_both = covariance[STATE, ZERO]
            if by_origin != 0.0:
                log, a, b, d, x, y = _factor_of_two(mean, covariance, of_origin, by_origin)
                state_x, state_y = covariance[STATE, ORIGIN], covariance[STATE, ORIGIN + 1]
                zero_x, zero_y = covariance[ZERO, ORIGIN], covariance[ZERO, ORIGIN + 1]
                state -= by_origin * (state_x * x + state_y * y)
                zero -= by_origin * (zero_x * x + zero_y * y)
                pulled_x, pulled_y = d * state_x - b * state_y, a * state_y - b * state_x
                of_state -= by_origin * (state_x * pulled_x + state_y * pulled_y)
                of_both -= by_origin * (zero_x * pulled_x + zero_y * pulled_y)
                pulled_x, pulled_y = d * zero_x - b * zero_y, a * zero_y - b * zero_x
                of_zero -= by_origin * (zero_x * pulled_x + zero_y * pulled_y)
            if by_zero != 0.0:
                log += _factor_of_one(zero, of_zero, of_zeros, by_zero)
                inside = 1.0 + by_zero * of_zero
                state -= by_zero * of_both * zero / inside
                of_state -= by_zero * of_both * of_both / inside
                zero, of_zero, of_both = zero / inside, of_zero / inside, of_both / inside
            state_means[k, c] = states[c] + state - zero
            state_variances[k, c] = max(of_state + of_zero - 2.0 * of_both, 0.0)
            factors[c] = log
            for p in range(paces):
                weight = resting[p, c] + moving[p, c]
                if weight > 0.0:
                    largest[p] = max(largest[p], log + math.log(weight))
        for p in range(paces):
            total = 0.0
            for c in range(count):
                here = resting[p, c] + moving[p, c] > 0.0
                factor = math.exp(factors[c] - largest[p]) if here else 0.0
                weights[0, k, p, c] = resting[p, c] * factor
                weights[1, k, p, c] = moving[p, c] * factor
                total += weights[0, k, p, c] + weights[1, k, p, c]
            for c in range(count):
                weights[0, k, p, c] /= total
                weights[1, k, p, c] /= total


@_inner
def _below(value: float, mean: float, per_std: float) -> Any:
    """Probability of a Gaussian below a value, by a cubic between those of ``BELOW``: to 3e-10."""
    steps = (min(max((value - mean) * per_std, -TABLED), TABLED) + TABLED) * PER_DEVIATION
    k = int(steps)
    t, by = steps - k, BELOW[k + 1, 0] - BELOW[k, 0]
    rise, rises = BELOW[k, 1], BELOW[k + 1, 1]
    bent = 3.0 * by - 2.0 * rise - rises + t * (rise + rises - 2.0 * by)
    return BELOW[k, 0] + t * (rise + t * bent)


@_inner
def _add(
    weight: float,
    moving: float,
    mean: float,
    std: float,
    first: float,
    cell: float,
    wraps: bool,
    out: FloatArray,
    p_moving: FloatArray,
) -> None:
    """Add a Gaussian to the cells ``out`` (n,) of a lattice, its moving share to ``p_moving`` (n,).

    What lies beyond the ends of a lattice that doesn't wrap is cut off.
    """
    count, per_std = out.shape[0], 1.0 / std
    lower, upper = first, first + cell * (count - 1)
    low = math.floor((mean - SIGMAS * std - first) / cell + 0.5)
    high = math.floor((mean + SIGMAS * std - first) / cell + 0.5)
    if wraps:
        if high - low >= count:
            low, high = 0, count - 1
    else:
        inside = _below(upper, mean, per_std) - _below(lower, mean, per_std)
        if inside < OUTSIDE:
            end = 0 if mean < lower else count - 1
            out[end] += weight
            p_moving[end] += moving
            return
        weight, moving = weight / inside, moving / inside
        low, high = max(low, 0), min(high, count - 1)
    cut_low, cut_high = not wraps and low == 0, not wraps and high == count - 1
    before = _below(lower if cut_low else first + cell * (low - 0.5), mean, per_std)
    for j in range(low, high + 1):
        edge = upper if cut_high and j == high else first + cell * (j + 0.5)
        after, at = _below(edge, mean, per_std), j % count if wraps else j
        out[at] += weight * (after - before)
        p_moving[at] += moving * (after - before)
        before = after


@_inner
def _scale(values: FloatArray, to: float) -> None:
    """Scale values (n,) to a sum."""
    total = 0.0
    for j in range(values.shape[0]):
        total += values[j]
    for j in range(values.shape[0]):
        values[j] *= to / total


@called_with("f2 f2 f2 f2 i f f b f f2 f2")
@_compile
def read_off(
    resting: FloatArray,
    moving: FloatArray,
    means: FloatArray,
    variances: FloatArray,
    cells: int,
    first: float,
    cell: float,
    wraps: bool,
    never: float,
    out: FloatArray,
    p_moving: FloatArray,
) -> None:
    """Probabilities ``out`` (k, n) of a lattice's cells, and of moving in each, ``p_moving`` (k, n).

    From Gaussians of the state with weights, means and variances (k, c), of which the last are
    atoms at the ends. No cell weighs less than ``never`` before atoms are added.
    """
    components, count = resting.shape[1], out.shape[1]
    for k in range(resting.shape[0]):
        all_moving, heaviest = 0.0, 0.0
        for j in range(count):
            out[k, j] = p_moving[k, j] = 0.0
        for c in range(components):
            all_moving += moving[k, c]
            if c < cells:
                heaviest = max(heaviest, resting[k, c] + moving[k, c] + never)
        for c in range(cells):
            weight = resting[k, c] + moving[k, c] + never
            if weight >= LEAST_WEIGHT * heaviest:
                moved, std = moving[k, c] + never, max(math.sqrt(variances[k, c]), NARROWEST * cell)
                _add(weight, moved, means[k, c], std, first, cell, wraps, out[k], p_moving[k])
        _scale(p_moving[k], all_moving)
        if cells < components:
            lower = resting[k, cells] + moving[k, cells]
            upper = resting[k, cells + 1] + moving[k, cells + 1]
            _scale(out[k], 1.0 - (lower + upper))
            out[k, 0] += lower
            out[k, count - 1] += upper
        _scale(out[k], 1.0)
        for j in range(count):
            p_moving[k, j] = min(p_moving[k, j] / max(out[k, j], never), 1.0)
