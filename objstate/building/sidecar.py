"""The errors of a building relative to its model, in a YAML file beside the URDF."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import yaml

from objstate.config import BuildingErrorSettings, Strict, load_yaml, parse_strict

SUFFIX = ".building.yaml"
ROUGHNESS = 0.6  # of a map's cell, by which walls made of it are off
DRAWN = 0.02  # m by which a building is off its plan at least: what builders are allowed


class Sidecar(Strict):
    """The content of such a file."""

    building_error: BuildingErrorSettings = BuildingErrorSettings()


def sidecar_path(urdf: Path) -> Path:
    """The file beside a URDF, whether it is there or not."""
    return urdf.with_name(urdf.stem + SUFFIX)


def read_sidecar(urdf: Path) -> BuildingErrorSettings | None:
    """How far a building is off, by the file beside its URDF; None where there is none.

    Raises SettingsError for one that can't be understood.
    """
    path = sidecar_path(urdf)
    if not path.is_file():
        return None
    return parse_strict(Sidecar, load_yaml(path), str(path)).building_error


def unknown_doors(
    error: BuildingErrorSettings, objects: Collection[str], where: str | Path
) -> list[str]:
    """A sentence for each door whose errors ``where`` states, but which the building lacks."""
    return [
        f"building_error.doors of {where} names '{name}', which is no object of the building; "
        "correct the name, or remove it."
        for name in error.doors
        if name not in objects
    ]


def sidecar_text(urdf: Path) -> str | None:
    """The text of the file beside a URDF; None where there is none."""
    path = sidecar_path(urdf)
    return path.read_text(encoding="utf-8") if path.is_file() else None


def sidecar_of(error: BuildingErrorSettings) -> str:
    """The file for a building whose errors were learnt from drives."""
    words = error.model_dump(exclude_unset=True)
    words["wall_std_m"] = round(error.wall_std_m, 4)
    words["doors"] = {
        name: {
            key: round(value, 4) if isinstance(value, float) else value
            for key, value in own.model_dump(exclude_defaults=True).items()
        }
        for name, own in error.doors.items()
    }
    return _text(words, " Learnt from drives.")


def sidecar_of_map(resolution: float) -> str:
    """The file for a building made of a map, with cells of some m, and a table of doors."""
    error = {
        "wall_std_m": round(ROUGHNESS * resolution, 4),
        "hinge_std_m": 0.05,  # read off the map by eye
        "bearing_std_deg": 1.0,  # likewise, to a degree
        "robot_length_m": 2.0,  # maps are bent over metres
    }
    return _text(error)


def sidecar_of_drawing(unit: float) -> str:
    """The file for a building that was drawn by hand over a picture with pixels of a size, m."""
    std = round(max(unit, DRAWN), 4)
    return _text({"wall_std_m": std, "hinge_std_m": std, "bearing_std_deg": 1.0})


def _text(error: Mapping[str, Any], source: str = "") -> str:
    head = f"# How far walls, hinges and lasers may be off; standard deviations.{source}\n"
    return head + yaml.safe_dump({"building_error": dict(error)}, sort_keys=False)
