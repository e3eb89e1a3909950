"""Writing what was edited: the building, its table of doors, and what a person decided."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from objstate.building import building_from_map, load_building
from objstate.building.door_table import door_rows, read_doors
from objstate.building.model import Building, Kind, MovableObject
from objstate.building.sidecar import sidecar_of, sidecar_text
from objstate.building.writing import DECISIONS_FILE, DOORS_FILE, check_target, write_buildings
from objstate.editing.rows import DoorRow, Edits, hangs_alike, leaf_of, row_of
from objstate.editing.subject import Subject
from objstate.errors import BuildingError

Before = Mapping[str, tuple[MovableObject, DoorRow]]  # by name, the doors that can be edited


def save(subject: Subject, edits: Edits) -> Path:
    """Write the edited building, ``doors.csv`` and ``decisions.json``, whole or not at all.

    Returns the URDF's path. Raises BuildingError for doors that can't be, and ResultError.
    """
    if subject.out.exists():
        check_target(subject.out, overwrite=True)
    table = _checked_table(edits)
    if subject.plan is None:
        building = _edited(subject.building, edits)
        sidecar = _sidecar(subject, edits)
    else:
        building, sidecar = _of_map(subject.plan, table)
    decisions = edits.model_dump_json(indent=1, exclude_none=True)
    beside = {DOORS_FILE: table, DECISIONS_FILE: decisions + "\n"}
    return write_buildings(subject.out, {".": building}, {".": sidecar}, beside)[0]


def _sidecar(subject: Subject, edits: Edits) -> str | None:
    """The file beside the URDF, whose deviations follow doors that hang as before; others go."""
    error = subject.building.error
    if error is None or not error.doors:
        return subject.sidecar
    before = _before(subject.building)
    known = {name: own for name, own in error.doors.items() if name not in before}
    for row in edits.doors:
        old = _door_before(row, before)
        if not row.is_taken or old is None or not hangs_alike(old[1], row):
            continue
        if old[0].name in error.doors:
            known[row.name] = error.doors[old[0].name]
    if known == error.doors:
        return subject.sidecar
    return sidecar_of(error.model_copy(update={"doors": known}))


def _before(building: Building) -> Before:
    rows = ((item, row_of(item)) for item in building.objects.values())
    return {item.name: (item, row) for item, row in rows if row is not None}


def _door_before(row: DoorRow, before: Before) -> tuple[MovableObject, DoorRow] | None:
    """What a door was: the one that hangs alike, whatever its name; else the one of its name."""
    named = before.get(row.name)
    if named is not None and hangs_alike(named[1], row):
        return named
    return next((old for old in before.values() if hangs_alike(old[1], row)), named)


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
    before = _before(building)
    others = {name: item for name, item in building.objects.items() if name not in before}
    doors: dict[str, MovableObject] = {}
    for row in edits.doors:
        if not row.is_taken:
            continue
        if row.name in others:
            kind = (
                "furniture" if others[row.name].kind is Kind.PLANAR else "a door that isn't edited"
            )
            raise BuildingError(f"'{row.name}' is {kind} already; choose another name.")
        old = _door_before(row, before)
        doors[row.name] = leaf_of(row, None if old is None else old[0])
    return replace(building, objects=doors | others)


def _of_map(plan: Path, table: str) -> tuple[Building, str | None]:
    """The building of a map and a table of doors, whose leaves are cleared from the map."""
    with tempfile.TemporaryDirectory() as folder:
        doors = Path(folder) / DOORS_FILE
        doors.write_text(table, encoding="utf-8")
        urdf = building_from_map(plan, doors, Path(folder) / "building")
        return load_building(urdf), sidecar_text(urdf)
