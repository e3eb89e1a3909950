"""What is in a building, and what is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from objstate.building.assembly import assemble
from objstate.building.model import Building, Mesh, MovableObject
from objstate.building.outline import outline
from objstate.building.problems import find_problems
from objstate.building.sidecar import read_sidecar, sidecar_path, unknown_doors
from objstate.building.urdf import read_description, urdf_of
from objstate.errors import BuildingError, SettingsError
from objstate.geometry import FloatArray

DEFAULT_HEIGHT = 0.3  # m above the floor, where many robots carry their laser


@dataclass(frozen=True)
class ObjectSummary:
    """One movable object, as the model shows it: a door closed, furniture in its place."""

    name: str
    kind: str  # hinged, sliding, planar
    lower: float  # rad or m; 0 for furniture, which has no limits
    upper: float
    wraps: bool  # goes round and round
    position: tuple[float, float, float]  # m, of the hinge, or of where it should stand
    reach: float  # m from there to the farthest point of its outline: of a door, its width
    outline_length: float  # m, all around at laser height
    faces: int


@dataclass(frozen=True)
class BuildingSummary:
    """A building as ``inspect`` shows it. Lengths in metres."""

    source: str
    name: str
    height: float  # of the laser above the floor
    wall_faces: int
    extent: tuple[tuple[float, float, float], tuple[float, float, float]]  # corners of the walls
    outline_length: float  # of the walls at laser height
    outline_segments: int
    objects: tuple[ObjectSummary, ...]
    problems: list[str]


def inspect_building(path: str | Path, height: float = DEFAULT_HEIGHT) -> BuildingSummary:
    """What a URDF holds for a level laser at ``height`` m, and what is wrong with it.

    Of a folder, its only URDF. A building that can't be used is still shown as far as it can be
    read; why it is refused stands first among the problems. Raises BuildingError only where the
    file is no URDF at all.
    """
    path = urdf_of(Path(path))
    problems: list[str] = []

    def note(error: BuildingError) -> None:
        problems.append(str(error))

    description = read_description(path, note)
    try:
        building = assemble(description, note)
    except BuildingError as error:
        note(error)
        building = Building(description.name, Mesh.empty(), {}, path)
    else:
        problems += find_problems(building, height)
    problems += _sidecar_problems(path, building)
    return _summary(building, path, height, problems)


def _sidecar_problems(urdf: Path, building: Building) -> list[str]:
    """What is wrong with the file beside a URDF, if there is one."""
    try:
        error = read_sidecar(urdf)
    except SettingsError as fault:
        return [str(fault)]
    return [] if error is None else unknown_doors(error, building.objects, sidecar_path(urdf))


def _summary(building: Building, path: Path, height: float, problems: list[str]) -> BuildingSummary:
    segments = outline(building.walls, height)
    return BuildingSummary(
        source=str(path),
        name=building.name,
        height=height,
        wall_faces=len(building.walls.faces),
        extent=_extent(building.walls),
        outline_length=_length(segments),
        outline_segments=len(segments),
        objects=tuple(_object_summary(item, height) for item in building.objects.values()),
        problems=problems,
    )


def _object_summary(item: MovableObject, height: float) -> ObjectSummary:
    segments = outline(item.mesh, height, item.transforms(item.home[None])[0])
    away = np.linalg.norm(segments - item.origin[:2, 3], axis=2)
    return ObjectSummary(
        name=item.name,
        kind=item.kind.value,
        lower=item.lower,
        upper=item.upper,
        wraps=item.wraps,
        position=_point(item.origin[:3, 3]),
        reach=float(np.max(away, initial=0.0)),
        outline_length=_length(segments),
        faces=len(item.mesh.faces),
    )


def _extent(mesh: Mesh) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    if len(mesh.vertices) == 0:
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    return _point(mesh.vertices.min(axis=0)), _point(mesh.vertices.max(axis=0))


def _point(xyz: FloatArray) -> tuple[float, float, float]:
    return float(xyz[0]), float(xyz[1]), float(xyz[2])


def _length(segments: FloatArray) -> float:
    return float(np.linalg.norm(segments[:, 1] - segments[:, 0], axis=1).sum())
