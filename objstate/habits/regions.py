"""The regions of a door's state: closed, and as many others as the places have where doors stood."""

from __future__ import annotations

import math

import numpy as np

from objstate.geometry import FloatArray, IntArray

CLOSED_RAD, CLOSED_M = math.radians(10.0), 0.1  # up to which a door counts as closed
MOST_OTHERS = 3  # regions beside it: ajar, open, wide
LEAST_PLACES = 20  # from so many places on it is asked whether they fall apart
LEAST_STD_RAD, LEAST_STD_M = math.radians(4.0), 0.05  # within a region


def region_bounds(places: FloatArray, closed: float, least_std: float) -> tuple[float, ...]:
    """Bounds between regions, ascending, the first of them ``closed``.

    ``places`` (n,) are the distances from the closed state at which doors stood. Those beyond
    ``closed`` are cut into one to three groups, each about normal, as many as Bayes' information
    criterion asks for.
    """
    others = np.sort(places[places > closed])
    if len(others) < LEAST_PLACES:
        return (closed,)
    best, cuts = np.inf, tuple[float, ...]()
    for groups in range(1, MOST_OTHERS + 1):
        found, cost = _cut(others, groups, least_std)
        cost += (3 * groups - 1) / 2.0 * math.log(len(others))
        if cost < best:
            best, cuts = cost, found
    return (closed, *cuts)


def region_of(distances: FloatArray, bounds: tuple[float, ...]) -> IntArray:
    """(n,) the region of each distance from the closed state."""
    return np.asarray(np.searchsorted(bounds, distances, side="left"))


def _cut(values: FloatArray, groups: int, least_std: float) -> tuple[tuple[float, ...], float]:
    """The bounds between so many groups of ascending values, and minus the log-likelihood; by dynamic programming."""
    n = len(values)
    sums, squares = (np.concatenate([[0.0], np.cumsum(values**k)]) for k in (1, 2))
    grid = np.unique(np.linspace(0, n, min(n, 200) + 1).astype(int))  # where groups may end
    low, high = grid[:, None], grid[None]
    count = np.maximum(high - low, 1)
    mean = (sums[high] - sums[low]) / count
    variance = np.maximum((squares[high] - squares[low]) / count - mean**2, 0.0) + least_std**2
    cost = count * (0.5 * np.log(variance) + 0.5 - np.log(count / n))
    cost = np.where(high > low, cost, np.inf)
    best, back = cost[0], []
    for _ in range(groups - 1):
        over = best[:, None] + cost
        back.append(over.argmin(axis=0))
        best = over.min(axis=0)
    ends, at = [], len(grid) - 1
    for step in reversed(back):
        at = int(step[at])
        ends.append(int(grid[at]))
    bounds = tuple(float((values[k - 1] + values[k]) / 2.0) for k in sorted(ends))
    return bounds, float(best[-1])
