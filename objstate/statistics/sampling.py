"""Samples of a posterior over the unit cube: sequential Monte Carlo with tempering.

The likelihood's exponent rises from 0 to 1 in steps that keep half of the samples effective;
after each, the samples are resampled and moved by random walks (Del Moral, Doucet and Jasra
2006, *Sequential Monte Carlo samplers*, JRSS B 68, section 3.3).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from objstate.geometry import FloatArray

SAMPLES = 1000
WALKS = 4  # steps of the random walk after each rise
EFFECTIVE = 0.5  # share of samples that stay effective at a rise
BISECTIONS = 40  # of the exponent
JITTER = 1e-9  # on the diagonal of the walk's covariance

LogLikelihood = Callable[[FloatArray], FloatArray]  # (k, d) points to (k,)


def sample(log_likelihood: LogLikelihood, dimensions: int, rng: np.random.Generator) -> FloatArray:
    """(SAMPLES, d) points of the unit cube after the likelihood, with a uniform prior."""
    points = rng.random((SAMPLES, dimensions))
    known = log_likelihood(points)
    exponent = 0.0
    while exponent < 1.0:
        risen = _next_exponent(known, exponent)
        weights = _weights(known, risen - exponent)
        chosen = rng.choice(SAMPLES, SAMPLES, p=weights)
        points, known, exponent = points[chosen], known[chosen], risen
        for _ in range(WALKS):
            points, known = _walk(points, known, exponent, log_likelihood, rng)
    return points


def _next_exponent(known: FloatArray, exponent: float) -> float:
    """The largest that keeps enough samples effective, at most 1."""
    low, high = exponent, 2.0 - exponent  # so that 1 is the first that is tried
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        if 1 / np.sum(_weights(known, middle - exponent) ** 2) < EFFECTIVE * SAMPLES:
            high = middle
        elif middle >= 1.0:
            return 1.0
        else:
            low = middle
    return max(low, float(np.nextafter(exponent, 1.0)))


def _weights(known: FloatArray, rise: float) -> FloatArray:
    weights = np.exp(rise * (known - known.max()))
    return np.asarray(weights / weights.sum())


def _walk(
    points: FloatArray,
    known: FloatArray,
    exponent: float,
    log_likelihood: LogLikelihood,
    rng: np.random.Generator,
) -> tuple[FloatArray, FloatArray]:
    """One step of Metropolis' random walk, as wide as the samples lie; reflected at the faces."""
    dimensions = points.shape[1]
    spread = np.cov(points.T) * 2.38**2 / dimensions + JITTER * np.eye(dimensions)
    width = rng.choice([0.1, 1.0], size=(len(points), 1))  # short steps serve narrow corners
    step = rng.multivariate_normal(
        np.zeros(dimensions), spread, size=len(points), method="cholesky"
    )
    proposed = 1 - np.abs(1 - np.abs(points + width * step) % 2)
    there = log_likelihood(proposed)
    taken = np.log(rng.random(len(points))) < exponent * (there - known)
    return np.where(taken[:, None], proposed, points), np.where(taken, there, known)
