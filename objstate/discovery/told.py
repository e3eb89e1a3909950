"""What drives told of a building, as ``learn.json`` keeps it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from objstate.building.warping import Columns
from objstate.building.writing import LEARN_FILE
from objstate.calibration import LaserCorrection, Survey, Surveyed
from objstate.errors import BuildingError
from objstate.geometry import FloatArray
from objstate.world.places import PlaceEvidence, Places, PlaceStatics
from objstate.world.statics import DoorEvidence, DoorStatics, Drive

FORM = 2  # of what is written to LEARN_FILE


@dataclass(frozen=True, eq=False)
class Told:
    """What one drive told."""

    log: str
    digest: str
    mounts: Mapping[str, FloatArray]  # (4, 4) in base_link, with which its lasers were read
    survey: Survey  # of walls and lasers
    doors: Drive
    furniture: Places

    def words(self, *, contradicts: bool) -> dict[str, Any]:
        """As JSON has it."""
        return {
            "log": self.log,
            "sha256": self.digest,
            "contradicts": contradicts,
            "mounts": {frame: mount.tolist() for frame, mount in self.mounts.items()},
            "survey": self.survey.words(),
            "doors": {name: door.words() for name, door in self.doors.items()},
            "furniture": {name: piece.words() for name, piece in self.furniture.items()},
        }

    @staticmethod
    def read(words: Mapping[str, Any]) -> Told:
        """Raises KeyError, TypeError, ValueError or AttributeError for what isn't such words."""
        return Told(
            words["log"],
            words["sha256"],
            {frame: np.array(mount, dtype=float) for frame, mount in words["mounts"].items()},
            Survey.read(words["survey"]),
            {name: DoorEvidence.read(door) for name, door in words["doors"].items()},
            {name: PlaceEvidence.read(e) for name, e in words.get("furniture", {}).items()},
        )


def told_before(out: Path, digest: str) -> list[Told] | None:
    """What earlier drives told, where ``out`` was learnt of the building of a digest; else None.

    Raises BuildingError for a folder whose file is damaged.
    """
    file = out / LEARN_FILE
    if not file.is_file():
        return None
    try:
        words = json.loads(file.read_text(encoding="utf-8"))
        if words.get("form") != FORM or words.get("geometry_sha256") != digest:
            return None
        return [Told.read(each) for each in words["drives"]]
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise BuildingError(
            f"{file} can't be gone on from ({error}); remove it, or choose another folder."
        ) from error


def learn_text(
    building: str,
    digest: str,
    told: Sequence[Told],
    left_out: Sequence[Told],
    columns: Columns,
    walls: Surveyed,
    lasers: Sequence[LaserCorrection],
    doors: Sequence[DoorStatics],
    furniture: Sequence[PlaceStatics],
) -> str:
    """The content of ``learn.json``."""
    about = {
        "form": FORM,
        "building": building,
        "geometry_sha256": digest,
        "walls": _of_walls(columns, walls),
        "lasers": [_of_laser(each) for each in lasers],
        "doors": [_of_door(each) for each in doors],
        "furniture": [_of_piece(each) for each in furniture],
        "drives": [each.words(contradicts=each in left_out) for each in told],
    }
    return json.dumps(about, indent=1) + "\n"


def _of_walls(columns: Columns, walls: Surveyed) -> dict[str, Any]:
    stds = np.sqrt(np.linalg.eigvalsh(walls.covariances))  # (c, 2), the better told first
    return {
        "std_m": round(walls.wall_std, 4),
        "remaining_std_m": round(walls.remaining_std, 4),
        "hidden": walls.hidden,
        "columns": [
            {"place_m": place, "moved_m": moved, "std_m": std}
            for place, moved, std in zip(
                columns.places.round(3).tolist(),
                walls.walls.round(4).tolist(),
                stds.round(4).tolist(),
                strict=True,
            )
        ],
    }


def _of_laser(laser: LaserCorrection) -> dict[str, Any]:
    def words(values: FloatArray) -> dict[str, float]:
        x, y, yaw, _ = values.tolist()
        return {"x_m": round(x, 4), "y_m": round(y, 4), "yaw_deg": round(math.degrees(yaw), 3)}

    return {"frame": laser.frame, "moved": words(laser.correction), "std": words(laser.std)}


def _of_piece(piece: PlaceStatics) -> dict[str, Any]:
    (x, y, yaw), std = piece.moved.tolist(), piece.std
    return {
        "piece": piece.name,
        "drives": piece.drives,
        "p_fixed": round(piece.fixed, 4),
        "place_m": [round(x, 4), round(y, 4)],
        "place_std_m": round(piece.place_std, 4),
        "yaw_deg": round(math.degrees(yaw), 3),
        "yaw_std_deg": round(math.degrees(float(std[2])), 3),
    }


def _of_door(door: DoorStatics) -> dict[str, Any]:
    return {
        "door": door.name,
        "drives": door.drives,
        "hinge_m": door.hinge.round(4).tolist(),
        "hinge_std_m": round(door.hinge_std, 4),
        "bearing_deg": round(math.degrees(door.bearing), 3),
        "bearing_std_deg": round(math.degrees(door.bearing_std), 3),
        "leaf_m": door.leaf.round(4).tolist(),
        "leaf_std_m": round(door.leaf_std, 4),
        "wider_m": round(door.width, 4),
        "wider_std_m": round(door.width_std, 4),
    }
