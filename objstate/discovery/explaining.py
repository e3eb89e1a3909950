"""The explanations of a doorway, and the leaf that explains it best, with its deviations."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import Doorway, beside
from objstate.discovery.modes import Refined, log_seen, refine
from objstate.discovery.proposals import Backgrounds, Shown, proposals, settled
from objstate.discovery.scoring import Behind, Leaf, log_joint
from objstate.discovery.things import Hung, bare, plugs_of, things_of, walls_on
from objstate.geometry import FloatArray, wrap

DOOR = 0.5  # probability that an opening of a wall has a leaf
# Shares of doors: one in twenty slides, and of these every other one has two leaves. Of others one
# in six has. The side of the hinge and the way to open are evenly distributed.
SLIDING = 0.05
LOG_HINGED = np.log(1.0 - SLIDING) + np.log([5.0 / 6.0 / 4.0, 1.0 / 6.0 / 2.0])
LOG_SLIDING = np.log(SLIDING) + np.log([0.5 / 2.0, 0.5])
REFINED, REFINED_SLIDING = 6, 2  # leaves
DEPTH_APART = 0.1  # m, of leaves that are refined apart
SHARED_PLACE_STD = 0.02  # m, of the robot in the map, likewise
SHARED_WIDTH_STD = 0.012  # m, of a width, which all looks share: what readings of both jambs do


@dataclass(frozen=True, eq=False)
class Explained:
    """What a doorway holds."""

    leaves: tuple[Refined, ...]  # one, or the two of a double door
    side_probability: float  # of hinges at these ends, and of leaves that open this way
    probability: float
    log_door: float  # evidence, against the map as it is
    log_bare: float
    shift: FloatArray  # (2,) m, of the map about it

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
    place, shift = settled(place, plan)
    plan = plan.moved(shift)
    shown = Shown.about(place, plan)
    about, rough = Backgrounds.of(place, shown), place.rough
    roughly, found = Backgrounds.of(rough, shown).cleared, list[Refined]()
    for number, leaf in _tried(rough, shown, roughly):
        refined = _refined(about, about.cleared[leaf.about][number], leaf)
        if refined is not None:
            found.append(refined)
    pairs = _pairs(about, _tried_pairs(rough, shown, roughly))
    each_kind: dict[tuple[int, bool, float], Refined] = {}
    for each in sorted(found, key=lambda leaf: leaf.log_evidence):
        each_kind[each.leaf.kind] = each
    several: list[tuple[float, tuple[Refined, ...]]] = [
        *((one.log_evidence + _log_type((one,)), (one,)) for one in each_kind.values()),
        *((log + _log_type(both), both) for log, both in pairs),
    ]
    if not several:
        return None
    found += [each for _, both in pairs for each in both]
    tried = [*((each,) for each in found), *(both for _, both in pairs)]
    things = things_of(place, tried) + plugs_of(tried) + walls_on(place, plan)
    doors = [Hung.of(place, log, leaves, things) for log, leaves in several]
    best = max(doors, key=lambda door: door.log_evidence)
    all_log = float(np.logaddexp.reduce([door.log_evidence for door in doors]))
    base = float(about.as_is.log_likelihood.sum())
    door = all_log + np.log(DOOR) - base
    variants = [open_ for each in about.cleared.values() for open_ in each]
    single = [door for door in doors if len(door.leaves) == 1]
    likely = dict.fromkeys([best, max(single, key=lambda door: door.log_evidence, default=best)])
    variants += [hung.leaves[0].behind.alone for hung in likely]  # it may be there without them
    without = bare(place, about.as_is, variants, best.as_things(place), things)
    without += np.log1p(-DOOR * max(each.p_doorway for each in place.openings)) - base
    return Explained(
        leaves=tuple(_with_others(each, found, plan.resolution) for each in best.leaves),
        side_probability=float(np.exp(best.log_evidence - all_log)),
        probability=float(1.0 / (1.0 + np.exp(-np.clip(door - without, -50, 50)))),
        log_door=door,
        log_bare=without,
        shift=shift,
    )


def _log_type(leaves: tuple[Refined, ...]) -> float:
    """Of a door with such leaves, among all doors."""
    return float((LOG_SLIDING if leaves[0].leaf.slides else LOG_HINGED)[len(leaves) - 1])


def _refined(about: Backgrounds, behind: Behind, leaf: Leaf) -> Refined | None:
    """A leaf refined, and once more without what the map shows in its place then."""
    found = refine(about.place, behind, leaf)
    again = about.redrawn([found.leaf], behind) if found is not None else None
    if found is None or again is None:
        return found
    better = refine(about.place, again, found.leaf)
    return better if better is not None and better.log_evidence > found.log_evidence else found


def _pairs(
    about: Backgrounds, tried: list[tuple[int, Leaf]]
) -> list[tuple[float, tuple[Refined, ...]]]:
    """The leaves of double doors and their log evidence, the best ones for each way to open."""
    found: dict[int, tuple[float, tuple[Refined, ...]]] = {}
    for number, leaf in tried:
        behind = about.cleared[leaf.about][number]
        pair, way = _pair(about.place, behind, leaf), leaf.sense * (-1) ** leaf.from_end
        again = about.redrawn([each.leaf for each in pair[1]], behind) if pair else None
        better = _pair(about.place, again, pair[1][0].leaf) if pair and again else None
        for each in (pair, better):
            if each is not None and (way not in found or each[0] > found[way][0]):
                found[way] = each
    return list(found.values())


def _joint_of_pair(place: Doorway, behind: Behind, leaf: Leaf) -> float:
    """Log p(beams, leaves) of a double door, either leaf given the other one's angles."""
    lattice, other = leaf.lattice, replace(_other(place, leaf), twin=leaf)
    angles = lattice.angles[lattice.best(behind.gains(place, leaf, lattice.angles))]
    beside_first = behind.beside(place, leaf, angles)
    angles = lattice.angles[lattice.best(beside_first.gains(place, other, lattice.angles))]
    beside_other = behind.beside(place, other, angles)
    first = log_joint(place, beside_other, leaf, lattice)
    second = log_joint(place, beside_first, other, lattice)
    gain = beside_other.gains(place, leaf, lattice.angles)
    return first - log_seen(beside_other, gain, lattice.best(gain)) + second


def _pair(
    place: Doorway, behind: Behind, leaf: Leaf
) -> tuple[float, tuple[Refined, Refined]] | None:
    """A leaf and the other one of its double door, refined in turns; their log evidence."""
    lattice = leaf.lattice
    angles = lattice.angles[lattice.best(behind.gains(place, leaf, lattice.angles))]
    other = refine(place, behind.beside(place, leaf, angles), _other(place, leaf))
    if other is None:
        return None
    first = refine(place, behind.beside(place, other.leaf, other.angles), leaf)
    if first is None:
        return None
    alike = replace(_other(place, first.leaf), twin=first.leaf)
    other = refine(place, behind.beside(place, first.leaf, first.angles), alike)
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
    """The best single leaves of each kind, depth and background, with the numbers of these."""
    best: dict[tuple[int, bool, int, int], tuple[float, int, Leaf]] = {}
    for number, leaf in [*_on_each(proposals(place), cleared), *shown.proposed(place)]:
        if leaf.share < 1.0:
            continue
        _, aside = beside(leaf.hinge[None], *place.openings[leaf.about].jamb(leaf.from_end))
        key = leaf.sense, leaf.from_end, round(float(aside[0]) / DEPTH_APART), number
        score = log_joint(place, cleared[leaf.about][number], leaf, leaf.lattice)
        if key not in best or score > best[key][0]:
            best[key] = score, number, leaf
    return _foremost(best.values())


def _foremost(scored: Iterable[tuple[float, int, Leaf]]) -> list[tuple[int, Leaf]]:
    """The numbers and leaves that scored best."""
    ordered = [(number, leaf) for _, number, leaf in sorted(scored, key=lambda each: -each[0])]
    turning = [each for each in ordered if not each[1].slides]
    sliding = [each for each in ordered if each[1].slides]
    return turning[:REFINED] + sliding[:REFINED_SLIDING]


def _on_each(leaves: list[Leaf], cleared: dict[int, list[Behind]]) -> Iterator[tuple[int, Leaf]]:
    """Leaves that the map needn't show, on each of their backgrounds.

    No map shows a leaf that slides elsewhere than in its opening.
    """
    return (
        (n, leaf) for leaf in leaves for n in range(1 if leaf.slides else len(cleared[leaf.about]))
    )


def _tried_pairs(
    place: Doorway, shown: Shown, cleared: dict[int, list[Behind]]
) -> list[tuple[int, Leaf]]:
    """The same of the first leaves of double doors, by the way to open and the background."""
    best: dict[tuple[int, int, int], tuple[float, int, Leaf]] = {}
    drawn = [
        (n, _other(place, leaf) if leaf.from_end else leaf) for n, leaf in shown.proposed(place)
    ]
    able = {(leaf.about, leaf.sense, number) for number, leaf in drawn}
    for number, leaf in [*_on_each(proposals(place), cleared), *drawn]:
        key = leaf.about, leaf.sense, number
        if leaf.share < 1.0 and not leaf.from_end and (number == 0 or key in able):
            score = _joint_of_pair(place, cleared[leaf.about][number], leaf)
            if key not in best or score > best[key][0]:
                best[key] = score, number, leaf
    return _foremost(best.values())


def _with_others(best: Refined, found: list[Refined], cell: float) -> Refined:
    """A leaf whose covariance covers others of its kind that explain about as much.

    All looks share where the map's cells, m, and the robot in it are off.
    """
    place = np.hypot(cell / np.sqrt(12.0), SHARED_PLACE_STD)
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
