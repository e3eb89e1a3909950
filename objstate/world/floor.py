"""What a drive left of its grid: where things stood that the building doesn't know, and how it ages.

A cell keeps how probably it was occupied and when it is forgotten (Darmstadt, eqs. 6.2 to 6.4): the
longer ago it was seen, the nearer its value is to 0.5, until nothing is known of it.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from types import EllipsisType

import numpy as np
from numpy.typing import ArrayLike, NDArray

from objstate.errors import GridError, QueryError, WorldError
from objstate.geometry import FloatArray, IntArray
from objstate.grid import Grid, Layout, expected_occupancy, swept
from objstate.lazy import lazy
from objstate.objects import ObjectBelief
from objstate.records import NANOSECONDS
from objstate.world.blocking import (
    Blocker,
    checked_path,
    points_of,
    probability_in,
    probability_on,
)

Cells = tuple[IntArray, IntArray] | EllipsisType  # rows and columns

BYTE = 255
UNKNOWN = 0.5
FORMAT = 1  # of packed floors


@dataclass(frozen=True, eq=False)
class FloorMemory:
    """A grid as it was left at a moment."""

    layout: Layout
    stamp_ns: int
    max_age_s: float  # from a look until a cell is forgotten
    share: NDArray[np.uint8] = field(repr=False)  # (rows, columns) P(occupied), in 255ths
    left: NDArray[np.uint8] = field(repr=False)  # (rows, columns) reliability then, in 255ths

    @staticmethod
    def of(grid: Grid, values: NDArray[np.float32], stamp_ns: int) -> FloorMemory:
        """A grid at a moment, with values (rows, columns), which may leave known objects out."""
        reliable = 1.0 - grid.ages(stamp_ns)
        left = np.rint(BYTE * reliable).astype(np.uint8)
        shares = UNKNOWN + (values - UNKNOWN) / np.maximum(reliable, 1.0 / BYTE)
        packed = np.rint(BYTE * np.clip(shares, 0.0, 1.0)).astype(np.uint8)
        packed[left == 0] = BYTE // 2  # packs small
        return FloorMemory(grid.layout, stamp_ns, grid.cells.max_age_s, packed, left)

    def reliability(self, stamp_ns: int, cells: Cells = ...) -> FloatArray:
        """1 of cells that were just seen, 0 of those not known, at or after its own moment."""
        lost = (stamp_ns - self.stamp_ns) / NANOSECONDS / self.max_age_s
        return np.maximum(self.left[cells] / BYTE - lost, 0.0)

    def values(self, stamp_ns: int, cells: Cells = ...) -> FloatArray:
        """P(occupied) of cells, by default of all (rows, columns), at a moment, eq. (6.4)."""
        return UNKNOWN + self.reliability(stamp_ns, cells) * (self.share[cells] / BYTE - UNKNOWN)

    def kept(self) -> KeptFloor:
        """As a world keeps it."""
        lasting = round(self.max_age_s * NANOSECONDS)
        return KeptFloor(self.stamp_ns, self.stamp_ns + lasting, self.pack())

    def pack(self) -> bytes:
        """As bytes."""
        layout = self.layout
        head = {
            "format": FORMAT,
            "resolution": layout.resolution,
            "rows": layout.rows,
            "columns": layout.columns,
            "origin": layout.origin.tolist(),
            "frame": layout.frame,
            "max_age_s": self.max_age_s,
        }
        cells = self.share.tobytes() + self.left.tobytes()
        return zlib.compress(json.dumps(head).encode() + b"\n" + cells)

    @staticmethod
    def unpack(packed: bytes, stamp_ns: int) -> FloorMemory:
        """From bytes. Raises WorldError for damaged ones."""
        try:
            head, _, cells = zlib.decompress(packed).partition(b"\n")
            told = json.loads(head)
            origin = np.array(told["origin"], dtype=float)
            layout = Layout(
                told["resolution"], told["rows"], told["columns"], origin, told["frame"]
            )
            share, left = np.frombuffer(cells, np.uint8).reshape(2, *layout.shape)
            return FloorMemory(layout, stamp_ns, float(told["max_age_s"]), share, left)
        except (zlib.error, ValueError, KeyError, TypeError, GridError) as error:
            raise WorldError(
                f"The floor that a drive left at {stamp_ns} ns is damaged ({error}); make the world "
                "anew from its logs."
            ) from error


@dataclass(frozen=True, eq=False)
class KeptFloor:
    """A floor as a world keeps it: packed until somebody asks for a moment at which it says anything."""

    stamp_ns: int
    forgotten_ns: int  # from when on nothing of it is known
    packed: bytes = field(repr=False)

    @lazy
    def memory(self) -> FloorMemory:
        """The floor. Raises WorldError where it is damaged."""
        return FloorMemory.unpack(self.packed, self.stamp_ns)


@dataclass(frozen=True)
class Occupancy:
    """How probably something stands in an area."""

    probability: (
        float  # something of the building's objects, or something seen that it doesn't know
    )
    blockers: tuple[Blocker, ...]  # of the building's objects, the most probable first
    # P(occupied) of the surest cell, of what the building doesn't know; 0 where none is known
    unlisted: float
    known: float  # share of the area's cells of which the grids know anything now
    seen_ns: int | None  # the last moment of the newest grid that knows any of them


def occupied(
    beliefs: Mapping[str, ObjectBelief],
    floors: Sequence[KeptFloor],
    area: ArrayLike,
    robot_radius: float | None,
    stamp_ns: int,
) -> Occupancy:
    """How probably an area is occupied at a moment: a polygon (n, 2) m, or a path of a robot's disc.

    ``floors`` are in time order; the newest that knows a cell counts for it. Raises QueryError for
    an area that is none.
    """
    if robot_radius is None:
        polygon = _polygon(area)
        pieces, chance = [polygon], partial(probability_in, polygon=polygon)
    else:
        path = checked_path(area, robot_radius)
        pieces = swept(path, robot_radius)
        chance = partial(probability_on, path=path, robot_radius=robot_radius)
    blockers = [
        Blocker(name, probability)
        for name, belief in beliefs.items()
        if (probability := chance(belief)) > 0.0
    ]
    blockers.sort(key=lambda each: (-each.probability, each.object))
    unlisted, known, seen = _cells(floors, pieces, stamp_ns)
    free = float(np.prod([1.0 - each.probability for each in blockers])) * (1.0 - unlisted)
    return Occupancy(1.0 - free, tuple(blockers), unlisted, known, seen)


def _cells(
    floors: Sequence[KeptFloor], pieces: Sequence[FloatArray], stamp_ns: int
) -> tuple[float, float, int | None]:
    """The surest cell, the share of cells that are known, and when the newest grid of those ended.

    ``pieces`` (k, 2) m are polygons that make up the area.
    """
    unlisted, known, seen = 0.0, 0.0, None
    rest: FloatArray | None = None  # (n, 2) m, middles of cells that no newer grid knows
    for kept in reversed(floors):
        if not kept.stamp_ns <= stamp_ns < kept.forgotten_ns:
            continue
        floor = kept.memory
        layout = floor.layout
        if rest is None:
            where = expected_occupancy(layout, pieces, np.ones(len(pieces))).where
            if not len(where):
                continue
            rows, columns = np.divmod(where, layout.columns)
            rest = layout.to_frame(np.column_stack([columns, rows]) + 0.5)
            count = len(rest)
        at = np.floor(layout.to_cells(rest)).astype(np.int64)
        inside = layout.within(at.astype(float))
        column, row = at[inside].T
        reliable = floor.reliability(stamp_ns, (row, column)) > 0.0
        if reliable.any():
            seen = floor.stamp_ns if seen is None else seen
            values = floor.values(stamp_ns, (row, column))[reliable]
            unlisted = max(unlisted, float(values.max()))
            known += float(reliable.sum()) / count
            inside[inside] = reliable
            rest = rest[~inside]
        if not len(rest):
            break
    return unlisted, min(known, 1.0), seen


def _polygon(area: ArrayLike) -> FloatArray:
    """(n, 2) m corners. Raises QueryError."""
    import shapely

    points = points_of(area)
    if points is None or len(points) < 3:
        raise QueryError(
            "An area is a polygon of three or more points (x, y), in finite metres; for a path give "
            "robot_radius."
        )
    if not shapely.Polygon(points).is_valid or shapely.Polygon(points).area == 0.0:
        raise QueryError(
            "An area is a polygon whose edges don't cross and that encloses a piece of the floor."
        )
    return points
