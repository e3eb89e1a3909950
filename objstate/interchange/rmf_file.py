"""Open-RMF ``building.yaml`` files, as traffic-editor writes them: their content, checked.

Source: rmf_building_map_tools and rmf_traffic_editor of Open-RMF (Building, Level, Edge, Lift).
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, ValidationError

from objstate.errors import BuildingError
from objstate.faults import faults
from objstate.yaml_files import YamlError, read_yaml

Number = Annotated[float, Field(ge=-1e8, le=1e8)]
Length = Annotated[float, Field(gt=0, le=1000)]  # m
Index = Annotated[int, Field(ge=0)]


class _Group(BaseModel):
    """Keys that this version doesn't know are let pass: the editor adds some with every release."""

    model_config = ConfigDict(extra="ignore", frozen=True)


class Edge(_Group):
    """Two vertices and what joins them."""

    start: Index
    end: Index
    params: dict[str, Any]

    def text(self, name: str, default: str) -> str:
        return str(self.params.get(name, default))

    def number(self, name: str, default: float) -> float:
        """Raises BuildingError where the value is no finite number."""
        value = self.params.get(name, default)
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not math.isfinite(value)
        ):
            raise BuildingError(
                f"'{name}' of the edge from vertex {self.start} to {self.end} is '{value}'; it must "
                "be a finite number."
            )
        return float(value)


def _edge(row: Any) -> Any:
    """``[start, end, {name: [type, value]}]`` as keys and plain values."""
    if not isinstance(row, list) or len(row) not in (2, 3):
        return row
    params = row[2] if len(row) == 3 else {}
    if isinstance(params, dict):
        params = {k: v[1] if isinstance(v, list) and len(v) == 2 else v for k, v in params.items()}
    return {"start": row[0], "end": row[1], "params": params}


def _vertex(row: Any) -> Any:
    """The place of ``[x, y, z, name, params]``."""
    return row[:2] if isinstance(row, list) and len(row) >= 3 else row


def _fiducial(row: Any) -> Any:
    return dict(zip(("x", "y", "name"), row, strict=False)) if isinstance(row, list) else row


Edges = list[Annotated[Edge, BeforeValidator(_edge)]]


class Fiducial(_Group):
    """A point that several levels' drawings show."""

    x: Number
    y: Number
    name: str


class Model(_Group):
    """A thing that stands on a level, in a model of its own."""

    name: str
    model_name: str
    x: Number
    y: Number
    z: Number = 0.0
    yaw: Number
    static: bool = True


class Level(_Group):
    """One storey. Places are those of its drawing."""

    elevation: Number = 0.0
    vertices: list[Annotated[tuple[Number, Number], BeforeValidator(_vertex)]] = []
    walls: Edges = []
    doors: Edges = []
    measurements: Edges = []
    lanes: list[Any] = []
    floors: list[Any] = []
    holes: list[Any] = []
    fiducials: list[Annotated[Fiducial, BeforeValidator(_fiducial)]] = []
    models: list[Model] = []


class LiftDoor(_Group):
    """A door of a lift, about the middle of its cabin."""

    door_type: int
    x: Number
    y: Number
    motion_axis_orientation: Number  # rad
    width: Length


class Lift(_Group):
    """A lift and the doors that it has on each level."""

    x: Number
    y: Number
    yaw: Number
    depth: Length
    width: Length
    reference_floor_name: str | None = None
    doors: dict[str, LiftDoor] = {}
    level_doors: dict[str, list[str]] = {}


class RmfBuilding(_Group):
    """A whole file."""

    coordinate_system: Literal["reference_image", "cartesian_meters", "web_mercator", "wgs84"] = (
        "reference_image"
    )
    reference_level_name: str | None = None
    parameters: dict[str, Any] = {}
    levels: dict[str, Level] = Field(min_length=1)
    lifts: dict[str, Lift] = {}


def read_rmf(path: Path) -> RmfBuilding:
    """The content of a file. Raises BuildingError for anything wrong in it."""
    try:
        content = read_yaml(path)
    except OSError as error:
        raise BuildingError(f"{path} can't be read ({error.strerror}); check the path.") from error
    except YamlError as error:
        raise BuildingError(f"{path} is not valid YAML: {error}; mend it there.") from error
    if not isinstance(content, dict) or "levels" not in content:
        raise BuildingError(
            f"{path} has no 'levels', so it is no Open-RMF building; give the .building.yaml that "
            "traffic-editor saves."
        )
    content = _without_blanks(content)
    try:
        return _checked(RmfBuilding.model_validate(content), path)
    except ValidationError as error:
        found = "; ".join(faults(RmfBuilding, error, content))
        raise BuildingError(f"{path} can't be used: {found}.") from error


def _without_blanks(group: dict[str, Any]) -> dict[str, Any]:
    """The same keys without those that are there with no value, as in ``lanes:``."""
    kept = {key: value for key, value in group.items() if value is not None}
    if isinstance(kept.get("levels"), dict):
        kept["levels"] = {
            name: _without_blanks(level) if isinstance(level, dict) else level
            for name, level in kept["levels"].items()
        }
    return kept


def _checked(building: RmfBuilding, path: Path) -> RmfBuilding:
    """The same, if what its parts name is there."""
    for name, level in building.levels.items():
        for kind in ("walls", "doors", "measurements"):
            for number, edge in enumerate(getattr(level, kind)):
                if max(edge.start, edge.end) >= len(level.vertices):
                    raise BuildingError(
                        f"{path}: entry {number + 1} of {kind} on level '{name}' names vertex "
                        f"{max(edge.start, edge.end)}, but the level has {len(level.vertices)}; "
                        "save it again with traffic-editor."
                    )
    known = building.reference_level_name
    if known is not None and known not in building.levels:
        raise BuildingError(
            f"{path} names the reference level '{known}', which it doesn't have; its levels: "
            f"{', '.join(building.levels)}."
        )
    return building
