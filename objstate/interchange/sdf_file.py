"""SDFormat files: worlds and models, with what they include from other files.

Source: the SDFormat specification 1.4 to 1.11 (sdformat.org). Lengths are metres, angles radians
unless ``degrees`` is set, z is up, and frames are right-handed.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from objstate.building.markup import Element, numbers_in, read_xml
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, rotation_from_quaternion, rotation_from_rpy, transform
from objstate.interchange.imported import Notes

MODEL = "model://"
# Gazebo's search paths
PATHS = ("GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "GAZEBO_MODEL_PATH")
DEEPEST = 30  # models within models; more include themselves
TRUE = ("1", "true")


@dataclass(frozen=True)
class Folders:
    """The folders that are searched for ``model://``, in this order."""

    roots: tuple[Path, ...]

    @staticmethod
    def of(given: Sequence[Path], source: Path) -> Folders:
        """The folders given, those of Gazebo's variables, and those that the file lies in."""
        known = [
            Path(root)
            for name in PATHS
            for root in os.environ.get(name, "").split(os.pathsep)
            if root
        ]
        return Folders((*given, *known, *source.resolve().parents))

    def find(self, uri: str, beside: Path) -> Path | None:
        """The file or folder that a URI means in a file; None where there is none."""
        if uri.startswith(MODEL):
            places = [root / uri.removeprefix(MODEL) for root in self.roots]
        elif "://" in uri and not uri.startswith("file://"):
            return None
        else:
            name = uri.removeprefix("file://")
            places = [beside.parent / name, *(root / name for root in self.roots)]
        return next((place for place in places if place.exists()), None)


@dataclass(frozen=True, eq=False)
class Model:
    """A model, or the world, with the models in it."""

    name: str
    element: Element
    path: Path  # the file that it stands in
    version: tuple[int, int]  # of the format there
    is_static: bool
    pose: Element | None  # where it stands in the model that holds it
    placed_by: str | None  # the frame in it that stands there; its own where None
    models: dict[str, Model] = field(default_factory=dict)

    def all(self, tag: str) -> dict[str, Element]:
        """The elements of one kind in it, by name."""
        return {each.text("name"): each for each in self.element.all(tag)}


def read_world(path: Path, folders: Folders, notes: Notes) -> Model:
    """The world of a file, or its models as a world. Raises BuildingError."""
    top = read_xml(path)
    if top.tag != "sdf":
        raise BuildingError(
            f"{path} is no SDF: its first element is <{top.tag}>, not <sdf>; give a world or model."
        )
    worlds = top.all("world")
    if len(worlds) > 1:
        names = ", ".join(world.attributes.get("name", "") for world in worlds)
        raise BuildingError(f"{path} holds several worlds ({names}); give a file with one.")
    element = worlds[0] if worlds else top
    reader = _Reader(folders, notes)
    world = Model(path.stem, element, path, _version(top), False, None, None)
    reader.fill(world, 0)
    return world


@dataclass(frozen=True)
class _Reader:
    folders: Folders
    notes: Notes

    def fill(self, model: Model, depth: int) -> None:
        """Read the models that stand in a model."""
        if depth > DEEPEST:
            raise BuildingError(f"{model.path} includes itself; remove that include.")
        for child in model.element.children:
            inner = None
            if child.tag == "model":
                inner = self._nested(child, model)
            elif child.tag == "include":
                inner = self._included(child, model)
            if inner is None:
                continue
            if inner.name in model.models:
                raise BuildingError(
                    f"Model '{inner.name}' in {child.where} stands there for the second time; give "
                    "it a <name> of its own."
                )
            self.fill(inner, depth + 1)
            model.models[inner.name] = inner

    def _nested(self, element: Element, outer: Model) -> Model:
        return Model(
            name=element.text("name"),
            element=element,
            path=outer.path,
            version=outer.version,
            is_static=outer.is_static or _is_true(element.first("static")),
            pose=element.first("pose"),
            placed_by=element.attributes.get("placement_frame"),
        )

    def _included(self, include: Element, outer: Model) -> Model | None:
        """The model of another file; None, and a note, where it isn't there."""
        uri = include.need("uri").content
        name = include.first("name")
        called = name.content if name else uri.rpartition("/")[2]
        file = _model_file(self.folders.find(uri, outer.path))
        if file is None:
            self.notes.left.append(f"Model '{called}': there is no '{uri}' here ({include.where}).")
            return None
        top = read_xml(file)
        element = top.first("model")
        if element is None:
            kinds = ", ".join(sorted({child.tag for child in top.children})) or "nothing"
            if kinds != "light":
                self.notes.left.append(f"Model '{called}': {file.name} holds {kinds}.")
            return None
        if include.attributes.get("merge", "").lower() in TRUE:
            self.notes.doubts.append(
                f"Model '{called}' is to be merged into '{outer.name}'; it stands there as a model."
            )
        static = include.first("static")
        return Model(
            name=name.content if name else element.text("name"),
            element=element,
            path=file,
            version=_version(top),
            is_static=outer.is_static or _is_true(static or element.first("static")),
            pose=include.first("pose") or element.first("pose"),
            placed_by=_text(include.first("placement_frame"))
            or element.attributes.get("placement_frame"),
        )


def _model_file(place: Path | None) -> Path | None:
    """The SDF file of a model's folder: the newest that ``model.config`` names."""
    if place is None or place.is_file():
        return place
    config = place / "model.config"
    if config.is_file():
        named = [(_version(each), each.content) for each in read_xml(config).all("sdf")]
        for _, name in sorted(named, reverse=True):
            if (place / name).is_file():
                return place / name
    return place / "model.sdf" if (place / "model.sdf").is_file() else None


def _version(element: Element) -> tuple[int, int]:
    major, _, minor = element.attributes.get("version", "1.4").partition(".")
    return (int(major), int(minor)) if major.isdigit() and minor.isdigit() else (1, 4)


def _text(element: Element | None) -> str | None:
    return None if element is None else element.content


def _is_true(element: Element | None) -> bool:
    return element is not None and element.content.lower() in TRUE


def numbers(parent: Element, tag: str, default: tuple[float, ...] | None) -> tuple[float, ...]:
    """The numbers in a child element, as many as ``default`` has; BuildingError if it holds others.

    A child without a default must be there, and hold one number.
    """
    element = parent.need(tag) if default is None else parent.first(tag)
    count = 1 if default is None else len(default)
    if element is None:
        return default or ()
    values = numbers_in(element.content)
    if len(values) != count:
        raise BuildingError(
            f"<{tag}> in {element.where} is '{element.content}'; it must hold {count} finite "
            "number(s)."
        )
    return values


def matrix_of(pose: Element | None) -> FloatArray:
    """The transform (4, 4) that a <pose> states. Raises BuildingError."""
    if pose is None or not pose.content:
        return np.eye(4)
    values = numbers_in(pose.content)
    form = pose.attributes.get("rotation_format", "euler_rpy")
    if form == "quat_xyzw" and len(values) == 7:
        try:
            return transform(rotation_from_quaternion(*values[3:]), values[:3])
        except ValueError as error:
            raise BuildingError(f"<pose> in {pose.where}: {error}.") from error
    if form != "euler_rpy" or len(values) != 6:
        raise BuildingError(
            f"<pose> in {pose.where} is '{pose.content}'; it must hold x y z roll pitch yaw."
        )
    turn = np.array(values[3:])
    if pose.attributes.get("degrees", "").lower() in TRUE:
        turn = np.radians(turn)
    return transform(rotation_from_rpy(*turn.tolist()), values[:3])
