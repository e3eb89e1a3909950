"""Shapes as cells with values (Darmstadt, section 6.1.4, algorithms 3 and 4).

A drawing is a value: the cells that a shape covers, and their values. Any grid can add it, by the
rule of its cells or by a merge.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from objstate.errors import GridError
from objstate.geometry import FloatArray
from objstate.grid.layout import Layout
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.grid import rasters
else:
    rasters = Later("objstate.grid.rasters")

UNKNOWN = 0.5
ROUND = 1e-9  # relative; how far the two halves of a covariance may differ


@dataclass(frozen=True, eq=False)
class Drawing:
    """Cells of a layout, each once, and their values."""

    layout: Layout
    where: NDArray[np.int32] = field(repr=False)  # (m,) indices, row by row
    values: NDArray[np.float32] = field(repr=False)  # (m,)

    def scaled(self, share: float, about: float = UNKNOWN) -> Drawing:
        """Values scaled about the neutral value ``about`` (ValueScaling)."""
        return Drawing(self.layout, self.where, about + np.float32(share) * (self.values - about))

    def plane(self, elsewhere: float = UNKNOWN) -> NDArray[np.float32]:
        """(rows, columns) the values, and ``elsewhere`` what the others have."""
        plane = np.full(self.layout.size, elsewhere, dtype=np.float32)
        plane[self.where] = self.values
        return plane.reshape(self.layout.shape)


def beam(
    layout: Layout, start: FloatArray, end: FloatArray, reach: float, obstacle: bool
) -> Drawing:
    """A ray between points (2,) m: free cells by Bresenham's algorithm, algorithm 4, and its end.

    The end is occupied if there is an ``obstacle``, else free. Values fall to 0.5 at a distance of
    ``reach`` m, eq. (6.9). The algorithm as printed swaps the ends of rays that run to the left;
    here all run from the robot, so that only ties between two cells may differ.
    """
    _positive(reach, "reach of a beam, m")
    first, last = np.floor(layout.to_cells(_points(np.stack([start, end])))).astype(np.int64)
    far = np.abs(last - first)
    main = int(far[1] > far[0])
    steps = int(far[main])
    taken = np.arange(steps + 1)
    minor = (2 * taken * far[1 - main] + steps) // max(1, 2 * steps)
    walked = np.stack([taken, minor] if main == 0 else [minor, taken], axis=-1)
    cells = first + np.sign(last - first) * walked
    middles = (cells - first) * layout.resolution
    reliability = 1.0 - np.minimum(1.0, np.hypot(middles[:, 0], middles[:, 1]) / reach)
    signs = np.full(steps + 1, -0.5)
    signs[-1] = 0.5 if obstacle else -0.5
    return _on(layout, cells, UNKNOWN + signs * reliability)


def ellipse(
    layout: Layout,
    centre: FloatArray,
    semiaxes: tuple[float, float],
    yaw: float,
    value: float,
) -> Drawing:
    """The cells of a filled ellipse at a point (2,) m with semiaxes, m, the first at ``yaw``.

    Algorithm 3 with eqs. (6.10) to (6.17): a cell belongs to it if its distance, turned by ``-yaw``
    and divided by the semiaxes, is 1 at most. Eq. (6.14) and (6.17) leave a square out, and the box
    of algorithm 3 is too small for a scale above 1; eq. (6.13) and the cells that the ellipse
    reaches are taken.
    """
    for each in semiaxes:
        _positive(each, "semiaxis of an ellipse, m")
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    covariance = turn @ np.diag(np.square(semiaxes)) @ turn.T
    cells, _ = _within(layout, centre, covariance, 1.0)
    return _on(layout, cells, np.full(len(cells), value))


def circle(layout: Layout, centre: FloatArray, radius: float, value: float) -> Drawing:
    """The cells of a filled circle, eq. (6.18)."""
    return ellipse(layout, centre, (radius, radius), 0.0, value)


def gaussian(
    layout: Layout,
    mean: FloatArray,
    covariance: FloatArray,
    value: float,
    share: float = 0.9,
    about: float = UNKNOWN,
) -> Drawing:
    """A Gaussian (2,), (2, 2) m, in the ellipse that holds a share of it: ``value`` at its mean.

    Eqs. (6.19) to (6.21). Elsewhere values fall to ``about`` as the density does with the
    Mahalanobis distance, eq. (2.25). Semiaxes are roots of eigenvalues, which the text takes
    themselves.
    """
    if not 0.0 < share < 1.0:
        raise GridError(f"An ellipse can't hold the share {share:g} of a Gaussian; give 0.9.")
    quantile = -2.0 * math.log(1.0 - share)  # of a chi-squared distribution with two degrees
    cells, squared = _within(layout, mean, _covariance(covariance), quantile)
    return _on(layout, cells, about + (value - about) * np.exp(-squared / 2.0))


def spread_of(semiaxes: tuple[float, float], yaw: float) -> FloatArray:
    """The covariance (2, 2) whose 1-sigma ellipse has semiaxes, m, the first at ``yaw``.

    Eqs. (6.22) to (6.24); as printed, (6.24) turns one side of the matrix only, which leaves it
    unsymmetric.
    """
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    return np.asarray(turn @ np.diag(np.square(semiaxes)) @ turn.T)


def rectangle(
    layout: Layout, centre: FloatArray, size: tuple[float, float], yaw: float, value: float
) -> Drawing:
    """The cells that a rectangle touches, of a length at ``yaw`` and a width, m."""
    for each in size:
        _positive(each, "side of a rectangle, m")
    halves = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * np.asarray(size) / 2.0
    cos, sin = math.cos(yaw), math.sin(yaw)
    corners = np.asarray(centre) + halves @ np.array([[cos, sin], [-sin, cos]])
    return polygon(layout, corners, value)


def polygon(layout: Layout, corners: FloatArray, value: float) -> Drawing:
    """The cells that a polygon (k, 2) m touches, as of a footprint; it need not be convex."""
    covered = expected_occupancy(layout, [corners], np.ones(1))
    return Drawing(layout, covered.where, np.full(len(covered.where), value, dtype=np.float32))


def expected_occupancy(
    layout: Layout, outlines: Sequence[FloatArray], weights: FloatArray
) -> Drawing:
    """The probability that an object touches a cell, of the footprints (k, 2) m it may have.

    ``weights`` (n,) are the probabilities of the footprints. They sum to the probability that the
    object is there at all.
    """
    if len(outlines) != len(weights):
        raise GridError(f"{len(outlines)} footprints can't have {len(weights)} weights.")
    if not (np.isfinite(weights).all() and (weights >= 0.0).all()):
        raise GridError("Weights of footprints have to be finite and not negative.")
    if not len(outlines):
        return Drawing(layout, np.empty(0, np.int32), np.empty(0, np.float32))
    lengths = np.array([len(outline) for outline in outlines], dtype=np.int32)
    cells = layout.to_cells(_points(np.concatenate(outlines)))
    size = np.array([layout.columns, layout.rows])
    low = np.clip(np.floor(cells.min(axis=0)), 0, size).astype(np.int64)
    high = np.clip(np.floor(cells.max(axis=0)) + 1, low, size).astype(np.int64)
    plane = np.zeros((high - low)[::-1])
    mark = np.full(plane.size, -1, dtype=np.int32)
    rasters.cover(mark, plane, cells - low, lengths, np.asarray(weights, dtype=float))
    rows, columns = np.nonzero(plane)
    return _on(layout, np.column_stack([columns, rows]) + low, plane[rows, columns])


def swept(way: FloatArray, radius: float) -> list[FloatArray]:
    """The footprints (k, 2) m of a disc on each leg of a way (n, 2) m, n > 0.

    Legs are apart, so that what a way leads around isn't covered.
    """
    import shapely

    ends = way if len(way) > 1 else np.concatenate([way, way])
    legs = shapely.linestrings(np.stack([ends[:-1], ends[1:]], axis=1))
    return [shapely.get_coordinates(each)[:-1] for each in shapely.buffer(legs, radius)]


def _within(
    layout: Layout, centre: FloatArray, covariance: FloatArray, quantile: float
) -> tuple[NDArray[np.int64], FloatArray]:
    """Cells (m, 2) within a squared Mahalanobis distance of a point, and distances (m,)."""
    middle = np.floor(layout.to_cells(_points(np.asarray(centre, dtype=float)))).astype(np.int64)
    cos, sin = math.cos(layout.origin[2]), math.sin(layout.origin[2])
    to_cells = np.array([[cos, sin], [-sin, cos]]) / layout.resolution
    spread = to_cells @ covariance @ to_cells.T
    reach = np.sqrt(quantile * np.diag(spread)).astype(np.int64)
    size = np.array([layout.columns, layout.rows])
    low, high = np.maximum(middle - reach, 0), np.minimum(middle + reach, size - 1)
    if (high < low).any():
        return np.empty((0, 2), dtype=np.int64), np.empty(0)
    column, row = np.meshgrid(*(np.arange(a, b + 1) for a, b in zip(low, high, strict=True)))
    cells = np.stack([column.ravel(), row.ravel()], axis=-1)
    away = cells - middle
    squared = np.einsum("ni,ij,nj->n", away, np.linalg.inv(spread), away)
    kept = squared <= quantile
    return cells[kept], squared[kept]


def _on(layout: Layout, cells: NDArray[np.int64], values: FloatArray) -> Drawing:
    """Of cells (m, 2), column and row, those on the grid."""
    kept = layout.within(cells.astype(float))
    where = cells[kept, 1] * layout.columns + cells[kept, 0]
    return Drawing(layout, where.astype(np.int32), values[kept].astype(np.float32))


def _points(points: FloatArray) -> FloatArray:
    if not np.isfinite(points).all():
        raise GridError("A shape can't be drawn at a place that is not finite; leave it out.")
    return points


def _positive(value: float, name: str) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise GridError(f"The {name}, can't be {value:g}; give a number above 0.")


def _covariance(covariance: FloatArray) -> FloatArray:
    matrix = np.asarray(covariance, dtype=float)
    if matrix.shape != (2, 2) or not np.isfinite(matrix).all():
        raise GridError("The covariance of a Gaussian has to be a finite matrix of 2 by 2, m^2.")
    if (
        abs(matrix[0, 1] - matrix[1, 0]) > ROUND * np.abs(matrix).max()
        or not (np.linalg.eigvalsh(matrix) > 0.0).all()
    ):
        raise GridError(
            f"{matrix.tolist()} is no covariance: it has to be symmetric with eigenvalues above 0."
        )
    return matrix
