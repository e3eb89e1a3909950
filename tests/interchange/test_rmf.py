"""Open-RMF buildings: places, scales, and the way each type of door moves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from objstate.building import inspect_building, load_building, outline
from objstate.building.model import Building, MovableObject
from objstate.errors import BuildingError
from objstate.geometry import FloatArray
from objstate.interchange import import_building
from objstate.interchange.importing import ImportResult
from tests.interchange.rmf_files import door, edge, level, room, save

V1, V2 = np.array([6.0, -12.0]), np.array([8.0, -12.0])  # m, the ends of the gap


def imported(folder: Path, levels: dict[str, Any], **keys: Any) -> tuple[ImportResult, Building]:
    result = import_building(save(folder, levels, **keys), folder / "out")
    return result, load_building(result.buildings[0])


def tip(item: MovableObject, state: float) -> FloatArray:
    """Where the far end of a leaf is."""
    far = item.mesh.vertices[:, 0].max()
    return (item.transforms(np.array([[state]]))[0] @ [far, 0, 0, 1])[:2]


def root(item: MovableObject, state: float) -> FloatArray:
    return (item.transforms(np.array([[state]]))[0] @ [0, 0, 0, 1])[:2]


def test_walls_stand_where_the_drawing_has_them_with_y_upwards(tmp_path: Path) -> None:
    _, building = imported(tmp_path, {"L1": room([])})
    segments = outline(building.walls, 0.3)
    assert segments.reshape(-1, 2).min(axis=0) == pytest.approx([1.95, -12.05])
    assert segments.reshape(-1, 2).max(axis=0) == pytest.approx([12.05, -1.95])
    assert np.ptp(building.walls.vertices[:, 2]) == pytest.approx(2.5)
    lower = segments[np.abs(segments[..., 1] + 12).max(axis=1) < 0.06]
    crossed = (lower[..., 0].min(axis=1) < 7) & (lower[..., 0].max(axis=1) > 7)
    assert not crossed.any()
    assert lower[..., 0].min() < 6
    assert lower[..., 0].max() > 8


def test_a_wall_ends_at_a_door_and_goes_round_a_corner(tmp_path: Path) -> None:
    _, building = imported(tmp_path, {"L1": room([door(4, 5, "d", "sliding")])})
    points = outline(building.walls, 0.3).reshape(-1, 2)
    ends = points[(np.abs(points[:, 1] + 12) < 0.06) & (points[:, 0] > 3) & (points[:, 0] < 11)]
    assert sorted(set(np.round(ends[:, 0], 6))) == pytest.approx([6.0, 8.0])


@pytest.mark.parametrize(("direction", "ahead"), [(1, -1.0), (-1, 1.0)])
def test_a_hinged_door_turns_clockwise_where_its_direction_is_one(
    tmp_path: Path, direction: int, ahead: float
) -> None:
    # from v1 = (6, -12) to v2 = (8, -12): clockwise is towards negative y
    one = door(4, 5, "front", "hinged", motion_direction=direction)
    result, building = imported(tmp_path, {"L1": room([one])})
    front = building["front"]
    assert tip(front, 0.0) == pytest.approx(V2)
    assert tip(front, front.upper) == pytest.approx([6, -12 + 2 * ahead])
    assert front.upper == pytest.approx(np.pi / 2)
    assert inspect_building(result.buildings[0]).problems == []


def test_the_second_leaf_of_a_double_door_turns_the_other_way(tmp_path: Path) -> None:
    one = door(4, 5, "main", "double_hinged", right_left_ratio=3.0)
    result, building = imported(tmp_path, {"L1": room([one])})
    right, left = building["main_right"], building["main_left"]
    meet = [7.5, -12]
    assert tip(right, 0.0) == pytest.approx(meet)
    assert tip(left, 0.0) == pytest.approx(meet)
    assert tip(right, right.upper) == pytest.approx([6, -13.5])
    assert tip(left, left.upper) == pytest.approx([8, -12.5])
    assert inspect_building(result.buildings[0]).problems == []


def test_sliding_leaves_go_into_the_walls_beside_them(tmp_path: Path) -> None:
    doors = [door(4, 5, "one", "sliding"), door(5, 4, "two", "double_sliding")]
    _, building = imported(tmp_path, {"L1": room(doors)})
    one, right, left = (building[name] for name in ("one", "two_right", "two_left"))
    assert (root(one, 0.0), tip(one, 0.0)) == (pytest.approx(V2), pytest.approx(V1))
    assert root(one, one.upper) == pytest.approx(V1)
    assert root(right, right.upper) == pytest.approx(V2)  # v1 of the second door
    assert root(left, left.upper) == pytest.approx(V1)


def test_a_door_that_hangs_at_its_end_is_taken_as_drawn_and_told(tmp_path: Path) -> None:
    one = door(4, 5, "front", "hinged", motion_axis="end")
    result, building = imported(tmp_path, {"L1": room([one])})
    assert tip(building["front"], 0.0) == pytest.approx(V1)
    assert tip(building["front"], np.pi / 2) == pytest.approx([8, -10])
    assert any("hangs at its end" in doubt for doubt in result.notes.doubts)


def test_levels_are_laid_over_each_other_by_their_fiducials(tmp_path: Path) -> None:
    shared = [[100, 600, "a"], [600, 600, "b"], [100, 100, "c"]]
    # the same room, drawn at half the size, turned by 90 degrees and elsewhere
    turned = [[700 + y / 2, 900 - x / 2] for x, y, _ in shared]
    vertices = [[700 + y / 2, 900 - x / 2] for x, y in [(100, 600), (600, 600), (600, 100)]]
    levels = {
        "L1": room([], fiducials=shared),
        "L2": {
            "elevation": 4,
            "fiducials": [[*xy, name] for xy, name in zip(turned, "abc", strict=True)],
            "vertices": [[*xy, 0, ""] for xy in vertices],
            "walls": [edge(0, 1), edge(1, 2)],
        },
    }
    result, first = imported(tmp_path, levels, reference_level_name="L1")
    second = load_building(result.buildings[1])
    assert [path.relative_to(tmp_path / "out").as_posix() for path in result.buildings] == [
        "L1/office_L1.urdf",
        "L2/office_L2.urdf",
    ]
    for building in (first, second):
        low = outline(building.walls, 0.3).reshape(-1, 2).min(axis=0)
        assert low == pytest.approx([1.95, -12.05])
    assert not result.notes.doubts


def test_names_of_levels_lead_nowhere_else(tmp_path: Path) -> None:
    result, _ = imported(tmp_path, {"..": room([]), "a/b": room([]), "a_b": room([])})
    folders = [path.parent.relative_to(tmp_path / "out").as_posix() for path in result.buildings]
    assert folders == ["unnamed", "a_b", "a_b_2"]


def test_one_level_can_be_asked_for(tmp_path: Path) -> None:
    path = save(tmp_path, {"L1": room([]), "L2": room([door(4, 5, "upstairs", "sliding")])})
    result = import_building(path, tmp_path / "out", level="L2")
    assert result.buildings == [tmp_path / "out" / "office_L2.urdf"]
    assert list(load_building(result.buildings[0]).objects) == ["upstairs"]
    with pytest.raises(BuildingError, match="no level 'L3'; its levels: L1, L2"):
        import_building(path, tmp_path / "other", level="L3")


def test_a_lift_has_shaft_doors_and_a_cabin_on_each_level(tmp_path: Path) -> None:
    lift = {
        "depth": 2.0,
        "width": 2.4,
        "x": 350,
        "y": 350,
        "yaw": 0.0,
        "reference_floor_name": "L1",
        "doors": {
            "gate": {"door_type": 2, "motion_axis_orientation": 0, "width": 1.0, "x": 0, "y": -1.1}
        },
        "level_doors": {"L1": ["gate"]},
    }
    result, building = imported(tmp_path, {"L1": room([]), "L2": room([])}, lifts={"Lift1": lift})
    right, left = building["Lift1_gate_right"], building["Lift1_gate_left"]
    assert root(right, 0.0) == pytest.approx([7.0, -8.05])
    assert tip(right, 0.0) == pytest.approx([7.5, -8.05])
    assert root(left, left.upper) == pytest.approx([6.5, -8.05])
    from shapely import MultiLineString, Point

    walls = MultiLineString(list(outline(building.walls, 0.3)))
    assert walls.distance(Point(7.0, -8.0)) == pytest.approx(0.5)  # the cabin's gap
    assert walls.distance(Point(7.0, -6.0)) < 1e-6  # its back
    assert not load_building(result.buildings[1]).objects


def test_what_is_not_taken_is_named(tmp_path: Path) -> None:
    chair = {"model_name": "Open/Chair", "name": "Chair", "static": True, "x": 1, "y": 2, "yaw": 0}
    doors = [door(4, 5, "odd", "revolving"), door(4, 4, "flat", "hinged")]
    floors = room(doors, models=[chair, chair], lanes=[[0, 1, {}]], holes=None)
    result, building = imported(tmp_path, {"L1": floors})
    assert not building.objects
    assert result.notes.left == [
        "Level 'L1': door 'odd', as its type 'revolving' is none of hinged, double_hinged, sliding, "
        "double_sliding.",
        "Level 'L1': door 'flat', as it has no width.",
        "Level 'L1': 2 models: Chair (2).",
        "Level 'L1': 1 lane.",
    ]


def test_doors_of_one_name_are_all_taken_and_told_apart(tmp_path: Path) -> None:
    result, building = imported(
        tmp_path, {"L1": room([door(4, 5, "way", "hinged"), door(5, 4, "way", "hinged")])}
    )
    assert list(building.objects) == ["way", "way_2"]
    assert "Level 'L1': 2 doors: 2 hinged." in result.notes.taken
    assert "'way' is called 'way_2' in what was written." in result.notes.doubts


def test_measurements_that_contradict_each_other_are_told(tmp_path: Path) -> None:
    both = [edge(0, 1, distance=10.0), edge(1, 2, distance=9.0)]
    result, _ = imported(tmp_path, {"L1": room([], measurements=both)})
    assert any("a pixel is 18.00 to 20.00 mm" in doubt for doubt in result.notes.doubts)


def test_a_drawing_in_metres_needs_no_measurement_and_is_not_turned_over(tmp_path: Path) -> None:
    square = [[0.0, 0.0], [10.0, 0.0], [10.0, 5.0], [4.0, 0.0], [5.0, 0.0]]
    plan = level(square, walls=[edge(0, 3), edge(4, 1), edge(1, 2)], measurements=[])
    plan["doors"] = [door(3, 4, "d", "hinged")]
    _, building = imported(tmp_path, {"L1": plan}, coordinate_system="cartesian_meters")
    assert tip(building["d"], np.pi / 2) == pytest.approx([4, -1])
    assert outline(building.walls, 0.3)[..., 1].max() == pytest.approx(5.05)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"measurements": []}, "no measurement, so the size of its pixels is unknown"),
        ({"walls": [edge(0, 99)]}, "entry 1 of walls on level 'L1' names vertex 99"),
        ({"vertices": [["left", 1, 0, ""]]}, "can't be used"),
        ({"walls": []}, "holds no walls"),
    ],
)
def test_a_file_that_cannot_be_used_is_refused(
    tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    path = save(tmp_path, {"L1": room([]) | change})
    with pytest.raises(BuildingError, match=message):
        import_building(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_places_on_the_globe_are_refused(tmp_path: Path) -> None:
    path = save(tmp_path, {"L1": room([])}, coordinate_system="wgs84")
    with pytest.raises(BuildingError, match="cartesian_meters"):
        import_building(path, tmp_path / "out")


def test_an_earlier_import_is_replaced_only_when_asked_for(tmp_path: Path) -> None:
    path = save(tmp_path, {"L1": room([]), "L2": room([])})
    import_building(path, tmp_path / "out")
    with pytest.raises(BuildingError, match="--overwrite"):
        import_building(path, tmp_path / "out")
    import_building(path, tmp_path / "out", level="L1", overwrite=True)
    assert (tmp_path / "out" / "office_L1.urdf").is_file()
    (tmp_path / "out" / "notes.txt").write_text("mine")
    with pytest.raises(BuildingError, match=r"objstate didn't write .*notes\.txt"):
        import_building(path, tmp_path / "out", overwrite=True)
