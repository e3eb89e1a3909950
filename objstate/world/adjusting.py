"""A building as drives found it: its walls bent, and its doors hung where they were found."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from objstate.building.model import Building, Kind
from objstate.building.warping import Columns
from objstate.calibration import Surveyed
from objstate.config import BuildingErrorSettings
from objstate.geometry import FloatArray
from objstate.objects.doorframe import bearings_by_walls
from objstate.world.places import Places, PlaceStatics, placed
from objstate.world.statics import LEAST_STD_M, DoorStatics, Drive, combined, leaves, rehung

Motions = Mapping[str, tuple[FloatArray, float]]  # by object: a shift (2,) m, a turn in rad


def motions(building: Building, columns: Columns, walls: FloatArray) -> Motions:
    """How the walls about each object are moved, with displacements (c, 2) m of their columns.

    Turns are about a door's axis, and about that which points up of a piece of furniture.
    """
    out = {}
    for name, item in building.objects.items():
        shift, turn = columns.motion(walls, item.hinge)
        is_up = item.kind is Kind.PLANAR or item.direction[2] > 0.0
        out[name] = shift, turn if is_up else -turn
    return out


def _downward(building: Building) -> frozenset[str]:
    """The doors that are closed at their upper limit."""
    return frozenset(
        name
        for name, item in building.objects.items()
        if item.kind is Kind.HINGED and 2.0 * item.home[0] > item.lower + item.upper
    )


def beside(drive: Drive, moved: Motions, times: float) -> Drive:
    """What a drive tells, about doors that were moved.

    A drive tells where a door hangs beside the walls about it, as these were known then.
    """
    return {
        name: each.beside(times * moved[name][0], times * moved[name][1])
        for name, each in drive.items()
    }


def hung(
    building: Building,
    columns: Columns,
    walls: FloatArray,
    moved: Motions,
    drives: Sequence[Drive],
) -> list[DoorStatics]:
    """Where doors hang by drives, beside walls with displacements (c, 2) m of their columns.

    ``moved`` are the ``motions`` of these walls. They tell the bearings of doors that they are in
    line with.
    """
    error = building.error or BuildingErrorSettings()
    there = [beside(each, moved, 1.0) for each in drives]
    names = sorted({name for each in drives for name in each} - error.doors.keys())
    bent = replace(building, walls=columns.warped(walls)) if names else building
    by_walls = bearings_by_walls(bent, names, error.wall_std_m)
    return combined(there, error, _downward(building), by_walls, leaves(building))


def places_beside(drive: Places, moved: Motions, times: float) -> Places:
    """The same of furniture."""
    return {name: each.beside(times * np.append(*moved[name])) for name, each in drive.items()}


def adjusted(
    building: Building,
    columns: Columns,
    walls: Surveyed,
    doors: Sequence[DoorStatics],
    pieces: Sequence[PlaceStatics] = (),
) -> Building:
    """The building as it was learnt."""
    hung = rehung(replace(building, walls=columns.warped(walls.walls)), doors)
    hung = placed(hung, pieces)
    error = hung.error or BuildingErrorSettings()
    std = max(walls.remaining_std, LEAST_STD_M)
    return replace(hung, error=error.model_copy(update={"wall_std_m": std}))
