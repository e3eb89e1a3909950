"""The game of cups on the floor: round bins that people push about, seen by a level laser."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from math import pi

import numpy as np

from objstate.experiments.elfring2012.looks import Seen
from objstate.experiments.elfring2012.scene import Scene
from objstate.geometry import FloatArray, IntArray

BEAMS = 720  # over 180 degrees
BEARINGS = np.linspace(0.0, np.pi, BEAMS)  # from the x axis; the laser is at the origin
ALONG = np.column_stack([np.cos(BEARINGS), np.sin(BEARINGS)])
RANGE_MAX = 10.0  # m
NOISE = 0.01  # m, sigma of a range
WRONG = 0.01  # share of beams that read anything
JUMP = 0.08  # m between the ranges of neighbouring beams, from which on they met two things
EDGES = np.array(
    [-0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75]
)  # of a bin's radius, where it is looked for


def scan(scene: Scene, rng: np.random.Generator) -> FloatArray:
    """(n,) m, what the laser reads of a scene."""
    ranges = np.full(BEAMS, RANGE_MAX)
    for x, y, radius, _, _ in scene.rounds.tolist():
        ahead = ALONG @ np.array([x, y])
        inside = ahead**2 - (x**2 + y**2 - radius**2)
        hit = (inside > 0.0) & (ahead > 0.0)
        ranges[hit] = np.minimum(ranges[hit], ahead[hit] - np.sqrt(inside[hit]))
    for left, right, near, *_ in scene.boxes.tolist():
        with np.errstate(divide="ignore"):
            away = near / ALONG[:, 1]
        across = away * ALONG[:, 0]
        hit = (across >= left) & (across <= right)
        ranges[hit] = np.minimum(ranges[hit], away[hit])
    ranges += NOISE * rng.standard_normal(BEAMS)
    wrong = rng.random(BEAMS) < WRONG
    ranges[wrong] = rng.uniform(0.1, RANGE_MAX, int(wrong.sum()))
    return ranges


@dataclass(frozen=True, eq=False)
class LaserLook:
    """Bins in a scan. A laser sees no colours: what is no bin is told by its shape."""

    ranges: FloatArray = field(repr=False)  # (n,) m
    radius: float
    fewest: int = 4
    noise: float = NOISE
    clutter: float = 0.1

    @property
    def setback(self) -> float:
        return pi / 4.0 * self.radius

    @property
    def sensor(self) -> FloatArray:
        return np.zeros(2)

    def seen(self, positions: FloatArray, reaches: FloatArray) -> Seen:
        """Runs of beams without a jump are of one thing, and are taken whole."""
        points, runs = self._runs
        off = points - positions[:, None]
        regions = np.hypot(off[..., 0], off[..., 1]) <= reaches[:, None]
        inside = np.isin(runs, runs[regions.any(axis=0)])
        return Seen(points[inside], points[inside], regions[:, inside], runs[inside])

    def elsewhere(self, positions: FloatArray, reaches: FloatArray) -> list[FloatArray]:
        points, runs = self._runs
        off = points - positions[:, None]
        taken = runs[(np.hypot(off[..., 0], off[..., 1]) <= reaches[:, None]).any(axis=0)]
        left = np.setdiff1d(np.flatnonzero(np.bincount(runs) >= self.fewest), taken)
        return [points[runs == k] for k in left.tolist()]

    @cached_property
    def _runs(self) -> tuple[FloatArray, IntArray]:
        """Points (n, 2) and their runs (n,), without isolated beams."""
        wide = np.pad(self.ranges, 1, mode="edge")
        middle = np.median(np.stack([wide[:-2], wide[1:-1], wide[2:]]), axis=0)
        runs = np.cumsum(np.abs(np.diff(middle, prepend=middle[0])) > JUMP).astype(np.int64)
        kept = (np.abs(self.ranges - middle) <= JUMP) & (middle < 0.99 * RANGE_MAX)
        return (self.ranges[:, None] * ALONG)[kept], runs[kept]

    def coded(self, positions: FloatArray) -> FloatArray:
        return positions

    def hidden(self, positions: FloatArray) -> FloatArray:
        distances = np.hypot(positions[..., 0], positions[..., 1])[..., None]
        middle = np.arctan2(positions[..., 1], positions[..., 0])[..., None]
        off = np.arcsin(np.minimum(EDGES * self.radius / np.maximum(distances, self.radius), 1.0))
        beams = np.rint((middle + off) / np.pi * (BEAMS - 1)).astype(int)
        within = np.clip(beams, 0, BEAMS - 1)
        before = self.ranges[within] < distances - 2.0 * self.radius
        return np.asarray((before | (beams != within)).mean(axis=-1))
