"""A building as a URDF that needs no other file."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.sax.saxutils import quoteattr

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.geometry import FloatArray, rpy_from_rotation
from objstate.recording.messages import MAP
from objstate.run.scene.solids import solids

JOINTS = {Kind.HINGED: "revolute", Kind.SLIDING: "prismatic", Kind.PLANAR: "planar"}
WALL, OBJECT = "0.75 0.78 0.82 1", "0.78 0.36 0.25 1"  # red, green, blue, opacity


def link_of(name: str) -> str:
    """The frame in which an object's link moves."""
    return f"{name}_link"


def self_contained_urdf(building: Building) -> str:
    """Links and joints of a building, its meshes as boxes; the root link is the frame ``map``."""
    parts = [
        '<?xml version="1.0"?>',
        f"<robot name={quoteattr(building.name)}>",
        _material("wall", WALL),
        _material("object", OBJECT),
        f"<link name={quoteattr(MAP)}>{_visuals(building.walls, 'wall')}</link>",
        *(part for item in building.objects.values() for part in _object(item)),
        "</robot>",
    ]
    return "\n".join(parts) + "\n"


def _object(item: MovableObject) -> Iterator[str]:
    link = quoteattr(link_of(item.name))
    yield f"<link name={link}>{_visuals(item.mesh, 'object')}</link>"
    kind = "continuous" if item.wraps else JOINTS[item.kind]
    limit = f'<limit lower="{item.lower:.9g}" upper="{item.upper:.9g}" effort="0" velocity="0"/>'
    yield (
        f'<joint name={quoteattr(item.name)} type="{kind}"><parent link="{MAP}"/>'
        f"<child link={link}/>{_origin(item.origin)}"
        f'<axis xyz="{_numbers(item.axis)}"/>{limit if kind in ("revolute", "prismatic") else ""}'
        "</joint>"
    )


def _visuals(mesh: Mesh, material: str) -> str:
    return "".join(
        f'<visual>{_origin(solid.place)}<geometry><box size="{_numbers(solid.size)}"/></geometry>'
        f'<material name="{material}"/></visual>'
        for solid in solids(mesh)
    )


def _material(name: str, colour: str) -> str:
    return f'<material name="{name}"><color rgba="{colour}"/></material>'


def _origin(matrix: FloatArray) -> str:
    rpy = rpy_from_rotation(matrix[:3, :3])
    return f'<origin xyz="{_numbers(matrix[:3, 3])}" rpy="{_numbers(rpy)}"/>'


def _numbers(values: Iterable[float]) -> str:
    return " ".join(f"{float(value) + 0.0:.6g}" for value in values)
