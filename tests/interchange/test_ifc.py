"""IFC files: units, storeys, and how the panels of doors move."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building, outline
from objstate.building.model import Building, Kind, MovableObject
from objstate.errors import BuildingError
from objstate.geometry import FloatArray
from objstate.interchange import ImportResult, import_building
from tests.interchange.ifc_files import Maker, pose

pytest.importorskip(
    "ifcopenshell", reason="IfcOpenShell is not installed (pip install 'objstate[ifc]')"
)

QUARTER = np.pi / 2


def imported(folder: Path, maker: Maker) -> tuple[ImportResult, Building]:
    result = import_building(maker.save(folder), folder / "out")
    return result, load_building(result.buildings[0])


def one_door(folder: Path, operation: str, shaped: bool = True) -> tuple[ImportResult, Building]:
    """A wall along x with a door of 1 m from x = 2 to 3, whose positive y is that of the building."""
    maker = Maker({"ground": 0.0})
    wall = maker.wall(6.0, pose(0, 0))
    maker.hole(wall, 1.0, 2.1, pose(2, 0))
    maker.door(operation, pose(2, 0), shaped=shaped)
    return imported(folder, maker)


def ends(item: MovableObject, state: float) -> tuple[FloatArray, FloatArray]:
    """The hinge's and the free end of a leaf."""
    far = item.mesh.vertices[:, 0].max()
    matrix = item.transforms(np.array([[state]]))[0]
    return (matrix @ [0, 0, 0, 1])[:2], (matrix @ [far, 0, 0, 1])[:2]


def test_walls_have_the_holes_of_their_doors_in_metres(tmp_path: Path) -> None:
    result, building = one_door(tmp_path, "SLIDING_TO_LEFT", shaped=False)
    segments = outline(building.walls, 0.3)
    assert segments.reshape(-1, 2).min(axis=0) == pytest.approx([0, 0], abs=1e-5)
    assert segments.reshape(-1, 2).max(axis=0) == pytest.approx([6, 0.2], abs=1e-5)
    inside = (segments[..., 0].min(axis=1) < 2.5) & (segments[..., 0].max(axis=1) > 2.5)
    assert not inside.any()
    assert "Unit: 0.001 m, as the file states (IFC4)." in result.notes.taken


def test_a_file_in_metres_is_the_same(tmp_path: Path) -> None:
    maker = Maker({"ground": 0.0}, prefix=None)
    maker.wall(6.0, pose(1, 1, QUARTER))
    result, building = imported(tmp_path, maker)
    points = outline(building.walls, 0.3).reshape(-1, 2)
    assert [*points.min(axis=0), *points.max(axis=0)] == pytest.approx([0.8, 1, 1, 7], abs=1e-5)
    assert "Unit: 1 m, as the file states (IFC4)." in result.notes.taken


@pytest.mark.parametrize(
    ("operation", "hinge", "opened"),
    [("SINGLE_SWING_LEFT", 2, [2, 1]), ("SINGLE_SWING_RIGHT", 3, [3, 1])],
)
def test_a_leaf_without_a_shape_hangs_at_the_side_of_its_operation_and_swings_ahead(
    tmp_path: Path, operation: str, hinge: float, opened: list[float]
) -> None:
    result, building = one_door(tmp_path, operation, shaped=False)
    door = building["door"]
    assert ends(door, 0.0)[0] == pytest.approx([hinge, 0])
    assert ends(door, 0.0)[1] == pytest.approx([5 - hinge, 0])
    assert ends(door, QUARTER)[1] == pytest.approx(opened)
    assert (door.lower, door.upper) == pytest.approx((0, QUARTER))
    assert any("90 degrees are taken" in doubt for doubt in result.notes.doubts)


@pytest.mark.parametrize("operation", ["SINGLE_SWING_LEFT", "SINGLE_SWING_RIGHT"])
def test_a_leaf_lies_where_its_shape_shows_it_and_its_lining_stands(
    tmp_path: Path, operation: str
) -> None:
    _, building = one_door(tmp_path, operation)
    door = building["door"]
    hinge, free = ends(door, 0.0)
    # IfcOpenShell draws a lining of 5 cm and a panel from y = 25 to 60 mm, 25 mm into the lining
    near, far = (2.025, 2.975) if operation.endswith("LEFT") else (2.975, 2.025)
    assert hinge == pytest.approx([near, 0.0425], abs=1e-4)
    assert free == pytest.approx([far, 0.0425], abs=1e-4)
    assert np.ptp(door.mesh.vertices[:, 1]) == pytest.approx(0.035, abs=1e-4)
    segments = outline(building.walls, 0.3)
    lining = segments[(segments[..., 0] > 2.01).all(axis=1) & (segments[..., 0] < 2.99).all(axis=1)]
    assert len(lining) == 2
    assert set(np.round(lining[..., 0].ravel(), 3)) == {2.025, 2.975}


def test_panels_of_double_doors_hang_at_both_sides(tmp_path: Path) -> None:
    _, building = one_door(tmp_path, "DOUBLE_DOOR_SINGLE_SWING", shaped=False)
    left, right = building["door_left"], building["door_right"]
    assert ends(left, 0.0)[0] == pytest.approx([2, 0])
    assert ends(right, 0.0)[0] == pytest.approx([3, 0])
    assert ends(left, QUARTER)[1] == pytest.approx([2, 0.5])
    assert ends(right, QUARTER)[1] == pytest.approx([3, 0.5])


def test_opposite_panels_swing_to_opposite_sides(tmp_path: Path) -> None:
    _, building = one_door(tmp_path, "DOUBLE_DOOR_SINGLE_SWING_OPPOSITE_LEFT", shaped=False)
    assert ends(building["door_left"], QUARTER)[1] == pytest.approx([2, 0.5])
    assert ends(building["door_right"], QUARTER)[1] == pytest.approx([3, -0.5])


def test_double_acting_doors_swing_both_ways(tmp_path: Path) -> None:
    _, building = one_door(tmp_path, "DOUBLE_SWING_LEFT", shaped=False)
    door = building["door"]
    assert (door.lower, door.upper) == pytest.approx((-QUARTER, QUARTER))
    assert ends(door, -QUARTER)[1] == pytest.approx([2, -1])


def test_sliding_doors_slide_to_their_side(tmp_path: Path) -> None:
    _, building = one_door(tmp_path, "SLIDING_TO_RIGHT", shaped=False)
    door = building["door"]
    assert door.kind is Kind.SLIDING
    assert sorted(end[0] for end in ends(door, 0.0)) == pytest.approx([2, 3])
    assert sorted(end[0] for end in ends(door, door.upper)) == pytest.approx([3, 4])


def test_the_share_of_panels_and_the_operation_are_found_at_the_type(tmp_path: Path) -> None:
    import ifcopenshell
    from ifcopenshell import api

    maker = Maker({"ground": 0.0})
    maker.wall(6.0, pose(0, 0))
    door = maker.door("NOTDEFINED", pose(2, 0), shaped=False)
    kind = api.run("root.create_entity", maker.file, ifc_class="IfcDoorType", name="t")
    kind.OperationType = "DOUBLE_DOOR_SLIDING"
    panel = maker.file.create_entity(
        "IfcDoorPanelProperties", GlobalId=ifcopenshell.guid.new(), PanelOperation="SLIDING",
        PanelWidth=0.3, PanelPosition="LEFT",
    )  # fmt: skip
    kind.HasPropertySets = [panel]
    api.run("type.assign_type", maker.file, related_objects=[door], relating_type=kind)
    _, building = imported(tmp_path, maker)
    widths = {name: item.upper for name, item in building.objects.items()}
    assert widths == pytest.approx({"door_left": 0.3, "door_right": 0.7})


def test_storeys_are_floors_of_their_own_and_high_walls_stand_on_each(tmp_path: Path) -> None:
    maker = Maker({"upper": 3.0, "ground": 0.0})
    maker.wall(6.0, pose(0, 0), name="low")
    maker.wall(2.0, pose(0, 5), name="atrium", height=6.0)
    maker.wall(4.0, pose(0, 0, z=3.0), name="high")
    maker.door("SINGLE_SWING_LEFT", pose(1, 5, z=3.0), name="up", shaped=False)
    maker.block("IfcFurniture", "desk", pose(1, 2, 0.5))
    result, ground = imported(tmp_path, maker)
    upper = load_building(result.buildings[1])
    assert [path.parent.name for path in result.buildings] == ["ground", "upper"]
    assert list(ground.objects) == ["desk"]
    assert list(upper.objects) == ["up"]
    assert ground["desk"].kind is Kind.PLANAR
    assert ground["desk"].home == pytest.approx([1, 2, 0.5])
    assert upper["up"].origin[2, 3] == pytest.approx(0)
    for building, longest in ((ground, 6.0), (upper, 4.0)):
        points = outline(building.walls, 0.3).reshape(-1, 2)
        assert points.max(axis=0) == pytest.approx([longest, 5.2], abs=1e-5)


def test_what_is_not_taken_is_named(tmp_path: Path) -> None:
    maker = Maker({"ground": 0.0})
    maker.wall(6.0, pose(0, 0))
    maker.block("IfcSlab", "floor", pose(0, 0))
    maker.door("REVOLVING", pose(2, 0), name="entrance", shaped=False)
    result, _ = imported(tmp_path, maker)
    left = result.notes.left
    assert "Door 'entrance', whose operation is REVOLVING; its doorway stays open." in left
    assert "1 IfcSlab." in left


def test_a_shape_beside_its_placement_is_told(tmp_path: Path) -> None:
    maker = Maker({"ground": 0.0})
    maker.wall(6.0, pose(0, 0))
    door = maker.door("SINGLE_SWING_LEFT", pose(2, 0))
    door.OverallWidth = 2000.0
    result, _ = imported(tmp_path, maker)
    assert any("not 0 to 2.00; check its hinge" in doubt for doubt in result.notes.doubts)


def test_a_file_without_a_unit_is_refused(tmp_path: Path) -> None:
    maker = Maker({"ground": 0.0})
    maker.wall(6.0, pose(0, 0))
    maker.file.by_type("IfcProject")[0].UnitsInContext = None
    with pytest.raises(BuildingError, match="doesn't state its unit of length"):
        imported(tmp_path, maker)


def test_a_file_whose_z_does_not_point_up_is_refused(tmp_path: Path) -> None:
    maker = Maker({"ground": 0.0})
    maker.wall(6.0, pose(0, 0))
    context = maker.file.by_type("IfcGeometricRepresentationContext", include_subtypes=False)[0]
    context.WorldCoordinateSystem.Axis = maker.file.createIfcDirection((0.0, 1.0, 0.0))
    context.WorldCoordinateSystem.RefDirection = maker.file.createIfcDirection((1.0, 0.0, 0.0))
    with pytest.raises(BuildingError, match="z doesn't point up"):
        imported(tmp_path, maker)


def test_a_damaged_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "office.ifc"
    path.write_text("ISO-10303-21;\nHEADER;\nnothing")
    with pytest.raises(BuildingError, match="can't be read as IFC"):
        import_building(path, tmp_path / "out")
