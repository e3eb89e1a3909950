"""How far it is around an opening: a door parts what nothing else joins near by."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import beside
from objstate.discovery.walls import Opening
from objstate.geometry import BoolArray, FloatArray

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
    from scipy import ndimage
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import dijkstra

    occupied, free, middles = _about(opening, plan)
    along, aside = beside(middles.reshape(-1, 2), opening.start, opening.bearing)
    along, aside = along.reshape(free.shape), aside.reshape(free.shape)
    clearance = ndimage.distance_transform_edt(~occupied) * plan.resolution
    bar = (along > -BEYOND) & (along < opening.width + BEYOND) & (np.abs(aside) < BAR)
    able = free & (clearance > BODY) & ~bar
    between = able & (along > INSIDE) & (along < opening.width - INSIDE)
    numbers = np.cumsum(able).reshape(able.shape) - 1
    ends = [
        numbers[between & (sign * aside > NEARBY[0]) & (sign * aside < NEARBY[1])]
        for sign in (1, -1)
    ]
    if min(len(end) for end in ends) < FEWEST:
        return None
    parts = [
        (numbers[a][ok], numbers[b][ok], way)
        for a, b, way in _steps(able.shape)
        if (ok := able[a] & able[b]).any()
    ]
    rows, columns = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    ways = np.concatenate([np.full(len(part[0]), part[2] * plan.resolution) for part in parts])
    count = int(able.sum())
    graph = coo_matrix((ways, (rows, columns)), shape=(count, count)).tocsr()
    far = dijkstra(graph, directed=False, indices=ends[0], min_only=True, limit=SHORT)
    return bool(np.isfinite(far[ends[1]]).any())


def _about(opening: Opening, plan: OccupancyMap) -> tuple[BoolArray, BoolArray, FloatArray]:
    """The map's cells about an opening: occupied ones, free ones, and middles (..., 2) m."""
    reach = int(np.ceil((SHORT / 2.0 + opening.width) / plan.resolution))
    column, row = np.floor(plan.to_cells(opening.middle[None])[0]).astype(int)
    low = max(row - reach, 0), max(column - reach, 0)
    near = slice(low[0], max(row + reach, 0)), slice(low[1], max(column + reach, 0))
    occupied, free = plan.occupied[near], plan.free[near]
    rows, columns = np.indices(occupied.shape)
    cells = np.column_stack([(columns + low[1]).ravel(), (rows + low[0]).ravel()]) + 0.5
    return occupied, free, plan.to_building(cells).reshape(*occupied.shape, 2)


def _steps(
    shape: tuple[int, ...],
) -> Iterator[tuple[tuple[slice, slice], tuple[slice, slice], float]]:
    """Pairs of neighbouring cells of a grid, as slices, and the way between them in cells."""
    for down, right in ((0, 1), (1, 0), (1, 1), (1, -1)):
        a = slice(0, shape[0] - down), slice(max(-right, 0), shape[1] - max(right, 0))
        b = slice(down, shape[0]), slice(max(right, 0), shape[1] - max(-right, 0))
        yield a, b, float(np.hypot(down, right))
