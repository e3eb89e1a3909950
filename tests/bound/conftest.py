"""A room with a door and a table, and drives in it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from objstate.building import load_building
from objstate.simulation.drive import Simulation
from objstate.simulation.scene import Scene

ROOM = """<robot name="room">
  <link name="walls">
    <visual><origin xyz="0 -2.05 1"/><geometry><box size="8 0.1 2"/></geometry></visual>
    <visual><origin xyz="-1.5 2.05 1"/><geometry><box size="5 0.1 2"/></geometry></visual>
    <visual><origin xyz="3 2.05 1"/><geometry><box size="2 0.1 2"/></geometry></visual>
    <visual><origin xyz="-4.05 0 1"/><geometry><box size="0.1 4.2 2"/></geometry></visual>
    <visual><origin xyz="4.05 0 1"/><geometry><box size="0.1 4.2 2"/></geometry></visual>
  </link>
  <link name="leaf">
    <visual><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></visual>
  </link>
  <joint name="door" type="revolute"><parent link="walls"/><child link="leaf"/>
    <origin xyz="1 2 0"/><axis xyz="0 0 -1"/><limit lower="0" upper="1.5"/></joint>
  <link name="board">
    <visual><origin xyz="0 0 0.4"/><geometry><box size="0.8 0.5 0.8"/></geometry></visual>
  </link>
  <joint name="table" type="planar"><parent link="walls"/><child link="board"/>
    <origin xyz="-2 1.2 0" rpy="0 0 0.3"/><axis xyz="0 0 1"/></joint>
</robot>
"""
STANDING = {"waypoints": [{"x": 0.0, "y": 0.0, "pause": 2.0}], "start_yaw": 1.4}
LASER = {"beams": 181, "rate": 2.0}

Drive = Callable[..., Simulation]


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """The URDF of the room."""
    path = tmp_path / "room.urdf"
    path.write_text(ROOM)
    return path


@pytest.fixture
def drive(room: Path) -> Drive:
    """Make a simulation in the room; settings replace those of a scene in which the robot stands."""

    def make(**settings: Any) -> Simulation:
        settings = {"route": STANDING, "lasers": [LASER], "building": room} | settings
        return Simulation(Scene.model_validate(settings), load_building(room))

    return make
