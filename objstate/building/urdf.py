"""URDF, as far as a building needs it: links with their shapes, joints with their limits.

Source: the URDF XML specification (link, joint, collision, visual). Inertia,
dynamics, mimic and transmission say nothing about where things are and are ignored.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from objstate.building.markup import Element, read_xml
from objstate.building.mesh_files import resolve
from objstate.building.model import Kind
from objstate.building.shapes import Box, Cylinder, MeshFile, Shape, Sphere
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, checked_angle, rotation_from_rpy, transform

T = TypeVar("T")
Refuse = Callable[[BuildingError], None]  # what to do with an error: raise it, or note it and go on

KINDS = {
    "revolute": Kind.HINGED,
    "continuous": Kind.HINGED,
    "prismatic": Kind.SLIDING,
    "planar": Kind.PLANAR,
}
DEFAULT_AXIS = (1.0, 0.0, 0.0)  # the specification's
UP = (0.0, 0.0, 1.0)
SAMPLE_LIMITS = {
    Kind.HINGED: '<limit lower="0" upper="1.57"/>',
    Kind.SLIDING: '<limit lower="0" upper="0.9"/>',
}
CALLED = {Kind.HINGED: "Door", Kind.SLIDING: "Sliding door", Kind.PLANAR: "Furniture"}
FULL_TURN = (-np.pi, np.pi)  # rad, the range of a continuous joint
NOT_MOVING = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Part:
    """One shape of a link."""

    shape: Shape
    origin: FloatArray = field(repr=False)  # (4, 4) in the link frame


@dataclass(frozen=True, eq=False)
class Link:
    """A rigid body: its collision shapes, or its visual ones where it has no other."""

    name: str
    parts: tuple[Part, ...]


@dataclass(frozen=True, eq=False)
class Joint:
    """What ties one link to another."""

    name: str
    kind: Kind | None  # None: fixed
    parent: str
    child: str
    origin: FloatArray = field(repr=False)  # (4, 4) joint frame in the parent link
    axis: FloatArray  # (3,) unit vector in the joint frame
    limits: tuple[float, float]  # rad or m
    wraps: bool
    where: str


@dataclass(frozen=True, eq=False)
class Description:
    """A URDF file: its links and joints, not yet put together."""

    name: str
    path: Path
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]


def urdf_of(path: Path) -> Path:
    """The URDF of a building's folder, or ``path`` if it is no folder. Raises BuildingError."""
    if not path.is_dir():
        return path
    models = sorted(path.glob("*.urdf"))
    if len(models) != 1:
        raise BuildingError(f"{path} holds {len(models)} URDF files; give that of the building.")
    return models[0]


def read_description(path: Path, refuse: Refuse) -> Description:
    """The links and joints of a URDF file.

    Each error in a link or joint goes to ``refuse``; if that returns, what is wrong
    is left out. Raises BuildingError where no URDF can be read at all.
    """
    robot = read_xml(path)
    _check_is_urdf(robot, path)
    links = _named(robot.all("link"), lambda element: read_link(element, path, refuse), refuse)
    joints = _named(robot.all("joint"), lambda element: read_joint(element, refuse), refuse)
    return Description(robot.attributes.get("name") or path.stem, path, links, joints)


def _check_is_urdf(robot: Element, path: Path) -> None:
    if robot.tag != "robot":
        raise BuildingError(
            f"{path} is no URDF: its first element is <{robot.tag}>, not <robot>; "
            "give the building's URDF file."
        )
    if _has_macros(robot):
        plain = path.name.removesuffix(".xacro").removesuffix(".urdf") + ".urdf"
        raise BuildingError(
            f"{path} holds xacro macros; expand them first: xacro {path.name} > {plain}."
        )


def _has_macros(element: Element) -> bool:
    pending = [element]
    while pending:
        here = pending.pop()
        if here.tag.startswith("xacro:") or any("${" in v for v in here.attributes.values()):
            return True
        pending.extend(here.children)
    return False


def _named(elements: list[Element], read: Callable[[Element], T], refuse: Refuse) -> dict[str, T]:
    found: dict[str, T] = {}
    for element in elements:
        try:
            name = element.text("name")
            if name in found:
                raise BuildingError(
                    f"The {element.tag} '{name}' in {element.where} stands there for the second "
                    "time; give it a name of its own."
                )
            found[name] = read(element)
        except BuildingError as error:
            refuse(error)
    return found


def _otherwise(read: Callable[[], T], instead: T, refuse: Refuse) -> T:
    """What ``read`` gives; if it fails and ``refuse`` returns, ``instead``."""
    try:
        return read()
    except BuildingError as error:
        refuse(error)
        return instead


def read_link(element: Element, urdf: Path, refuse: Refuse) -> Link:
    """A link with its shapes."""
    bodies = element.all("collision") or element.all("visual")
    parts = [_otherwise(partial(_read_part, body, urdf), None, refuse) for body in bodies]
    return Link(element.text("name"), tuple(part for part in parts if part))


def _read_part(body: Element, urdf: Path) -> Part | None:
    return Part(_read_shape(body.need("geometry"), urdf), _read_origin(body))


def _read_shape(geometry: Element, urdf: Path) -> Shape:
    for element in geometry.children:
        if element.tag == "box":
            return Box(element.positive("size", 3))
        if element.tag == "cylinder":
            return Cylinder(element.positive("radius")[0], element.positive("length")[0])
        if element.tag == "sphere":
            return Sphere(element.positive("radius")[0])
        if element.tag == "mesh":
            path = resolve(element.text("filename"), urdf, element.where)
            return MeshFile(path, _read_scale(element), element.where)
    found = ", ".join(f"<{child.tag}>" for child in geometry.children) or "nothing"
    raise BuildingError(
        f"<geometry> in {geometry.where} holds {found}; give a box, cylinder, sphere or mesh."
    )


def _read_scale(element: Element) -> tuple[float, ...]:
    scale = element.numbers("scale", (1.0, 1.0, 1.0))
    if 0.0 in scale:
        raise BuildingError(
            f"<mesh> in {element.where} is scaled to nothing; give a scale other than zero."
        )
    return scale


def _read_origin(element: Element) -> FloatArray:
    origin = element.first("origin")
    if origin is None:
        return np.eye(4)
    zero = (0.0, 0.0, 0.0)
    turn = [_angle(value, "rpy", origin) for value in origin.numbers("rpy", zero)]
    return transform(rotation_from_rpy(*turn), origin.numbers("xyz", zero))


def _angle(value: float, name: str, element: Element) -> float:
    try:
        return checked_angle(value)
    except ValueError as error:
        raise BuildingError(f"<{element.tag}> {name} in {element.where}: {error}.") from error


def read_joint(element: Element, refuse: Refuse) -> Joint:
    """A joint with its limits checked."""
    kind = _otherwise(lambda: _read_kind(element), None, refuse)
    return Joint(
        name=element.text("name"),
        kind=kind,
        parent=element.need("parent").text("link"),
        child=element.need("child").text("link"),
        origin=_otherwise(lambda: _read_origin(element), np.eye(4), refuse),
        axis=_otherwise(lambda: _read_axis(element, kind), np.array(UP), refuse),
        limits=_otherwise(lambda: _read_limits(element, kind), NOT_MOVING, refuse),
        wraps=element.attributes.get("type") == "continuous",
        where=element.where,
    )


def _read_kind(element: Element) -> Kind | None:
    name, kind = element.text("name"), element.text("type")
    if kind == "fixed":
        return None
    if kind == "floating":
        raise BuildingError(
            f"Joint '{name}' in {element.where} is floating, but furniture stands on the floor; "
            'make it type="planar".'
        )
    if kind not in KINDS:
        known = ", ".join(["fixed", *KINDS])
        raise BuildingError(
            f"Joint '{name}' in {element.where} has the unknown type '{kind}'; "
            f"it must be one of {known}."
        )
    return KINDS[kind]


def _read_axis(element: Element, kind: Kind | None) -> FloatArray:
    """The unit axis. A planar joint without one lies on the floor, whatever URDF's default."""
    stated = element.first("axis")
    default = UP if kind is Kind.PLANAR else DEFAULT_AXIS
    axis = np.array(stated.numbers("xyz", default) if stated else default)
    length = float(np.linalg.norm(axis))
    if stated and length == 0.0:
        raise BuildingError(
            f"Joint '{element.text('name')}' has an axis of length zero in {stated.where}; "
            'for a vertical hinge give <axis xyz="0 0 1"/>.'
        )
    return np.asarray(axis / length)


def _read_limits(element: Element, kind: Kind | None) -> tuple[float, float]:
    if kind is None or kind is Kind.PLANAR:
        return NOT_MOVING
    if element.attributes["type"] == "continuous":
        return FULL_TURN
    return _read_range(element, kind)


def _read_range(element: Element, kind: Kind) -> tuple[float, float]:
    """Lower and upper limit. One that is absent is 0, as URDF has it, where that leaves a range."""
    called = f"{CALLED[kind]} '{element.text('name')}'"
    limit = element.first("limit") or Element("limit", {}, element.where)
    (lower,), (upper,) = limit.numbers("lower", (0.0,)), limit.numbers("upper", (0.0,))
    if kind is Kind.HINGED:
        lower, upper = (_angle(lower, "lower", limit), _angle(upper, "upper", limit))
    if "upper" not in limit.attributes and lower >= 0:
        raise BuildingError(
            f"{called} has no upper limit in {limit.where}; add {SAMPLE_LIMITS[kind]}."
        )
    if lower > upper:
        raise BuildingError(
            f"{called} has its lower limit {lower:g} above its upper limit {upper:g} in "
            f"{limit.where}; exchange them, or turn the axis round."
        )
    if lower == upper:
        raise BuildingError(
            f"{called} can't move: both its limits are {lower:g} in {limit.where}; widen them as "
            f'in {SAMPLE_LIMITS[kind]}, or make it type="fixed".'
        )
    return lower, upper
