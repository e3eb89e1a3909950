"""Clearing a door's leaf out of a map that was recorded with the door in it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from objstate.building.door_table import Door
from objstate.building.occupancy import OccupancyMap
from objstate.building.speckle import NEIGHBOURS
from objstate.geometry import BoolArray, FloatArray, IntArray

SMEAR = 1.5  # cells by which a leaf in a map may stray from where the table has it
TAIL = 0.3  # m beyond the leaf's free edge in which a continuing wall must show
TAIL_SHARE = 0.5  # of the tail's length that must be occupied to count as a wall
FRAME = 0.3  # m; largest difference of the widths of a doorway and its leaf
GAP = 0.4  # m without a cell that part a doorway's other side from a leaf
FULL, EMPTY = 0.8, 0.2  # shares of a leaf's length with and without a wall


@dataclass(frozen=True, eq=False)
class Swing:
    """What of a map lies in the swing area of one door."""

    door: Door
    leaf: BoolArray = field(repr=False)  # (rows, columns) occupied cells that are the leaf
    kept: int  # occupied cells of a wall along the widest opening, left standing
    is_wall: bool  # where the leaf should close a wall runs, and a doorway lies behind the hinge


def clear_leaves(
    plan: OccupancyMap, doors: list[Door], thickness: float, tell: Callable[[str], None]
) -> BoolArray:
    """The map's occupied cells (rows, columns) without the leaves; ``tell`` receives counts."""
    cleared = plan.occupied.copy()
    for door in doors:
        swing = find_leaf(plan, door, thickness)
        if swing.is_wall and not any(_closes_behind(door, other) for other in doors):
            tell(
                f"Door '{door.name}': nothing cleared, as it would close along a wall, with a "
                "doorway behind its hinge. Correct its closed_bearing_deg; if it is right, give "
                "the door behind its hinge as well."
            )
            continue
        cleared &= ~swing.leaf
        count = np.count_nonzero(swing.leaf)
        kept = f", {swing.kept} kept as a wall behind the open leaf" if swing.kept else ""
        turns = "its swing area" if door.in_map is None else "where the map shows it"
        place = "where it closes" if door.slides else turns
        tell(f"Door '{door.name}': {count} cells cleared from {place}{kept}.")
    return cleared


def find_leaf(plan: OccupancyMap, door: Door, thickness: float) -> Swing:
    """The cells of a door's leaf, wherever between its limits the map shows it.

    Within the leaf's width of the hinge these are leaf:

    - everything inside the sector, where nothing else can stand;
    - everything about the closed leaf, within ``tolerance`` to either side: the wall
      that it closes ends at the hinge and begins again at the free edge, or where cells
      begin again behind a gap;
    - but along the widest opening a leaf may stand against a wall. There, a line of
      cells that continues beyond the free edge is that wall and stays.

    Blobs that begin there and reach no farther than ``tolerance`` past the widest opening, or
    ``TAIL`` past the free edge, are leaf as well. What reaches farther is a wall. ``tolerance`` is
    half the leaf's thickness and the blur of the map; cells that close to the hinge are the jamb
    and stay. Where the table says at which angle the map shows the leaf, this holds of that angle
    instead of the widest opening, and what else is in the sector stays. Of a leaf that slides only
    what stands about its closed place is cleared: elsewhere it lies on a wall, or in it.
    """
    tolerance = thickness / 2 + SMEAR * plan.resolution
    rows, columns = np.nonzero(plan.occupied)
    turn, reach = _polar(plan.middles - door.hinge, door)
    along, aside = _beside(turn, reach)
    is_wall, beyond = _walls_in_line(turn, reach, door, tolerance, plan.resolution)
    in_place = np.abs(aside) <= tolerance
    far = in_place & (along >= beyond)
    closed = (along > tolerance) & (along <= door.width) & in_place & ~far
    here = _Cells(plan.occupied.shape, rows, columns)
    if door.slides:
        return Swing(door, here.grid(closed), 0, is_wall)
    along, aside = _beside(turn - (door.upper if door.in_map is None else door.in_map), reach)
    free = (reach > tolerance) & (reach <= door.width)
    at_angle = (along > 0) & (np.abs(aside) <= tolerance)
    open_wide = free & at_angle
    wall = open_wide & ~closed & _on_wall_beyond(along, aside, door.width + tolerance, plan)
    within = at_angle if door.in_map is not None else (turn >= 0) & (turn <= door.upper)
    leaf = closed | (free & within & ~wall & ~far)
    past_limit = open_wide & ~wall & ~leaf & ~far
    past_edge = within & (reach > door.width) & (reach <= door.width + TAIL)
    remnants = here.blobs_inside(
        past_limit | past_edge, among=~leaf & (reach > tolerance), touching=leaf | past_limit
    )
    return Swing(door, here.grid(leaf | remnants), int(np.count_nonzero(wall)), is_wall)


def _walls_in_line(
    turn: FloatArray, reach: FloatArray, door: Door, tolerance: float, resolution: float
) -> tuple[bool, float]:
    """What isn't leaf although it stands in its place: all of it, or beyond a distance, m.

    All of it where cells fill the place, and behind the hinge there is an equal gap that ends at
    cells again, as a doorway does. A wall that shows beside it, within ``FRAME``, is that behind
    whose face the leaf lies, and no gap. A table that was compared with the map, as it says where
    that shows the leaf, has no leaf that closes along a wall. A leaf begins at its hinge, so that what follows a gap is
    the wall on its other side; up to ``FRAME`` of that may be a leaf drawn too long.
    """
    along, aside = _beside(turn, reach)
    in_line = along[np.abs(aside) <= tolerance]
    ahead = np.sort(in_line[(in_line > tolerance) & (in_line <= door.width)])
    about = along[np.abs(aside) <= FRAME]
    behind = -about[(about < -tolerance) & (about >= -door.width - FRAME)]

    def length(cells: FloatArray) -> float:
        return len(np.unique(np.floor(cells / resolution))) * resolution

    leaf = door.width - tolerance
    ends = bool(np.any(behind > door.width - FRAME))
    gap = behind[behind < door.width - FRAME]
    is_doorway = length(gap) <= EMPTY * leaf and ends
    if door.in_map is None and is_doorway and length(ahead) >= FULL * leaf:
        return True, np.inf
    wide = np.flatnonzero(np.diff(np.append(tolerance, ahead)) >= GAP)
    beyond = float(ahead[wide[0]]) if len(wide) else np.inf
    return False, beyond if door.width - beyond >= FRAME else np.inf


def _closes_behind(door: Door, other: Door) -> bool:
    """Whether another door closes the way on the other side of a door's hinge."""
    away = door.width / 2 * np.array([np.cos(door.closed_bearing), np.sin(door.closed_bearing)])
    along = np.array([np.cos(other.closed_bearing), np.sin(other.closed_bearing)])
    offset = door.hinge - away - other.hinge
    reach = float(np.clip(offset @ along, 0.0, other.width))
    return other is not door and bool(np.linalg.norm(offset - reach * along) <= FRAME)


def _polar(offsets: FloatArray, door: Door) -> tuple[FloatArray, FloatArray]:
    """Opening angle (n,) rad, below 0 and above ``upper`` equally far, and distance (n,) m."""
    bearing = np.arctan2(offsets[:, 1], offsets[:, 0])
    turn = (door.sense or 1) * (bearing - door.closed_bearing)
    spare = (2 * np.pi - door.upper) / 2
    return (turn + spare) % (2 * np.pi) - spare, np.linalg.norm(offsets, axis=1)


def _beside(turn: FloatArray, reach: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where points (n,) lie along a ray from the hinge and beside it, m, by their turn from it."""
    return reach * np.cos(turn), reach * np.sin(turn)


def _on_wall_beyond(
    along: FloatArray, aside: FloatArray, end: float, plan: OccupancyMap
) -> BoolArray:
    """(n,) the cells in line with a wall beyond the leaf's free ``end``; often none."""
    smear = SMEAR * plan.resolution
    tail = (along > end) & (along <= end + TAIL) & (np.abs(aside) <= 2 * smear)
    filled = len(np.unique(np.floor((along[tail] - end) / plan.resolution)))
    if filled * plan.resolution < TAIL_SHARE * TAIL:
        return np.zeros(len(along), dtype=bool)
    return np.asarray(np.abs(aside - np.median(aside[tail])) <= smear)


@dataclass(frozen=True, eq=False)
class _Cells:
    """Some cells of a grid; each mask below is over them."""

    shape: tuple[int, ...]
    rows: IntArray  # (n,)
    columns: IntArray  # (n,)

    def blobs_inside(self, region: BoolArray, among: BoolArray, touching: BoolArray) -> BoolArray:
        """(n,) the blobs of ``among`` that lie wholly in a region and touch or hold some cells."""
        from scipy.ndimage import binary_dilation, label

        blobs, count = label(self.grid(among), NEIGHBOURS)
        blob = blobs[self.rows, self.columns]
        chosen = np.zeros(count + 1, dtype=bool)
        near = binary_dilation(self.grid(touching), NEIGHBOURS)
        chosen[blob[near[self.rows, self.columns]]] = True
        chosen[blob[among & ~region]] = False
        return np.asarray(among & chosen[blob], dtype=bool)

    def grid(self, mask: BoolArray) -> BoolArray:
        """The cells of a mask in the grid."""
        grid = np.zeros(self.shape, dtype=bool)
        grid[self.rows[mask], self.columns[mask]] = True
        return grid
