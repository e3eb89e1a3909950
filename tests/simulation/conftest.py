"""A room with a door, a drawer's worth of sliding, and a table, to drive in."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOM = """<robot name="room">
  <link name="walls">
    <visual><origin xyz="0 -3.05 1"/><geometry><box size="10 0.1 2"/></geometry></visual>
    <visual><origin xyz="-1 3.05 1"/><geometry><box size="8 0.1 2"/></geometry></visual>
    <visual><origin xyz="-5.05 0 1"/><geometry><box size="0.1 6.3 2"/></geometry></visual>
    <visual><origin xyz="5.05 0 1"/><geometry><box size="0.1 6.3 2"/></geometry></visual>
  </link>
  <link name="leaf">
    <visual><origin xyz="0.5 0 1"/><geometry><box size="1 0.04 2"/></geometry></visual>
  </link>
  <joint name="door" type="revolute"><parent link="walls"/><child link="leaf"/>
    <origin xyz="3 3.05 0"/><axis xyz="0 0 -1"/><limit lower="0" upper="1.6"/></joint>
  <link name="panel">
    <visual><origin xyz="0 0 1"/><geometry><box size="1 0.04 2"/></geometry></visual>
  </link>
  <joint name="slider" type="prismatic"><parent link="walls"/><child link="panel"/>
    <origin xyz="-2 2.9 0"/><axis xyz="1 0 0"/><limit lower="0" upper="0.9"/></joint>
  <link name="board">
    <visual><origin xyz="0 0 0.4"/><geometry><box size="0.8 0.5 0.8"/></geometry></visual>
  </link>
  <joint name="table" type="planar"><parent link="walls"/><child link="board"/>
    <origin xyz="-3 -1.5 0" rpy="0 0 0.3"/><axis xyz="0 0 1"/></joint>
</robot>
"""
SCENE = """building: room.urdf
seed: 3
route:
  waypoints: [{x: -2, y: 0, pause: 0.5}, {x: 2, y: 0}]
"""


@pytest.fixture
def room(tmp_path: Path) -> Path:
    """The URDF of the room."""
    path = tmp_path / "room.urdf"
    path.write_text(ROOM)
    return path


@pytest.fixture
def scene(room: Path) -> Path:
    """A scene in it; tests append what they are about."""
    path = room.with_name("room.scene.yaml")
    path.write_text(SCENE)
    return path
