"""A sensor's data for light checks: readings of one colour in regions, and occlusion."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import pi
from typing import Protocol

import numpy as np
from scipy.ndimage import label

from objstate.experiments.elfring2012.camera import DEPTH, Camera, Picture
from objstate.experiments.elfring2012.scene import CUP_HEIGHT, CUP_RADIUS
from objstate.geometry import BoolArray, FloatArray, IntArray

BELOW_TOP = 0.012  # m: readings of a cup's top say nothing of its outline
EDGE = 0.004  # m below the top of what is seen from above, as far down as readings count
ABOVE_TABLE = 0.008  # m: nearer to the table than which pixels may be its
FACE = np.radians(
    [-50.0, -25.0, 0.0, 25.0, 50.0]
)  # of the side towards the camera, where it is looked for
LEVELS = np.array([0.2, 0.5, 0.8])  # of its height, likewise


@dataclass(frozen=True, eq=False)
class Seen:
    """Readings in regions of objects."""

    codes: FloatArray = field(repr=False)  # (n, q) in the sensor's own coordinates
    points: FloatArray = field(repr=False)  # (n, 2) m, in the plane
    regions: BoolArray = field(repr=False)  # (k, n) whether a reading is in an object's region
    runs: IntArray | None = field(default=None, repr=False)  # (n,) readings of one thing, if told


class Look(Protocol):
    """One frame of a sensor, for objects of one class."""

    @property
    def sensor(self) -> FloatArray:
        """(2,) m, where it is in the plane."""
        ...

    @property
    def noise(self) -> float:
        """m, of a reading."""
        ...

    @property
    def radius(self) -> float:
        """m, of the objects."""
        ...

    @property
    def setback(self) -> float:
        """m, how far behind the middle of its readings an object's middle is."""
        ...

    @property
    def fewest(self) -> int:
        """Readings that make an object."""
        ...

    def seen(self, positions: FloatArray, reaches: FloatArray) -> Seen:
        """Readings within reaches (k,) m of positions (k, 2)."""
        ...

    def elsewhere(self, positions: FloatArray, reaches: FloatArray) -> list[FloatArray]:
        """Readings (n, 2) of each thing outside these regions that may be such an object."""
        ...

    @property
    def clutter(self) -> float:
        """1/m^2, of what looks like such an object and is none."""
        ...

    def coded(self, positions: FloatArray) -> FloatArray:
        """(k, q) centres of objects at positions (k, 2), in the sensor's own coordinates."""
        ...

    def hidden(self, positions: FloatArray) -> FloatArray:
        """(...) occluded share of objects at positions (..., 2)."""
        ...


@dataclass(frozen=True, eq=False)
class CameraLook:
    """Things of one colour in a picture: round, or with ``round`` false seen from above."""

    camera: Camera
    picture: Picture
    colour: int
    radius: float = CUP_RADIUS
    height: float = CUP_HEIGHT
    round: bool = True
    fewest: int = 15
    clutter: float = 0.01

    @property
    def setback(self) -> float:
        """Readings spread evenly over a round thing's width lie pi / 4 radii before its centre."""
        return pi / 4.0 * self.radius if self.round else 0.0

    @property
    def sensor(self) -> FloatArray:
        return self.camera.origin[:2]

    @property
    def noise(self) -> float:
        """At the middle of the table."""
        return DEPTH * 1.3**2

    def seen(self, positions: FloatArray, reaches: FloatArray) -> Seen:
        """Whether the 2-D and the 3-D region of section III-D hold a reading."""
        rows, columns = self._window(positions, reaches)
        v, u = np.nonzero(self.picture.colours[rows, columns] == self.colour)
        v, u = v + rows.start, u + columns.start
        points, level = self._points(v, u)
        off = points[:, :2] - positions[:, None]
        regions = (np.hypot(off[..., 0], off[..., 1]) <= reaches[:, None]) & level
        inside = regions.any(axis=0)
        codes = np.column_stack([u, v])[inside] + 0.5
        return Seen(codes, points[inside, :2], regions[:, inside])

    def elsewhere(self, positions: FloatArray, reaches: FloatArray) -> list[FloatArray]:
        """Blobs of the colour."""
        blobs, count = label(self.picture.colours == self.colour)
        v, u = np.nonzero(blobs)
        points, level = self._points(v, u)
        off = points[:, :2] - positions[:, None]
        outside = level & (np.hypot(off[..., 0], off[..., 1]) > reaches[:, None]).all(axis=0)
        labels, points = blobs[v, u][outside], points[outside, :2]
        sizes = np.bincount(labels, minlength=count + 1)
        return [points[labels == k] for k in np.flatnonzero(sizes >= self.fewest).tolist()]

    def _points(self, v: IntArray, u: IntArray) -> tuple[FloatArray, BoolArray]:
        """(n, 3) m, where pixels are, and whether that is at a height that counts."""
        points = self.camera.origin + self.picture.depths[v, u][:, None] * self.camera.rays[v, u]
        if self.round:
            level = (points[:, 2] > ABOVE_TABLE) & (points[:, 2] < self.height - BELOW_TOP)
        else:
            level = points[:, 2] > self.height - EDGE
        return points, level

    def _window(self, positions: FloatArray, reaches: FloatArray) -> tuple[slice, slice]:
        low, high = positions - reaches[:, None], positions + reaches[:, None]
        corners = np.concatenate(
            [
                np.column_stack([xs[:, 0], ys[:, 1], np.full(len(xs), z)])
                for xs in (low, high)
                for ys in (low, high)
                for z in (0.0, self.height)
            ]
        )
        pixels, _ = self.camera.pixels(corners)
        limit = np.array([self.camera.setup.width, self.camera.setup.rows])
        first = np.clip(pixels.min(axis=0), 0, limit).astype(int)
        last = np.clip(np.ceil(pixels.max(axis=0)), 0, limit).astype(int)
        return slice(first[1], last[1]), slice(first[0], last[0])

    def coded(self, positions: FloatArray) -> FloatArray:
        middle = np.column_stack([positions, np.full(len(positions), self.height / 2.0)])
        return self.camera.pixels(middle)[0]

    def hidden(self, positions: FloatArray) -> FloatArray:
        toward = np.arctan2(*np.moveaxis(self.sensor - positions, -1, 0)[::-1])
        angles = toward[..., None] + FACE
        round_ = self.radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        sides = positions[..., None, :] + round_  # (..., f, 2)
        shape = (*sides.shape[:-1], len(LEVELS))
        points = np.empty((*shape, 3))
        points[..., :2] = sides[..., None, :]
        points[..., 2] = LEVELS * self.height
        pixels, expected = self.camera.pixels(points)
        limit = np.array([self.camera.setup.width, self.camera.setup.rows]) - 1
        u, v = np.moveaxis(np.clip(pixels.astype(int), 0, limit), -1, 0)
        before = self.picture.depths[v, u] < expected - self.radius
        return np.asarray(before.mean(axis=(-2, -1)))
