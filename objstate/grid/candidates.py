"""Candidates for objects: obstacles that stay in place and are not in the building.

Occupied cells that touch form one thing. Each observation says whether it is still there: a
permanent thing was hardly ever moved meanwhile, a passing one was with a probability that grows
with the time since the last observation (Elfring et al. 2012, section III-F: detections make new
objects or are clutter).
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import exp, hypot, log, log1p
from typing import Any

import numpy as np
from numpy.typing import NDArray

from objstate.geometry import BoolArray, FloatArray, IntArray, wrapped
from objstate.grid.grid import FREE, OCCUPIED
from objstate.grid.layout import Layout
from objstate.records import NANOSECONDS

PRIOR = 0.3  # probability that what is seen once stays
STAYS_S = 3600.0  # s, for which things that stay do so, on average
PASSES_S = 30.0  # s, for which people and what they push stand, on average
MISSED = 0.02  # probability of a wrong observation
GONE = 0.05  # probability of being real below which a candidate is dropped
REAL = 0.5  # probability from which on it is reported
FEWEST = 3  # cells
TOUCHING = np.ones((3, 3), bool)
MAJORITY = 0.5  # of the cells that an observation sees


@dataclass(frozen=True, eq=False)
class Candidate:
    """A thing that may be an object."""

    name: str
    cells: IntArray = field(repr=False)  # (n,) numbers in the layout
    log_odds: float  # that it is real
    looks: int
    first_ns: int
    seen_ns: int  # of the last observation

    @property
    def probability(self) -> float:
        """That it stays."""
        return 1.0 / (1.0 + exp(-self.log_odds))

    def places(self, layout: Layout) -> FloatArray:
        """(n, 2) m, the middles of its cells."""
        rows, columns = np.unravel_index(self.cells, layout.shape)
        return layout.to_frame(np.column_stack([columns, rows]).astype(float) + 0.5)

    def outline(self, layout: Layout) -> FloatArray:
        """(k, 2) m, the convex hull of its cells, counterclockwise."""
        import shapely

        hull = self._hull(layout)
        return np.asarray(shapely.get_coordinates(shapely.orient_polygons(hull))[:-1])

    def box(self, layout: Layout) -> tuple[FloatArray, tuple[float, float]]:
        """Pose (3,) and sides in m of the smallest box around it, the longer along x.

        A thing occupies the cells that it touches, on average one more than its sides are long. So
        that is taken off the box around them.
        """
        import shapely

        corners = shapely.get_coordinates(shapely.minimum_rotated_rectangle(self._hull(layout)))
        first, second = corners[1] - corners[0], corners[2] - corners[1]
        long, short = sorted((first, second), key=lambda side: -hypot(*side))
        yaw = (
            wrapped(2.0 * float(np.arctan2(long[1], long[0]))) / 2.0
        )  # turned by half it is the same
        x, y = corners[:4].mean(axis=0).tolist()
        cell = layout.resolution
        length, width = (max(hypot(*side) - cell, cell) for side in (long, short))
        return np.array([x, y, yaw]), (length, width)

    def _hull(self, layout: Layout) -> Any:
        import shapely

        half = layout.resolution / 2.0
        corners = np.array([[-half, -half], [-half, half], [half, half], [half, -half]])
        return shapely.convex_hull(
            shapely.MultiPoint((self.places(layout)[:, None] + corners).reshape(-1, 2))
        )


@dataclass(frozen=True)
class Candidates:
    """All candidates on a layout. ``looked`` returns the next value."""

    layout: Layout
    known: tuple[Candidate, ...] = ()
    counted: int = 0  # that ever were, for their names

    @property
    def real(self) -> tuple[Candidate, ...]:
        """Those that probably are objects, the most probable first."""
        found = [each for each in self.known if each.probability >= REAL]
        return tuple(sorted(found, key=lambda each: -each.log_odds))

    def looked(self, values: NDArray[np.float32], fresh: BoolArray, stamp_ns: int) -> Candidates:
        """Update by P(occupied) (rows, columns), and by which cells were seen."""
        from scipy.ndimage import binary_dilation, label

        occupied, free = values > OCCUPIED, values < FREE
        blobs, count = label(binary_dilation(occupied, TOUCHING), TOUCHING)
        blobs = np.where(occupied, blobs, 0)
        taken = np.zeros(count + 1, bool)
        kept: list[Candidate] = []
        for each in self.known:
            after = _looked_again(each, occupied, free, fresh, blobs, stamp_ns)
            taken[np.unique(blobs.ravel()[after.cells])] = True
            if after.probability >= GONE and not any(_holds(other, after) for other in kept):
                kept.append(after)
        sizes = np.bincount(blobs.ravel()[(occupied & fresh).ravel()], minlength=count + 1)
        new = np.flatnonzero((sizes >= FEWEST) & ~taken & (np.arange(count + 1) > 0)).tolist()
        odds = log(PRIOR) - log1p(-PRIOR)
        for number, blob in enumerate(new, start=self.counted + 1):
            cells = np.flatnonzero(blobs == blob)
            kept.append(Candidate(f"unknown_{number}", cells, odds, 1, stamp_ns, stamp_ns))
        return Candidates(self.layout, tuple(kept), self.counted + len(new))


def _looked_again(
    each: Candidate,
    occupied: BoolArray,
    free: BoolArray,
    fresh: BoolArray,
    blobs: IntArray,
    stamp_ns: int,
) -> Candidate:
    """A candidate after an observation, by Bayes' rule; unchanged where it wasn't seen."""
    flat = occupied.ravel()[each.cells], free.ravel()[each.cells], fresh.ravel()[each.cells]
    seen = int(flat[2].sum())
    if seen == 0:
        return each
    there, gone = int((flat[0] & flat[2]).sum()), int((flat[1] & flat[2]).sum())
    if max(there, gone) < MAJORITY * seen:
        return each
    gap = (stamp_ns - each.seen_ns) / NANOSECONDS
    stays, passes = (_still(gap, mean) for mean in (STAYS_S, PASSES_S))
    if there < gone:
        stays, passes = 1.0 - stays, 1.0 - passes
    own = np.setdiff1d(np.unique(blobs.ravel()[each.cells]), [0])
    seen_now = np.flatnonzero(np.isin(blobs, own)) if there >= gone else np.empty(0, int)
    left = each.cells[~(flat[1] & flat[2])]
    return replace(
        each,
        cells=np.union1d(left, seen_now) if there >= gone else each.cells,
        log_odds=each.log_odds + log(stays) - log(passes),
        looks=each.looks + 1,
        seen_ns=stamp_ns,
    )


def _holds(one: Candidate, other: Candidate) -> bool:
    """Whether the first takes all cells of the second: both turned out to be parts of one thing."""
    outer, inner = one.cells, other.cells  # in order
    if outer[0] > inner[0] or outer[-1] < inner[-1]:
        return False
    return bool(np.isin(inner, outer, assume_unique=True).all())


def _still(gap: float, mean: float) -> float:
    """Probability of seeing a thing again, given its mean duration of standing."""
    return MISSED + (1.0 - 2.0 * MISSED) * exp(-gap / mean)
