"""From a URDF's links and joints to a building: walls, and objects in the building's frame."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.shapes import Shape
from objstate.building.sidecar import read_sidecar
from objstate.building.urdf import Description, Joint, Part, Refuse, read_description, urdf_of
from objstate.errors import BuildingError
from objstate.geometry import FloatArray

LISTED = 5  # names that an error gives before it stops


def load_building(path: str | Path) -> Building:
    """The building that a URDF file describes, or the only one in a folder.

    The root link and what is fixed to it are the walls; each movable joint is an
    object, together with what is fixed below it. Raises BuildingError, with the
    line and the cure, for anything that can't be understood, and SettingsError for the file
    beside it that says how far the building is off. Raises TypeError for what is no path.
    """

    def refuse(error: BuildingError) -> None:
        raise error

    if not isinstance(path, str | Path):
        raise TypeError(
            f"A {type(path).__name__} is no path of a building; give the path of its URDF."
        )
    urdf = urdf_of(Path(path))
    building = assemble(read_description(urdf, refuse), refuse)
    return replace(building, error=read_sidecar(urdf))


def assemble(description: Description, refuse: Refuse) -> Building:
    """Put links and joints together.

    Each error goes to ``refuse``; if that returns, what the error is about is left out.
    """
    tree = _tree(description, refuse)
    mesh_of = _sharing_mesher()

    def mesh_or_none(parts: list[Part]) -> Mesh:
        try:
            return mesh_of(parts)
        except BuildingError as error:
            refuse(error)
            return Mesh.empty()

    shaped = [placed for placed in tree.movable if _has_its_shape(placed, refuse)]
    objects = {placed.joint.name: _movable(placed, mesh_or_none) for placed in shaped}
    return Building(description.name, mesh_or_none(tree.walls), objects, description.path)


@dataclass(frozen=True, eq=False)
class _Placed:
    """A movable joint, its frame in the building, and the parts that move with it."""

    joint: Joint
    kind: Kind
    origin: FloatArray  # (4, 4)
    parts: list[Part] = field(default_factory=list)  # in the moving link's frame


@dataclass(frozen=True, eq=False)
class _Tree:
    walls: list[Part] = field(default_factory=list)  # in the building's frame
    movable: list[_Placed] = field(default_factory=list)


def _has_its_shape(placed: _Placed, refuse: Refuse) -> bool:
    """Whether an object has the shape that it needs: a door's leaf gives its width."""
    if placed.parts or placed.kind is Kind.PLANAR:
        return True
    joint = placed.joint
    refuse(
        BuildingError(
            f"Door '{joint.name}' in {joint.where} has no shape; give its link '{joint.child}' a "
            '<collision> with that of the leaf, or make the joint type="fixed".'
        )
    )
    return False


def _movable(placed: _Placed, mesh_of: Callable[[list[Part]], Mesh]) -> MovableObject:
    return MovableObject(
        name=placed.joint.name,
        kind=placed.kind,
        origin=placed.origin,
        axis=placed.joint.axis,
        lower=placed.joint.limits[0],
        upper=placed.joint.limits[1],
        mesh=mesh_of(placed.parts),
        wraps=placed.joint.wraps,
    )


def _tree(description: Description, refuse: Refuse) -> _Tree:
    """Follow the joints from the root, collecting the parts of the walls and of each object."""
    below = _joints_below(description, refuse)
    root = _root(description, below, refuse)
    tree = _Tree()
    pending: list[tuple[str, FloatArray, _Placed | None]] = [(root, np.eye(4), None)]
    while pending:
        name, matrix, carrier = pending.pop()
        parts = carrier.parts if carrier else tree.walls
        parts += [Part(p.shape, matrix @ p.origin) for p in description.links[name].parts]
        for joint in below[name]:
            origin = matrix @ joint.origin
            if joint.kind is None:
                pending.append((joint.child, origin, carrier))
            elif carrier is None:
                placed = _Placed(joint, joint.kind, origin)
                tree.movable.append(placed)
                pending.append((joint.child, np.eye(4), placed))
            else:
                refuse(_nested(joint, carrier.joint))
    order = {name: index for index, name in enumerate(description.joints)}
    tree.movable.sort(key=lambda placed: order[placed.joint.name])
    return tree


def _nested(joint: Joint, above: Joint) -> BuildingError:
    return BuildingError(
        f"Joint '{joint.name}' in {joint.where} hangs below joint '{above.name}', which moves "
        "too; nested movable joints are not supported: hang it on a wall, or make it "
        'type="fixed".'
    )


def _joints_below(description: Description, refuse: Refuse) -> defaultdict[str, list[Joint]]:
    """The joints that hang on each link. Every child has one parent, and both exist."""
    below: defaultdict[str, list[Joint]] = defaultdict(list)
    carrier: dict[str, str] = {}
    for joint in description.joints.values():
        try:
            for end in (joint.parent, joint.child):
                if end not in description.links:
                    raise BuildingError(
                        f"Joint '{joint.name}' in {joint.where} names the link '{end}', which "
                        "does not exist; add the link or correct the name."
                    )
            if joint.child in carrier:
                raise BuildingError(
                    f"Link '{joint.child}' hangs on two joints, '{carrier[joint.child]}' and "
                    f"'{joint.name}' ({joint.where}); remove one of them."
                )
        except BuildingError as error:
            refuse(error)
            continue
        carrier[joint.child] = joint.name
        below[joint.parent].append(joint)
    return below


def _root(description: Description, below: defaultdict[str, list[Joint]], refuse: Refuse) -> str:
    """The one link that hangs on nothing, and from which every other can be reached."""
    hanging = {joint.child for joints in below.values() for joint in joints}
    roots = [name for name in description.links if name not in hanging]
    where = description.path.name
    if not description.links:
        raise BuildingError(f"{where} holds no links; add at least one with the walls.")
    if not roots:
        raise BuildingError(
            f"The joints in {where} go round in a circle: every link hangs on another; "
            "remove the joint that leads back to the walls."
        )
    if len(roots) > 1:
        refuse(
            BuildingError(
                f"{where} has {len(roots)} root links ({_listed(roots)}) where one must carry all; "
                'tie them together with joints of type="fixed".'
            )
        )
    _check_reachable(roots, description, below, refuse)
    return max(roots, key=lambda name: len(below[name]))


def _check_reachable(
    roots: list[str],
    description: Description,
    below: defaultdict[str, list[Joint]],
    refuse: Refuse,
) -> None:
    reached, pending = set(roots), list(roots)
    while pending:
        children = [joint.child for joint in below[pending.pop()]]
        reached.update(children)
        pending.extend(children)
    astray = [name for name in description.links if name not in reached]
    if astray:
        refuse(
            BuildingError(
                f"The joints in {description.path.name} go round in a circle through "
                f"{_listed(astray)}; remove the joint that closes it."
            )
        )


def _listed(names: list[str]) -> str:
    shown = ", ".join(f"'{name}'" for name in names[:LISTED])
    return shown if len(names) <= LISTED else f"{shown} and {len(names) - LISTED} more"


def _sharing_mesher() -> Callable[[list[Part]], Mesh]:
    """A function that joins parts into one mesh, and gives equal parts the same mesh object.

    A building of ten thousand equal doors so holds one leaf.
    """

    @cache
    def shape_mesh(shape: Shape) -> Mesh:
        return shape.mesh()

    @cache
    def joined(parts: tuple[tuple[Shape, bytes], ...]) -> Mesh:
        return Mesh.joined(
            [
                shape_mesh(shape).moved(np.frombuffer(matrix).reshape(4, 4))
                for shape, matrix in parts
            ]
        )

    return lambda parts: joined(tuple((part.shape, part.origin.tobytes()) for part in parts))
