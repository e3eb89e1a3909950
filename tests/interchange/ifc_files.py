"""Small IFC files, made with IfcOpenShell."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from objstate.geometry import FloatArray, transform_from_pose


class Maker:
    """A file with one storey per height, in a unit of length."""

    def __init__(self, storeys: dict[str, float], prefix: str | None = "MILLI") -> None:
        from ifcopenshell import api

        self._run = api.run
        self.file: Any = api.run("project.create_file", version="IFC4")
        self.unit = 0.001 if prefix == "MILLI" else 1.0
        project = api.run("root.create_entity", self.file, ifc_class="IfcProject", name="p")
        unit = api.run("unit.add_si_unit", self.file, unit_type="LENGTHUNIT", prefix=prefix)
        api.run("unit.assign_unit", self.file, units=[unit])
        model = api.run("context.add_context", self.file, context_type="Model")
        self.body = api.run(
            "context.add_context", self.file, context_type="Model", context_identifier="Body",
            target_view="MODEL_VIEW", parent=model,
        )  # fmt: skip
        self.storeys = {}
        for name, height in storeys.items():
            storey = self._make("IfcBuildingStorey", name, pose(0, 0, z=height))
            api.run(
                "aggregate.assign_object", self.file, products=[storey], relating_object=project
            )
            self.storeys[name] = storey

    def wall(
        self, length: float, place: FloatArray, name: str = "wall", height: float = 2.5
    ) -> Any:
        """A wall 0.2 m thick along x of its place, to the left of it."""
        shape = self._run(
            "geometry.add_wall_representation", self.file, context=self.body, length=length,
            height=height, thickness=0.2,
        )  # fmt: skip
        return self._make("IfcWall", name, place, shape)

    def hole(self, wall: Any, width: float, height: float, place: FloatArray) -> None:
        """An opening through a wall."""
        shape = self._run(
            "geometry.add_wall_representation", self.file, context=self.body, length=width,
            height=height, thickness=1.0, offset=-0.5,
        )  # fmt: skip
        opening = self._make("IfcOpeningElement", "hole", place, shape)
        self._run("feature.add_feature", self.file, feature=opening, element=wall)

    def door(
        self, operation: str, place: FloatArray, name: str = "door", width: float = 1.0,
        shaped: bool = True,
    ) -> Any:  # fmt: skip
        sizes = {"overall_width": width / self.unit, "overall_height": 2.1 / self.unit}
        shape = None
        if shaped:
            shape = self._run(
                "geometry.add_door_representation", self.file, context=self.body,
                operation_type=operation, **sizes,
            )  # fmt: skip
        door = self._make("IfcDoor", name, place, shape)
        door.OverallWidth, door.OverallHeight = sizes.values()
        door.OperationType = operation
        return door

    def block(self, kind: str, name: str, place: FloatArray) -> Any:
        """An element 1 m by 0.2 m by 0.7 m."""
        shape = self._run(
            "geometry.add_wall_representation", self.file, context=self.body, length=1.0,
            height=0.7, thickness=0.2,
        )  # fmt: skip
        return self._make(kind, name, place, shape)

    def save(self, folder: Path) -> Path:
        path = folder / "office.ifc"
        self.file.write(str(path))
        return path

    def _make(self, kind: str, name: str, place: FloatArray, shape: Any = None) -> Any:
        made = self._run("root.create_entity", self.file, ifc_class=kind, name=name)
        self._run(
            "geometry.edit_object_placement", self.file, product=made, matrix=place, is_si=True
        )
        if shape is not None:
            self._run(
                "geometry.assign_representation", self.file, product=made, representation=shape
            )
        return made


def pose(x: float, y: float, yaw: float = 0.0, z: float = 0.0) -> FloatArray:
    return transform_from_pose(np.array([x, y, yaw]), z)
