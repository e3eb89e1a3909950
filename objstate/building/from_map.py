"""A building from what most robots have: an occupancy map, and a table of doors."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from objstate.building.assembly import load_building
from objstate.building.contours import border_loops, straighten
from objstate.building.door_table import PROBABLE, Door, door_rows, read_doors
from objstate.building.model import Building, Mesh
from objstate.building.occupancy import OccupancyMap, read_map
from objstate.building.sidecar import sidecar_of_map
from objstate.building.speckle import without_pinholes, without_specks
from objstate.building.swing import clear_leaves
from objstate.building.writing import DOORS_FILE, check_output, write_building
from objstate.errors import BuildingError
from objstate.geometry import BoolArray, FloatArray

Surface = Literal["edge", "centre"]
Report = Callable[[str], None]  # receives sentences about what was done

# Cells from the outer side of an occupied cell to the wall's face. A laser marks the cell that
# its hits fall in, so on average they lie at the centre: in a corridor mapped at 5 cm, the ranges
# of 660 registered scans exceed the expected ones by 11 mm (median) with "centre", 44 with "edge".
INSET = {"edge": 0.0, "centre": 0.5}
BOX_FACES = 12  # triangles of a box, the alternative for each cell
LARGEST_SIZE = 1000.0  # m or cells; a larger size is a slip of the pen, or in another unit


def building_from_map(
    map_yaml: str | Path | OccupancyMap,
    doors_csv: str | Path | None,
    out_dir: str | Path,
    wall_height: float = 2.5,
    *,
    door_height: float = 2.0,
    leaf_thickness: float = 0.04,
    surface: Surface = "centre",
    tolerance: float = 0.75,
    min_cells: int = 3,
    overwrite: bool = False,
    report: Report | None = None,
) -> Path:
    """Write a building as URDF, with its walls beside it, and return the URDF's path.

    The occupied cells of a ROS map become vertical faces ``wall_height`` metres high,
    which miss the cells by at most about ``tolerance`` cells. They stand on the ``edge``
    of the outermost occupied cells or run through their ``centre``; only the ends of
    walls and small things keep to the edge. Blobs of fewer than ``min_cells`` touching
    cells are speckle and left out. Each row of ``doors_csv`` becomes a door, unless it is
    a candidate below 0.5, and what the map shows of its leaf is cleared away.

    ``map_yaml`` is the map's file, or one that was read, as ``conversion.recorded_map`` does of a
    log. Lengths are in metres. ``report`` receives what was cleared and what was made.
    ``out_dir`` is written whole or not at all; it must not exist, unless it holds an
    earlier such building and ``overwrite`` is set. Raises BuildingError, and ResultError
    if it can't be written.
    """
    out = Path(out_dir)
    sources = [each for each in (map_yaml, doors_csv) if isinstance(each, str | Path)]
    check_output(out, overwrite, *sources)
    sizes = {"wall_height": wall_height, "door_height": door_height}
    _check_sizes({**sizes, "leaf_thickness": leaf_thickness, "tolerance": tolerance})
    if min_cells < 0:
        raise BuildingError(f"min_cells is {min_cells}; it must be 0 or more.")
    inset = _inset(surface)
    tell = report or (lambda _: None)
    plan = map_yaml if isinstance(map_yaml, OccupancyMap) else read_map(Path(map_yaml))
    doors = [] if doors_csv is None else _probable(read_doors(Path(doors_csv)), tell)
    occupied = clear_leaves(plan, doors, leaf_thickness, tell)
    occupied = without_specks(occupied, min_cells, tell)
    occupied = without_pinholes(occupied, plan.resolution)
    polygons = [straighten(loop, tolerance, inset) for loop in border_loops(occupied)]
    walls = extrude([plan.to_building(polygon) for polygon in polygons], wall_height)
    if not len(walls.faces):
        raise BuildingError(
            f"Nothing is left of the walls in the map '{plan.name}'; check the door table, whose "
            "leaves are cleared away, and min_cells."
        )
    tell(_balance(occupied, walls))
    sidecar = sidecar_of_map(plan.resolution)
    height = min(door_height, wall_height)
    return write_building(out, plan.name, walls, doors, leaf_thickness, height, sidecar)


def building_of_map(plan: OccupancyMap, doors: Sequence[Door] = ()) -> Building:
    """What ``building_from_map`` makes of a map and a table of doors, read again.

    Raises BuildingError.
    """
    with tempfile.TemporaryDirectory() as folder:
        table = Path(folder) / DOORS_FILE
        table.write_text(door_rows(doors), encoding="utf-8")
        return load_building(building_from_map(plan, table, Path(folder) / "building"))


def _probable(rows: list[Door], tell: Report) -> list[Door]:
    """Those that are no candidates, or probable ones; ``tell`` receives how many others are."""
    doors = [row for row in rows if row.is_probable]
    if left_out := len(rows) - len(doors):
        tell(
            f"{left_out} of {len(rows)} doors left out, as their probability is below {PROBABLE:g}."
        )
    return doors


def _inset(surface: str) -> float:
    if surface not in INSET:
        raise BuildingError(f"surface is '{surface}'; it must be one of {', '.join(INSET)}.")
    return INSET[surface]


def extrude(polygons: list[FloatArray], height: float) -> Mesh:
    """Vertical faces up to ``height`` on the edges of closed polygons (m, 2), each edge once.

    There are no caps: a level laser never meets them.
    """
    if not polygons:
        return Mesh.empty()
    edges = np.concatenate([np.stack([p, np.roll(p, -1, axis=0)], axis=1) for p in polygons])
    backwards = (edges[:, 0, 0] > edges[:, 1, 0]) | (
        (edges[:, 0, 0] == edges[:, 1, 0]) & (edges[:, 0, 1] > edges[:, 1, 1])
    )
    edges = np.where(backwards[:, None, None], edges[:, ::-1], edges)
    edges = np.unique(edges[np.any(edges[:, 0] != edges[:, 1], axis=1)], axis=0)
    floor = edges.reshape(-1, 2)
    count = len(floor)
    vertices = np.vstack(
        [np.column_stack([floor, np.full(count, z)]) for z in (0.0, height)],
    )
    start = np.arange(0, count, 2)
    lower = np.column_stack([start, start + 1, start + 1 + count])
    upper = np.column_stack([start, start + 1 + count, start + count])
    return Mesh(vertices, np.concatenate([lower, upper]))


def _balance(occupied: BoolArray, walls: Mesh) -> str:
    cells = int(np.count_nonzero(occupied))
    return (
        f"{cells} occupied cells became walls of {len(walls.faces)} triangles "
        f"(a box for each cell would have {BOX_FACES * cells})."
    )


def _check_sizes(sizes: dict[str, float]) -> None:
    for name, value in sizes.items():
        if not 0 < value <= LARGEST_SIZE:
            raise BuildingError(
                f"{name} is {value:g}; it must be above 0, and {LARGEST_SIZE:g} at most."
            )
