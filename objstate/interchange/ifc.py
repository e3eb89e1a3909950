"""IFC files as objstate's buildings: a floor for each storey, with walls, doors and furniture."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.geometry import FloatArray
from objstate.interchange.ifc_doors import OPERATIONS, DoorShape, panels_of
from objstate.interchange.ifc_file import IfcFile, Storey, Thing
from objstate.interchange.imported import Imported, Notes, file_name, several, unused_name

FIXED = (
    "IfcWall", "IfcColumn", "IfcPlate", "IfcMember", "IfcWindow", "IfcRailing", "IfcStairFlight",
    "IfcRampFlight", "IfcCurtainWall", "IfcSanitaryTerminal", "IfcBuildingElementProxy",
)  # fmt: skip
FURNITURE = ("IfcFurnishingElement",)
DOORS = ("IfcDoor",)
GLASS = ("IfcWindow", "IfcPlate", "IfcCurtainWall")
LOWEST, HIGHEST = 0.05, 2.0  # m above a floor, between which a robot's laser is
STEP = 0.3  # m by which a door or furniture may stand below its storey's floor
UP = (0.0, 0.0, 1.0)


def import_ifc(path: Path) -> Imported:
    """The storeys of a file. Raises BuildingError, and SettingsError without IfcOpenShell."""
    notes = Notes()
    file = IfcFile(path, notes)
    storeys = file.storeys()
    floors = {storey.name: _Floor(storey) for storey in storeys}
    counts: Counter[str] = Counter()
    for thing in file.things(FIXED):
        counts[thing.element.is_a()] += 1
        mesh = thing.mesh.moved(thing.place)
        for floor in floors.values():
            floor.add_walls(mesh)
    _take_doors(file, list(floors.values()), notes)
    _take_furniture(file, list(floors.values()), notes)
    listed = ", ".join(f"{count} {name}" for name, count in counts.items()) or "none"
    notes.taken.append(f"Fixed, each on all storeys whose space it stands in: {listed}.")
    if clear := sum(counts[name] for name in GLASS):
        notes.doubts.append(
            f"{several(clear, 'element')} may be of glass; some lasers don't see it."
        )
    _tell_others(file, notes)
    single = len(storeys) == 1
    return Imported(
        {
            name: floor.building(path.stem if single else file_name(f"{path.stem}_{name}"))
            for name, floor in floors.items()
        },
        notes,
    )


@dataclass
class _Floor:
    """What stands on one storey, with its floor at z = 0."""

    storey: Storey
    walls: list[Mesh] = field(default_factory=list)
    objects: dict[str, MovableObject] = field(default_factory=dict)

    def add_walls(self, mesh: Mesh) -> None:
        """Add a mesh in the file's frame, if a laser on this storey may meet it."""
        heights = mesh.vertices[:, 2] - self.storey.floor
        if len(mesh.faces) and heights.min() < HIGHEST and heights.max() > LOWEST:
            self.walls.append(Mesh(mesh.vertices - [0, 0, self.storey.floor], mesh.faces))

    def holds(self, height: float) -> bool:
        """Whether something that stands at a height stands on this storey."""
        return self.storey.floor - STEP <= height < self.storey.ceiling - STEP

    def lowered(self, place: FloatArray) -> FloatArray:
        """A placement (4, 4), with this storey's floor at z = 0."""
        moved = place.copy()
        moved[2, 3] -= self.storey.floor
        return moved

    def building(self, name: str) -> Building:
        return Building(name, Mesh.joined(self.walls), self.objects)


def _take_doors(file: IfcFile, floors: list[_Floor], notes: Notes) -> None:
    counts: Counter[str] = Counter()
    for thing in file.things(DOORS):
        operation = _operation(thing.element)
        floor = next((f for f in floors if f.holds(thing.place[2, 3])), None)
        width, height = (
            file.unit * float(getattr(thing.element, name) or 0.0)
            for name in ("OverallWidth", "OverallHeight")
        )
        if fault := _fault(operation, floor, width, height, thing):
            notes.left.append(f"Door '{thing.name}', {fault}.")
            continue
        assert floor is not None
        place = floor.lowered(thing.place)
        share = _left_share(thing.element)
        if share is None:
            share = 0.5
        shape = DoorShape(
            unused_name(thing.name, floor.objects), width, height, place, thing.mesh, share
        )
        leaves, linings = panels_of(shape, operation)
        floor.objects |= {unused_name(leaf.name, floor.objects): leaf for leaf in leaves}
        if len(linings.faces):
            floor.walls.append(linings)
        notes.doubts.extend(_door_doubts(shape, thing))
        counts[operation] += 1
    if counts:
        listed = ", ".join(f"{count} {name}" for name, count in counts.items())
        notes.taken.append(f"{several(sum(counts.values()), 'door')}: {listed}.")
    if any("SWING" in name for name in counts):
        notes.doubts.append(
            "IFC doesn't say how far doors open; 90 degrees are taken. Widen the limits of those "
            "that open further."
        )


def _fault(
    operation: str, floor: _Floor | None, width: float, height: float, thing: Thing
) -> str | None:
    if operation not in OPERATIONS:
        return f"whose operation is {operation}; its doorway stays open"
    if floor is None:
        return "which stands below the lowest storey"
    if min(width, height) <= 0:
        return "which has no OverallWidth or OverallHeight"
    if thing.place[2, 2] < 0.99:
        return "which lies on its side"
    return None


def _operation(door: Any) -> str:
    """A door's own operation, or that of its type."""
    import ifcopenshell.util.element as elements

    own = getattr(door, "OperationType", None)
    kind = elements.get_type(door)
    typed = getattr(kind, "OperationType", None) if kind is not None else None
    return str(own if own not in (None, "NOTDEFINED") else typed or "NOTDEFINED")


def _left_share(door: Any) -> float | None:
    """The left panel's share of the width, by the panel properties of the door or its type."""
    import ifcopenshell.util.element as elements

    kind = elements.get_type(door)
    sets = [*(getattr(kind, "HasPropertySets", None) or ())]
    sets += [
        rel.RelatingPropertyDefinition
        for rel in door.IsDefinedBy
        if rel.is_a("IfcRelDefinesByProperties")
    ]
    widths = {
        each.PanelPosition: each.PanelWidth
        for each in sets
        if each.is_a("IfcDoorPanelProperties") and each.PanelWidth
    }
    if "LEFT" in widths:
        return float(widths["LEFT"])
    return 1.0 - float(widths["RIGHT"]) if "RIGHT" in widths else None


def _door_doubts(shape: DoorShape, thing: Thing) -> list[str]:
    """What speaks against reading a door as its placement and its operation have it."""
    doubts = []
    if len(thing.mesh.faces):
        low, high = thing.mesh.vertices[:, 0].min(), thing.mesh.vertices[:, 0].max()
        if max(abs(low), abs(high - shape.width)) > 0.1 + 0.1 * shape.width:
            doubts.append(
                f"Door '{shape.name}': its shape spans x = {low:.2f} to {high:.2f} m of its "
                f"placement, not 0 to {shape.width:.2f}; check its hinge."
            )
    if _is_mirrored(thing.element):
        doubts.append(
            f"Door '{shape.name}': its shape is mirrored; check on which side its hinge is."
        )
    return doubts


def _is_mirrored(door: Any) -> bool:
    """Whether a door's shape is that of a type, mirrored: then left and right may be exchanged."""
    from ifcopenshell.util import placement

    if door.Representation is None:
        return False
    return any(
        item.is_a("IfcMappedItem")
        and np.linalg.det(placement.get_mappeditem_transformation(item)[:3, :3]) < 0
        for representation in door.Representation.Representations
        for item in representation.Items
    )


def _take_furniture(file: IfcFile, floors: list[_Floor], notes: Notes) -> None:
    count = 0
    for thing in file.things(FURNITURE):
        floor = next((f for f in floors if f.holds(thing.place[2, 3])), None)
        if floor is None:
            notes.left.append(f"'{thing.name}', which stands below the lowest storey.")
            continue
        name = unused_name(thing.name, floor.objects)
        place = floor.lowered(thing.place)
        floor.objects[name] = MovableObject(
            name, Kind.PLANAR, place, np.array(UP), 0.0, 0.0, thing.mesh
        )
        count += 1
    if count:
        notes.taken.append(f"{several(count, 'piece')} of furniture.")


def _tell_others(file: IfcFile, notes: Notes) -> None:
    known = (*FIXED, *FURNITURE, *DOORS, "IfcFeatureElement", "IfcVirtualElement")
    others = Counter(
        each.is_a()
        for each in file.model.by_type("IfcElement")
        if each.Representation is not None and not any(_is_a(each, name) for name in known)
    )
    for name, count in sorted(others.items()):
        notes.left.append(f"{count} {name}.")


def _is_a(element: Any, name: str) -> bool:
    return bool(element.is_a(name))
