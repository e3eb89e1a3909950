"""Small Open-RMF buildings, in the form that traffic-editor saves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml

PIXEL = 0.02  # m

ROOM = [[100, 600], [600, 600], [600, 100], [100, 100]]  # 10 m by 10 m, y downwards


def param(value: Any) -> list[Any]:
    """A value with the number of its type."""
    kinds = {str: 1, int: 2, float: 3, bool: 4}
    return [kinds[type(value)], value]


def edge(start: int, end: int, **params: Any) -> list[Any]:
    return [start, end, {name: param(value) for name, value in params.items()}]


def door(start: int, end: int, name: str, kind: str, **params: Any) -> list[Any]:
    known = {
        "motion_axis": "start",
        "motion_degrees": 90.0,
        "motion_direction": 1,
        "plugin": "normal",
        "right_left_ratio": 1.0,
    }
    return edge(start, end, name=name, type=kind, **(known | params))


def level(vertices: list[list[float]], **keys: Any) -> dict[str, Any]:
    """A level whose first two vertices are 10 m apart in a drawing of 2 cm a pixel."""
    return {
        "drawing": {"filename": "office.png"},
        "elevation": 0,
        "measurements": [edge(0, 1, distance=10.0)],
        "vertices": [[x, y, 0, ""] for x, y in vertices],
        **keys,
    }


def save(folder: Path, levels: dict[str, Any], **keys: Any) -> Path:
    content = {
        "coordinate_system": "reference_image",
        "crowd_sim": {"enable": 0},
        "graphs": {},
        "levels": levels,
        "lifts": {},
        "name": "office",
        **keys,
    }
    path = folder / "office.building.yaml"
    path.write_text(yaml.safe_dump(content, sort_keys=False))
    return path


def room(doors: list[Any], **keys: Any) -> dict[str, Any]:
    """A room of 10 m by 10 m, whose lower wall has a gap from x = 6 to 8 m (vertices 4 and 5)."""
    walls = [edge(0, 4), edge(5, 1), edge(1, 2), edge(2, 3), edge(3, 0)]
    return level([*ROOM, [300, 600], [400, 600]], walls=walls, doors=doors, **keys)
