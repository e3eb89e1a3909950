"""A building with a door and other objects, as objstate wrote it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.building.door_table import Door
from objstate.building.leaves import hinged, sliding
from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.writing import write_buildings
from tests.rooms import block, placed, wall


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A room of 6 m by 4 m, with a gap from x = 2 to 3 m in its lower wall."""
    walls = Mesh.joined(
        [
            wall((0, 0), (2, 0)),
            wall((3, 0), (6, 0)),
            wall((6, 0), (6, 4)),
            wall((6, 4), (0, 4)),
            wall((0, 4), (0, 0)),
        ]
    )
    left = Door("left", np.array([2.0, 0.0]), 0.0, 1, 1.0, np.radians(100))
    items = [
        hinged(left, 0.04, 2.0),
        sliding("drawer", np.array([4.0, 3.5]), np.array([4.5, 3.5]), 0.4, 0.7),
        MovableObject(
            "desk",
            Kind.PLANAR,
            placed(1, 2),
            np.array([0.0, 0.0, 1.0]),
            0.0,
            0.0,
            block(0, 0, 1, 0.5),
        ),
    ]
    building = Building("room", walls, {item.name: item for item in items})
    return write_buildings(tmp_path / "building", {".": building}, {".": "building_error: {}\n"})[
        0
    ].parent
