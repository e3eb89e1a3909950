"""A building: fixed walls, and movable objects that are joints with a state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from objstate.errors import BuildingError
from objstate.geometry import FloatArray, IntArray, rotation_about, transform
from objstate.lazy import lazy

if TYPE_CHECKING:
    from objstate.building.symmetry import Symmetry
    from objstate.config import BuildingErrorSettings


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of a rigid thing."""

    vertices: FloatArray  # (v, 3) m
    faces: IntArray  # (f, 3) indices into vertices

    @staticmethod
    def empty() -> Mesh:
        return Mesh(np.zeros((0, 3)), np.zeros((0, 3), dtype=np.int64))

    @staticmethod
    def joined(parts: list[Mesh]) -> Mesh:
        """All triangles of several meshes in one."""
        if not parts:
            return Mesh.empty()
        starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
        return Mesh(
            np.concatenate([part.vertices for part in parts]),
            np.concatenate([p.faces + s for p, s in zip(parts, starts, strict=True)]),
        )

    def moved(self, matrix: FloatArray) -> Mesh:
        """The same triangles after a transform (4, 4)."""
        return Mesh(self.vertices @ matrix[:3, :3].T + matrix[:3, 3], self.faces)


class Kind(Enum):
    """How an object moves: its joint."""

    HINGED = "hinged"  # revolute or continuous: a door on a hinge
    SLIDING = "sliding"  # prismatic: a sliding door, a drawer
    PLANAR = "planar"  # on the floor: furniture


COORDINATES = {
    Kind.HINGED: ("angle",),
    Kind.SLIDING: ("offset",),
    Kind.PLANAR: ("x", "y", "yaw"),
}


@dataclass(frozen=True, eq=False)
class MovableObject:
    """One movable object: a joint and the rigid link on it.

    The state is ``(angle,)`` rad, ``(offset,)`` m, or ``(x, y, yaw)`` of the link
    in the building's frame, by kind. For furniture, ``origin`` is where it should
    stand.
    """

    name: str
    kind: Kind
    origin: FloatArray = field(repr=False)  # (4, 4) joint frame in the building
    axis: FloatArray = field(repr=False)  # (3,) unit vector in the joint frame
    lower: float  # rad or m; unused for furniture
    upper: float
    mesh: Mesh = field(repr=False)  # in the link frame
    wraps: bool = False  # a continuous joint: -pi and pi are one state

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the state's coordinates (d,): angle in rad, offset, x and y in m, yaw in rad."""
        return COORDINATES[self.kind]

    def hung_at(self, hinge: FloatArray) -> MovableObject:
        """The same object, its joint at another place (2,) m of the floor."""
        origin = self.origin.copy()
        origin[:2, 3] = hinge
        return replace(self, origin=origin)

    @property
    def hinge(self) -> FloatArray:
        """(2,) m of the floor, where the joint is."""
        return self.origin[:2, 3]

    @lazy
    def home(self) -> FloatArray:
        """(d,) the state in which the model shows the object: joint at zero, or nearest to it."""
        if self.kind is Kind.PLANAR:
            yaw = np.arctan2(self.origin[1, 0], self.origin[0, 0])
            return np.array([self.origin[0, 3], self.origin[1, 3], yaw])
        return np.array([np.clip(0.0, self.lower, self.upper)])

    @lazy
    def direction(self) -> FloatArray:
        """(3,) the joint's axis in the building."""
        return np.asarray(self.origin[:3, :3] @ self.axis)

    @lazy
    def _upright(self) -> FloatArray:
        """(3, 3) what remains of a planar joint's rotation when its yaw is taken away."""
        back = rotation_about((0.0, 0.0, 1.0), -self.home[2])
        return np.asarray(back @ self.origin[:3, :3])

    @lazy
    def upright_mesh(self) -> Mesh:
        """The mesh of furniture as it stands on the floor, about its origin at yaw 0."""
        return self.mesh.moved(transform(self._upright, np.zeros(3)))

    @lazy
    def symmetry(self) -> Symmetry:
        """The turns about the vertical after which the object looks the same; none for doors."""
        from objstate.building.symmetry import Symmetry, symmetry_of

        if self.kind is not Kind.PLANAR:
            return Symmetry(1, np.zeros(2))
        return symmetry_of(self.upright_mesh)

    def transforms(self, states: FloatArray) -> FloatArray:
        """Link transforms (n, 4, 4) in the building for states (n, d)."""
        states = np.asarray(states, dtype=float)
        if self.kind is Kind.HINGED:
            turn = transform(rotation_about(self.axis, states[:, 0]), np.zeros(3))
            return np.asarray(self.origin @ turn)
        if self.kind is Kind.SLIDING:
            return np.asarray(self.origin @ transform(np.eye(3), states * self.axis))
        rotation = rotation_about((0.0, 0.0, 1.0), states[:, 2]) @ self._upright
        height = np.full(len(states), self.origin[2, 3])
        return transform(rotation, np.column_stack([states[:, :2], height]))


@dataclass(frozen=True, eq=False)
class Building:
    """Fixed walls and the movable objects in them, in one frame (``map``), z up, metres."""

    name: str
    walls: Mesh = field(repr=False)
    objects: Mapping[str, MovableObject]
    source: Path | None = None
    error: BuildingErrorSettings | None = None  # its errors; None where unknown

    @property
    def symmetries(self) -> dict[str, int]:
        """The orders of the objects that look the same after some turns."""
        orders = {name: item.symmetry.order for name, item in self.objects.items()}
        return {name: order for name, order in orders.items() if order > 1}

    def with_object(self, item: MovableObject) -> Building:
        """The same building with another object of a name that it has."""
        return replace(self, objects={**self.objects, item.name: item})

    def __getitem__(self, name: str) -> MovableObject:
        try:
            return self.objects[name]
        except KeyError:
            known = ", ".join(sorted(self.objects)) or "none"
            raise BuildingError(
                f"Building '{self.name}' has no object '{name}'; its objects: {known}."
            ) from None


def check_building(given: object) -> None:
    """Raise TypeError for what is no Building, such as its path."""
    if not isinstance(given, Building):
        raise TypeError(
            f"A {type(given).__name__} is no Building; give the one that objstate.load_building "
            "reads from a URDF."
        )
