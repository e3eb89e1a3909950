"""IFC files through IfcOpenShell: units, axes, storeys, and the shapes of what stands in them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from objstate.building.model import Mesh
from objstate.errors import BuildingError, SettingsError
from objstate.geometry import FloatArray, is_rigid
from objstate.interchange.imported import Notes, unused_name

LONGEST_UNIT = 1.0  # m; no building is drawn in a longer one than the metre
FLAT = 1e-6  # of the vertical's components, by which an axis may lean


@dataclass(frozen=True, eq=False)
class Storey:
    """One floor."""

    name: str
    floor: float  # m, its height
    ceiling: float  # m, the height of the next floor


@dataclass(frozen=True, eq=False)
class Thing:
    """An element with its shape."""

    element: Any  # of IfcOpenShell
    name: str
    place: FloatArray = field(repr=False)  # (4, 4) m in the building
    mesh: Mesh = field(repr=False)  # in its placement, m


class IfcFile:
    """A file that was opened."""

    def __init__(self, path: Path, notes: Notes) -> None:
        try:
            import ifcopenshell
            import ifcopenshell.geom
            import ifcopenshell.util.unit
        except ImportError as error:
            raise SettingsError(
                f"IFC files need IfcOpenShell ({error}); pip install 'objstate[ifc]'."
            ) from error
        self.path, self._notes = path, notes
        try:
            self.model = ifcopenshell.open(str(path))
        except Exception as error:  # any error of the parser for a damaged file
            raise BuildingError(
                f"{path} can't be read as IFC ({error}); export it again."
            ) from error
        self._geometry = ifcopenshell.geom
        self._settings = ifcopenshell.geom.settings()
        self.unit = self._length_unit()
        self._check_axes()

    def _length_unit(self) -> float:
        """Metres per unit of length. Raises BuildingError where the file states none."""
        import ifcopenshell.util.unit as units

        if units.get_project_unit(self.model, "LENGTHUNIT") is None:
            raise BuildingError(
                f"{self.path} doesn't state its unit of length (IfcUnitAssignment); export it "
                "again with units."
            )
        unit = float(units.calculate_unit_scale(self.model))
        if not 0 < unit <= LONGEST_UNIT:
            raise BuildingError(
                f"{self.path} is drawn in units of {unit:g} m, which no building is; export it "
                "again."
            )
        self._notes.taken.append(f"Unit: {unit:g} m, as the file states ({self.model.schema}).")
        return unit

    def _check_axes(self) -> None:
        """Raise BuildingError where z doesn't point up."""
        from ifcopenshell.util import placement

        for context in self.model.by_type(
            "IfcGeometricRepresentationContext", include_subtypes=False
        ):
            system = context.WorldCoordinateSystem
            if context.ContextType != "Model" or system is None:
                continue
            up = placement.get_axis2placement(system)[:3, 2]
            if abs(up[2] - 1.0) > FLAT:
                raise BuildingError(
                    f"In {self.path} z doesn't point up (WorldCoordinateSystem); export it with z "
                    "up."
                )
        self._notes.taken.append("Axes: z upwards, right-handed, as the file states.")

    def storeys(self) -> list[Storey]:
        """The floors, lowest first; one without a name where the file has none."""
        from ifcopenshell.util import placement

        found = sorted(
            (
                self.unit * float(placement.get_local_placement(each.ObjectPlacement)[2, 3]),
                each.Name or f"storey_{each.id()}",
            )
            for each in self.model.by_type("IfcBuildingStorey")
        )
        if not found:
            self._notes.doubts.append("The file has no storeys; its floor is taken to be at z = 0.")
            return [Storey("building", 0.0, np.inf)]
        ceilings = [*(height for height, _ in found[1:]), np.inf]
        storeys: dict[str, Storey] = {}
        for (floor, name), ceiling in zip(found, ceilings, strict=True):
            own = unused_name(name, storeys)
            storeys[own] = Storey(own, floor, ceiling)
        return list(storeys.values())

    def things(self, classes: tuple[str, ...]) -> Iterator[Thing]:
        """The elements of some classes, in the file's order; those without a shape are noted."""
        elements = {each.id(): each for name in classes for each in self._of_class(name)}
        for number in sorted(elements):
            element = elements[number]
            name = element.Name or f"{element.is_a()}_{number}"
            place = self.place(element)
            mesh = self._mesh(element)
            if place is None:
                self._notes.left.append(
                    f"{element.is_a()} '{name}', whose placement is no rigid one."
                )
                continue
            if len(mesh.faces) or element.is_a("IfcDoor"):
                yield Thing(element, name, place, mesh)
            elif not element.IsDecomposedBy:  # else its parts have the shape
                self._notes.left.append(f"{element.is_a()} '{name}', which has no shape.")

    def _of_class(self, name: str) -> list[Any]:
        try:
            return list(self.model.by_type(name))
        except RuntimeError:  # a class of a later version of the format
            return []

    def place(self, element: Any) -> FloatArray | None:
        """An element's placement (4, 4) in m; None where it mirrors or stretches."""
        from ifcopenshell.util import placement

        matrix = np.array(placement.get_local_placement(element.ObjectPlacement), dtype=float)
        matrix[:3, 3] *= self.unit
        return matrix if is_rigid(matrix) else None

    def _mesh(self, element: Any) -> Mesh:
        if element.Representation is None:
            return Mesh.empty()
        try:
            geometry = self._geometry.create_shape(self._settings, element).geometry
        except RuntimeError:  # nothing of it is a body
            return Mesh.empty()
        vertices = np.array(geometry.verts, dtype=float).reshape(-1, 3)
        return Mesh(vertices, np.array(geometry.faces, dtype=np.int64).reshape(-1, 3))
