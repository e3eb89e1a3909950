"""A camera with depth that looks down on a table, simulated.

Pixels are a quarter of a Kinect's (320 by 240); depth errs as that of a Kinect does (Khoshelham and
Elberink 2012), and colours are told wrong now and then.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import cos, radians, sin

import numpy as np

from objstate.experiments.elfring2012.scene import TABLE, Scene
from objstate.geometry import FloatArray, IntArray

DEPTH = 1.425e-3  # 1/m: sigma of a depth z is DEPTH z^2
WRONG = 0.02  # share of pixels whose colour is told wrong
COLOURS = 5
NEAREST = 1e-6


@dataclass(frozen=True)
class CameraSetup:
    """Where the camera is, and what it sees."""

    height: float = 0.75  # m above the table
    pitch: float = radians(33.0)  # down from level
    focal: float = 285.0  # pixels
    width: int = 320
    rows: int = 240


@dataclass(frozen=True, eq=False)
class Picture:
    """One frame."""

    colours: IntArray = field(repr=False)  # (rows, width)
    depths: FloatArray = field(repr=False)  # (rows, width) m along the optical axis


class Camera:
    """Takes pictures, and knows where what it sees is.

    Args:
        setup: where it is.
    """

    def __init__(self, setup: CameraSetup) -> None:
        self.setup = setup
        self.origin = np.array([0.0, 0.0, setup.height])
        v, u = np.mgrid[: setup.rows, : setup.width] + 0.5
        right = (u - setup.width / 2.0) / setup.focal
        down = (v - setup.rows / 2.0) / setup.focal
        c, s = cos(setup.pitch), sin(setup.pitch)
        # a point at depth d is at origin + d * ray
        self.rays = np.stack([right, c - s * down, -s - c * down], axis=-1)
        self._axes = np.array([[1.0, 0.0, 0.0], [0.0, -s, -c], [0.0, c, -s]])
        self._table = setup.height / np.maximum(-self.rays[..., 2], NEAREST)

    def pixels(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Columns and rows (..., 2) of points (..., 3) in the picture, and their depths (...)."""
        right, down, depth = np.moveaxis((points - self.origin) @ self._axes.T, -1, 0)
        depth = np.maximum(depth, NEAREST)
        scale = self.setup.focal / depth
        centre = np.array([self.setup.width, self.setup.rows]) / 2.0
        return np.stack([right * scale, down * scale], axis=-1) + centre, depth

    def take(self, scene: Scene, rng: np.random.Generator) -> Picture:
        """A picture of a scene."""
        depths = self._table.copy()
        colours = np.full(depths.shape, TABLE)
        touched = []
        for x, y, radius, height, colour in scene.rounds.tolist():
            window = self._window(x - radius, x + radius, y - radius, y + radius, 0.0, height)
            touched.append(window)
            hit = self._round(self.rays[window], x, y, radius, height)
            _paint(depths[window], colours[window], hit, int(colour))
        for *bounds, colour in scene.boxes.tolist():
            window = self._window(*bounds)
            touched.append(window)
            hit = self._box(self.rays[window], np.array(bounds).reshape(3, 2))
            _paint(depths[window], colours[window], hit, int(colour))
        done = np.zeros(depths.shape, bool)
        for window in touched:
            fresh = ~done[window]
            done[window] = True
            part = depths[window]
            part[fresh] += (DEPTH * part**2 * rng.standard_normal(part.shape))[fresh]
            told = colours[window]
            wrong = fresh & (rng.random(part.shape) < WRONG)
            told[wrong] = rng.integers(0, COLOURS, int(wrong.sum()))
        return Picture(colours, depths)

    def _window(
        self, left: float, right: float, near: float, far: float, low: float, high: float
    ) -> tuple[slice, slice]:
        """The part of the picture that a box covers."""
        corners = np.array(
            [[x, y, z] for x in (left, right) for y in (near, far) for z in (low, high)]
        )
        pixels, _ = self.pixels(corners)
        limit = np.array([self.setup.width, self.setup.rows])
        first = np.clip(np.floor(pixels.min(axis=0)), 0, limit).astype(int)
        last = np.clip(np.ceil(pixels.max(axis=0)), 0, limit).astype(int)
        return slice(first[1], last[1]), slice(first[0], last[0])

    def _round(
        self, rays: FloatArray, x: float, y: float, radius: float, height: float
    ) -> FloatArray:
        """Depths of an upright cylinder's side and top; inf where it isn't met."""
        plan = rays[..., :2]
        a = (plan**2).sum(axis=-1)
        b = plan @ np.array([x, y])
        inside = b**2 - a * (x**2 + y**2 - radius**2)
        with np.errstate(invalid="ignore"):
            side = (b - np.sqrt(inside)) / a
        level = self.origin[2] + side * rays[..., 2]
        side = np.where((inside > 0.0) & (level >= 0.0) & (level <= height), side, np.inf)
        top = (height - self.origin[2]) / rays[..., 2]
        off = top[..., None] * plan - np.array([x, y])
        top = np.where((off**2).sum(axis=-1) <= radius**2, top, np.inf)
        return np.minimum(side, top)

    def _box(self, rays: FloatArray, bounds: FloatArray) -> FloatArray:
        """Depths of a box of bounds (3, 2); inf where it isn't met."""
        safe = np.where(np.abs(rays) < NEAREST, NEAREST, rays)[..., None]
        ends = (bounds - self.origin[:, None]) / safe
        enters, leaves = ends.min(axis=-1).max(axis=-1), ends.max(axis=-1).min(axis=-1)
        return np.where((enters <= leaves) & (enters > 0.0), enters, np.inf)


def _paint(depths: FloatArray, colours: IntArray, hit: FloatArray, colour: int) -> None:
    """Put what was hit before what is there, in place."""
    before = hit < depths
    depths[before], colours[before] = hit[before], colour
