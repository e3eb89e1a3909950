"""A leaf at the mode of its posterior, and the evidence about it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from objstate.discovery.doorway import Doorway
from objstate.discovery.scoring import Behind, Drawn, Leaf, log_joint
from objstate.geometry import FloatArray, IntArray

SCALE = np.array([0.02, 0.02, np.radians(1.0), 0.02])  # m, m, rad, m: about a posterior's width
STEP = 0.5  # of the scale, for curvatures


@dataclass(frozen=True, eq=False)
class Refined:
    """A leaf at the posterior's mode."""

    leaf: Leaf
    behind: Behind = field(repr=False)
    covariance: FloatArray  # (4, 4) of hinge, bearing and width
    log_evidence: float
    angles: FloatArray  # (groups,) rad or share of the width, the most probable of each look
    log_prior: float  # the evidence without the likelihood of the most probable angles

    @property
    def log_volume(self) -> float:
        """Of its posterior, in nats: how much of the places that it might have it leaves."""
        return _log_volume(self.covariance)

    @property
    def drawn(self) -> Drawn | None:
        """What the map shows of it, if it does."""
        return self.behind.drawn_as(self.leaf)


def refine(place: Doorway, behind: Behind, leaf: Leaf) -> Refined | None:
    """The mode near a leaf, and the evidence about it by Laplace's approximation."""
    from scipy.optimize import minimize

    whole = leaf.lattice
    lattice = whole.about(behind.gains(place, leaf, whole.angles))
    start = leaf.vector

    def score(offset: FloatArray) -> float:
        value = log_joint(place, behind, leaf.at(start + offset * SCALE), lattice)
        return -value if np.isfinite(value) else 1e9

    simplex = np.vstack([np.zeros(4), 2.0 * np.eye(4)])
    options = {"maxfev": 250, "xatol": 0.1, "fatol": 0.1, "initial_simplex": simplex}
    found = minimize(score, np.zeros(4), method="Nelder-Mead", options=options)
    covariance = _covariance(score, found.x)
    if covariance is None:
        return None
    leaf = leaf.at(start + found.x * SCALE)
    value, full = -float(found.fun), log_joint(place, behind, leaf, whole)
    if full > value:
        value, lattice = full, whole
    gain, evidence = behind.gains(place, leaf, lattice.angles), value + _log_volume(covariance)
    best = lattice.best(gain)
    log_prior = evidence - log_seen(behind, gain, best)
    return Refined(leaf, behind, covariance, evidence, lattice.angles[best], log_prior)


def _log_volume(covariance: FloatArray) -> float:
    return 0.5 * float(np.linalg.slogdet(2 * np.pi * covariance)[1])


def _covariance(score: Callable[[FloatArray], float], middle: FloatArray) -> FloatArray | None:
    """The inverse of the curvature at a mode."""
    size, hessian = len(middle), np.zeros((4, 4))
    units = np.eye(size) * STEP
    here = score(middle)
    for i in range(size):
        for j in range(i, size):
            if i == j:
                second = score(middle + units[i]) - 2 * here + score(middle - units[i])
            else:
                second = (
                    score(middle + units[i] + units[j])
                    - score(middle + units[i] - units[j])
                    - score(middle - units[i] + units[j])
                    + score(middle - units[i] - units[j])
                ) / 4
            hessian[i, j] = hessian[j, i] = second / STEP**2
    values, vectors = np.linalg.eigh(hessian)
    if values.max() <= 0:
        return None
    values = np.maximum(values, 0.02)
    return np.asarray(vectors @ np.diag(1.0 / values) @ vectors.T * np.outer(SCALE, SCALE))


def log_seen(behind: Behind, gain: FloatArray, best: IntArray) -> float:
    """Log-likelihood of all looks with a leaf of a ``gain`` (a, groups) at the ``best`` angles."""
    return float(gain[best, np.arange(len(best))].sum() + behind.log_likelihood.sum())
