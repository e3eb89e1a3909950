"""Where a camera that pans and tilts should look: by particles, as the thesis does, or the best of all.

Particles (section 6.3.3) follow the cells with the most bits times weight while the map is gone
through; the views about those few are then compared. The best of all is found from the picture of a
camera that turns all round: any view is a window of it, and sums over windows are differences of
sums.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from objstate.errors import GridError
from objstate.gaze.field.pan_tilt import RIGHT, PanTilt, clamped
from objstate.geometry import FloatArray, between, compose
from objstate.grid import Layout
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.gaze.field import kernels
else:
    kernels = Later("objstate.gaze.field.kernels")

Plane = NDArray[np.float32]  # (rows, columns)
Cells = NDArray[np.int32]  # (n,) row by row

STEP = math.radians(2.0)  # rad, between pixels of the panorama
NESTED = 4  # windows one in the other, whose mean falls from the middle of the view to its edges
LEAST = math.radians(2.0)  # rad below the horizon, from where the floor is looked at


@dataclass(frozen=True)
class Focus:
    """A place to look at."""

    place: FloatArray = field(repr=False)  # (2,) m in the grid's frame
    pan: float  # rad to the left of the robot's heading
    tilt: float  # rad below the horizon
    bits: float  # mean of the view, or of the cell where only cells are compared


class FocusGazer:
    """Chooses places on a grid for one camera."""

    def __init__(
        self, layout: Layout, camera: PanTilt, particles: int = 10, apart: float = 0.4
    ) -> None:
        if particles < 1 or not (math.isfinite(apart) and apart >= 0.0):
            raise GridError(
                f"{particles} particles {apart:g} m apart can't be; give 1 or more, 0 m or more."
            )
        self.layout, self.camera, self.particles, self.apart = layout, camera, particles, apart
        self._centres = layout.centres().reshape(-1, 2)

    def by_particles(
        self,
        bits: Plane,
        robot: FloatArray,
        focus: FloatArray,
        rng: np.random.Generator,
        seeds: Sequence[FloatArray] = (),
        scatter: float = 0.5,
        *,
        views: bool = True,
    ) -> list[Focus]:
        """Places by particles, the best first, from a robot's pose (3,) and the last place (2,) m.

        Particles begin at random within ``scatter`` m of the first seed; seeds (2,) m are
        candidates besides. Candidates are ranked by the entropy of the view about them, eq. (6.36),
        which here is clipped at a Mahalanobis distance of 1, or, without ``views``, by eqs. (6.34)
        and (6.35).
        """
        self._check(bits)
        weights = self.weights(robot, focus)
        begin = np.asarray(seeds[0] if len(seeds) else robot[:2], dtype=float)
        started = begin + scatter * rng.uniform(-1.0, 1.0, (self.particles, 2))
        cells = self.cells(started)
        flat, where = bits.reshape(-1), np.flatnonzero(weights > 0.0).astype(np.int32)
        cells = cells[np.lexsort((-weights[cells], -flat[cells] * weights[cells]))]
        apart = self.apart / self.layout.resolution
        kernels.follow_maxima(self.layout.columns, flat, weights, where, apart, cells)
        cells = np.concatenate([cells, self.cells(np.array(seeds, dtype=float).reshape(-1, 2))])
        if views:
            worth = self.views(bits, robot, cells)
        else:
            worth = (flat[cells] * weights[cells]).astype(float)
        return self._ranked(robot, cells, worth)

    def by_windows(self, bits: Plane, robot: FloatArray, focus: FloatArray) -> list[Focus]:
        """The best place of all whose weight isn't 0, by sums over windows of a panorama.

        The mean of a view is over the floor in it, less the farther it is away, up to the camera's
        reach, eq. (6.9), and towards the edges of the picture.
        """
        self._check(bits)
        camera, layout = self.camera, self.layout
        half, up = camera.wide / 2.0, camera.high / 2.0
        side = math.ceil(min(camera.turn, math.pi) / STEP)
        margin = math.ceil(half / STEP)
        pans = STEP * np.arange(-side - margin, side + margin + 1)
        tilts = np.arange(LEAST, RIGHT, STEP)
        distances = camera.height / np.tan(tilts) / layout.resolution
        slant = camera.height / np.sin(tilts) ** 2 / layout.resolution  # cells by rad of tilt
        heading = pans + robot[2] - layout.origin[2]
        seen, shown = np.empty((len(pans), len(tilts))), np.empty((len(pans), len(tilts)))
        column, row = layout.to_cells(np.asarray(robot[:2], dtype=float)).tolist()
        kernels.panorama(
            layout.columns,
            layout.rows,
            bits.reshape(-1),
            column,
            row,
            np.column_stack([np.cos(heading), np.sin(heading)]),
            distances,
            distances * slant * STEP**2 * clamped(distances * layout.resolution, camera.reach),
            seen,
            shown,
        )
        total, count = (_windows(each, half / STEP, up / STEP) for each in (seen, shown))
        k, j = np.meshgrid(
            np.arange(margin, margin + 2 * side + 1), np.arange(len(tilts)), indexing="ij"
        )
        away = distances[j] * layout.resolution
        points = np.stack([away * np.cos(pans[k]), away * np.sin(pans[k])], axis=-1)
        inside = shown[k, j] > 0.0
        allowed = camera.weights(points, _seen_from(robot, focus)) > 0.0
        worth = np.where(inside & allowed, total[k, j] / np.maximum(count[k, j], 1e-9), -1.0)
        best = np.unravel_index(int(worth.argmax()), worth.shape)
        place = compose(np.asarray(robot, dtype=float), np.append(points[best], 0.0))[:2]
        return [Focus(place, float(pans[k[best]]), float(tilts[j[best]]), float(worth[best]))]

    def weights(self, robot: FloatArray, focus: FloatArray) -> FloatArray:
        """(n,) of all cells, eq. (6.33)."""
        points = _seen_from(robot, self._centres)
        return self.camera.weights(points, _seen_from(robot, focus))

    def views(self, bits: Plane, robot: FloatArray, cells: Cells) -> FloatArray:
        """(n,) mean bits of the views about cells (n,), eq. (6.36)."""
        points = _seen_from(robot, self._centres[cells])
        bearing = np.arctan2(points[:, 1], points[:, 0]) + robot[2] - self.layout.origin[2]
        means = np.empty(len(cells))
        kernels.mean_views(
            self.layout.columns,
            self.layout.rows,
            bits.reshape(-1),
            self.layout.to_cells(self._centres[cells]),
            np.column_stack([np.cos(bearing), np.sin(bearing)]),
            self.camera.view(points) / self.layout.resolution,
            means,
        )
        return means

    def _ranked(self, robot: FloatArray, cells: Cells, worth: FloatArray) -> list[Focus]:
        found = []
        for k in np.argsort(-worth, kind="stable"):
            place = self._centres[cells[k]]
            pan, tilt = self.camera.aim(_seen_from(robot, place))
            found.append(Focus(place, pan, tilt, float(worth[k])))
        return found

    def cells(self, points: FloatArray) -> Cells:
        """(n,) the nearest cells to points (n, 2) m."""
        most = np.array([self.layout.columns, self.layout.rows]) - 1
        at = np.clip(np.floor(self.layout.to_cells(points)), 0, most).astype(np.int32)
        return np.asarray(at[:, 1] * self.layout.columns + at[:, 0], dtype=np.int32)

    def _check(self, bits: Plane) -> None:
        if bits.shape != self.layout.shape or not np.isfinite(bits).all():
            raise GridError(
                f"Places to look at need finite bits of {self.layout.shape} cells; these have shape "
                f"{bits.shape}."
            )


def _seen_from(robot: FloatArray, points: FloatArray) -> FloatArray:
    """Points (..., 2) m in the robot's frame."""
    poses = np.concatenate([points, np.zeros((*np.shape(points)[:-1], 1))], axis=-1)
    return between(np.asarray(robot, dtype=float), poses)[..., :2]


def _windows(plane: FloatArray, wide: float, high: float) -> FloatArray:
    """(k, j) means of sums over nested windows about each pixel, up to so many pixels to each side."""
    summed = np.zeros((plane.shape[0] + 1, plane.shape[1] + 1))
    summed[1:, 1:] = plane.cumsum(axis=0).cumsum(axis=1)
    result = np.zeros(plane.shape)
    k, j = np.arange(plane.shape[0]), np.arange(plane.shape[1])
    for part in range(1, NESTED + 1):
        across, up = round(wide * part / NESTED), round(high * part / NESTED)
        left, right = np.maximum(k - across, 0), np.minimum(k + across + 1, len(k))
        low, top = np.maximum(j - up, 0), np.minimum(j + up + 1, len(j))
        result += (
            summed[np.ix_(right, top)]
            - summed[np.ix_(left, top)]
            - summed[np.ix_(right, low)]
            + summed[np.ix_(left, low)]
        )
    return result / NESTED
