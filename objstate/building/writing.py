"""Writing a building of walls and doors: a URDF, and the walls' mesh beside it."""

from __future__ import annotations

from html import escape
from pathlib import Path

from objstate.building.door_table import Door
from objstate.building.model import Mesh
from objstate.building.sidecar import SUFFIX
from objstate.errors import BuildingError
from objstate.geometry import FloatArray
from objstate.outputs import whole

WALLS_FILE = "walls.stl"


def check_target(out: Path, overwrite: bool) -> None:
    """Whether a building may be written to ``out``; BuildingError if anything else is there."""
    if not out.exists():
        return
    if not overwrite:
        raise BuildingError(f"{out} exists already; choose another folder, or add --overwrite.")
    if not _is_replaceable(out):
        raise BuildingError(
            f"{out} is not just a building made from a map, so it won't be overwritten; "
            "choose another folder, or move it away."
        )


def _is_replaceable(folder: Path) -> bool:
    """Whether a path is a folder that is empty, or holds one URDF, its walls, and perhaps its sidecar."""
    if not folder.is_dir():
        return False
    files = list(folder.iterdir())
    if not files:
        return True
    models = [path for path in files if path.suffix == ".urdf"]
    if len(models) != 1:
        return False
    known = {models[0], folder / WALLS_FILE, models[0].with_name(models[0].stem + SUFFIX)}
    return folder / WALLS_FILE in files and set(files) <= known


def write_building(
    out: Path,
    name: str,
    walls: Mesh,
    doors: list[Door],
    thickness: float,
    height: float,
    sidecar: str,
) -> Path:
    """Write ``name``.urdf with its walls and its sidecar to the folder ``out``, whole or not at all.

    The doors' leaves are boxes of ``thickness`` and ``height``, m. What ``out`` held
    is replaced; ask ``check_target`` before. Raises ResultError if it can't be written.
    """
    import trimesh

    start = walls.vertices.min(axis=0)  # taken off, a float32 file keeps the walls' digits
    shape = trimesh.Trimesh(walls.vertices - start, walls.faces, process=False)
    urdf = _urdf(name, start, [_door_elements(door, thickness, height) for door in doors])
    with whole(out, overwrite=True, replaceable=_is_replaceable) as made:
        made.mkdir()
        (made / f"{name}.urdf").write_text(urdf, encoding="utf-8")
        (made / f"{name}{SUFFIX}").write_text(sidecar, encoding="utf-8")
        shape.export(made / WALLS_FILE)
    return out / f"{name}.urdf"


def _urdf(name: str, start: FloatArray, doors: list[str]) -> str:
    walls = f"""\
  <link name="walls">
    <collision>
      <origin xyz="{_numbers(start)}"/>
      <geometry><mesh filename="{WALLS_FILE}"/></geometry>
    </collision>
  </link>
"""
    parts = "".join([walls, *doors])
    return f'<?xml version="1.0"?>\n<robot name="{escape(name)}">\n{parts}</robot>\n'


def _door_elements(door: Door, thickness: float, height: float) -> str:
    """The link and joint of one door: the leaf along x, the hinge at the joint's origin."""
    middle = (door.width / 2, 0.0, height / 2)
    return f"""\
  <link name="{escape(door.name)}_leaf">
    <collision>
      <origin xyz="{_numbers(middle)}"/>
      <geometry><box size="{_numbers((door.width, thickness, height))}"/></geometry>
    </collision>
  </link>
  <joint name="{escape(door.name)}" type="revolute">
    <parent link="walls"/>
    <child link="{escape(door.name)}_leaf"/>
    <origin xyz="{_numbers((*door.hinge, 0.0))}" rpy="{_numbers((0, 0, door.closed_bearing))}"/>
    <axis xyz="0 0 {door.sense}"/>
    <limit lower="0" upper="{door.upper:.12g}" effort="0" velocity="0"/>
  </joint>
"""


def _numbers(values: FloatArray | tuple[float, ...]) -> str:
    return " ".join(f"{float(value):.12g}" for value in values)
