"""SDF worlds as objstate's buildings: what can't move is walls, doors and furniture are objects."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.urdf import FULL_TURN
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, invert
from objstate.interchange.imported import Imported, Notes, several, tell_renamed, unused_name
from objstate.interchange.sdf_bodies import Body, Standing, Tie, bodies_and_ties
from objstate.interchange.sdf_file import Folders, Model, read_world
from objstate.interchange.sdf_frames import INTO, plain_name
from objstate.interchange.sdf_shapes import Shapes

SHOWN = 8  # most names in a note
UP = (0.0, 0.0, 1.0)
# elements of a world that are noted where they occur
SETTING = ("light", "actor", "state", "population")


def import_sdf(path: Path, models: Sequence[Path] = (), movable: Sequence[str] = ()) -> Imported:
    """The world, or the models, of an SDF file.

    ``models`` are folders that are searched for ``model://``. Models whose names match a pattern in
    ``movable`` are furniture even where the file has them static. Raises BuildingError.
    """
    notes, folders = Notes(), Folders.of(models, path)
    world = read_world(path, folders, notes)
    bodies, ties = bodies_and_ties(world, Shapes(folders, notes), notes)
    _tell_unmatched(movable, bodies, notes)
    objects: dict[str, MovableObject] = {}
    walls = _Sorting(bodies, _above(bodies, ties, notes), movable, notes).sort(objects)
    notes.taken.append("Unit and axes: metres, z upwards, as the format has it.")
    notes.taken.append(f"Walls: {several(len(walls), 'link')} that can't move.")
    for kind, number in Counter(item.kind.value for item in objects.values()).items():
        notes.taken.append(f"{several(number, f'{kind} object')}.")
    _tell_setting(world, notes)
    title = path.resolve().parent.name if path.stem == "model" else path.stem
    return Imported({title: Building(title, Mesh.joined(walls), objects)}, notes)


def _above(bodies: list[Body], ties: list[Tie], notes: Notes) -> dict[str, Tie]:
    """The joint on which each body hangs; those of static models hold nothing."""
    static = {body.name: body.is_static for body in bodies}
    above: dict[str, Tie] = {}
    for tie in ties:
        if tie.child not in static or tie.child in above:
            notes.left.append(f"Joint '{tie.name}' ({tie.where}), as its child hangs elsewhere.")
        elif not static[tie.child]:
            above[tie.child] = tie
        elif tie.kind != "fixed":
            notes.left.append(f"Joint '{tie.name}', as its model is static.")
    for tie in above.values():
        if tie.kind != "fixed" and not _moves(tie):
            notes.left.append(f"Joint '{tie.name}', taken as fixed, as its limits leave no range.")
    return above


def _moves(tie: Tie) -> bool:
    """Whether a joint has a range; a sliding one needs limits for that."""
    if tie.kind == "fixed" or (tie.limits is None and tie.kind is Kind.SLIDING):
        return False
    return tie.limits is None or (
        tie.limits[0] < tie.limits[1] and bool(np.isfinite(tie.limits).all())
    )


@dataclass(frozen=True)
class _Sorting:
    """Which bodies are walls, and which belong to which object."""

    bodies: list[Body]
    above: dict[str, Tie]
    movable: Sequence[str]
    notes: Notes
    _told: set[str] = field(default_factory=set)  # nested joints

    def sort(self, objects: dict[str, MovableObject]) -> list[Mesh]:
        """The walls; the objects are added to ``objects``."""
        carried: defaultdict[str, list[Body]] = defaultdict(list)
        carriers: dict[str, Tie | Standing] = {}
        walls = []
        for body in self.bodies:
            carrier = self._carrier(body)
            if len(body.mesh.faces) == 0:
                continue
            if carrier is None:
                walls.append(body.mesh.moved(body.place))
                continue
            carriers[carrier.name] = carrier
            carried[carrier.name].append(body)
        several_joints = Counter(
            name.rpartition(INTO)[0] for name, each in carriers.items() if isinstance(each, Tie)
        )
        for name, carrier in carriers.items():
            if isinstance(carrier, Standing):
                item = _furniture(self._name(name, objects), carrier, carried[name])
            else:
                model = name.rpartition(INTO)[0]
                is_only = several_joints[model] == 1 and model
                called = model if is_only else name.removesuffix("_joint")
                item = _hung(self._name(called, objects), carrier, carried[name])
            objects[item.name] = item
        return walls

    def _name(self, called: str, objects: Mapping[str, MovableObject]) -> str:
        """The name of an object; one that differs from the file's is noted."""
        name = unused_name(plain_name(called), objects)
        tell_renamed(self.notes, called.replace(INTO, "_"), name)
        return name

    def _carrier(self, body: Body) -> Tie | Standing | None:
        """What moves a body: its furniture, or the joint nearest to the ground; None for walls."""
        for model in body.models:
            if any(fnmatchcase(model.name, pattern) for pattern in self.movable):
                return model
        ties = self._chain(body.name)
        moving = [tie for tie in ties if _moves(tie)]
        for tie in moving[:-1]:
            if tie.name not in self._told:
                self._told.add(tie.name)
                self.notes.left.append(
                    f"Joint '{tie.name}', taken as fixed, as it moves on joint '{moving[-1].name}'."
                )
        if moving:
            return moving[-1]
        base = ties[-1].parent if ties else body.name
        is_held = base not in self._names or body.is_static or not body.models
        return None if is_held or body.models[0].name in self._jointed else body.models[0]

    def _chain(self, name: str) -> list[Tie]:
        """The joints from a body to the ground. Raises BuildingError where they never get there."""
        ties: list[Tie] = []
        while name in self.above:
            if self.above[name] in ties:
                raise BuildingError(f"The joints of '{name}' go round in a circle; remove one.")
            ties.append(self.above[name])
            name = ties[-1].parent
        return ties

    @cached_property
    def _names(self) -> set[str]:
        return {body.name for body in self.bodies}

    @cached_property
    def _jointed(self) -> set[str]:
        """The outermost models that have a joint that moves; the rest of them stands still."""
        return {name.partition(INTO)[0] for name, tie in self.above.items() if _moves(tie)}


def _hung(name: str, tie: Tie, bodies: list[Body]) -> MovableObject:
    lower, upper = tie.limits or FULL_TURN
    assert tie.kind != "fixed"
    return MovableObject(
        name=name,
        kind=tie.kind,
        origin=tie.place,
        axis=tie.axis,
        lower=lower,
        upper=upper,
        mesh=_mesh(bodies, tie.place),
        wraps=tie.limits is None,
    )


def _furniture(name: str, model: Standing, bodies: list[Body]) -> MovableObject:
    return MovableObject(
        name=name,
        kind=Kind.PLANAR,
        origin=model.place,
        axis=np.array(UP),
        lower=0.0,
        upper=0.0,
        mesh=_mesh(bodies, model.place),
    )


def _mesh(bodies: list[Body], place: FloatArray) -> Mesh:
    back = invert(place)
    return Mesh.joined([body.mesh.moved(back @ body.place) for body in bodies])


def _tell_unmatched(movable: Sequence[str], bodies: list[Body], notes: Notes) -> None:
    """Note patterns of furniture that match no model."""
    names = list(dict.fromkeys(model.name for body in bodies for model in body.models))
    for pattern in movable:
        if not any(fnmatchcase(name, pattern) for name in names):
            notes.doubts.append(
                f"--movable '{pattern}' matches no model; there are {', '.join(names[:SHOWN])}"
                f"{', ...' if len(names) > SHOWN else ''}."
            )


def _tell_setting(world: Model, notes: Notes) -> None:
    for tag in SETTING:
        if number := len(world.element.all(tag)):
            notes.left.append(f"{several(number, tag)}.")
    if world.element.first("state") is not None:
        notes.doubts.append(
            "The world was saved while it ran (<state>); models stand where they began, not where "
            "they were then."
        )
