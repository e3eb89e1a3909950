"""A building as an SDF world: walls as a static model, each object as one with a joint."""

from __future__ import annotations

from dataclasses import replace
from html import escape
from pathlib import Path

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.writing import SHAPE_FILE, WALLS_FILE, box_corners, write_mesh
from objstate.geometry import FloatArray, rpy_from_rotation
from objstate.interchange.imported import Notes, several, tell_renamed, unused_name
from objstate.interchange.sdf_frames import plain_name

VERSION = "1.9"  # of SDFormat, Gazebo Fortress's
MASS = 30.0  # kg, of whatever moves; a simulator can't move a thing without one
INERTIA = 1.0  # kg m², likewise
JOINTS = {Kind.HINGED: "revolute", Kind.SLIDING: "prismatic"}


def write_sdf(out: Path, building: Building, notes: Notes) -> None:
    """Write ``NAME.sdf`` and the meshes that it names to a folder."""
    vertices = building.walls.vertices
    start = vertices.min(axis=0) if len(vertices) else np.zeros(3)
    write_mesh(out / WALLS_FILE, Mesh(vertices - start, building.walls.faces))
    names = _names(building, notes)
    static = unused_name("walls", names)
    models = [_model(static, _pose(start), _link("walls", _mesh_file(WALLS_FILE)), static=True)]
    for number, (name, item) in enumerate(
        zip(names, building.objects.values(), strict=True), start=1
    ):
        models.append(_object(replace(item, name=name), _geometry(item, out, number)))
    text = (
        f'<?xml version="1.0"?>\n<sdf version="{VERSION}">\n<world name="{escape(building.name)}">\n'
        f"{''.join(models)}</world>\n</sdf>\n"
    )
    (out / f"{building.name}.sdf").write_text(text, encoding="utf-8")
    notes.taken.append(f"Walls, and {several(len(building.objects), 'object')} with their joints.")
    if building.objects:
        notes.doubts.append(f"Objects weigh {MASS:g} kg each; objstate knows no masses.")


def _names(building: Building, notes: Notes) -> list[str]:
    """The objects' names, without what parts names in SDF; those that differ are noted."""
    names: list[str] = []
    for name in building.objects:
        names.append(unused_name(plain_name(name), names))
        tell_renamed(notes, name, names[-1])
    return names


def _object(item: MovableObject, geometry: tuple[str, str]) -> str:
    pose, shape = geometry
    place = f"{_numbers(item.origin[:3, 3])} {_numbers(rpy_from_rotation(item.origin[:3, :3]))}"
    weight = (
        f"<inertial><mass>{MASS:g}</mass><inertia><ixx>{INERTIA:g}</ixx><iyy>{INERTIA:g}</iyy>"
        f"<izz>{INERTIA:g}</izz></inertia></inertial>"
    )
    link = _link("body", shape, pose, weight)
    if item.kind is Kind.PLANAR:
        return _model(item.name, place, link)
    limits = (
        ""
        if item.wraps
        else (f"<limit><lower>{item.lower:.12g}</lower><upper>{item.upper:.12g}</upper></limit>")
    )
    kind = "continuous" if item.wraps else JOINTS[item.kind]
    joint = (
        f'    <joint name="joint" type="{kind}"><parent>world</parent><child>body</child>\n'
        f"      <axis><xyz>{_numbers(item.axis)}</xyz>{limits}</axis></joint>\n"
    )
    return _model(item.name, place, link + joint)


def _geometry(item: MovableObject, out: Path, number: int) -> tuple[str, str]:
    """Where an object's shape lies in its link, and the shape's element."""
    corners = box_corners(item.mesh)
    if corners is not None:
        low, high = corners
        return _pose((low + high) / 2), f"<box><size>{_numbers(high - low)}</size></box>"
    name = SHAPE_FILE.format(number)
    write_mesh(out / name, item.mesh)
    return _pose(np.zeros(3)), _mesh_file(name)


def _model(name: str, pose: str, content: str, static: bool = False) -> str:
    told = "    <static>true</static>\n" if static else ""
    return f'  <model name="{escape(name)}">\n{told}    <pose>{pose}</pose>\n{content}  </model>\n'


def _link(name: str, shape: str, pose: str = "0 0 0 0 0 0", weight: str = "") -> str:
    bodies = "".join(
        f'      <{tag} name="{tag}"><pose>{pose}</pose><geometry>{shape}</geometry></{tag}>\n'
        for tag in ("collision", "visual")
    )
    return f'    <link name="{name}">{weight}\n{bodies}    </link>\n'


def _mesh_file(name: str) -> str:
    return f"<mesh><uri>{name}</uri></mesh>"


def _pose(place: FloatArray) -> str:
    return f"{_numbers(place)} 0 0 0"


def _numbers(values: FloatArray | tuple[float, ...]) -> str:
    return " ".join(f"{float(value) + 0.0:.12g}" for value in values)
