"""Where an edited building goes: its own folder, or another one."""

from __future__ import annotations

from pathlib import Path

from objstate.building.occupancy import files_of_map, is_map
from objstate.building.writing import check_apart, check_target, is_replaceable
from objstate.errors import BuildingError


def target_of(source: Path, out: str | Path | None) -> Path:
    """The folder for what is edited of a building or a map.

    Raises BuildingError where it isn't given but needed, or where objstate may not replace it.
    """
    if out is None:
        return _own(source)
    target = Path(out)
    if not is_in_place(source, target):
        check_apart(target, *(files_of_map(source) if is_map(source) else [source]))
    check_saving(target)
    return target


def check_saving(target: Path) -> None:
    """Raise BuildingError where objstate may not write what was edited to a folder."""
    if target.exists():
        check_target(target, overwrite=True)


def is_in_place(source: Path, target: Path) -> bool:
    """Whether the edited building replaces the one that was read."""
    return not is_map(source) and target.resolve() == folder_of(source).resolve()


def folder_of(source: Path) -> Path:
    """The folder of a building, or of a file."""
    return source if source.is_dir() else source.parent


def _own(source: Path) -> Path:
    folder = folder_of(source)
    if is_map(source) or not is_replaceable(folder):
        raise BuildingError(
            f"{folder} wasn't written by objstate, so nothing is changed there; say with --out "
            "where the edited building goes."
        )
    return folder
