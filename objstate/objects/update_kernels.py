"""What precedes and what follows Bayes' rule in the components of a door's mixture; compiled.

A moved door may hang as it was learnt, or by the prior. So a component that it just arrived in has
a twin with the prior of the static errors; both are conditioned, and the likelier is kept.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.objects.mixture_kernels import ERRORS, GLASS, HANDLE, ORIGIN, join

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@called_with("f1 f1 f1 f2 f2 f2 i1 f f1 f1 f2 f3 f2 b1")
@_compile
def arrive(
    paces: FloatArray,
    stays: FloatArray,
    before: FloatArray,
    resting: FloatArray,
    moving: FloatArray,
    arrived: FloatArray,
    edges: IntArray,
    never: float,
    beyond: FloatArray,
    widths: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    kinds: FloatArray,
    out: BoolArray,
) -> None:
    """Update the Gaussians of components in which a moved door arrived, and the weights ``beyond``.

    Under each of some ``paces`` of probabilities (k,), a door ``stays`` at rest with probabilities
    (k,); ``resting`` and ``moving`` (k, c) are the weights after a prediction, of which ``arrived``
    (k, c) just came to rest, and ``before`` (c,) those before it. Of cells beyond a limit, with
    weights ``beyond`` (o,), the last ones before it are ``edges`` (o,). Set in ``out`` (c + o,) are
    components of which most of the weight arrived; ``join`` says what they have then.
    """
    count, remains = before.shape[0], 0.0
    arriving, came = np.empty(out.shape[0]), np.empty(count)
    for k in range(paces.shape[0]):
        remains += paces[k] * stays[k]
    for c in range(count):
        came[c], new, every = 0.0, 0.0, 0.0
        for k in range(paces.shape[0]):
            came[c] += paces[k] * arrived[k, c]
            new += paces[k] * moving[k, c]
            every += paces[k] * (resting[k, c] + moving[k, c])
        arriving[c] = (came[c] + new) / max(every, never)
    for c in range(beyond.shape[0]):
        new = came[edges[c]]
        beyond[c] = remains * beyond[c] + new
        arriving[count + c] = new / max(beyond[c], never)
    for c in range(out.shape[0]):
        out[c] = arriving[c] >= 0.5
    join(before, arriving, widths, means, covariances, kinds)


@called_with("f1 f1 b1 i i f f f1 f1 f2 f3 f2 f1 b1 f2 f3 f2 f1")
@_compile
def begin(
    weights: FloatArray,
    beyond: FloatArray,
    arrived: BoolArray,
    cells: int,
    atoms: int,
    never: float,
    forgets: float,
    static_means: FloatArray,
    static_variances: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    kinds: FloatArray,
    out_weights: FloatArray,
    out_arrived: BoolArray,
    out_means: FloatArray,
    out_covariances: FloatArray,
    out_kinds: FloatArray,
    log_evidence: FloatArray,
) -> None:
    """Set the arrays (2 n + 1, ...) that are conditioned: n components, their twins, and no leaf.

    The first of ``weights`` (c,) are those of ``cells``, then ``atoms``, which aren't conditioned;
    those of cells ``beyond`` the limits (n - c,) follow. No cell weighs less than ``never``. A
    component that the door ``arrived`` in (n,) has a twin with a share ``forgets`` of its weight;
    twins of others weigh 0, and no leaf weighs ``never``. Before any scan, static errors have
    ``static_means`` (8,) and ``static_variances`` (8,).
    """
    count = means.shape[0]
    out_means[:count], out_covariances[:count], out_kinds[:count] = means, covariances, kinds
    for c in range(count):
        here = max(weights[c], never) if c < cells else 0.0
        if c >= cells + atoms:
            here = beyond[c - cells - atoms]
        twin = arrived[c] and here > 0.0
        out_weights[c] = (1.0 - forgets) * here if twin else here
        out_weights[count + c] = forgets * here if twin else 0.0
        for k in (c, count + c):
            out_arrived[k], log_evidence[k] = twin, -np.inf
        if not twin:
            continue
        k = count + c
        out_means[k], out_covariances[k], out_kinds[k] = means[c], covariances[c], kinds[c]
        for a in range(ORIGIN, ERRORS):
            out_means[k, a] = static_means[a]
            for b in range(ERRORS):
                out_covariances[k, a, b] = out_covariances[k, b, a] = 0.0
            out_covariances[k, a, a] = static_variances[a]
    last = 2 * count
    out_weights[last], out_arrived[last], log_evidence[last] = never, False, -np.inf
    out_means[last], out_covariances[last], out_kinds[last] = means[0], covariances[0], kinds[0]


@called_with("f f1 f1 f2 f3 f2 f2 f3")
@_compile
def choose(
    forgets: float,
    weights: FloatArray,
    log_evidence: FloatArray,
    means: FloatArray,
    covariances: FloatArray,
    kinds: FloatArray,
    means_before: FloatArray,
    covariances_before: FloatArray,
) -> None:
    """Replace the first n of 2 n + 1 components by their twins where those are likelier.

    Their ``log_evidence`` becomes that of both. Components are ``weights`` (2 n + 1,), Gaussians
    and ``kinds`` after a scan; those before it are replaced too. Twins have a share ``forgets``.
    """
    count = weights.shape[0] // 2
    known, unknown = math.log1p(-forgets), math.log(forgets)
    for c in range(count):
        k = count + c
        if weights[k] == 0.0:
            continue
        own, other = log_evidence[c] + known, log_evidence[k] + unknown
        most = max(own, other)
        log_evidence[c] = most + math.log(math.exp(own - most) + math.exp(other - most))
        if other <= own:
            continue
        means[c], covariances[c], kinds[c] = means[k], covariances[k], kinds[k]
        means_before[c], covariances_before[c] = means_before[k], covariances_before[k]


@_inner
def _posterior_paces(paces: FloatArray, log_paces: FloatArray, out: FloatArray) -> None:
    """Probabilities of paces, by prior ones and the logarithm of their evidence (k,)."""
    most, total = -np.inf, 0.0
    for k in range(paces.shape[0]):
        most = max(most, log_paces[k])
    for k in range(paces.shape[0]):
        out[k] = paces[k] * math.exp(log_paces[k] - most)
        total += out[k]
    for k in range(paces.shape[0]):
        out[k] /= total


@called_with("f1 i i f f f1 f3 f1 f1 f2")
@_compile
def reweigh(
    log_evidence: FloatArray,
    cells: int,
    atoms: int,
    most_nats: float,
    never: float,
    paces: FloatArray,
    by_pace: FloatArray,
    log_paces: FloatArray,
    beyond: FloatArray,
    kinds: FloatArray,
) -> Any:
    """Multiply weights by the evidence (n,) of components, and normalize them; their log evidence.

    These are ``by_pace`` (2, k, c), of a door at rest and of one that moves under each of paces with
    prior probabilities ``paces`` (k,), and those ``beyond`` the limits (o,). ``log_paces`` (k,) take
    the evidence for each pace, and ``kinds`` (n, 2) of limits become those of all others. Cells
    beyond a limit may be far likelier than all others: by ``most_nats`` at most.
    """
    count, best, every = cells + atoms, -np.inf, 0.0
    for c in range(count):
        best = max(best, log_evidence[c])
    likelihood, shares = np.empty(log_evidence.shape[0]), np.empty(paces.shape[0])
    for c in range(log_evidence.shape[0]):
        likelihood[c] = math.exp(min(log_evidence[c] - best, most_nats))
    _posterior_paces(paces, log_paces, shares)
    for k in range(paces.shape[0]):
        total = 0.0
        for c in range(count):
            by_pace[0, k, c] = max(by_pace[0, k, c] * likelihood[c], never)
            by_pace[1, k, c] *= likelihood[c]
            total += by_pace[0, k, c] + by_pace[1, k, c]
        for c in range(count):
            by_pace[0, k, c] /= total
            by_pace[1, k, c] /= total
        log_paces[k] += math.log(total)
        every += shares[k] * total
    for c in range(beyond.shape[0]):
        beyond[c] = min(max(beyond[c] * likelihood[count + c] / every, never), 1.0)
    if atoms == 0:
        return best + math.log(every)
    _posterior_paces(paces, log_paces, shares)
    handle, glass, free = 0.0, 0.0, 0.0
    for c in range(kinds.shape[0]):
        weight = beyond[c - count] if c >= count else 0.0
        for k in range(paces.shape[0] if c < cells else 0):
            weight += shares[k] * (by_pace[0, k, c] + by_pace[1, k, c])
        handle, glass = handle + weight * kinds[c, HANDLE], glass + weight * kinds[c, GLASS]
        free += weight
    for c in range(cells, count):
        kinds[c, HANDLE], kinds[c, GLASS] = handle / free, glass / free
    return best + math.log(every)
