"""Runs of beams that one unexpected thing stops, compiled.

A box or a person stops neighbouring beams. So whether something unexpected stops a beam is a hidden
Markov chain along the scan: with probability LASTING a beam has the state of the one before it, and
otherwise it is stopped with probability UNEXPECTED. Poses run along the last axis of every array,
as in ``likelihood``; rows are beams in the scan's order.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from objstate.compiling import inner
from objstate.geometry import FloatArray
from objstate.sensing.sweeps import (
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
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def hit_density(off: float, half: float, peak: float, is_gaussian: bool) -> Any:
    """The density of a hit that is off by some m, without the density of random readings.

    ``half`` of the Gaussian's precision, 1/m^2.
    """
    exponent = half * off * off
    return peak * (np.exp(-exponent) if is_gaussian else bell(exponent))


@_inner
def half_precision(model: FloatArray) -> Any:
    """Half the precision of a hit, 1/m^2."""
    return 0.5 * model[PER_SIGMA] * model[PER_SIGMA]


@_inner
def densities_of(measured: float, short: float, lasting: float, model: FloatArray) -> Any:
    """The reading of a beam, and what doesn't depend on the expected range.

    ``short`` and ``lasting`` are the densities of a reading stopped by something new, and by the
    same thing as the beam before.
    """
    surely = 1.0 / (1.0 - model[UNEXPECTED])
    of_hit = surely * model[HIT], surely * model[PEAK], half_precision(model), model[RANGE_MAX]
    return (
        measured,
        floor_of(measured, model),
        short,
        lasting,
        model[LASTING],
        model[UNEXPECTED],
        of_hit,
    )


@_inner
def hit(expected: float, beam: Any, is_gaussian: bool) -> Any:
    """The density of a beam's reading, given that nothing unexpected stops it.

    Without the density of random readings.
    """
    measured, _, _, _, _, _, (clear, peak, half, range_max) = beam
    if measured == np.inf:
        return clear if expected >= range_max else 0.0
    reads = min(expected, range_max) if is_gaussian else expected
    return hit_density(measured - reads, half, peak, is_gaussian)


@_inner
def fared(free: float, stopped: float, hits: float, expected: float, beam: Any) -> Any:
    """One step of the chain: joint densities of the readings and the beam's state, and of a hit.

    ``free`` and ``stopped`` are the joint densities up to the beam before; ``hits`` is ``hit`` for
    what is expected of this one.
    """
    measured, floor, short, lasting, lasts, unexpected, _ = beam
    is_before, both = measured < expected, (1.0 - lasts) * (free + stopped)
    reaches = lasts * free + (1.0 - unexpected) * both
    goes_on = floor + (lasting if is_before else 0.0)
    begins = unexpected * floor + (short if is_before else 0.0)
    after = lasts * stopped * goes_on + both * begins
    return reaches * (hits + floor), after, reaches * hits


@_inner
def step(
    expected: FloatArray, beam: Any, model: FloatArray, free: FloatArray, stopped: FloatArray
) -> None:
    """``fared`` for many poses: expected ranges and densities, which are updated, are (p,)."""
    if model[GAUSSIAN] > 0.0:  # a loop of its own: the other one handles several poses at a time
        _step_each(expected, beam, True, free, stopped)
    else:
        _step_each(expected, beam, False, free, stopped)


@_inner
def _step_each(
    expected: FloatArray, beam: Any, is_gaussian: bool, free: FloatArray, stopped: FloatArray
) -> None:
    """``step``, pose by pose."""
    for p in range(free.shape[0]):
        hits = hit(expected[p], beam, is_gaussian)
        free[p], stopped[p], _ = fared(free[p], stopped[p], hits, expected[p], beam)


@_inner
def _look_on(
    expected: FloatArray,
    beam: Any,
    is_gaussian: bool,
    before: FloatArray,
    hits: FloatArray,
    per_density: FloatArray,
    after: FloatArray,
) -> None:
    """One forward step of ``look_past``: ``after`` (p,) is ``before`` of the next beam."""
    for p in range(expected.shape[0]):
        hits[p] = hit(expected[p], beam, is_gaussian)
        free, stopped, _ = fared(1.0 - before[p], before[p], hits[p], expected[p], beam)
        per_density[p] = 1.0 / (free + stopped)
        after[p] = stopped * per_density[p]


@_inner
def _look_back(
    expected: FloatArray,
    beam: Any,
    hits: FloatArray,
    per_density: FloatArray,
    free: FloatArray,
    stopped: FloatArray,
    free_before: FloatArray,
    stopped_before: FloatArray,
) -> None:
    """One backward step: the likelihood of a reading and those behind it.

    ``free`` and ``stopped`` (p,) are those of the readings behind, given the beam's own state;
    ``free_before`` and ``stopped_before`` (p,) are given the state of the beam before it.
    """
    measured, floor, short, lasting, lasts, unexpected, _ = beam
    for p in range(expected.shape[0]):
        is_before, scale = measured < expected[p], per_density[p]
        goes_on = scale * stopped[p] * (floor + (lasting if is_before else 0.0))
        begins = scale * stopped[p] * (unexpected * floor + (short if is_before else 0.0))
        reached = scale * free[p] * (hits[p] + floor)
        either = (1.0 - lasts) * ((1.0 - unexpected) * reached + begins)
        free_before[p] = lasts * reached + either
        stopped_before[p] = lasts * goes_on + either


@_maker
def look_past(
    expected: FloatArray,
    measured: FloatArray,
    short: FloatArray,
    lasting: FloatArray,
    model: FloatArray,
) -> Any:
    """Forward and backward pass over a scan's beams (n,), for what is ``expected`` (n, p).

    Expected is all but an object. Returned are the probability (n, p) that something unexpected
    stopped the beam before each, given the readings up to there; one over the density (n, p) of
    each reading, given those before; and the likelihoods (n, p) of the readings behind, given that
    the beam was free or stopped, relative to what those before predict. With independent beams
    these are constant.
    """
    count, size = expected.shape
    before, per_density = np.empty((count + 1, size)), np.empty((count, size))
    free, stopped, hits = np.empty((count, size)), np.empty((count, size)), np.empty((count, size))
    for p in range(size):
        before[0, p] = model[UNEXPECTED]
    for j in range(count):
        beam = densities_of(measured[j], short[j], lasting[j], model)
        rows = before[j], hits[j], per_density[j], before[j + 1]
        if model[GAUSSIAN] > 0.0:
            _look_on(expected[j], beam, True, *rows)
        else:
            _look_on(expected[j], beam, False, *rows)
    for j in range(count - 1, -1, -1):
        if j == count - 1 or model[LASTING] == 0.0:
            for p in range(size):
                free[j, p], stopped[j, p] = 1.0, 1.0
            continue
        behind, after = j + 1, (free[j + 1], stopped[j + 1])
        beam = densities_of(measured[behind], short[behind], lasting[behind], model)
        of_hit = hits[behind], per_density[behind]
        _look_back(expected[behind], beam, *of_hit, *after, free[j], stopped[j])
    return before, per_density, free, stopped
