"""The links of an SDF world in one frame, and the joints that tie them together."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from objstate.building.markup import Element
from objstate.building.model import Kind, Mesh
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, invert
from objstate.interchange.imported import Notes
from objstate.interchange.sdf_file import TRUE, Model, matrix_of, numbers
from objstate.interchange.sdf_frames import INTO, SELF, WORLD, Frames
from objstate.interchange.sdf_shapes import Shapes

KINDS = {"revolute": Kind.HINGED, "continuous": Kind.HINGED, "prismatic": Kind.SLIDING}
ENDLESS = 1e15  # rad or m: larger limits count as none, as the format's defaults of 1e16
IN_JOINT = (1, 5)  # from this version on, axes are given in the joint's frame
LASERS = ("ray", "gpu_ray", "lidar", "gpu_lidar")


@dataclass(frozen=True, eq=False)
class Standing:
    """A model in the world."""

    name: str  # with the models that hold it
    place: FloatArray = field(repr=False)  # (4, 4) in the world


@dataclass(frozen=True, eq=False)
class Body:
    """A link."""

    name: str  # with the models that hold it
    models: tuple[Standing, ...]  # that hold it, outermost first
    place: FloatArray = field(repr=False)  # (4, 4) in the world
    mesh: Mesh = field(repr=False)  # in the link
    is_static: bool


@dataclass(frozen=True, eq=False)
class Tie:
    """A joint."""

    name: str
    kind: Kind | Literal["fixed"]
    parent: str  # the names of two bodies
    child: str
    place: FloatArray = field(repr=False)  # (4, 4) in the world
    axis: FloatArray  # (3,) unit vector in the joint
    limits: tuple[float, float] | None  # rad or m; None where it has none
    where: str


def bodies_and_ties(world: Model, shapes: Shapes, notes: Notes) -> tuple[list[Body], list[Tie]]:
    """All links and joints. Raises BuildingError for what can't be understood."""
    walk = _Walk(shapes, notes)
    walk.visit(Frames(world), np.eye(4), ())
    return walk.bodies, walk.ties


@dataclass
class _Walk:
    shapes: Shapes
    notes: Notes
    bodies: list[Body] = field(default_factory=list)
    ties: list[Tie] = field(default_factory=list)

    def visit(self, frames: Frames, at: FloatArray, holders: tuple[Standing, ...]) -> None:
        """Collect what a model at ``at`` holds; ``holders`` are those that hold it, and itself."""
        prefix = holders[-1].name + INTO if holders else ""
        model = frames.model
        for name, link in model.all("link").items():
            own = frames.at(name, link.where)
            self.bodies.append(
                Body(
                    name=prefix + name,
                    models=holders,
                    place=at @ own,
                    mesh=self.shapes.of(link, model, _places(link, frames, own)),
                    is_static=model.is_static,
                )
            )
        for joint in model.element.all("joint"):
            self.ties.append(self._tie(joint, frames, at, prefix))
        for name, inside in frames.inner.items():
            if _has_laser(inside.model.element):
                self.notes.left.append(f"Model '{prefix}{name}': it carries a laser, as robots do.")
                continue
            there = at @ frames.at(name, inside.model.path.name)
            self.visit(inside, there, (*holders, Standing(prefix + name, there)))

    def _tie(self, joint: Element, frames: Frames, at: FloatArray, prefix: str) -> Tie:
        name = prefix + joint.text("name")
        kind, axis, limits = joint.text("type"), np.zeros(3), None
        if kind in KINDS:
            stated = joint.need("axis")
            axis, limits = _axis(joint, stated, frames), _limits(stated, kind)
        elif kind != "fixed":
            self.notes.left.append(f"Joint '{name}', of type {kind}, which is taken as fixed.")
        parent, child = (
            _body(frames.link_of(joint.need(tag).content, joint.where), prefix)
            for tag in ("parent", "child")
        )
        return Tie(
            name=name,
            kind=KINDS.get(kind, "fixed"),
            parent=parent,
            child=child,
            place=at @ frames.at(joint.text("name"), joint.where),
            axis=axis,
            limits=limits,
            where=joint.where,
        )


def _body(name: str, prefix: str) -> str:
    return WORLD if name == WORLD else prefix + name


def _has_laser(model: Element) -> bool:
    pending = [model]
    while pending:
        here = pending.pop()
        if here.tag == "sensor" and here.attributes.get("type") in LASERS:
            return True
        pending += [
            each for each in here.children if each.tag in ("model", "link", "sensor", "joint")
        ]
    return False


def _places(link: Element, frames: Frames, own: FloatArray) -> Callable[[Element], FloatArray]:
    """A function that says where the shapes of a link lie in it."""

    def at(body: Element) -> FloatArray:
        pose = body.first("pose")
        given = {} if pose is None else pose.attributes
        to = given.get("relative_to") or given.get("frame") or link.text("name")
        if pose is None or to == link.text("name"):
            return matrix_of(pose)
        return np.asarray(invert(own) @ frames.at(to, pose.where) @ matrix_of(pose))

    return at


def _axis(joint: Element, stated: Element, frames: Frames) -> FloatArray:
    """The unit axis in the joint's frame."""
    xyz = stated.first("xyz")
    axis = np.array(numbers(stated, "xyz", (0.0, 0.0, 1.0)))
    length = float(np.linalg.norm(axis))
    if length == 0:
        raise BuildingError(f"The axis in {stated.where} has no length; give <xyz>0 0 1</xyz>.")
    name, where = joint.text("name"), joint.where
    told_in = "" if xyz is None else xyz.attributes.get("expressed_in", "")
    in_model = stated.first("use_parent_model_frame")
    if not told_in and (
        frames.model.version < IN_JOINT or (in_model is not None and in_model.content in TRUE)
    ):
        told_in = SELF
    if told_in:
        turn = invert(frames.at(name, where)) @ frames.at(told_in, where)
        axis = turn[:3, :3] @ axis
    return np.asarray(axis / length)


def _limits(stated: Element, kind: str) -> tuple[float, float] | None:
    limit = stated.first("limit")
    if kind == "continuous" or limit is None:
        return None
    ends = []
    for tag, default in (("lower", -np.inf), ("upper", np.inf)):
        element = limit.first(tag)
        if element is None:
            ends.append(default)
            continue
        try:  # the format's own defaults are out of a building's range
            value = float(element.content)
        except ValueError as error:
            raise BuildingError(
                f"<{tag}> in {element.where} is '{element.content}'; it must be a number."
            ) from error
        ends.append(value)
    lower, upper = ends
    return None if lower < -ENDLESS and upper > ENDLESS else (lower, upper)
