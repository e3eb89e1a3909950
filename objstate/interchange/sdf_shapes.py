"""The shapes of SDF links that a laser can meet."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from objstate.building.markup import Element, numbers_in
from objstate.building.mesh_files import COLLADA, collada_asset, load_mesh, resolve
from objstate.building.model import Mesh
from objstate.building.shapes import Box, Cylinder, Sphere
from objstate.errors import BuildingError
from objstate.geometry import FloatArray
from objstate.interchange.imported import Notes
from objstate.interchange.sdf_file import Folders, Model, numbers

GROUND = ("plane", "heightmap", "empty")  # what one stands on, or nothing


@dataclass
class Shapes:
    """Reads the shapes of links, each mesh file once."""

    folders: Folders
    notes: Notes
    _files: dict[tuple[str, tuple[float, ...]], Mesh] = field(default_factory=dict)

    def of(self, link: Element, model: Model, at: Callable[[Element], FloatArray]) -> Mesh:
        """A link's collision shapes, or its visual ones where it has no other, in its frame.

        ``at`` says where a shape lies whose pose is relative to another frame.
        """
        bodies = link.all("collision") or link.all("visual")
        parts = []
        for body in bodies:
            shape = self._shape(body, model)
            if shape is not None:
                parts.append(shape.moved(at(body)))
        return Mesh.joined(parts)

    def _shape(self, body: Element, model: Model) -> Mesh | None:
        geometry = body.need("geometry")
        for element in geometry.children:
            if element.tag in GROUND:
                return None
            if element.tag == "box":
                return Box(_positive(element, numbers(element, "size", (1.0,) * 3))).mesh()
            if element.tag == "cylinder":
                (radius,), (length,) = (
                    numbers(element, "radius", None),
                    numbers(element, "length", None),
                )
                return Cylinder(*_positive(element, (radius, length))).mesh()
            if element.tag == "sphere":
                return Sphere(*_positive(element, numbers(element, "radius", None))).mesh()
            if element.tag == "polyline":
                return _prism(element)
            if element.tag == "mesh":
                return self._mesh(element, model)
        found = ", ".join(child.tag for child in geometry.children) or "nothing"
        self.notes.left.append(f"A shape of model '{model.name}': {found} ({geometry.where}).")
        return None

    def _mesh(self, element: Element, model: Model) -> Mesh | None:
        uri = element.need("uri").content
        if element.first("submesh") is not None:
            self.notes.left.append(
                f"Model '{model.name}': part of the mesh {uri} ({element.where})."
            )
            return None
        scale = numbers(element, "scale", (1.0, 1.0, 1.0))
        if uri.startswith("package://"):
            path = resolve(uri, model.path, element.where)
        else:
            found = self.folders.find(uri, model.path)
            if found is None or not found.is_file():
                self.notes.left.append(
                    f"Model '{model.name}': there is no mesh '{uri}' here ({element.where})."
                )
                return None
            path = found
        key = (str(path), scale)
        if key not in self._files:
            try:
                mesh = load_mesh(path, element.where)
            except BuildingError as error:  # a lamp's COLLADA is no reason to refuse the walls
                self.notes.left.append(f"Model '{model.name}': {error}")
                mesh = Mesh.empty()
            else:
                self._doubt_axis(path, model)
            faces = mesh.faces if np.prod(scale) > 0 else mesh.faces[:, ::-1]
            self._files[key] = Mesh(mesh.vertices * np.array(scale), faces)
        return self._files[key]

    def _doubt_axis(self, path: Path, model: Model) -> None:
        """Say where a mesh states an axis that some simulators heed, and others don't."""
        if path.suffix.lower() == COLLADA and (up := collada_asset(path)[1]) != "Z_UP":
            self.notes.doubts.append(
                f"Model '{model.name}': {path.name} states {up}, and is turned accordingly; some "
                "simulators don't. Check that it stands."
            )


def _positive(element: Element, values: tuple[float, ...]) -> tuple[float, ...]:
    if min(values) <= 0:
        raise BuildingError(
            f"<{element.tag}> in {element.where} has no extent; give metres above 0."
        )
    return values


def _prism(element: Element) -> Mesh:
    """The sides of an extruded polygon; a level laser never meets its ends."""
    points = [numbers_in(point.content) for point in element.all("point")]
    (height,) = numbers(element, "height", (1.0,))
    if len(points) < 3 or any(len(point) != 2 for point in points):
        raise BuildingError(
            f"<polyline> in {element.where} must have three points of two numbers, or more."
        )
    from objstate.building.from_map import extrude

    return extrude([np.array(points)], height)
