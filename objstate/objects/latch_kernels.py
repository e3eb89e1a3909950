"""A latched door as a special case of one that rests anywhere: the Savage-Dickey ratio; compiled.

A latched door stands exactly at a limit. Otherwise it is like one that rests in a cell. So its
evidence needs no likelihood of its own: it is the density of the free state at the limit after the
readings, over that before them (Dickey 1971), and its Gaussian is the free one given that state.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray
from objstate.linear import ROOT_2, ROOT_TAU
from objstate.objects.mixture_kernels import ERRORS, STATE, ZERO

ATOMS = 2  # the limits
LEAST_WITHIN = 1e-9  # least probability of a free door's being between its limits
LEAST_OF_DENSITY = 1e-9  # share of a limit's density below which a component is left out

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})
_maker = inner(makes_arrays=True, nogil=True, error_model="numpy", fastmath={"contract"})


@_inner
def _at_limit(middle: float, limit: float, width: float, mean: FloatArray, cov: FloatArray) -> Any:
    """Log density of a component's state at a limit, blurred; its distance, and their variance."""
    off = middle + mean[STATE] - mean[ZERO] - limit
    spread = cov[STATE, STATE] + cov[ZERO, ZERO] - 2.0 * cov[STATE, ZERO] + width
    return -0.5 * off * off / spread - math.log(ROOT_TAU * math.sqrt(spread)), off, spread


@_inner
def _log_beyond(
    middle: float, lower: float, upper: float, mean: FloatArray, covariance: FloatArray
) -> Any:
    """Log probability that the leaf stands beyond the limit beside which the component began."""
    std, leaf = math.sqrt(covariance[STATE, STATE]), middle + mean[STATE]
    past = leaf - lower if middle < lower else upper - leaf
    return math.log(max(0.5 * math.erfc(past / (ROOT_2 * std)), 1e-300))


@_inner
def _log_within(
    middle: float,
    lower: float,
    upper: float,
    widths: FloatArray,
    mean: FloatArray,
    covariance: FloatArray,
) -> Any:
    """Log probability that a component's state lies between the limits, of variances ``widths``."""
    _, off, spread = _at_limit(middle, lower, widths[0], mean, covariance)
    below = 0.5 * math.erfc(off / (ROOT_2 * math.sqrt(spread)))
    _, off, spread = _at_limit(middle, upper, widths[1], mean, covariance)
    above = 0.5 * math.erfc(-off / (ROOT_2 * math.sqrt(spread)))
    return math.log(max(1.0 - below - above, LEAST_WITHIN))


@_inner
def _log_shares(
    weights: FloatArray,
    middles: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    cells: int,
    atom: int,
    width: float,
    log_factors: FloatArray,
    out: FloatArray,
) -> Any:
    """Log densities ``out`` (c,) of free components at a limit, and of all together.

    ``log_factors`` (c,) are those of the ``weights``.
    """
    largest, lower, upper = -np.inf, middles[cells], middles[cells + 1]
    for c in range(weights.shape[0]):
        out[c] = -np.inf
        if cells <= c < cells + ATOMS:
            continue
        out[c] = math.log(weights[c]) + log_factors[c]
        out[c] += _at_limit(middles[c], middles[atom], width, means[c], covariances[c])[0]
        if c >= cells + ATOMS:
            out[c] += _log_beyond(middles[c], lower, upper, means[c], covariances[c])
        largest = max(largest, out[c])
    total = 0.0
    for c in range(weights.shape[0]):
        total += math.exp(out[c] - largest)
    return largest + math.log(total)


@_maker
def _latch(
    atom: int,
    weights: FloatArray,
    middles: FloatArray,
    width: float,
    cells: int,
    before: FloatArray,
    priors: FloatArray,
    within: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    log_evidence: FloatArray,
) -> None:
    """Set the evidence and the Gaussian of one limit, as ``limit`` does.

    ``within`` (c,) are log probabilities before the scan that a free door is between its limits.
    """
    count = weights.shape[0]
    log, gain, own = np.empty(count), np.empty(ERRORS), np.empty(ERRORS)
    prior = _log_shares(weights, middles, before, priors, cells, atom, width, -within, log)
    evidence = log_evidence - within
    total = _log_shares(weights, middles, means, covariances, cells, atom, width, evidence, log)
    mean, covariance = means[atom], covariances[atom]
    mean[:], covariance[:] = 0.0, 0.0
    for c in range(count):
        share = math.exp(log[c] - total)
        if share < LEAST_OF_DENSITY:
            continue
        x, free = means[c], covariances[c]
        _, off, spread = _at_limit(middles[c], middles[atom], width, x, free)
        for a in range(ERRORS):  # the state's error is counted from the limit
            gain[a] = (free[a, STATE] - free[a, ZERO]) / spread
        gain[STATE] = 1.0 - width / spread
        for a in range(ERRORS):
            own[a] = (off if a == STATE else x[a]) - gain[a] * off
            mean[a] += share * own[a]
        for a in range(ERRORS):
            for b in range(ERRORS):
                value = -gain[a] * gain[b] * spread + own[a] * own[b]
                if a == STATE:
                    value += gain[b] * spread
                elif b == STATE:
                    value += gain[a] * spread
                else:
                    value += free[a, b]
                covariance[a, b] += share * value
    for a in range(ERRORS):
        for b in range(ERRORS):
            covariance[a, b] -= mean[a] * mean[b]
    log_evidence[atom] = total - prior


@called_with("f1 f1 f1 i f2 f3 f2 f3 f1")
@_compile
def limit(
    weights: FloatArray,
    middles: FloatArray,
    widths: FloatArray,
    cells: int,
    before: FloatArray,
    priors: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    log_evidence: FloatArray,
) -> None:
    """Set the evidence and the Gaussians of both limits, and keep free doors between them.

    These are ``cells`` between the limits, two limits, and cells beyond them. Their ``weights``
    (c,) of a door at rest and their Gaussians ``before`` (c, 8), ``priors`` (c, 8, 8) are from
    before a scan; ``means`` (c, 8), ``covariances`` (c, 8, 8) and ``log_evidence`` (c,) from after
    it. ``widths`` (c,) are variances of a latched door's distance from the limit. Components beyond
    a limit count as far as the leaf stands there. The evidence of a cell is that of a prior which
    ends at the limits.
    """
    within, stops = np.zeros(weights.shape[0]), widths[cells : cells + ATOMS]
    lower, upper = middles[cells], middles[cells + 1]
    for c in range(cells):
        within[c] = _log_within(middles[c], lower, upper, stops, before[c], priors[c])
    for atom in range(cells, cells + ATOMS):
        _latch(
            atom,
            weights,
            middles,
            widths[atom],
            cells,
            before,
            priors,
            within,
            means,
            covariances,
            log_evidence,
        )
    for c in range(cells):
        after = _log_within(middles[c], lower, upper, stops, means[c], covariances[c])
        log_evidence[c] += after - within[c]
