"""Where an edited building goes: its own folder, or another one."""

from __future__ import annotations

from pathlib import Path

from objstate.building.occupancy import files_of_map, is_map
from objstate.building.writing import (
    DECISIONS_FILE,
    check_apart,
    check_in_place,
    check_target,
)
from objstate.errors import BuildingError


def target_of(source: Path, out: str | Path | None) -> Path:
    """The folder for what is edited of a building or a map.

    Raises BuildingError where it isn't given but needed, or where objstate may not replace it.
    """
    if out is None and is_map(source):
        raise BuildingError(
            f"{source} is a map, which isn't changed; say with --out where its building goes."
        )
    folder = folder_of(source) if out is None else Path(out)
    target = folder.resolve() if folder.is_symlink() else folder  # a link itself isn't replaced
    if not is_in_place(source, target):
        check_apart(target, *(files_of_map(source) if is_map(source) else [source]))
    check_saving(source, target)
    return target


def check_saving(source: Path, target: Path) -> None:
    """Raise BuildingError where what was edited of a source may not be written to a folder.

    A folder other than the source's own must be empty, or hold what was edited earlier.
    """
    if not target.exists():
        return
    if is_in_place(source, target):
        check_in_place(target)
    else:
        check_target(target, overwrite=True)
        _check_edited(target)
    if within := sorted(each for each in target.iterdir() if each.is_dir()):
        raise BuildingError(
            f"{within[0]} would be lost, as {target} is replaced by what is edited; move it away, "
            "or give another --out."
        )


def _check_edited(target: Path) -> None:
    if any(target.iterdir()) and not (target / DECISIONS_FILE).is_file():
        raise BuildingError(
            f"{target} has no {DECISIONS_FILE} of an earlier edit, so what it holds won't be "
            "replaced; give an --out that is new or empty, or move it away."
        )


def is_in_place(source: Path, target: Path) -> bool:
    """Whether the edited building replaces the one that was read."""
    return not is_map(source) and target.resolve() == folder_of(source).resolve()


def folder_of(source: Path) -> Path:
    """The folder of a building, or of a file."""
    return source if source.is_dir() else source.parent
