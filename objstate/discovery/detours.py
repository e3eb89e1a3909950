"""How far it is around an opening: a door parts what nothing else joins near by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import beside
from objstate.discovery.walls import Opening
from objstate.gaze.floor import edges_between
from objstate.geometry import FloatArray

BODY = 0.15  # m that the way stays off whatever the map shows
NEARBY, BAR = (0.1, 0.8), 0.1  # m across, where a way begins and ends, and what it must not cross
BEYOND = 0.25  # m of the jambs that the way must not cross either: walls have holes in a map
INSIDE = 0.1  # m from the jambs
SHORT = 6.0  # m, of a way around
FEWEST = 4  # cells on either side
# probability of a short way around an opening of a wall, and around a gap between things
AROUND_WALL, AROUND_THINGS = 0.05, 0.5


def with_ways_around(found: list[Opening], plan: OccupancyMap) -> list[Opening]:
    """The openings, with the probability of a wall by whether there is a short way around, too.

    Where the map knows too little of either side, that tells nothing.
    """
    out = []
    for opening in found:
        is_short = has_way_around(opening, plan)
        if is_short is None:
            out.append(opening)
            continue
        wall, things = AROUND_WALL, AROUND_THINGS
        if not is_short:
            wall, things = 1.0 - wall, 1.0 - things
        p_wall = opening.p_wall * wall
        out.append(replace(opening, p_wall=p_wall / (p_wall + (1.0 - opening.p_wall) * things)))
    return out


def has_way_around(opening: Opening, plan: OccupancyMap) -> bool | None:
    """Whether the map shows a short way from one side of an opening to the other around it.

    None where it doesn't show enough of a side.
    """
    from scipy.ndimage import distance_transform_edt
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import dijkstra

    near, middles = _about(opening, plan)
    along, aside = beside(plan.to_building(middles), opening.start, opening.bearing)
    clearance = distance_transform_edt(~plan.occupied[near]) * plan.resolution
    bar = (along > -BEYOND) & (along < opening.width + BEYOND) & (np.abs(aside) < BAR)
    able = (plan.free[near] & (clearance > BODY)).reshape(-1) & ~bar
    between = able & (along > INSIDE) & (along < opening.width - INSIDE)
    left, right = (
        np.flatnonzero(between & (side > NEARBY[0]) & (side < NEARBY[1]))
        for side in (aside, -aside)
    )
    if min(len(left), len(right)) < FEWEST:
        return None
    here, there = edges_between(able.reshape(clearance.shape)).T
    ways = np.hypot(*(middles[there] - middles[here]).T) * plan.resolution
    graph = csr_array((ways, (here, there)), shape=(len(able), len(able)))
    far = dijkstra(graph, directed=False, indices=left, min_only=True, limit=SHORT)
    return bool(np.isfinite(far[right]).any())


def _about(opening: Opening, plan: OccupancyMap) -> tuple[tuple[slice, slice], FloatArray]:
    """The rows and columns of a map about an opening, and middles (n, 2) of their cells, in cells."""
    reach = int(np.ceil((SHORT / 2.0 + opening.width) / plan.resolution))
    column, row = np.floor(plan.to_cells(opening.middle[None])[0]).astype(int)
    (top, bottom), (left, right) = (
        np.clip([middle - reach, middle + reach], 0, count)
        for middle, count in zip((row, column), plan.occupied.shape, strict=True)
    )
    columns, rows = np.meshgrid(np.arange(left, right), np.arange(top, bottom))
    middles = np.column_stack([columns.reshape(-1), rows.reshape(-1)]) + 0.5
    return (slice(top, bottom), slice(left, right)), middles
