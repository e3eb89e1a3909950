"""Runs of beams that one unexpected thing stops, compiled.

A box or a person stops beams side by side. So whether something unexpected stops a beam is a hidden
Markov chain along the scan: with probability LASTING a beam fares as the one before it, and
otherwise it is stopped with probability UNEXPECTED, whatever came before. Poses run along the last
axis of every array, as in ``likelihood``; rows are beams in the scan's own order.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner
from objstate.geometry import FloatArray
from objstate.sensing.kernels import (
    GAUSSIAN,
    HIT,
    LASTING,
    PEAK,
    PER_SIGMA,
    RANGE_MAX,
    UNEXPECTED,
    bell,
    floor_of,
)

_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def hit_density(off: float, half: float, peak: float, is_gaussian: bool) -> Any:
    """The density of a hit so many m off, without the floor that all readings have.

    ``half`` of the Gaussian's precision, 1/m^2.
    """
    exponent = half * off * off
    return peak * (np.exp(-exponent) if is_gaussian else bell(exponent))


@_inner
def half_precision(model: FloatArray) -> Any:
    """Half the precision of a hit, 1/m^2."""
    return 0.5 * model[PER_SIGMA] * model[PER_SIGMA]


@_inner
def _as_expected(
    expected: FloatArray, measured: float, model: FloatArray, hits: FloatArray
) -> None:
    """Densities ``hits`` (p,), without the floor, of a reading of what is ``expected`` (p,), if nothing else stops the beam."""
    surely = 1.0 / (1.0 - model[UNEXPECTED])
    if measured == np.inf:
        for p in range(hits.shape[0]):
            hits[p] = surely * model[HIT] if expected[p] >= model[RANGE_MAX] else 0.0
        return
    peak, half, range_max = surely * model[PEAK], half_precision(model), model[RANGE_MAX]
    is_gaussian = model[GAUSSIAN] > 0.0
    for p in range(hits.shape[0]):
        reads = min(expected[p], range_max) if is_gaussian else expected[p]
        hits[p] = hit_density(measured - reads, half, peak, is_gaussian)


@_inner
def step(
    expected: FloatArray,
    measured: float,
    short: float,
    lasting: float,
    model: FloatArray,
    free: FloatArray,
    stopped: FloatArray,
    hits: FloatArray,
) -> None:
    """Take the next beam's reading into the joint densities (p,) of what was read and how the last beam fared.

    It was ``free`` to reach what is ``expected`` (p,), or ``stopped``. ``short`` and ``lasting`` are
    the densities of a reading that something new stops, and that what stopped the beam before
    stops. ``hits`` (p,) are that of what is expected.
    """
    _as_expected(expected, measured, model, hits)
    _advance(expected, measured, short, lasting, model, free, stopped, hits)


@_inner
def _advance(
    expected: FloatArray,
    measured: float,
    short: float,
    lasting: float,
    model: FloatArray,
    free: FloatArray,
    stopped: FloatArray,
    hits: FloatArray,
) -> None:
    """``step``, where ``hits`` (p,) hold the densities of a reading of what is expected already."""
    floor, lasts, unexpected = floor_of(measured, model), model[LASTING], model[UNEXPECTED]
    fresh = 1.0 - lasts
    for p in range(free.shape[0]):
        both = fresh * (free[p] + stopped[p])
        reaches = lasts * free[p] + (1.0 - unexpected) * both
        is_before = measured < expected[p]
        goes_on = floor + (lasting if is_before else 0.0)
        begins = unexpected * floor + (short if is_before else 0.0)
        free[p] = reaches * (hits[p] + floor)
        stopped[p] = lasts * stopped[p] * goes_on + both * begins
        hits[p] *= reaches


@_inner
def _step_back(
    expected: FloatArray,
    measured: float,
    short: float,
    lasting: float,
    model: FloatArray,
    scale: FloatArray,
    hits: FloatArray,
    free: FloatArray,
    stopped: FloatArray,
) -> None:
    """The same the other way: how likely later beams read what they do, given how the one before fared.

    ``free`` and ``stopped`` (p,) hold that for this beam first; its densities count ``scale`` (p,) times.
    ``hits`` (p,) are those of a reading of what is expected.
    """
    floor, lasts, unexpected = floor_of(measured, model), model[LASTING], model[UNEXPECTED]
    for p in range(free.shape[0]):
        is_before = measured < expected[p]
        goes_on = scale[p] * stopped[p] * (floor + (lasting if is_before else 0.0))
        begins = scale[p] * stopped[p] * (unexpected * floor + (short if is_before else 0.0))
        reached = scale[p] * free[p] * (hits[p] + floor)
        either = (1.0 - lasts) * ((1.0 - unexpected) * reached + begins)
        free[p] = lasts * reached + either
        stopped[p] = lasts * goes_on + either


@_inner
def look_past(
    expected: FloatArray,
    measured: FloatArray,
    short: FloatArray,
    lasting: FloatArray,
    model: FloatArray,
    before: FloatArray,
    per_density: FloatArray,
    free: FloatArray,
    stopped: FloatArray,
) -> None:
    """The whole scan's beams (n,), against what is ``expected`` (n, p) of all but an object.

    ``before`` (n, p) is the probability that something unexpected stopped the beam before each, by
    the readings up to there; ``per_density`` (n, p) one over the density of each reading, by those
    before. ``free`` and ``stopped`` (n, p) are how likely those after read what they do, given how
    the beam fared, against what those before let expect; where each beam is stopped by itself, that tells nothing.
    """
    count, size = expected.shape
    reach, stop, hits = np.empty(size), np.empty(size), np.empty(size)
    as_expected = np.empty((count, size))
    for p in range(size):
        reach[p], stop[p] = 1.0 - model[UNEXPECTED], model[UNEXPECTED]
    for j in range(count):
        _as_expected(expected[j], measured[j], model, as_expected[j])
        for p in range(size):
            before[j, p] = stop[p]
            hits[p] = as_expected[j, p]
        _advance(expected[j], measured[j], short[j], lasting[j], model, reach, stop, hits)
        for p in range(size):
            per_density[j, p] = 1.0 / (reach[p] + stop[p])
            reach[p] *= per_density[j, p]
            stop[p] *= per_density[j, p]
    if model[LASTING] == 0.0:
        for j in range(count):
            for p in range(size):
                free[j, p], stopped[j, p] = 1.0, 1.0
        return
    for p in range(size):
        reach[p], stop[p] = 1.0, 1.0
    for j in range(count - 1, -1, -1):
        for p in range(size):
            free[j, p] = reach[p]
            stopped[j, p] = stop[p]
        _step_back(
            expected[j],
            measured[j],
            short[j],
            lasting[j],
            model,
            per_density[j],
            as_expected[j],
            reach,
            stop,
        )
