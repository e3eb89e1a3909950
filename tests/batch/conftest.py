"""A room with a door, and short drives past it."""

from dataclasses import dataclass
from pathlib import Path

import pytest

from objstate.simulation import simulate

ROOM = """
<robot name="room">
  <link name="map">
    <collision><origin xyz="2 -2 1"/><geometry><box size="8 0.1 2"/></geometry></collision>
    <collision><origin xyz="-2 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
    <collision><origin xyz="6 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
    <collision><origin xyz="0 2 1"/><geometry><box size="4 0.1 2"/></geometry></collision>
    <collision><origin xyz="4.45 2 1"/><geometry><box size="3.1 0.1 2"/></geometry></collision>
    <collision><origin xyz="2 4 1"/><geometry><box size="8 0.1 2"/></geometry></collision>
  </link>
  <link name="leaf">
    <collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></collision>
  </link>
  <joint name="office_door" type="revolute">
    <parent link="map"/><child link="leaf"/>
    <origin xyz="2 2 0"/><axis xyz="0 0 -1"/>
    <limit lower="0" upper="1.6" effort="0" velocity="0"/>
  </joint>
</robot>
"""
SCENE = """
building: room.urdf
route: {waypoints: [{x: 1.0, y: 0.0}, {x: 2.0, y: 0.3}]}
lasers: [{frame: laser, rate: 10.0, range_max: 10.0}]
objects: [{name: office_door, initial: random}]
"""
COUNT = 3


@dataclass(frozen=True)
class Drives:
    """Simulated drives in folders of their own, with truths, and the building."""

    folder: Path
    building: Path
    logs: tuple[Path, ...]


@pytest.fixture(scope="session")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Drives:
    home = tmp_path_factory.mktemp("room")
    (home / "room.urdf").write_text(ROOM)
    (home / "room.scene.yaml").write_text(SCENE)
    folder = home / "drives"
    logs = [
        simulate(home / "room.scene.yaml", folder / f"drive_{seed}", seed=seed).log
        for seed in range(COUNT)
    ]
    return Drives(folder, home / "room.urdf", tuple(logs))
