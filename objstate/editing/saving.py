"""Writing what was edited: the building, its table of doors, and what a person decided."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from objstate.building.door_table import PROBABILITY, door_rows, read_doors
from objstate.building.from_map import building_of_map
from objstate.building.model import Building, Kind, MovableObject
from objstate.building.sidecar import sidecar_of
from objstate.building.writing import (
    DECISIONS_FILE,
    DOORS_FILE,
    kept_in_place,
    write_buildings,
)
from objstate.editing.rows import DoorRow, Edits, hangs_alike, leaf_of, row_of
from objstate.editing.subject import Subject
from objstate.editing.target import check_saving
from objstate.errors import BuildingError


def save(subject: Subject, edits: Edits) -> Subject:
    """Write the edited building, ``doors.csv`` and ``decisions.json``, whole or not at all.

    Walls are made of the map anew, where it is known. In the building's own folder all else stays,
    as what ``learn`` wrote. Returns the subject as it was saved. Doors that are edited again are
    still made of the building that was read, so that what is undone is as it was. Raises
    BuildingError for doors that can't be, and ResultError.
    """
    check_saving(subject.source, subject.out)
    table = _checked_table(subject, edits)
    building = _edited(subject.building, edits)
    if subject.plan is not None:
        doors = [row.door for row in edits.doors if row.is_taken]
        walls = building_of_map(subject.plan, doors).walls
        building = replace(building, walls=walls)
    sidecar = _sidecar(subject, edits)
    decisions = edits.model_dump_json(indent=1, exclude_none=True)
    beside = {DOORS_FILE: table, DECISIONS_FILE: decisions + "\n"}
    keep = kept_in_place(subject.out) if subject.is_in_place else ()
    write_buildings(subject.out, {".": building}, {".": sidecar}, beside, keep)
    shown = replace(subject.building, walls=building.walls)
    return replace(subject, building=shown, rows=edits.doors)


def _sidecar(subject: Subject, edits: Edits) -> str | None:
    """The file beside the URDF, whose deviations follow doors that hang as before; others go."""
    error = subject.building.error
    if error is None or not error.doors:
        return subject.sidecar
    before = _rows(subject.building)
    known = {name: own for name, own in error.doors.items() if name not in before}
    for row in edits.doors:
        name = _hanging_alike(row, before) if row.is_taken else None
        if name in error.doors:
            known[row.name] = error.doors[name]
    if known == error.doors:
        return subject.sidecar
    return sidecar_of(error.model_copy(update={"doors": known}))


def _rows(building: Building) -> dict[str, DoorRow]:
    """The doors that can be edited, by name."""
    rows = (row_of(item) for item in building.objects.values())
    return {row.name: row for row in rows if row is not None}


def _hanging_alike(row: DoorRow, others: Mapping[str, DoorRow]) -> str | None:
    """The name of the other that hangs as a door does, if any: its own, if that does."""
    named = others.get(row.name)
    if named is not None and hangs_alike(named, row):
        return row.name
    return next((name for name, other in others.items() if hangs_alike(other, row)), None)


def _checked_table(subject: Subject, edits: Edits) -> str:
    """The table of all doors that are taken, and of candidates that nobody has decided on.

    What drives told of them stands there for doors that hang as before. Raises BuildingError where
    it couldn't be read again.
    """
    rows = [row for row in edits.doors if row.is_taken or row.decision == "open"]
    known = {name: DoorRow.of(door) for name, door in subject.table.items()}
    beside: dict[str, dict[str, object]] = {}
    for row in rows:
        name = _hanging_alike(row, known)
        beside[row.name] = {} if name is None else dict(subject.table[name].told)
        if row.decision == "open" and row.probability is not None:
            beside[row.name][PROBABILITY] = row.probability
    table = door_rows([row.door for row in rows], beside)
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
    before = _rows(building)
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
        name = _hanging_alike(row, before) or row.name
        doors[row.name] = leaf_of(row, building.objects.get(name))
    return replace(building, objects=doors | others)
