"""The edited building, or map, with candidates for doors and earlier decisions."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from objstate.building import load_building
from objstate.building.door_table import Door, read_doors
from objstate.building.from_map import building_of_map
from objstate.building.model import Building
from objstate.building.occupancy import OccupancyMap, is_map, read_map
from objstate.building.sidecar import sidecar_of_map, sidecar_text
from objstate.building.urdf import urdf_of
from objstate.building.writing import DECISIONS_FILE
from objstate.editing.learnt import map_of_learnt, table_of
from objstate.editing.merging import merged_rows
from objstate.editing.rows import DoorRow, Edits, row_of
from objstate.editing.target import folder_of, is_in_place, target_of
from objstate.errors import BuildingError


@dataclass(frozen=True, eq=False)
class Subject:
    """A building, or a map, and where the edited building goes."""

    building: Building  # of a map, its walls with all that is drawn in it
    plan: OccupancyMap | None  # of which the walls are made, where it is known
    sidecar: str | None
    rows: list[DoorRow]
    table: Mapping[str, Door]  # of tables of doors that were read, by name
    source: Path
    out: Path
    candidates: Path | None
    warnings: tuple[str, ...] = ()

    @property
    def is_in_place(self) -> bool:
        """Whether the edited building replaces the one that was read."""
        return is_in_place(self.source, self.out)

    @property
    def urdf(self) -> Path:
        """Of the edited building."""
        return self.out / f"{self.building.name}.urdf"

    def read_again(self) -> Subject:
        """The same from the files as they are now. Raises BuildingError."""
        return subject_of(self.source, self.out, self.candidates)


def subject_of(
    source: str | Path, out: str | Path | None = None, candidates: str | Path | None = None
) -> Subject:
    """The content of a folder with a building, of its URDF, or of a map's YAML file.

    ``candidates`` is a table of doors, with a column ``probability`` if they are to be decided on;
    such a table in the building's folder is found there. Without ``out`` a folder that objstate
    wrote is edited in place. Raises BuildingError.
    """
    path = Path(source)
    if not path.exists():
        raise BuildingError(
            f"{path} doesn't exist; give a building's folder or URDF, or a map's YAML file."
        )
    target = target_of(path, out)
    building, plan, sidecar, warnings = (_of_map if is_map(path) else _of_building)(path)
    table = None if candidates is None else Path(candidates)
    is_own = path.is_dir() or is_in_place(path, target)
    own = table_of(folder_of(path)) if is_own else []
    found = (
        [door for door in own if door.probability is not None]
        if table is None
        else read_doors(table)
    )
    rows = [row for item in building.objects.values() if (row := row_of(item)) is not None]
    names = set(building.objects) - {row.name for row in rows}
    return Subject(
        building=building,
        plan=plan,
        sidecar=sidecar,
        rows=merged_rows(rows, _decisions(target), [DoorRow.of(door) for door in found], names),
        table={door.name: door for door in [*own, *found]},
        source=path,
        out=target,
        candidates=table,
        warnings=tuple(warnings),
    )


Opened = tuple[Building, OccupancyMap | None, str | None, list[str]]


def _of_map(path: Path) -> Opened:
    """A map's walls, the map, the sidecar of a building made of it, and no warnings."""
    plan = read_map(path)
    return building_of_map(plan), plan, sidecar_of_map(plan.resolution), []


def _of_building(path: Path) -> Opened:
    """A building, the map in which it was learnt, its sidecar, and warnings."""
    urdf = urdf_of(path)
    building = load_building(urdf)
    plan, warnings = map_of_learnt(folder_of(path), building)
    return building, plan, sidecar_text(urdf), warnings


def _decisions(folder: Path) -> list[DoorRow]:
    """What was decided before, in the same folder."""
    path = folder / DECISIONS_FILE
    if not path.is_file():
        return []
    try:
        return Edits.model_validate(json.loads(path.read_text(encoding="utf-8"))).doors
    except (ValueError, ValidationError) as error:
        raise BuildingError(
            f"{path} can't be read ({error}); remove it to decide on all doors anew."
        ) from error
