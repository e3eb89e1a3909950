"""Things that nobody drew, which stand about a doorway, with a leaf or without one.

Leaves and things are explanations of the same beams. Each thing pays for its place once, by how
surely the beams tell it, and may stand there or not in any look.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic, NamedTuple, TypeVar

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import Doorway, beside
from objstate.discovery.lattice import chained
from objstate.discovery.modes import Refined
from objstate.discovery.scoring import (
    HALF,
    NEARLY_CLOSED,
    SAME_PLACE,
    Behind,
    Drawn,
    Leaf,
    turned,
    with_things,
)
from objstate.discovery.walls import Opening, shown_beside
from objstate.geometry import FloatArray

# Log densities, 1/(m3 rad), of place, direction and length of something straight that is no leaf:
PLUG = 9.0  # it fills a doorway for good, such as a shelf, at any depth: as a leaf would
SHOWN = 12.0  # the map shows it, as well as maps do
ALONG_WALL = 5.0  # it is a piece of a wall
GAP = -3.0  # nats: the map lacks a thing, or a piece of a wall
WALLS_OFF, WALL_ASIDE = (-0.03, 0.0, 0.03), 0.03  # m, of a wall's face from its line
SAME_WALL = 0.04  # m aside
# An opening is a way through if the map has floor on both sides of it, so far from its line, beyond
# niches, over half of its width. A wall that is there can't be what the map lacks.
BESIDE_WAY, WAY_THROUGH = np.array([-0.45, -0.35, 0.35, 0.45]), 0.5  # m, 1
SAME_TURN = np.radians(4.0)  # between angles of a leaf that may be one thing
MOST_TURNS = 3  # of a leaf that is none, but things at all these angles
MOST_THINGS = 3  # that stand about a doorway

Gain = TypeVar("Gain")


class Thing(NamedTuple):
    """Something straight that is no leaf, or several of them side by side."""

    log_prior: float
    places: FloatArray  # (k, 4) as of leaves
    leaves: tuple[tuple[Leaf, FloatArray], ...] = ()  # that it might be, at angles (1,)
    stays: bool = False  # it is there in all looks, or in none

    def on(self, place: Doorway, behind: Behind) -> Behind:
        """What there is with it; a map may show just that, as the thing's cells are a bit off."""
        there = with_things(place, behind, self.places)
        return there if self.stays else replace(there, is_shown=self._is_what_lacks(behind))

    def _is_what_lacks(self, behind: Behind) -> bool:
        """Whether it is all that the map shows and the background lacks."""
        turned_away = [each for each in behind.drawn if each.turn != 0.0]
        filling = [each for each in behind.drawn if each.turn == 0.0]
        whole = [each for each in filling if each.share == 1.0]
        halves = [each for each in filling if each.share < 1.0]
        fills = any(map(self._is, whole)) or (bool(halves) and all(map(self._is, halves)))
        if not behind.drawn or (filling and not fills):
            return False
        return all(map(self._is, turned_away))

    def _is(self, drawn: Drawn) -> bool:
        return any(
            drawn.may_be(leaf) and float(drawn.off(leaf, angle)[0]) < SAME_PLACE
            for leaf, angle in self.leaves
        )


def things_of(place: Doorway, several: Sequence[tuple[Refined, ...]]) -> list[Thing]:
    """What leaves would be, if they were just things: their prior, and places (k, 4) side by side."""
    things = []
    for leaves in several:
        for angles in _apart(np.array([each.angles for each in leaves]).T):
            pairs = list(zip(leaves, angles[:, None], strict=True))
            cost = sum(_cost(each, _log_density(place, each, angle)) for each, angle in pairs)
            places = np.concatenate([turned(each.leaf, angle) for each, angle in pairs])
            things.append(Thing(cost, places, tuple((e.leaf, angle) for e, angle in pairs)))
    return things


def plugs_of(several: Sequence[tuple[Refined, ...]]) -> list[Thing]:
    """What closed leaves would be, if they just filled the doorway: that stays, as a shelf does."""
    plugs = []
    for leaves in several:
        if all(each.angles.min() < NEARLY_CLOSED for each in leaves):
            cost = sum(_cost(each, PLUG) for each in leaves)
            closed = np.concatenate([turned(each.leaf, np.zeros(1)) for each in leaves])
            plugs.append(Thing(cost, closed, stays=True))
    return plugs


def _apart(angles: FloatArray) -> list[FloatArray]:
    """Those of the rows (n, leaves) that differ, the commonest first."""
    rows, counts = np.unique(angles, axis=0, return_counts=True)
    kept: list[FloatArray] = []
    for row in rows[np.argsort(-counts, kind="stable")]:
        if all(np.abs(row - other).max() > SAME_TURN for other in kept):
            kept.append(row)
    return kept


def _cost(found: Refined, log_density: float) -> float:
    """Log evidence of a thing in the place of a leaf, without its likelihood: it is as sure."""
    return GAP + min(log_density + found.log_volume, 0.0)


def _log_density(place: Doorway, found: Refined, angle: FloatArray) -> float:
    """Of a thing in the place of a leaf at an angle (1,).

    The map may show it, or it may be a piece of a wall that the map shows in part.
    """
    if bool(found.behind.map_of(found.leaf, angle)[1][0]):
        return SHOWN
    if angle[0] >= found.leaf.away or place.is_wall(turned(found.leaf, angle)[0]):
        return ALONG_WALL
    anywhere = np.log(np.pi * place.radius**2) + np.log(np.pi)  # its length is between 0 and 1 m
    return -float(anywhere)


def _of_first_line(place: Doorway) -> list[Opening]:
    """The openings of the longest wall; a recess has lines of its own."""
    first = place.openings[0]
    asides = [beside(each.middle[None], first.start, first.bearing)[1] for each in place.openings]
    pairs = zip(place.openings, asides, strict=True)
    return [each for each, aside in pairs if abs(float(aside[0])) < SAME_WALL]


def walls_on(place: Doorway, plan: OccupancyMap) -> list[Thing]:
    """Pieces of wall that the map may lack: in the place of each opening, and on either side of it.

    In an opening its face may lie a little off its line. Where the map shows a way through it, there
    is no wall.
    """
    found = []
    for opening in _of_first_line(place):
        start, bearing = opening.jamb(False)
        inward = place.inward(start, bearing)
        for off in () if _is_way(opening, plan) else WALLS_OFF:
            face = np.array([[*(start + (HALF + off) * inward), bearing, opening.width]])
            found.append(Thing(GAP - 0.5 * (off / WALL_ASIDE) ** 2, face, stays=True))
        for jamb, away in (opening.jamb(False), opening.jamb(True)):
            far = place.radius - opening.width / 2.0
            face = np.array([[*(jamb + HALF * inward), away + np.pi, far]])
            found.append(Thing(GAP, face, stays=True))
    return found


def _is_way(opening: Opening, plan: OccupancyMap) -> bool:
    """Whether a map shows floor on both sides of an opening."""
    places = np.arange(plan.resolution / 2.0, opening.width, plan.resolution)
    free = shown_beside(plan, plan.free, opening.start, opening.along, places, BESIDE_WAY)
    return bool(free.all(axis=1).mean() > WAY_THROUGH)


@dataclass(frozen=True, eq=False)
class Hung:
    """The leaves of a door, and the things that stand about beside them."""

    log_evidence: float
    leaves: tuple[Refined, ...]
    things: list[Thing]

    @staticmethod
    def of(place: Doorway, log: float, leaves: tuple[Refined, ...], things: list[Thing]) -> Hung:
        """Leaves that have a ``log`` evidence alone, with some of the things that there may be."""
        behind, leaf, lattice = leaves[-1].behind, leaves[-1].leaf, leaves[-1].leaf.lattice
        log_map = behind.map_of(leaf, lattice.angles)[0]
        log_way = behind.log_way(leaf, lattice.angles)

        def gains(there: Behind) -> FloatArray:
            change = there.log_likelihood - behind.log_likelihood
            return np.asarray(there.gains(place, leaf, lattice.angles) + change)

        def total(there: list[FloatArray]) -> float:
            return lattice.log_evidence(log_map, log_way, np.concatenate(there), place.stays)

        on_each, alone = [[thing.on(place, behind)] for thing in things], [gains(behind)]
        value, chosen, there = _Told(place, gains, total).best(alone, things, on_each)
        if chosen:  # beside things a leaf may stand elsewhere than without them
            angles = lattice.angles[lattice.best(np.max(there, axis=0))]
            leaves = (*leaves[:-1], replace(leaves[-1], angles=angles))
        return Hung(log + value - total(alone), leaves, chosen)

    def as_things(self, place: Doorway) -> list[Thing]:
        """What stands about, if none of it is a leaf: the leaves at some angles, and the rest."""
        return [*things_of(place, [self.leaves])[:MOST_TURNS], *self.things]


def bare(
    place: Doorway, as_is: Behind, opened: list[Behind], hung: list[Thing], things: list[Thing]
) -> float:
    """Log evidence of a doorway without a leaf: in each look as drawn, or open, or with things.

    These are found one after the other, or are all that stands about where there is a door,
    ``hung``. Open it is one of ``opened``.
    """

    def total(there: list[Behind]) -> float:
        gain, is_shown = np.array([e.log_likelihood for e in there]), [e.is_shown for e in there]
        prior = np.full(len(gain), -np.log(len(gain)))
        first = np.where(is_shown, -np.log(sum(is_shown)), -np.inf)
        return float(chained(first, prior, gain, place.stays)[0])

    told, logs = _Told(place, lambda there: there, total), list[float]()
    on_map = [thing.on(place, as_is) for thing in things]
    for open_ in opened:
        states = [as_is, open_]
        for thing in hung:
            beside = [thing.on(place, state) for state in states]
            states = beside if thing.stays else states + beside
        logs.append(sum(thing.log_prior for thing in hung) + total(states))
        on_open = (thing.on(place, open_) for thing in things)
        on_each = [list(both) for both in zip(on_map, on_open, strict=True)]
        logs.append(told.best([as_is, open_], things, on_each)[0])
    return max(logs)


class _Told(NamedTuple, Generic[Gain]):
    """How much looks tell of what there may be: the ``total`` of the ``gains`` of each."""

    place: Doorway
    gains: Callable[[Behind], Gain]
    total: Callable[[list[Gain]], float]

    def best(
        self, there: list[Gain], things: list[Thing], on_each: list[list[Behind]]
    ) -> tuple[float, list[Thing], list[Gain]]:
        """The most log evidence, where things may stand about, which do, and what all states gain.

        Each is paid for once; in any look it may be there or not, unless it stays. With each thing,
        the states are as ``on_each`` has them; they gain after those that are ``there`` without.
        """
        value, spent, chosen = self.total(there), 0.0, list[Thing]()
        left = [
            (thing, more, [self.gains(state) for state in more])
            for thing, more in zip(things, on_each, strict=True)
        ]
        while left:
            pays = [
                spent + thing.log_prior + self.total(theirs if thing.stays else there + theirs)
                for thing, _, theirs in left
            ]
            best = int(np.argmax(pays))
            if pays[best] <= value:
                break
            value, (thing, added, theirs) = pays[best], left.pop(best)
            there, spent = theirs if thing.stays else there + theirs, spent + thing.log_prior
            chosen.append(thing)
            if len(chosen) == MOST_THINGS:
                break
            for other, more, its in left:
                if thing.stays:
                    more.clear()
                    its.clear()
                new = [other.on(self.place, state) for state in added]
                more.extend(new)
                its.extend(self.gains(state) for state in new)
        return value, chosen, there
