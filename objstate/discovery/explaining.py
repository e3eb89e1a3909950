"""The explanations of a doorway, and the leaf that explains it best, with its deviations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import Doorway
from objstate.discovery.proposals import backgrounds, proposals
from objstate.discovery.scoring import Behind, Lattice, Leaf, gains, log_joint, turned
from objstate.geometry import FloatArray

LOG_DOOR = np.log(0.5)  # prior of a doorway to have a leaf
LOG_BARE = np.log(0.5)
LOG_KINDS = np.log(0.25)  # of the side of the hinge and the way it opens
THING = -16.0  # nats: place, direction and length of something straight, of all there might be
PLUG = -6.0  # nats: something that fills a doorway, such as a shelf, at some depth
LOG_HALF = np.log(0.5)
REFINED = 4  # leaves
FINE, ABOUT = np.radians(0.75), np.radians(6.0)  # angles of a refined leaf
SCALE = np.array([0.02, 0.02, np.radians(1.0), 0.02])  # m, m, rad, m: about a posterior's width
STEP = 0.5  # of the scale, for curvatures


@dataclass(frozen=True, eq=False)
class Refined:
    """A leaf at the posterior's mode."""

    leaf: Leaf
    behind: Behind = field(repr=False)
    covariance: FloatArray  # (4, 4) of hinge, bearing and width
    log_evidence: float
    angles: FloatArray  # (groups,) rad, the most probable of each look


@dataclass(frozen=True, eq=False)
class Explained:
    """What a doorway holds."""

    best: Refined
    probability: float
    log_door: float  # evidence, against the map as it is
    log_bare: float


def explain(place: Doorway, plan: OccupancyMap) -> Explained | None:
    """The most probable leaf of a doorway, and the probability that there is one; None where nothing fits."""
    rough = place.rough
    tried = _tried(rough, plan)
    as_is, cleared = backgrounds(place, plan)
    found: list[Refined] = []
    for number, leaf in tried:
        refined = _refine(place, cleared[leaf.about][number], leaf)
        if refined is not None:
            found.append(refined)
    if not found:
        return None
    base = float(as_is.log_likelihood.sum())
    best = max(found, key=lambda each: each.log_evidence)
    kinds: dict[tuple[int, bool, float], float] = {}
    for each in found:
        key = each.leaf.sense, each.leaf.from_end, each.leaf.share
        kinds[key] = max(kinds.get(key, -np.inf), each.log_evidence)
    door = float(np.logaddexp.reduce(list(kinds.values()))) + LOG_KINDS + LOG_DOOR - base
    things = _things(found)
    bare = max(
        _bare(place, as_is, open_, things) for several in cleared.values() for open_ in several
    )
    bare += LOG_BARE - base
    odds = door - bare
    return Explained(best, float(1.0 / (1.0 + np.exp(-np.clip(odds, -50, 50)))), door, bare)


def _tried(place: Doorway, plan: OccupancyMap) -> list[tuple[int, Leaf]]:
    """The best proposals of each kind, with the number of the background."""
    _, cleared = backgrounds(place, plan)
    lattice = Lattice.whole()
    best: dict[tuple[int, bool, float], tuple[float, int, Leaf]] = {}
    for leaf in proposals(place):
        for number, behind in enumerate(cleared[leaf.about]):
            score = log_joint(place, behind, leaf, lattice)
            key = leaf.sense, leaf.from_end, leaf.share
            if key not in best or score > best[key][0]:
                best[key] = score, number, leaf
    ordered = sorted(best.values(), key=lambda each: -each[0])[:REFINED]
    return [(number, leaf) for _, number, leaf in ordered]


def _refine(place: Doorway, behind: Behind, leaf: Leaf) -> Refined | None:
    """The mode near a leaf, and the evidence about it by Laplace's approximation."""
    from scipy.optimize import minimize

    whole = Lattice.whole()
    lattice = whole.about(gains(place, behind, turned(leaf, whole.angles)), FINE, ABOUT)
    start = leaf.vector

    def score(offset: FloatArray) -> float:
        value = log_joint(place, behind, leaf.at(start + offset * SCALE), lattice)
        return -value if np.isfinite(value) else 1e9

    simplex = np.vstack([np.zeros(4), 2.0 * np.eye(4)])
    options = {"maxfev": 250, "xatol": 0.05, "fatol": 0.05, "initial_simplex": simplex}
    found = minimize(score, np.zeros(4), method="Nelder-Mead", options=options)
    covariance = _covariance(score, found.x)
    if covariance is None:
        return None
    leaf = leaf.at(start + found.x * SCALE)
    full = log_joint(place, behind, leaf, whole)
    value = max(-float(found.fun), full)
    volume = 0.5 * np.linalg.slogdet(2 * np.pi * covariance)[1]
    gain = gains(place, behind, turned(leaf, lattice.angles)) + lattice.log_prior[:, None]
    angles = lattice.angles[np.argmax(gain, axis=0)]
    return Refined(leaf, behind, covariance, value + float(volume), angles)


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


def _things(found: list[Refined]) -> list[tuple[float, FloatArray]]:
    """What leaves that were found would be, if they were just things: their prior, and place (4,)."""
    things = []
    for each in found:
        for angle in np.unique(each.angles):
            cost = PLUG if angle < np.radians(10.0) else THING
            things.append((cost, turned(each.leaf, np.array([angle]))[0]))
    return things


def _bare(
    place: Doorway, as_is: Behind, open_: Behind, things: list[tuple[float, FloatArray]]
) -> float:
    """Log evidence of a doorway without a leaf: in each look as drawn, or open, with things where they pay.

    A thing may stand in any of the looks, and is paid for once.
    """
    total = np.logaddexp(as_is.log_likelihood, open_.log_likelihood) + LOG_HALF
    if not things:
        return float(total.sum())
    gain = gains(place, open_, np.array([each for _, each in things]))
    costs = np.array([cost for cost, _ in things])
    value, left = 0.0, list(range(len(things)))
    while left:
        better = np.maximum(open_.log_likelihood + gain[left] + 2 * LOG_HALF, total)
        pays = costs[left] + (better - total).sum(axis=1)
        best = int(np.argmax(pays))
        if pays[best] <= 0:
            break
        value += costs[left[best]]
        total = better[best]
        left.pop(best)
    return value + float(total.sum())
