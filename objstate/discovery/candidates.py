"""From a map and the beams of drives to doors with their probabilities."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from objstate.building import outline
from objstate.building.door_table import Door
from objstate.building.model import Building
from objstate.building.occupancy import OccupancyMap
from objstate.config import BeamModelSettings
from objstate.discovery.doorway import Doorway, doorway, ended_on, together
from objstate.discovery.explaining import Explained, Refined, explain
from objstate.discovery.gathering import Beams
from objstate.discovery.registering import registered
from objstate.discovery.walls import distinct, openings, wall_lines
from objstate.geometry import FloatArray

PROBABLE = 0.5  # from which on a candidate is a door
LEAST = 0.05  # probability below which a doorway isn't worth telling of
HEIGHT = 0.3  # m, where the walls of a map are cut: they are upright
SWING = math.radians(5.0)  # by which a door opens wider than it was seen
LEAST_LIMIT = math.radians(95.0)  # that doors open at least, where none was seen wider

Progress = Callable[[float], None]  # share done


@dataclass(frozen=True, eq=False)
class Candidate:
    """A door that may be there."""

    door: Door
    probability: float
    side_probability: float  # of the hinge at this end, and of opening this way, if it is a door
    hinge_std: FloatArray  # (2,) m along and across the closed leaf
    bearing_std: float  # rad
    width_std: float  # m
    angles: tuple[float, ...]  # rad, the most probable of each look
    log_odds: float  # of the evidence, against all that is no door

    @property
    def hinge_deviation(self) -> float:
        """m, in each direction, on average."""
        return float(np.sqrt(np.mean(np.square(self.hinge_std))))


def find_doors(
    plan: OccupancyMap,
    walls: Building,
    beams: Beams,
    settings: BeamModelSettings,
    on_progress: Progress | None = None,
) -> list[Candidate]:
    """Doors of a map in what drives saw, the most probable first, named in that order."""
    lines, beams = registered(wall_lines(outline(walls.walls, HEIGHT)), beams)
    places = together(distinct(openings(lines, plan, beams)))
    seen = [doorway(place, lines, plan, beams, settings) for place in places]
    left = dict[int, Explained]()
    for number, place in enumerate(seen):
        if on_progress is not None:
            on_progress(number / len(places))
        if (explained := _explained(place, plan)) is not None:
            left[number] = explained
    found: list[Candidate] = []
    while left:
        number = max(left, key=lambda each: (left[each].log_odds, -each))
        best = left.pop(number)
        found += [_candidate(best, each) for each in best.leaves]
        if best.probability < PROBABLE:
            continue
        plan, beams = _explained_away(seen[number], best, plan, beams)
        for other in [each for each in left if seen[each].is_near(seen[number])]:
            seen[other] = doorway(places[other], lines, plan, beams, settings)
            again = _explained(seen[other], plan)
            if again is None:
                del left[other]
            else:
                left[other] = again
    found.sort(key=lambda each: (-each.probability, -each.log_odds))
    return _named(_apart(found))


def _explained(place: Doorway, plan: OccupancyMap) -> Explained | None:
    """What a doorway holds, if that may be a door."""
    explained = explain(place, plan) if place.groups else None
    return explained if explained is not None and explained.probability >= LEAST else None


def _explained_away(
    place: Doorway, best: Explained, plan: OccupancyMap, beams: Beams
) -> tuple[OccupancyMap, Beams]:
    """The map and the beams without those that a door explains: they tell nothing of other doors."""
    for each in best.leaves:
        bearings = each.leaf.bearing + each.leaf.sense * each.angles
        vector = np.array([*each.leaf.hinge, each.leaf.width])
        beams = beams.take(~ended_on(place, beams, vector, bearings))
        if each.drawn is not None:
            plan = plan.without(each.drawn.points)
    return plan, beams


def _candidate(explained: Explained, best: Refined) -> Candidate:
    leaf = best.leaf
    cos, sin = np.cos(leaf.bearing), np.sin(leaf.bearing)
    axes = np.array([[cos, sin], [-sin, cos]])
    hinge = axes @ best.covariance[:2, :2] @ axes.T
    widest = float(best.angles.max(initial=0.0))
    door = Door(
        name="",
        hinge=leaf.hinge,
        closed_bearing=float(leaf.bearing),
        sense=leaf.sense,
        width=leaf.width,
        upper=max(widest + SWING, LEAST_LIMIT),
        probability=explained.probability,
    )
    return Candidate(
        door=door,
        probability=explained.probability,
        side_probability=explained.side_probability,
        hinge_std=np.sqrt(np.diag(hinge)),
        bearing_std=float(np.sqrt(best.covariance[2, 2])),
        width_std=float(np.sqrt(best.covariance[3, 3])),
        angles=tuple(best.angles.tolist()),
        log_odds=explained.log_odds,
    )


def _apart(found: Sequence[Candidate]) -> list[Candidate]:
    """Each leaf once: of those that close the same way, the most probable."""
    kept: list[Candidate] = []
    for each in found:
        if not any(_overlap(each.door, other.door) for other in kept):
            kept.append(each)
    return kept


def _overlap(one: Door, other: Door) -> bool:
    middles = [_along(door, door.width / 2) for door in (one, other)]
    return float(np.hypot(*(middles[1] - middles[0]))) < (one.width + other.width) / 4


def _along(door: Door, way: float) -> FloatArray:
    bearing = door.closed_bearing
    return np.asarray(door.hinge + way * np.array([np.cos(bearing), np.sin(bearing)]))


def _named(found: Sequence[Candidate]) -> list[Candidate]:
    return [
        replace(each, door=replace(each.door, name=f"door_{number:02d}"))
        for number, each in enumerate(found, start=1)
    ]
