"""``objstate building import``: a file of another tool becomes buildings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from objstate.building.model import Building
from objstate.building.writing import check_output, write_buildings
from objstate.errors import BuildingError
from objstate.interchange.ifc import import_ifc
from objstate.interchange.imported import Imported, Notes, file_name, unused_name
from objstate.interchange.rmf import import_rmf
from objstate.interchange.sdf import import_sdf


@dataclass(frozen=True)
class ImportOptions:
    """What some formats need beside the file."""

    models: Sequence[Path] = ()  # folders that are searched for ``model://``
    movable: Sequence[str] = ()  # patterns of the names of models that are furniture


WORLDS = (".sdf", ".world")  # endings of the files that these options are for

Reader = Callable[[Path, ImportOptions], Imported]

READERS: dict[str, Reader] = {
    **dict.fromkeys((".yaml", ".yml"), lambda path, _: import_rmf(path)),
    **dict.fromkeys(
        WORLDS, lambda path, options: import_sdf(path, options.models, options.movable)
    ),
    ".ifc": lambda path, _: import_ifc(path),
}


@dataclass(frozen=True)
class ImportResult:
    """What was written, and what of the file it holds."""

    buildings: list[Path]  # the URDF of each floor
    notes: Notes


def import_building(
    path: str | Path,
    out_dir: str | Path,
    *,
    level: str | None = None,
    options: ImportOptions | None = None,
    overwrite: bool = False,
) -> ImportResult:
    """Make buildings of a file of another tool, and write them to ``out_dir``, all or nothing.

    A file of several floors becomes a folder for each in ``out_dir``, unless ``level`` names one.
    ``out_dir`` must not exist, unless it holds earlier such buildings and ``overwrite`` is set.
    Raises BuildingError, and ResultError if they can't be written.
    """
    source, out = Path(path), Path(out_dir)
    check_output(out, overwrite, source)
    if source.suffix.lower() not in READERS:
        raise BuildingError(
            f"{source} has the ending '{source.suffix}', which is not imported; give one of "
            f"{', '.join(READERS)}."
        )
    if not source.is_file():
        raise BuildingError(f"{source} is no file; check the path.")
    options = options or ImportOptions()
    if (options.models or options.movable) and source.suffix.lower() not in WORLDS:
        raise BuildingError(
            f"--models and --movable are for SDF worlds, which {source} isn't; leave them out."
        )
    made = READERS[source.suffix.lower()](source, options)
    floors = made.floors if level is None else {level: _level(made, level, source)}
    empty = [name for name, building in floors.items() if not len(building.walls.faces)]
    if len(empty) == len(floors):
        raise BuildingError(f"{source} holds no walls that can be used: {_listed(made.notes.left)}")
    for name in empty:
        made.notes.left.append(f"Level '{name}', which has no walls.")
    kept = {name: building for name, building in floors.items() if name not in empty}
    folders: dict[str, str] = {}
    for name in kept:
        own = unused_name(file_name(name), folders.values())
        folders[name] = "." if len(kept) == 1 else own
    written = write_buildings(
        out,
        {folders[name]: building for name, building in kept.items()},
        {folders[name]: made.sidecars.get(name) for name in kept},
    )
    return ImportResult(written, made.notes)


def _level(made: Imported, level: str, source: Path) -> Building:
    if level not in made.floors:
        raise BuildingError(
            f"{source} has no level '{level}'; its levels: {', '.join(made.floors)}."
        )
    return made.floors[level]


def _listed(left: list[str]) -> str:
    return " ".join(left) or "it is empty."
