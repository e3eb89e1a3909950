"""Walls at a laser's height in short pieces, each with an offset of its own.

A building is never built, nor mapped, exactly as its model says. Whoever compares ranges with walls
has to know which piece of wall each beam should meet.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.sensing import pieces
else:
    pieces = Later("objstate.sensing.pieces")

PIECE = 2.0  # m, largest length of a piece: few walls are straight to millimetres over more
STRIDE = 1.0  # m that a robot drives before the pieces near it are looked up again


class Surfaces:
    """A building's walls at one height, in pieces."""

    def __init__(self, segments: FloatArray) -> None:
        self.pieces = _cut(segments)  # (k, 4) m
        along = self.pieces[:, 2:] - self.pieces[:, :2]
        lengths = np.hypot(along[:, 0], along[:, 1])
        self.normals = np.column_stack([-along[:, 1], along[:, 0]]) / lengths[:, None]  # (k, 2)
        self._middles = (self.pieces[:, :2] + self.pieces[:, 2:]) / 2.0
        self._halves = lengths / 2.0
        self._near: tuple[FloatArray, float, IntArray] | None = None

    def near(self, place: FloatArray, reach: float) -> IntArray:
        """Numbers (m,) of the pieces that may come within ``reach`` m of a place (2,)."""
        known = self._near
        if known is None or known[1] != reach or math.dist(place, known[0]) > STRIDE:
            away = np.hypot(*(self._middles - place).T) - self._halves
            known = place.copy(), reach, np.flatnonzero(away <= reach + STRIDE)
            self._near = known
        return known[2]

    def meet(
        self, origins: FloatArray, directions: FloatArray, reach: float
    ) -> tuple[FloatArray, IntArray]:
        """Ranges (n,) m to the nearest piece, inf where there is none, and its number (n,).

        ``origins`` (n, 2) m lie close together; ``directions`` (n, 2) are unit vectors. Beams that
        meet nothing within ``reach`` m have the number -1.
        """
        among = self.near(origins[0], reach)
        ranges, numbers = np.empty(len(origins)), np.empty(len(origins), dtype=np.int64)
        pieces.meet(self.pieces, self.normals, among, origins, directions, ranges, numbers)
        return ranges, numbers

    def cosines(self, numbers: IntArray, directions: FloatArray) -> FloatArray:
        """(n,) cosines of the incidence of beams on pieces of some ``numbers`` (n,).

        Their size is at least that of a grazing incidence.
        """
        products = self.normals[numbers] * directions
        cosines = products[:, 0] + products[:, 1]
        return np.copysign(np.maximum(np.abs(cosines), pieces.GRAZING), cosines)

    def slopes(self, numbers: IntArray, directions: FloatArray) -> FloatArray:
        """(n,) squared tangents of that incidence, and 0 for beams that meet nothing."""
        out, meets = np.zeros(len(numbers)), numbers >= 0
        out[meets] = 1.0 / self.cosines(numbers[meets], directions[meets]) ** 2 - 1.0
        return out


def _cut(segments: FloatArray) -> FloatArray:
    """Segments (k, 4) cut into equal pieces of at most ``PIECE`` m."""
    along = segments[:, 2:] - segments[:, :2]
    counts = np.maximum(np.ceil(np.hypot(along[:, 0], along[:, 1]) / PIECE), 1.0).astype(np.int64)
    of = np.repeat(np.arange(len(segments)), counts)
    number = np.arange(len(of)) - np.repeat(np.cumsum(counts) - counts, counts)
    start = segments[of, :2] + (number / counts[of])[:, None] * along[of]
    end = segments[of, :2] + ((number + 1) / counts[of])[:, None] * along[of]
    return np.ascontiguousarray(np.column_stack([start, end]))
