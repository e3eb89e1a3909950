"""Scans are registered to each other and to the map, so that they agree about where surfaces are.

The filter knows a pose to some centimetres, along a corridor less well, while what a look tells of
a leaf is as sure as a hundred readings of 2 cm noise. So the surfaces that readings show are summed
up in squares of the floor, by a normal distribution in each (Biber and Strasser 2003), and the
poses of all scans and the places of all surfaces are adjusted to each other (Lu and Milios 1997).
The map is one more scan, which stays where it is.

Only surfaces tell that the map shows as well: leaves, furniture and people move. Of a square only
the normal of a flat surface tells, since of a corner each scan sees other parts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery.doorway import thinned
from objstate.discovery.gathering import Beams
from objstate.discovery.walls import WallLine, fitted, shown_at
from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later

if TYPE_CHECKING:
    from scipy import ndimage, sparse
    from scipy.sparse import linalg
else:
    ndimage, sparse = Later("scipy.ndimage"), Later("scipy.sparse")
    linalg = Later("scipy.sparse.linalg")

PLACE_STD, TURN_STD = 0.08, np.radians(1.0)  # m, rad: of a scan's pose, as the filter has it
SIDES = 0.3, 0.3, 0.2, 0.15, 0.15  # m, of squares, in turn
SHIFTS = np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 0.5], [0.5, 0.5]])  # squares overlap
FEWEST = 10  # readings in a square
READING_STD = 0.02  # m, of a reading about its surface
CELL_STD = 0.03  # m, of a map's cell about it
FLAT = 0.5  # of the variance along a surface: across it, from which on it has no normal
OUTLIER = 2.0  # deviations at which a reading counts by half
TOLD = 100.0  # readings of a scan that tell something of their own
KEPT = 150  # beams of a scan, of which the others tell nothing of their own
NEAR_MAP = 0.2  # m from the next occupied cell of the map up to which it shows a surface
LEAST_KNOWN = 1e-9  # 1/m², of a surface's place
ACCURACY, MOST_STEPS = 1e-3, 100  # relative, of the solution, and steps to it


def registered(
    lines: list[WallLine], beams: Beams, plan: OccupancyMap
) -> tuple[list[WallLine], Beams]:
    """Lines and beams that agree with each other, and on average with a map."""
    off = ndimage.distance_transform_edt(~plan.occupied, sampling=plan.resolution)
    is_near, cells = np.asarray(off <= NEAR_MAP), plan.middles
    kept = thinned(beams.scan, KEPT)
    kept = kept[np.isfinite(beams.ranges[kept])]
    moved = np.zeros((len(beams.scans) - 1, 3))
    for side in SIDES:
        seen = kept[shown_at(plan, is_near, beams.ends(kept))]
        by = _adjustment(beams, seen, cells, moved, side)
        beams, moved = _moved(beams, by), moved + by
    return fitted(lines, beams), beams


def _adjustment(
    beams: Beams, numbers: IntArray, cells: FloatArray, moved: FloatArray, side: float
) -> FloatArray:
    """(s, 3) by how much scans have to be moved, m, and turned, rad, which were ``moved`` already.

    A step of robust Gauss-Newton for all scans and surfaces, in which the places of surfaces are
    eliminated; by the beams of some numbers, and the middles of a map's cells.
    """
    ends = beams.ends(numbers)
    squares = _squares(np.concatenate([ends, cells]), side)
    square, of_cells = squares[:, : len(ends)].ravel(), squares[:, len(ends) :].ravel()
    points, cells = np.tile(ends, (len(SHIFTS), 1)), np.tile(cells, (len(SHIFTS), 1))
    surfaces = _Surfaces.of(points, square, int(squares.max()) + 1)

    scan = np.tile(beams.scan[numbers], len(SHIFTS))
    reach = np.tile(beams.ranges[numbers, None] * beams.directions[numbers], (len(SHIFTS), 1))
    most = TOLD / np.maximum(np.bincount(scan, minlength=len(moved)) / len(SHIFTS), TOLD)
    aside, weight = surfaces.told(points, square, READING_STD)
    normal = surfaces.normal[square]
    turn = normal[:, 1] * reach[:, 0] - normal[:, 0] * reach[:, 1]
    slope = np.column_stack([normal, turn])
    by_map = surfaces.told(cells, of_cells, np.hypot(READING_STD, CELL_STD))
    seen = _Residuals(scan, square, aside, weight * most[scan], slope)
    return _solved(seen, moved, _pull(of_cells, *by_map, len(surfaces.normal)))


class _Residuals(NamedTuple):
    """How far readings lie from their surfaces."""

    scan: IntArray  # (n,)
    square: IntArray  # (n,)
    aside: FloatArray  # (n,) m
    weight: FloatArray  # (n,) 1/m²
    slope: FloatArray  # (n, 3) of that, by how a scan is moved and turned


def _pull(
    square: IntArray, aside: FloatArray, weight: FloatArray, count: int
) -> tuple[FloatArray, FloatArray]:
    """What points tell of the places of surfaces (count,): information 1/m², and its pull 1/m."""
    known, pull = (np.bincount(square, each, count) for each in (weight, weight * aside))
    return known.astype(float), pull.astype(float)


def _solved(
    seen: _Residuals, moved: FloatArray, by_map: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """(s, 3) moves of scans that fit readings, map and prior best, by conjugate gradients."""
    scan, square, aside, weight, slope = seen
    scans, count = len(moved), len(by_map[0])
    known, pull = np.add(by_map, _pull(square, aside, weight, count))
    prior = 1.0 / np.square([PLACE_STD, PLACE_STD, TURN_STD])
    own = np.zeros((scans, 3, 3)) + np.diag(prior)
    np.add.at(own, scan, weight[:, None, None] * slope[:, :, None] * slope[:, None, :])
    rows, columns = (3 * scan[:, None] + np.arange(3)).ravel(), np.repeat(square, 3)
    values = (weight[:, None] * slope).ravel()
    joint = sparse.csr_matrix((values, (rows, columns)), shape=(3 * scans, count))
    of_surfaces = joint.T.tocsr()
    apart = 1.0 / np.maximum(known, LEAST_KNOWN)
    inverse: FloatArray = np.linalg.inv(own).astype(float)

    def times(blocks: FloatArray, by: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("sij,sj->si", blocks, by.reshape(-1, 3)).ravel())

    def left(by: FloatArray) -> FloatArray:
        return np.asarray(times(own, by) - joint @ (apart * (of_surfaces @ by)))

    right = joint @ (apart * pull) - (prior * moved).ravel()
    right -= np.bincount(rows, np.repeat(aside, 3) * values, 3 * scans)
    shape = 2 * (3 * scans,)
    by, _ = linalg.cg(
        linalg.LinearOperator(shape, left, dtype=float),
        right,
        M=linalg.LinearOperator(shape, partial(times, inverse), dtype=float),
        rtol=ACCURACY,
        maxiter=MOST_STEPS,
    )
    return np.asarray(by).reshape(-1, 3)


def _squares(points: FloatArray, side: float) -> IntArray:
    """(shifts, n) the number of the square in which each of some points (n, 2) lies."""
    at = np.floor(points / side + SHIFTS[:, None]).astype(np.int64)
    at -= at.min(axis=(0, 1))
    width, height = at.max(axis=(0, 1)) + 1
    key = (np.arange(len(SHIFTS))[:, None] * height + at[..., 1]) * width + at[..., 0]
    return np.asarray(np.unique(key, return_inverse=True)[1]).reshape(key.shape)


@dataclass(frozen=True, eq=False)
class _Surfaces:
    """The surface in each of some squares."""

    middle: FloatArray  # (k, 2) m
    normal: FloatArray  # (k, 2) unit vectors
    variance: FloatArray  # (k,) m², across it
    flatness: FloatArray  # (k,) from 0, where it has no normal, to 1

    @staticmethod
    def of(points: FloatArray, square: IntArray, count: int) -> _Surfaces:
        """Those of points (n, 2) in squares (n,)."""
        number = np.bincount(square, minlength=count)
        some = np.maximum(number, 1)
        sums = [np.bincount(square, each, count) for each in points.T]
        middle: FloatArray = np.column_stack(sums) / some[:, None]
        x, y = (points - middle[square]).T
        xx, xy, yy = (np.bincount(square, each, count) / some for each in (x * x, x * y, y * y))
        across = (xx + yy) / 2.0 - np.hypot((xx - yy) / 2.0, xy)
        along = xx + yy - across
        angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)  # of the surface
        noise = READING_STD**2
        flatness = np.clip(1.0 - (across + noise) / (FLAT * (along + noise)), 0.0, 1.0)
        return _Surfaces(
            middle,
            np.column_stack([-np.sin(angle), np.cos(angle)]),
            across,
            np.where(number >= FEWEST, flatness, 0.0),
        )

    def told(
        self, points: FloatArray, square: IntArray, std: float
    ) -> tuple[FloatArray, FloatArray]:
        """How far points (n, 2) of a deviation lie from the surfaces of their squares (n,), m.

        And their weights (n,), 1/m²; each point is in as many squares as there are shifts.
        """
        aside = ((points - self.middle[square]) * self.normal[square]).sum(axis=1)
        variance = self.variance[square] + std**2
        robust = 1.0 + np.square(aside / OUTLIER) / variance
        return aside, self.flatness[square] / (robust * variance * len(SHIFTS))


def _moved(beams: Beams, by: FloatArray) -> Beams:
    """The beams of scans that were moved (s, 3) in x and y, and turned about their lasers."""
    x, y, turn = by[beams.scan].T
    cos, sin = np.cos(turn), np.sin(turn)
    a, b = beams.directions.T
    directions = np.column_stack([cos * a - sin * b, sin * a + cos * b])
    return replace(beams, origins=beams.origins + np.column_stack([x, y]), directions=directions)
