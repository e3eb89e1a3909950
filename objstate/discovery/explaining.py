"""The explanations of a doorway, and the leaf that explains it best, with its deviations."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import Doorway, beside
from objstate.discovery.proposals import Shown, backgrounds, proposals
from objstate.discovery.registering import PLACE_STD
from objstate.discovery.scoring import (
    FLAT,
    HALF,
    NEARLY_CLOSED,
    Behind,
    Drawn,
    Lattice,
    Leaf,
    chained,
    log_joint,
    turned,
    with_things,
)
from objstate.discovery.walls import Opening
from objstate.geometry import FloatArray, IntArray, wrap

DOOR = 0.75  # probability that an opening of a wall has a leaf
LOG_KINDS = np.log(0.25)  # of the side of the hinge and the way it opens
THING = -16.0  # nats: place, direction and length of something straight, of all there might be
PLUG = -6.0  # nats: something that fills a doorway, such as a shelf, at some depth
GAP = -3.0  # nats: the map lacks a piece of a wall
SAME_WALL = 0.04  # m aside
REFINED = 6  # leaves
DEPTH_APART = 0.1  # m, of leaves that are refined apart
FINE, ABOUT = np.radians(0.75), np.radians(6.0)  # angles of a refined leaf
SCALE = np.array([0.02, 0.02, np.radians(1.0), 0.02])  # m, m, rad, m: about a posterior's width
SHARED_WIDTH_STD = 0.012  # m, of a width, which all looks share: what readings of both jambs do
STEP = 0.5  # of the scale, for curvatures


Thing = tuple[float, FloatArray]  # log prior; (k, 4) places of something straight, as of leaves


@dataclass(frozen=True, eq=False)
class Refined:
    """A leaf at the posterior's mode."""

    leaf: Leaf
    behind: Behind = field(repr=False)
    covariance: FloatArray  # (4, 4) of hinge, bearing and width
    log_evidence: float
    angles: FloatArray  # (groups,) rad, the most probable of each look
    log_prior: float  # the evidence without the likelihood of the most probable angles

    @property
    def drawn(self) -> Drawn | None:
        """What the map shows of it, if it does."""
        return self.behind.drawn_as(self.leaf)


@dataclass(frozen=True, eq=False)
class Explained:
    """What a doorway holds."""

    leaves: tuple[Refined, ...]  # one, or the two of a double door
    side_probability: float  # of hinges at these ends, and of leaves that open this way
    probability: float
    log_door: float  # evidence, against the map as it is
    log_bare: float

    @property
    def log_odds(self) -> float:
        """Of a door, against none."""
        return self.log_door - self.log_bare

    @property
    def of_leaf(self) -> float:
        """The log odds of one leaf: those of a double door are of both."""
        return self.log_odds / len(self.leaves)


def explain(place: Doorway, plan: OccupancyMap) -> Explained | None:
    """The most probable leaf of a doorway, and the probability that there is one; None where nothing fits."""
    shown = Shown.about(place, plan)
    as_is, cleared = backgrounds(place, shown)
    rough, found = place.rough, list[Refined]()
    _, roughly = backgrounds(rough, shown)
    for number, leaf in _tried(rough, shown, roughly):
        refined = _refine(place, cleared[leaf.about][number], leaf)
        if refined is not None:
            found.append(refined)
    pairs = _pairs(place, _tried_pairs(rough, shown, roughly), cleared)
    each_kind: dict[tuple[int, bool, float], Refined] = {}
    for each in sorted(found, key=lambda leaf: leaf.log_evidence):
        each_kind[each.leaf.kind] = each
    several = [(one.log_evidence, (one,)) for one in each_kind.values()] + pairs
    if not several:
        return None
    best, leaves = max(several, key=lambda one: one[0])
    all_log = float(np.logaddexp.reduce([log for log, _ in several]))
    base = float(as_is.log_likelihood.sum())
    door = all_log + LOG_KINDS + np.log(DOOR) - base
    found += [each for _, both in pairs for each in both]
    things = _things([*((each,) for each in found), *(both for _, both in pairs)])
    things += [(GAP, _wall(place, opening)[None]) for opening in _of_first_line(place)]
    bare = max(
        _bare(place, as_is, open_, things) for variants in cleared.values() for open_ in variants
    )
    bare += np.log1p(-DOOR * max(each.p_wall for each in place.openings)) - base
    return Explained(
        leaves=tuple(_with_others(each, found, plan.resolution) for each in leaves),
        side_probability=float(np.exp(best - all_log)),
        probability=float(1.0 / (1.0 + np.exp(-np.clip(door - bare, -50, 50)))),
        log_door=door,
        log_bare=bare,
    )


def _pairs(
    place: Doorway, tried: list[tuple[int, Leaf]], cleared: dict[int, list[Behind]]
) -> list[tuple[float, tuple[Refined, ...]]]:
    """The leaves of double doors and their log evidence, the best ones for each way to open."""
    found: dict[int, tuple[float, tuple[Refined, ...]]] = {}
    for number, leaf in tried:
        pair = _pair(place, cleared[leaf.about][number], leaf)
        way = leaf.sense * (-1) ** leaf.from_end
        if pair is not None and (way not in found or pair[0] > found[way][0]):
            found[way] = pair
    return list(found.values())


def _joint_of_pair(place: Doorway, behind: Behind, leaf: Leaf) -> float:
    """Log p(beams, leaves) of a double door, either leaf given the other one's angles."""
    lattice, other = Lattice.whole(), replace(_other(place, leaf), twin=leaf)
    angles = lattice.angles[lattice.best(behind.gains(place, leaf, lattice.angles))]
    beside_first = behind.beside(place, leaf, angles)
    angles = lattice.angles[lattice.best(beside_first.gains(place, other, lattice.angles))]
    beside_other = behind.beside(place, other, angles)
    first = log_joint(place, beside_other, leaf, lattice)
    second = log_joint(place, beside_first, other, lattice)
    gain = beside_other.gains(place, leaf, lattice.angles)
    return first - _log_seen(beside_other, gain, lattice.best(gain)) + second


def _log_seen(behind: Behind, gain: FloatArray, best: IntArray) -> float:
    """Log-likelihood of all looks with a leaf of a ``gain`` (a, groups) at the ``best`` angles."""
    return float(gain[best, np.arange(len(best))].sum() + behind.log_likelihood.sum())


def _pair(
    place: Doorway, behind: Behind, leaf: Leaf
) -> tuple[float, tuple[Refined, Refined]] | None:
    """A leaf and the other one of its double door, refined in turns; their log evidence."""
    lattice = Lattice.whole()
    angles = lattice.angles[lattice.best(behind.gains(place, leaf, lattice.angles))]
    other = _refine(place, behind.beside(place, leaf, angles), _other(place, leaf))
    if other is None:
        return None
    first = _refine(place, behind.beside(place, other.leaf, other.angles), leaf)
    if first is None:
        return None
    alike = replace(_other(place, first.leaf), twin=first.leaf)
    other = _refine(place, behind.beside(place, first.leaf, first.angles), alike)
    return None if other is None else (first.log_prior + other.log_evidence, (first, other))


def _other(place: Doorway, leaf: Leaf) -> Leaf:
    """The other leaf of a double door: as deep in the wall, hinged at the other end."""
    opening = place.openings[leaf.about]
    start, _ = opening.jamb(not leaf.from_end)
    _, aside = beside(leaf.hinge[None], *opening.jamb(leaf.from_end))
    bearing = leaf.bearing + np.pi
    hinge = start - float(aside[0]) * np.array([-np.sin(bearing), np.cos(bearing)])
    return Leaf(hinge, bearing, -leaf.sense, leaf.width, leaf.about, not leaf.from_end, leaf.share)


def _tried(
    place: Doorway, shown: Shown, cleared: dict[int, list[Behind]]
) -> list[tuple[int, Leaf]]:
    """The best single leaves of each kind and depth, with the numbers of their backgrounds."""
    lattice = Lattice.whole()
    best: dict[tuple[int, bool, int, bool], tuple[float, int, Leaf]] = {}
    drawn = [(n, leaf, True) for n, leaf in shown.proposed(place)]
    for number, leaf, is_drawn in [*_on_each(proposals(place), cleared), *drawn]:
        if leaf.share < 1.0:
            continue
        _, aside = beside(leaf.hinge[None], *place.openings[leaf.about].jamb(leaf.from_end))
        key = leaf.sense, leaf.from_end, round(float(aside[0]) / DEPTH_APART), is_drawn
        score = log_joint(place, cleared[leaf.about][number], leaf, lattice)
        if key not in best or score > best[key][0]:
            best[key] = score, number, leaf
    ordered = sorted(best.values(), key=lambda each: -each[0])[:REFINED]
    return [(number, leaf) for _, number, leaf in ordered]


def _on_each(
    leaves: list[Leaf], cleared: dict[int, list[Behind]]
) -> Iterator[tuple[int, Leaf, bool]]:
    """Leaves that the map needn't show, on each of their backgrounds."""
    return ((n, leaf, False) for leaf in leaves for n in range(len(cleared[leaf.about])))


def _tried_pairs(
    place: Doorway, shown: Shown, cleared: dict[int, list[Behind]]
) -> list[tuple[int, Leaf]]:
    """The same of the first leaves of double doors, the best one of each way to open."""
    best: dict[int, tuple[float, int, Leaf]] = {}
    drawn = (
        (n, _other(place, leaf) if leaf.from_end else leaf) for n, leaf in shown.proposed(place)
    )
    for number, leaf in [*((0, leaf) for leaf in proposals(place)), *drawn]:
        if leaf.share < 1.0 and not leaf.from_end:
            score = _joint_of_pair(place, cleared[leaf.about][number], leaf)
            if leaf.sense not in best or score > best[leaf.sense][0]:
                best[leaf.sense] = score, number, leaf
    return [(number, leaf) for _, number, leaf in best.values()]


def _with_others(best: Refined, found: list[Refined], cell: float) -> Refined:
    """A leaf whose covariance covers others of its kind that explain about as much.

    All looks share where the map's cells, m, and the robot in it are off.
    """
    place = np.hypot(cell / np.sqrt(12.0), PLACE_STD)
    shared = np.diag(np.square([place, place, 0.0, SHARED_WIDTH_STD]))
    alike = [each for each in found if each.leaf.kind == best.leaf.kind]
    log = np.array([each.log_evidence for each in alike])
    weights = np.exp(log - np.logaddexp.reduce(log))
    total = np.zeros((4, 4))
    for weight, each in zip(weights, alike, strict=True):
        off = each.leaf.vector - best.leaf.vector
        off[2] = wrap(off[2])
        total += weight * (each.covariance + np.outer(off, off))
    return replace(best, covariance=total + shared)


def _refine(place: Doorway, behind: Behind, leaf: Leaf) -> Refined | None:
    """The mode near a leaf, and the evidence about it by Laplace's approximation."""
    from scipy.optimize import minimize

    whole = Lattice.whole()
    lattice = whole.about(behind.gains(place, leaf, whole.angles), FINE, ABOUT)
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
    full = log_joint(place, behind, leaf, whole)
    value = max(-float(found.fun), full)
    volume = 0.5 * np.linalg.slogdet(2 * np.pi * covariance)[1]
    gain, evidence = behind.gains(place, leaf, lattice.angles), value + float(volume)
    best = lattice.best(gain)
    log_prior = evidence - _log_seen(behind, gain, best)
    return Refined(leaf, behind, covariance, evidence, lattice.angles[best], log_prior)


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


def _things(several: Sequence[tuple[Refined, ...]]) -> list[Thing]:
    """What leaves would be, if they were just things: their prior, and places (k, 4) side by side."""
    things = []
    for leaves in several:
        for angles in np.unique(np.array([each.angles for each in leaves]).T, axis=0).tolist():
            pairs = list(zip(leaves, np.array(angles)[:, None], strict=True))
            cost = sum(_cost(each, angle) for each, angle in pairs)
            things.append((cost, np.concatenate([turned(e.leaf, angle) for e, angle in pairs])))
    return things


def _cost(found: Refined, angle: FloatArray) -> float:
    """Log prior of a thing in the place of a leaf at an angle (1,); the map may show it."""
    if angle[0] == FLAT:
        return GAP
    is_shown = bool(found.behind.map_of(found.leaf, angle)[1][0])
    return PLUG if angle[0] < NEARLY_CLOSED or is_shown else THING


def _of_first_line(place: Doorway) -> list[Opening]:
    """The openings of the longest wall; a recess has lines of its own."""
    first = place.openings[0]
    asides = [beside(each.middle[None], first.start, first.bearing)[1] for each in place.openings]
    pairs = zip(place.openings, asides, strict=True)
    return [each for each, aside in pairs if abs(float(aside[0])) < SAME_WALL]


def _wall(place: Doorway, opening: Opening) -> FloatArray:
    """(4,) what would be in the place of an opening, if the wall went on there: its face."""
    start, bearing = opening.jamb(False)
    return np.array([*(start + HALF * place.inward(start, bearing)), bearing, opening.width])


def _bare(place: Doorway, as_is: Behind, open_: Behind, things: list[Thing]) -> float:
    """Log evidence of a doorway without a leaf: in each look as drawn, or open, or with things.

    A thing may stand in any of the looks, and is paid for once.
    """
    logs = [as_is.log_likelihood, open_.log_likelihood]

    def total(more: list[FloatArray]) -> float:
        gain = np.array([*logs, *more])
        prior = np.full(len(gain), -np.log(len(gain)))
        first = np.full(len(gain), -np.inf)
        first[0] = 0.0
        return float(chained(first, prior, gain, place.stays)[0])

    value, chosen = total([]), list[FloatArray]()
    if not things:
        return value
    gain = [with_things(place, open_, each) for _, each in things]
    costs, spent, left = [cost for cost, _ in things], 0.0, list(range(len(things)))
    while left:
        pays = [spent + costs[k] + total([*chosen, gain[k]]) for k in left]
        best = int(np.argmax(pays))
        if pays[best] <= value:
            break
        value, number = pays[best], left.pop(best)
        spent += costs[number]
        chosen.append(gain[number])
    return value
