"""The free space at floor level as a grid, and shortest ways through it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.building.outline import outline
from objstate.config import NonNegative, Positive, Share, Strict
from objstate.errors import SettingsError
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import lazy
from objstate.objects import ObjectBelief
from objstate.objects.footprint import footprint

NEIGHBOURS = ((1, 0), (0, 1), (1, 1), (1, -1))  # half of a cell's eight; the others mirror them
DOORWAY = 1.0  # cells to either side of a closed leaf in which a way pays for the door
NODE = 0.6  # m, side of the squares that are represented by one cell


class FloorSettings(Strict):
    """A robot's body on the floor, and its costs of doors."""

    robot_radius: Positive = 0.25  # m
    robot_height: Positive = 0.6  # m, below which walls and furniture are in its way
    resolution: Positive = 0.15  # m, of the grid
    closed_door_cost: NonNegative = 30.0  # m of detour that a certainly closed door costs
    furniture_share: Share = 0.5  # probability of standing in a cell that closes it


@dataclass(frozen=True, eq=False)
class Floor:
    """The cells of a building where the middle of a robot can be, walls considered."""

    building: Building
    settings: FloorSettings
    origin: FloatArray = field(repr=False)  # (2,) m, middle of cell (0, 0)
    clearance: FloatArray = field(repr=False)  # (rows, columns) m to the nearest wall

    @staticmethod
    def of(building: Building, settings: FloorSettings | None = None) -> Floor:
        """The floor of a building. Raises SettingsError where the robot fits nowhere."""
        from scipy.ndimage import distance_transform_edt

        s = settings or FloorSettings()
        segments = _walls_up_to(building, s.robot_height, s.resolution)
        corners = building.walls.vertices[:, :2]
        origin = corners.min(axis=0)
        columns, rows = np.ceil(np.ptp(corners, axis=0) / s.resolution).astype(np.int64) + 1
        free = np.ones((rows, columns), dtype=bool)
        cells = np.rint((_points_on(segments, s.resolution / 2) - origin) / s.resolution)
        column, row = cells.astype(np.int64).T
        free[row, column] = False
        clearance = np.asarray(distance_transform_edt(free, sampling=s.resolution))
        if not (clearance > s.robot_radius).any():
            raise SettingsError(
                f"Building '{building.name}' has no place for a robot of radius {s.robot_radius} "
                "m; give a smaller robot_radius."
            )
        return Floor(building, s, origin, clearance)

    @lazy
    def free(self) -> BoolArray:
        """(rows, columns) the cells where the robot touches no wall."""
        return np.asarray(self.clearance > self.settings.robot_radius)

    @lazy
    def pieces(self) -> IntArray:
        """(cells,) number of the connected piece of free floor that each cell is in; 0 for none."""
        from scipy.ndimage import label

        return np.asarray(label(self.free, np.ones((3, 3)))[0].reshape(-1), dtype=np.int64)

    @lazy
    def places(self) -> FloatArray:
        """(cells, 2) m, middles of all cells, row by row."""
        rows, columns = np.indices(self.free.shape)
        steps = np.column_stack([columns.reshape(-1), rows.reshape(-1)])
        return np.asarray(self.origin + self.settings.resolution * steps)

    @lazy
    def _edges(self) -> IntArray:
        """(e, 2) numbers of neighbouring cells that are both free."""
        return edges_between(self.free)

    @lazy
    def _lengths(self) -> FloatArray:
        """(e,) m"""
        ends = self.places[self._edges]
        return np.asarray(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1))

    @lazy
    def _adjacency(self) -> tuple[IntArray, IntArray, IntArray]:
        """Numbers (2 e,) of the edges that leave each cell, their targets, and each cell's first."""
        both = np.concatenate([self._edges, self._edges[:, ::-1]])
        order = np.lexsort(both.T[::-1])
        starts = np.searchsorted(both[order, 0], np.arange(self.free.size + 1))
        return order % len(self._edges), both[order, 1], starts

    @lazy
    def _doorways(self) -> dict[str, IntArray]:
        """By door, the free cells that the closed leaf would touch a robot in."""
        doors = [item for item in self.building.objects.values() if item.kind is not Kind.PLANAR]
        free = np.flatnonzero(self.free.reshape(-1))
        return {
            item.name: free[
                _near_line(self.places[free], *leaf_ends(item), DOORWAY * self.settings.resolution)
            ]
            for item in doors
        }

    @lazy
    def nodes(self) -> IntArray:
        """(cells,) for each free cell the roomiest one near it, in the same piece; -1 for others.

        What is seen from a cell is about what is seen from its node.
        """
        rows, columns = np.indices(self.free.shape) // round(NODE / self.settings.resolution)
        block = (rows * (columns.max() + 1) + columns).reshape(-1)
        cells = np.flatnonzero(self.pieces)
        order = np.lexsort((-self.clearance.reshape(-1)[cells], self.pieces[cells], block[cells]))
        cells = cells[order]
        starts = np.diff(block[cells], prepend=-1) != 0
        starts |= np.diff(self.pieces[cells], prepend=-1) != 0
        out = np.full(self.free.size, -1, dtype=np.int64)
        out[cells] = cells[starts][np.cumsum(starts) - 1]
        return out

    def ways_from(self, place: FloatArray, beliefs: Mapping[str, ObjectBelief]) -> Ways:
        """Cheapest ways from a place (2,) to everywhere, doors and furniture as believed.

        Raises SettingsError for a place that is not on the free floor.
        """
        from scipy.sparse import csr_array
        from scipy.sparse.csgraph import dijkstra

        start = self.nearest(place)
        toll, edges, size = self._tolls(beliefs), self._edges, self.free.size
        weights = self._lengths + (toll[edges[:, 0]] + toll[edges[:, 1]]) / 2.0
        which, cells, starts = self._adjacency
        graph = csr_array((weights[which], cells, starts), shape=(size, size))
        cost, before = dijkstra(graph, indices=start, return_predecessors=True)
        return Ways(self, start, cost, before.astype(np.int64))

    def nearest(self, place: FloatArray) -> int:
        """Number of the free cell nearest to a place (2,).

        Raises SettingsError where none is near.
        """
        if not np.isfinite(place).all():
            raise SettingsError(
                f"The robot can't be at {place} m; give a finite place on the floor."
            )
        off = np.linalg.norm(self.places - place, axis=1)
        off[~self.free.reshape(-1)] = np.inf
        cell = int(off.argmin())
        if off[cell] > 2.0 * self.settings.robot_radius + self.settings.resolution:
            raise SettingsError(
                f"The robot at ({place[0]:.2f}, {place[1]:.2f}) m is {off[cell]:.2f} m away from "
                f"the free floor of building '{self.building.name}'; give a place inside it."
            )
        return cell

    def _tolls(self, beliefs: Mapping[str, ObjectBelief]) -> FloatArray:
        """(cells,) m that passing a cell costs on top of its length; inf where furniture stands."""
        s = self.settings
        toll = np.zeros(self.free.size)
        for name, belief in beliefs.items():
            if belief.item.kind is Kind.PLANAR:
                toll[self._occupied(belief)] = np.inf
                continue
            closed = 1.0 - belief.probability_clear(2.0 * s.robot_radius)
            cells = self._doorways[name]
            each = closed * s.closed_door_cost / (2.0 * DOORWAY)
            toll[cells] = np.maximum(toll[cells], each)
        return toll

    def _occupied(self, belief: ObjectBelief) -> IntArray:
        """The cells in which the robot would touch furniture at its mean."""
        margin, covered = self.settings.robot_radius, footprint(belief.item, belief.mean[None])
        near = self.within(covered.min(axis=0) - margin, covered.max(axis=0) + margin)
        return near[_inside(self.places[near], covered, margin)]

    def within(self, lower: FloatArray, upper: FloatArray) -> IntArray:
        """Numbers of the cells between two corners (2,)."""
        low = np.ceil((lower - self.origin) / self.settings.resolution).astype(np.int64).clip(min=0)
        high = np.floor((upper - self.origin) / self.settings.resolution).astype(np.int64) + 1
        rows, columns = self.free.shape
        inside = np.arange(rows)[low[1] : high[1], None] * columns
        return np.asarray(inside + np.arange(columns)[None, low[0] : high[0]]).reshape(-1)


@dataclass(frozen=True, eq=False)
class Ways:
    """The cheapest ways from one place to all others."""

    floor: Floor
    start: int
    costs: FloatArray = field(repr=False)  # (cells,) m, tolls included; inf where none leads
    before: IntArray = field(repr=False)  # (cells,) the cell before each on its way

    def to(self, cell: int) -> IntArray | None:
        """Cells (k,) of the way from the start to a cell, inclusive; None where there is none."""
        if not np.isfinite(self.costs[cell]):
            return None
        cells = [cell]
        while cells[-1] != self.start:
            cells.append(int(self.before[cells[-1]]))
        return np.array(cells[::-1])

    def to_each(self, cells: IntArray) -> IntArray:
        """Cells (k, n) of the ways to some cells (n,), which can be reached; short ones begin late.

        All are as long as the longest: the others wait at the start.
        """
        before = self.before.copy()
        before[self.start] = self.start
        passed = [cells]
        while (passed[-1] != self.start).any():
            passed.append(before[passed[-1]])
        return np.array(passed[::-1])


@lru_cache(maxsize=4096)
def leaf_ends(item: MovableObject) -> tuple[FloatArray, FloatArray]:
    """Both ends (2,) of a door's leaf when the door is as its model shows it."""
    plan = item.mesh.vertices[:, :2]
    far = plan[np.linalg.norm(plan, axis=1).argmax()]
    near = plan[np.linalg.norm(plan, axis=1).argmin()]
    place = item.transforms(item.home[None])[0]
    return near @ place[:2, :2].T + place[:2, 3], far @ place[:2, :2].T + place[:2, 3]


def length_of(way: FloatArray) -> float:
    """m, of a way through places (k, 2)."""
    return float(np.linalg.norm(np.diff(way, axis=0), axis=1).sum())


def _walls_up_to(building: Building, height: float, spacing: float) -> FloatArray:
    """Segments (k, 2, 2) in which the walls are cut at heights up to the robot's."""
    levels = np.arange(spacing / 2, height, spacing)
    cuts = [outline(building.walls, float(level)) for level in levels]
    return np.concatenate([np.zeros((0, 2, 2)), *cuts])


def _points_on(segments: FloatArray, spacing: float) -> FloatArray:
    """Points (n, 2) on segments (k, 2, 2), at most ``spacing`` m apart."""
    points = [np.zeros((0, 2))]
    for start, end in segments:
        count = max(int(np.ceil(np.linalg.norm(end - start) / spacing)), 1) + 1
        points.append(start + np.linspace(0.0, 1.0, count)[:, None] * (end - start))
    return np.concatenate(points)


def edges_between(free: BoolArray) -> IntArray:
    """(e, 2) numbers, row by row, of neighbouring cells (rows, columns) that are both free."""
    numbers, able = np.arange(free.size).reshape(free.shape), free.reshape(-1)
    pairs = []
    for down, right in NEIGHBOURS:
        here, there = _shifted(numbers, down, right)
        both = able[here] & able[there]
        pairs.append(np.column_stack([here[both], there[both]]))
    return np.concatenate(pairs)


def _shifted(numbers: IntArray, down: int, right: int) -> tuple[IntArray, IntArray]:
    """Numbers (n,) of cells with a neighbour at an offset down and right, and of these."""
    rows, columns = numbers.shape
    if right < 0:
        return numbers[: rows - down, -right:].reshape(-1), numbers[down:, :right].reshape(-1)
    here = numbers[: rows - down, : columns - right]
    return here.reshape(-1), numbers[down:, right:].reshape(-1)


def _near_line(
    points: FloatArray, start: FloatArray, end: FloatArray, distance: float
) -> BoolArray:
    """Which points (n, 2) lie within ``distance`` m of the line between two points (2,)."""
    along = end - start
    share = ((points - start) @ along / (along @ along)).clip(0.0, 1.0)
    off = points - (start + share[:, None] * along)
    return np.asarray(np.linalg.norm(off, axis=1) <= distance)


def _inside(points: FloatArray, corners: FloatArray, margin: float) -> BoolArray:
    """Which points (n, 2) lie in a convex polygon (k, 2) or within ``margin`` m of its sides."""
    along = np.roll(corners, -1, axis=0) - corners
    normal = np.column_stack([along[:, 1], -along[:, 0]])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    outside = np.einsum("nkd,kd->nk", points[:, None] - corners, normal)
    return np.asarray(outside.max(axis=1) <= margin)
