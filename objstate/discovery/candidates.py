"""From a map and the beams of drives to doors with their probabilities."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from objstate.building import outline
from objstate.building.door_table import PROBABLE, Door, closing_distance
from objstate.building.model import Building
from objstate.building.occupancy import OccupancyMap
from objstate.config import BeamModelSettings
from objstate.discovery.beyond import with_rooms_beyond
from objstate.discovery.detours import with_ways_around
from objstate.discovery.doorway import (
    Doorway,
    beside,
    doorway,
    ended_on,
    together,
    unexplained,
)
from objstate.discovery.explaining import Explained, explain
from objstate.discovery.gathering import Beams
from objstate.discovery.modes import Refined
from objstate.discovery.registering import registered
from objstate.discovery.scoring import WAY, turned
from objstate.discovery.walls import LONGER, Opening, distinct, openings, wall_lines
from objstate.geometry import BoolArray, FloatArray, wrap
from objstate.processes import Each

LEAST = 0.05  # probability below which a doorway isn't worth telling of
HEIGHT = 0.3  # m, where the walls of a map are cut: they are upright
SWING = math.radians(5.0)  # by which a door opens wider than it was seen, at least
SPACED = 0.05  # m between points of walls at which leaves stop

Progress = Callable[[float], None]  # share done


@dataclass(frozen=True, eq=False)
class Candidate:
    """A door that may be there."""

    door: Door
    probability: float
    # of the hinge at this end, and of opening this way, turning or sliding, if it is a door
    side_probability: float
    hinge_std: FloatArray  # (2,) m along and across the closed leaf
    bearing_std: float  # rad
    width_std: float  # m
    angles: tuple[float, ...]  # rad, m if it slides, the most probable of each look
    log_odds: float  # of the evidence, against all that is no door

    @property
    def hinge_deviation(self) -> float:
        """m, in each direction, on average."""
        return float(np.sqrt(np.mean(np.square(self.hinge_std))))


class Finding(NamedTuple):
    """The doors of a map, and the openings that weren't weighed."""

    candidates: list[Candidate]  # the most probable first, named in that order
    openings: int  # number of openings, weighed or not
    passed_over: list[Opening]  # those whose line is a wall with less than ``LEAST``


def find_doors(
    plan: OccupancyMap,
    walls: Building,
    beams: Beams,
    settings: BeamModelSettings,
    on_progress: Progress | None = None,
    in_each: Each = map,
) -> Finding:
    """Doors of a map in what drives saw; ``in_each`` may share the work out over processes."""
    lines, beams = registered(wall_lines(outline(walls.walls, HEIGHT)), beams, plan)
    open_ = with_ways_around(distinct(openings(lines, plan, beams)), plan)
    passed_over = [each for each in open_ if each.p_wall < LEAST]
    in_walls = [each for each in open_ if each.p_wall >= LEAST]
    places = together(with_rooms_beyond(in_walls, plan, beams))
    left = np.ones(len(beams), dtype=bool)  # the beams that no door explains
    found, waiting = list[Candidate](), dict[int, Weighed]()

    def place_of(number: int) -> Doorway | None:
        closed = [each.door for each in found if each.door.is_probable]  # they hold no other leaf
        free = (o for o in places[number] if not any(_overlap(door, o) for door in closed))
        every = [unexplained(each, beams, left) for each in free]
        still = [each for each in every if each.p_wall >= LEAST]
        place = doorway(still, lines, plan, beams, settings, left) if still else None
        return place if place is not None and place.groups else None

    def weigh(numbers: Iterable[int], tell: Progress | None = None) -> None:
        """Weigh places among the doors found so far."""
        begun = deque[tuple[int, Doorway]]()

        def every_place() -> Iterator[Doorway]:
            for number in numbers:
                if (place := place_of(number)) is not None:
                    begun.append((number, place))
                    yield place

        for explained in in_each(partial(explain, plan=plan), every_place()):
            number, place = begun.popleft()
            if explained is not None and explained.probability >= LEAST:
                waiting[number] = Weighed(place, explained)
            if tell is not None:
                tell((number + 1) / len(places))

    weigh(range(len(places)), on_progress)
    while waiting:
        in_turn = sorted(waiting, key=lambda each: (-waiting[each].explained.of_leaf, each))
        if not waiting[in_turn[0]].is_current:  # once more, without what has been explained since
            again = _next_of({each: waiting[each] for each in in_turn})
            for number in again:
                del waiting[number]
            weigh(again)
            continue
        place, best, _ = waiting.pop(in_turn[0])
        found += [_candidate(place, best, each) for each in best.leaves]
        if best.probability < PROBABLE:
            continue
        plan = _explained_away(place, best, plan, beams, left)
        for other, each in waiting.items():
            if each.place.is_near(place):
                waiting[other] = each._replace(is_current=False)
    found.sort(key=lambda each: (-each.probability, -each.log_odds))
    return Finding(_named(_apart(found)), len(open_), passed_over)


class Weighed(NamedTuple):
    """A doorway that may hold a door."""

    place: Doorway
    explained: Explained
    is_current: bool = True  # no door near by was accepted since


def _next_of(in_turn: Mapping[int, Weighed]) -> list[int]:
    """Those that aren't current, and near which none comes before them, so that none explains them."""
    before, chosen = list[Doorway](), list[int]()
    for number, each in in_turn.items():
        if not (each.is_current or any(place.is_near(each.place) for place in before)):
            chosen.append(number)
        before.append(each.place)
    return chosen


def _explained_away(
    place: Doorway, best: Explained, plan: OccupancyMap, beams: Beams, left: BoolArray
) -> OccupancyMap:
    """The map without what a door explains; its beams are taken from those ``left`` (n,).

    They tell nothing of other doors.
    """
    for each in best.leaves:
        left[ended_on(place, beams, turned(each.leaf, each.angles))] = False
        if each.drawn is not None:
            plan = plan.without(each.drawn.points - best.shift)
    return plan


def _candidate(place: Doorway, explained: Explained, best: Refined) -> Candidate:
    leaf = best.leaf
    cos, sin = np.cos(leaf.bearing), np.sin(leaf.bearing)
    axes = np.array([[cos, sin], [-sin, cos]])
    hinge = axes @ best.covariance[:2, :2] @ axes.T
    angles = best.angles * leaf.width if leaf.slides else best.angles
    door = Door(
        name="",
        hinge=leaf.hinge,
        closed_bearing=float(wrap(leaf.bearing)),
        sense=leaf.sense,
        width=leaf.width,
        upper=leaf.width if leaf.slides else limit_of(place, best),
        probability=explained.probability,
        in_map=None if leaf.slides else _in_map(place, best),
    )
    return Candidate(
        door=door,
        probability=explained.probability,
        side_probability=explained.side_probability,
        hinge_std=np.sqrt(np.diag(hinge)),
        bearing_std=float(np.sqrt(best.covariance[2, 2])),
        width_std=float(np.sqrt(best.covariance[3, 3])),
        angles=tuple(angles.tolist()),
        log_odds=explained.log_odds,
    )


def _in_map(place: Doorway, best: Refined) -> float:
    """The angle, rad, by which the map shows a leaf open; 0 where it shows none open."""
    leaf, drawn = best.leaf, best.drawn
    if drawn is None or drawn.turn == 0.0:
        return 0.0
    _, bearing = place.openings[leaf.about].jamb(leaf.from_end)
    return max(leaf.sense * float(wrap(bearing + drawn.turn - leaf.bearing)), 0.0)


def limit_of(place: Doorway, best: Refined) -> float:
    """The angle, rad, that a leaf can't pass: where it would stand in a wall, or lie along its own.

    That it was never seen wider open, in drives or in the map, doesn't show that it stops there.
    """
    leaf = best.leaf
    seen = max(float(best.angles.max(initial=0.0)), _in_map(place, best))
    stops = [np.pi]
    for wall in place.walls:
        for begin, end in wall.solid if wall.shown >= LONGER * leaf.width else ():
            points = wall.start + np.arange(begin, end, SPACED)[:, None] * wall.along
            along, aside = beside(points, leaf.hinge, leaf.bearing)
            far, angle = np.hypot(along, aside), np.arctan2(leaf.sense * aside, along)
            # neither at the jambs, nor about the closed leaf
            met = (far > WAY) & (far < leaf.width - WAY) & (angle * far > WAY)
            first = float((angle + WAY / np.maximum(far, WAY))[met].min(initial=np.pi))
            if first > seen:  # else it is the leaf itself, which was seen beyond it
                stops.append(first)
    return max(min(stops), min(seen + SWING, np.pi))


def _apart(found: Sequence[Candidate]) -> list[Candidate]:
    """Each leaf once: of those that close the same way, the most probable."""
    kept: list[Candidate] = []
    for each in found:
        if not any(_overlap(each.door, other.door) for other in kept):
            kept.append(each)
    return kept


def _overlap(one: Door, other: Door | Opening) -> bool:
    """Whether a leaf closes the same way as another, or an opening."""
    return bool(closing_distance(one.middle, one.width, other.middle, other.width) < 1.0)


def _named(found: Sequence[Candidate]) -> list[Candidate]:
    return [
        replace(each, door=replace(each.door, name=f"door_{number:02d}"))
        for number, each in enumerate(found, start=1)
    ]
