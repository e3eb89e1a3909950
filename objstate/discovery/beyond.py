"""What lies beyond a wall: doors part rooms, and windows are in walls that nothing is behind."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import beside
from objstate.discovery.gathering import Beams
from objstate.discovery.walls import Opening, shown_beside

ABOUT = 10.0  # m of the wall to either side of an opening
BEYOND = 0.35  # m from the wall's line, from where on nothing is the wall, or a niche of it
FLOOR = 2.0  # m from it, up to which a map may show floor
FEWEST = 3  # cells of floor, one behind another
FLOOR_SHARE = 0.02  # of the wall's length, behind which such floor has to show
FAR = 4.0  # m from it, up to which readings tell
STRAY = 0.01  # such readings for each of the wall, as errors may leave
# Probabilities: of a wall around the building, and that nothing is seen behind such a wall, and
# behind one between rooms, all of whose doors have to be closed.
OUTER, NONE_BEHIND_OUTER, NONE_BEHIND_INNER = 0.4, 0.99, 0.02


def with_rooms_beyond(found: list[Opening], plan: OccupancyMap, beams: Beams) -> list[Opening]:
    """The openings, with the probability that their wall parts two rooms."""
    out = []
    for opening in found:
        inner, outer = NONE_BEHIND_INNER, NONE_BEHIND_OUTER
        if _shows_both_sides(plan, opening) or _reach_both_sides(beams, opening):
            inner, outer = 1.0 - inner, 1.0 - outer
        odds = (1.0 - OUTER) * inner / (OUTER * outer)
        out.append(replace(opening, p_inner=odds / (1.0 + odds)))
    return out


def _shows_both_sides(plan: OccupancyMap, opening: Opening) -> bool:
    """Whether a map shows floor on both sides of a wall."""
    places = np.arange(-ABOUT, opening.width + ABOUT, plan.resolution)
    away = np.arange(BEYOND, FLOOR, plan.resolution)
    asides = np.concatenate([away, -away])
    free = shown_beside(plan, plan.free, opening.start, opening.along, places, asides)
    deep = np.count_nonzero(free.reshape(len(places), 2, -1), axis=-1)
    return bool(((deep >= FEWEST).mean(axis=0) > FLOOR_SHARE).all())


def _reach_both_sides(beams: Beams, opening: Opening) -> bool:
    """Whether beams end on both sides of a wall."""
    way = opening.along
    readings = beams.readings
    about = readings.nearby.strip(opening.start - ABOUT * way, opening.end + ABOUT * way, FAR)
    along, aside = beside(readings.ends[about], opening.start, opening.bearing)
    aside = aside[(along > -ABOUT) & (along < opening.width + ABOUT)]
    on = np.count_nonzero(np.abs(aside) < BEYOND)
    sides = [np.count_nonzero((side > BEYOND) & (side < FAR)) for side in (aside, -aside)]
    return bool(min(sides) > STRAY * on)
