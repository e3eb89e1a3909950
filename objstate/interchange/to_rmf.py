"""A building as an Open-RMF ``building.yaml`` of one level, in metres."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from objstate.building.model import Building, Kind, MovableObject
from objstate.building.outline import wall_outline
from objstate.geometry import FloatArray
from objstate.interchange.imported import Notes, several
from objstate.interchange.rmf_walls import WALL_THICKNESS, wall_lines

LEVEL = "L1"
TEXT, WHOLE, NUMBER = 1, 2, 3  # how the format marks types
SAME = 1e-3  # m, of lengths
UPRIGHT = 1e-3  # of a unit axis, by which it may lean


class _Vertices:
    """Points of the plan, each once."""

    def __init__(self) -> None:
        self.rows: list[list[Any]] = []
        self._numbers: dict[tuple[float, float], int] = {}

    def number(self, point: FloatArray) -> int:
        x, y = (round(float(value), 4) + 0.0 for value in point)
        if (x, y) not in self._numbers:
            self._numbers[x, y] = len(self.rows)
            self.rows.append([x, y, 0.0, ""])
        return self._numbers[x, y]


def write_rmf(out: Path, building: Building, height: float, notes: Notes) -> None:
    """Write ``NAME.building.yaml`` to a folder: the walls at ``height`` m, and the doors."""
    vertices = _Vertices()
    faces = wall_outline(building.walls, height)
    doors = [
        edge
        for item in building.objects.values()
        if (edge := _door(item, vertices, notes)) is not None
    ]
    leaves = [np.array([vertices.rows[at][:2] for at in door[:2]]) for door in doors]
    lines = wall_lines(faces, leaves)
    walls = [[vertices.number(a), vertices.number(b), {}] for a, b in lines]
    walls = [row for row in walls if row[0] != row[1]]
    level = {
        "elevation": 0.0,
        "vertices": vertices.rows,
        "walls": walls,
        "doors": doors,
        "lanes": [],
        "floors": [],
        "models": [],
    }
    content = {
        "name": building.name,
        "coordinate_system": "cartesian_meters",
        "levels": {LEVEL: level},
        "lifts": {},
    }
    text = yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=100)
    (out / f"{building.name}.building.yaml").write_text(text, encoding="utf-8")
    notes.taken.append(f"Walls at {height:g} m, by {several(len(walls), 'line')}.")
    notes.taken.append(f"{several(len(doors), 'door')}.")
    notes.doubts.append(
        f"Open-RMF draws walls {WALL_THICKNESS:g} m thick; thinner ones come out thicker, doorways "
        "as wide as they are."
    )


def _door(item: MovableObject, vertices: _Vertices, notes: Notes) -> list[Any] | None:
    """The edge of a door; None, and a note, for doors that the format can't hold."""
    if item.kind is Kind.PLANAR:
        notes.left.append(f"'{item.name}', as furniture is a model of its own there.")
        return None
    closed = item.mesh.moved(item.transforms(np.zeros((1, 1)))[0]).vertices[:, :2]
    if item.kind is Kind.SLIDING:
        along = item.direction[:2]
        if abs(np.linalg.norm(along) - 1.0) > UPRIGHT:
            notes.left.append(f"'{item.name}', as it doesn't slide level.")
            return None
        # it opens towards the first vertex
        places = (closed - closed.mean(axis=0)) @ along
        first, last = (
            closed.mean(axis=0) + along * place for place in (places.max(), places.min())
        )
        if item.upper <= 0:
            first, last = last, first
        width, travel = float(np.ptp(places)), item.upper - item.lower
        if abs(travel - width) > SAME:
            notes.doubts.append(
                f"'{item.name}' slides by {travel:.2f} m, there by its width of {width:.2f} m."
            )
        return _edge(item.name, "sliding", 1, 0.0, vertices.number(first), vertices.number(last))
    if abs(abs(item.direction[2]) - 1.0) > UPRIGHT:
        notes.left.append(f"'{item.name}', as its hinge isn't upright.")
        return None
    hinge = item.hinge
    off = closed - hinge
    way = off.mean(axis=0) / max(float(np.linalg.norm(off.mean(axis=0))), 1e-9)
    free = hinge + way * float((off @ way).max())
    swing = item.upper if item.upper >= -item.lower else item.lower
    clockwise = swing * item.direction[2] < 0
    if item.lower < 0 < item.upper:
        notes.doubts.append(f"'{item.name}' opens to both sides; its wider one is taken.")
    degrees = abs(math.degrees(swing))
    numbers = vertices.number(hinge), vertices.number(free)
    return _edge(item.name, "hinged", 1 if clockwise else -1, degrees, *numbers)


def _edge(name: str, kind: str, direction: int, degrees: float, v1: int, v2: int) -> list[Any]:
    return [
        v1,
        v2,
        {
            "name": [TEXT, name],
            "type": [TEXT, kind],
            "motion_axis": [TEXT, "start"],
            "motion_direction": [WHOLE, direction],
            "motion_degrees": [NUMBER, round(degrees, 6)],
            "plugin": [TEXT, "normal"],
            "right_left_ratio": [NUMBER, 1.0],
        },
    ]
