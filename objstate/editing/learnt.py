"""The map of a building whose doors were learnt in it."""

from __future__ import annotations

import json
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from objstate.building.door_table import Door, read_doors
from objstate.building.from_map import building_of_map
from objstate.building.model import Building, Mesh
from objstate.building.occupancy import OccupancyMap, read_map
from objstate.building.writing import DOORS_FILE, LEARN_FILE
from objstate.editing.rows import row_of
from objstate.errors import BuildingError

SAME = 1e-3  # m, of walls: meshes are written with float32 numbers


def table_of(folder: Path) -> list[Door]:
    """The doors in a folder's table, none without one. Raises BuildingError."""
    path = folder / DOORS_FILE
    return read_doors(path) if path.is_file() else []


def map_of_learnt(folder: Path, building: Building) -> tuple[OccupancyMap | None, list[str]]:
    """The map in which ``learn`` found the doors of the building in a folder, and warnings.

    None where it isn't told, can't be read, or has other walls than the building.
    """
    name = _map_name(folder / LEARN_FILE)
    if name is None:
        return None, []
    try:
        plan = read_map(_found(folder.resolve().parent / name, Path(name)))
        if not _has_walls(plan, building, table_of(folder)):
            raise BuildingError(f"The map {name} with the building's doors has other walls.")
    except BuildingError as error:
        told = (
            f"The walls of {folder} stay as they are, since they can't be made of the map in which "
            "its doors were found: a rejected door leaves a hole in its wall, and an accepted one "
            f"stands in it. {error}"
        )
        return None, [told]
    return plan, []


def _map_name(file: Path) -> str | None:
    """The map that ``learn.json`` names, if it does."""
    if not file.is_file():
        return None
    try:
        words = json.loads(file.read_text(encoding="utf-8"))
    except ValueError:
        return None  # of damaged files ``learn`` tells, which goes on from them
    name = words.get("map") if isinstance(words, dict) else None
    return name if isinstance(name, str) else None


def _found(*places: Path) -> Path:
    """The first place that holds a regular file: to open a pipe would wait for its writer.

    Raises BuildingError where none does.
    """
    for place in places:
        with suppress(OSError):  # as of a name that is too long
            if place.is_file():
                return place
    raise BuildingError(
        f"There is no file {str(places[-1])!r}, which {LEARN_FILE} names as the map; put it there."
    )


def _has_walls(plan: OccupancyMap, building: Building, table: Iterable[Door]) -> bool:
    """Whether a map has a building's walls, its leaves being shown as a table of doors says.

    Raises BuildingError.
    """
    in_map = {door.name: door.in_map for door in table}
    rows = [row_of(item) for item in building.objects.values()]
    doors = [replace(row.door, in_map=in_map.get(row.name)) for row in rows if row is not None]
    made = building_of_map(plan, doors)
    return _is_same(made.walls, building.walls)


def _is_same(one: Mesh, other: Mesh) -> bool:
    return one.vertices.shape == other.vertices.shape and bool(
        np.allclose(one.vertices, other.vertices, rtol=0.0, atol=SAME)
    )
