"""What drives taught of a building, for its report page."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from objstate.building.model import Building
from objstate.building.warping import Columns
from objstate.calibration import LaserCorrection, Surveyed
from objstate.discovery.told import Told
from objstate.geometry import FloatArray, IntArray
from objstate.report.learnt_page import WallsOff, learnt_page
from objstate.report.markup import Cell, text
from objstate.world.places import PlaceStatics
from objstate.world.statics import DoorStatics

OF_DOORS = (
    "door",
    "drives",
    "hinge x (cm)",
    "y (cm)",
    "± (cm)",
    "bearing (°)",
    "± (°)",
    "wider (cm)",
    "± (cm)",
)
OF_PIECES = ("piece", "drives", "fixed (%)", "x (cm)", "y (cm)", "± (cm)", "yaw (°)", "± (°)")
OF_LASERS = ("laser", "x (cm)", "± (cm)", "y (cm)", "± (cm)", "yaw (°)", "± (°)")


def report_of(
    building: Building,
    columns: Columns,
    walls: Surveyed,
    lasers: Sequence[LaserCorrection],
    doors: Sequence[DoorStatics],
    pieces: Sequence[PlaceStatics],
    drives: Sequence[Told],
) -> str:
    """The page."""
    height = drives[0].survey.height
    faces = columns.faces(height)
    before, after = (
        WallsOff(faces.segments, _of_faces(off, faces.columns, faces.shares))
        for off in (walls.before, walls.after)
    )
    tables = [
        ("Doors", OF_DOORS, [_door(each) for each in doors]),
        *([("Furniture", OF_PIECES, [_piece(each) for each in pieces])] if pieces else []),
        ("Lasers", OF_LASERS, [_laser(each) for each in lasers]),
    ]
    said = (
        f"{len(drives)} drives; walls differ from the model by {100.0 * walls.wall_std:.1f} cm, and "
        f"are known to {100.0 * walls.remaining_std:.1f} cm."
    )
    return learnt_page(building, height, before, after, tables, said)


def _of_faces(off: FloatArray, columns: IntArray, shares: FloatArray) -> FloatArray:
    """(k,) m, the mean over both ends of faces, each between two columns (k, 2, 2)."""
    return np.asarray(np.mean(np.sum(shares * off[columns], axis=2), axis=1))


def _door(door: DoorStatics) -> list[str | Cell]:
    bearing, std = math.degrees(door.bearing), math.degrees(door.bearing_std)
    return [
        text(door.name),
        str(door.drives),
        *(f"{100.0 * value:+.1f}" for value in door.hinge),
        f"{100.0 * door.hinge_std:.1f}",
        f"{bearing:+.2f}",
        f"{std:.2f}",
        f"{100.0 * door.width:+.1f}",
        f"{100.0 * door.width_std:.1f}",
    ]


def _piece(piece: PlaceStatics) -> list[str | Cell]:
    (x, y, yaw), std = piece.moved.tolist(), piece.std
    return [
        text(piece.name),
        str(piece.drives),
        f"{100.0 * piece.fixed:.0f}",
        f"{100.0 * x:+.1f}",
        f"{100.0 * y:+.1f}",
        f"{100.0 * piece.place_std:.1f}",
        f"{math.degrees(yaw):+.1f}",
        f"{math.degrees(std[2]):.1f}",
    ]


def _laser(laser: LaserCorrection) -> list[str | Cell]:
    units = (100.0, 100.0, 180.0 / math.pi)
    cells: list[str | Cell] = [text(laser.frame)]
    for value, std, unit in zip(laser.correction[:3], laser.std[:3], units, strict=True):
        cells += [f"{unit * value:+.2f}", f"{unit * std:.2f}"]
    return cells
