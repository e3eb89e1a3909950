"""Writing what was edited: the building, its table of doors, and what a person decided."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from objstate.building import building_from_map, load_building
from objstate.building.door_table import door_rows, read_doors
from objstate.building.model import Building, Kind, MovableObject
from objstate.building.sidecar import sidecar_of, sidecar_text
from objstate.building.writing import DECISIONS_FILE, DOORS_FILE, check_target, write_buildings
from objstate.editing.rows import Edits, leaf_of, row_of
from objstate.editing.subject import Subject
from objstate.errors import BuildingError

SAME_PLACE = 1e-3  # m, of origins that weren't moved: tables are rounded


def save(subject: Subject, edits: Edits) -> Path:
    """Write the edited building, ``doors.csv`` and ``decisions.json``, whole or not at all.

    Returns the URDF's path. Raises BuildingError for doors that can't be, and ResultError.
    """
    if subject.out.exists():
        check_target(subject.out, overwrite=True)
    table = _checked_table(edits)
    if subject.plan is None:
        building = _edited(subject.building, edits)
        sidecar = _sidecar(subject, building)
    else:
        building, sidecar = _of_map(subject.plan, table)
    decisions = edits.model_dump_json(indent=1, exclude_none=True)
    beside = {DOORS_FILE: table, DECISIONS_FILE: decisions + "\n"}
    return write_buildings(subject.out, {".": building}, {".": sidecar}, beside)[0]


def _sidecar(subject: Subject, building: Building) -> str | None:
    """The file beside the URDF, without deviations of doors that a person has put elsewhere."""
    before = subject.building
    known = {} if before.error is None else before.error.doors
    same = {name: own for name, own in known.items() if _stays(before, building, name)}
    if before.error is None or same == known:
        return subject.sidecar
    return sidecar_of(before.error.model_copy(update={"doors": same}))


def _stays(before: Building, after: Building, name: str) -> bool:
    """Whether a door is where it was."""
    if name not in before.objects or name not in after.objects:
        return False
    origins = before.objects[name].origin, after.objects[name].origin
    return bool(np.allclose(*origins, atol=SAME_PLACE))


def _checked_table(edits: Edits) -> str:
    """The table of all doors that are taken; BuildingError where it couldn't be read again."""
    table = door_rows([row.door for row in edits.doors if row.is_taken])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / DOORS_FILE
        path.write_text(table, encoding="utf-8")
        try:
            read_doors(path)
        except BuildingError as error:
            raise BuildingError(str(error).replace(str(path), DOORS_FILE)) from error
    return table


def _edited(building: Building, edits: Edits) -> Building:
    """The building with the accepted doors in place of the editable ones."""
    others = {name: item for name, item in building.objects.items() if row_of(item) is None}
    doors: dict[str, MovableObject] = {}
    for row in edits.doors:
        if not row.is_taken:
            continue
        if row.name in others:
            kind = (
                "furniture" if others[row.name].kind is Kind.PLANAR else "a door that isn't edited"
            )
            raise BuildingError(f"'{row.name}' is {kind} already; choose another name.")
        doors[row.name] = leaf_of(row, building.objects.get(row.name))
    return replace(building, objects=doors | others)


def _of_map(plan: Path, table: str) -> tuple[Building, str | None]:
    """The building of a map and a table of doors, whose leaves are cleared from the map."""
    with tempfile.TemporaryDirectory() as folder:
        doors = Path(folder) / DOORS_FILE
        doors.write_text(table, encoding="utf-8")
        urdf = building_from_map(plan, doors, Path(folder) / "building")
        return load_building(urdf), sidecar_text(urdf)
