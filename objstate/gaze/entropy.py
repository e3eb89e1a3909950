"""How much is not known: differential entropies in nats (section 5.1, Elfring et al. 2014).

Differential entropies are relative to the units of the state: metres and radians.
Differences between entropies of one object don't depend on them.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from objstate.building.model import Kind
from objstate.geometry import FloatArray
from objstate.objects import ObjectBelief
from objstate.particles import Weights, entropy

NORMAL = 0.5 * (1.0 + np.log(2.0 * np.pi))  # nats, of a normal variable of variance one
# rad and m, measure of a limit at which a door may stand exactly, beside that of states between
LIMIT_RAD, LIMIT_M = math.radians(5.0), 0.03
POINT = 1e-12  # m^2 or rad^2, least variance that counts: below it samples are copies of one

# states (m, d) and former states (n, d) to transition densities p(q | q') (m, n)
TransitionDensity = Callable[[FloatArray, FloatArray], FloatArray]


def gaussian_entropy(covariance: FloatArray) -> FloatArray:
    """Eq. (3): nats (...) of Gaussians with covariances (..., d, d).

    Raises ValueError for singular ones.
    """
    sign, log_determinant = np.linalg.slogdet(covariance)
    if (sign <= 0).any():
        raise ValueError("a covariance must be positive definite to have an entropy")
    return np.asarray(covariance.shape[-1] * NORMAL + 0.5 * log_determinant)


def diagonal_entropy(variances: FloatArray) -> FloatArray:
    """Eq. (3) of Gaussians with independent coordinates of variances (..., d), nats (...)."""
    return np.asarray((NORMAL + 0.5 * np.log(variances)).sum(axis=-1))


def particle_filter_entropy(
    states: FloatArray,
    former_states: FloatArray,
    former_weights: Weights,
    log_likelihood: FloatArray,
    transition: TransitionDensity,
) -> float:
    """Eq. (4), after Boers et al. 2010: of a particle filter's posterior, nats.

    ``states`` (n, d) were drawn from ``former_states`` (n, d) of ``former_weights`` (n,) by the
    motion model of density ``transition``; ``log_likelihood`` (n,) is log p(z | q_i).
    """
    weights, log_evidence = former_weights.reweight(log_likelihood)
    with np.errstate(divide="ignore"):
        predicted = np.log(transition(states, former_states) @ former_weights.values)
    carried = weights.values > 0.0
    return float(log_evidence - weights.values[carried] @ (log_likelihood + predicted)[carried])


def histogram_entropy(weights: FloatArray, cell: float) -> float:
    """Of a density that is constant over cells of size ``cell`` with ``weights`` (n,), nats."""
    return entropy(weights) + float(np.log(cell))


def belief_entropy(belief: ObjectBelief) -> float:
    """Of an object's belief, nats: a histogram's for doors, for furniture a Gaussian's.

    A door has some probability of standing exactly at a limit. There the reference measure is that
    of ``LIMIT_RAD`` or ``LIMIT_M``, so that a door which is surely closed is about as certain as one
    that was seen elsewhere, whatever the lattice.

    Free samples stand for the Gaussian of their mean and covariance, which is the largest
    entropy that these allow (Cover and Thomas 2006, theorem 8.6.5): what is still open
    between two places counts as wholly open.
    """
    if (belief.cell > 0.0).all():
        weights, item = belief.weights.values, belief.item
        entropy = histogram_entropy(weights, float(np.prod(belief.cell)))
        if item.kind is Kind.PLANAR or item.wraps:
            return entropy
        wide = LIMIT_RAD if item.kind is Kind.HINGED else LIMIT_M
        at_limits = float(weights[0] + weights[-1])
        return entropy + at_limits * math.log(wide / float(belief.cell[0]))
    return float(gaussian_entropy(sample_covariance(belief.deviations, belief.weights.values)))


def sample_covariance(deviations: FloatArray, weights: FloatArray) -> FloatArray:
    """(d, d) of weighted samples (n, d) about their mean, never quite singular."""
    covariance = (weights[:, None] * deviations).T @ deviations
    return np.asarray(covariance + POINT * np.eye(deviations.shape[1]))
