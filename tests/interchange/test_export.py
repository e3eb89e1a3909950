"""What is exported means the same when it is read again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from objstate.building import building_from_map, inspect_building, load_building, outline
from objstate.building.door_table import Door
from objstate.building.leaves import hinged, sliding
from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.occupancy import read_map
from objstate.building.shapes import Cylinder
from objstate.building.writing import write_buildings
from objstate.errors import BuildingError
from objstate.geometry import FloatArray
from objstate.interchange import ExportOptions, export_building, import_building
from tests.rooms import placed, wall

HEIGHT = 0.3  # m


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A room of 6 m by 4 m, a door of each kind, and a round table."""
    walls = Mesh.joined(
        [
            wall((0, 0), (2, 0)),
            wall((3, 0), (6, 0)),
            wall((6, 0), (6, 4)),
            wall((6, 4), (5, 4)),
            wall((4, 4), (0, 4)),
            wall((0, 4), (0, 0)),
        ]
    )
    swings = Door("swings", np.array([3.0, 0.0]), np.pi, -1, 1.0, 1.2)
    table = MovableObject(
        "table",
        Kind.PLANAR,
        placed(1, 2, 0, (0, 0, 0.5)),
        np.array([0.0, 0.0, 1.0]),
        0.0,
        0.0,
        Cylinder(0.4, 0.7).mesh().moved(placed(0, 0, 0.35)),
    )
    items = [
        hinged(swings, 0.04, 2.0),
        sliding("slides", np.array([4.0, 4.0]), np.array([5.0, 4.0]), 0.04, 2.0),
        table,
    ]
    building = Building("room", walls, {item.name: item for item in items})
    return write_buildings(tmp_path_factory.mktemp("room") / "b", {".": building}, {})[0]


def shapes(building: Building, share: float) -> dict[str, FloatArray]:
    """Every object's corners (n, 3), sorted, when it is open by a share."""
    found = {}
    for item in building.objects.values():
        state = item.home if item.kind is Kind.PLANAR else np.array([share * item.upper])
        corners = item.mesh.moved(item.transforms(state[None])[0]).vertices
        found[item.name] = np.array(sorted(map(tuple, np.unique(np.round(corners, 4), axis=0))))
    return found


@pytest.mark.parametrize("share", [0.0, 0.7])
def test_an_sdf_world_is_the_same_building(urdf: Path, tmp_path: Path, share: float) -> None:
    notes = export_building(urdf, tmp_path / "sdf", "sdf")
    back = import_building(tmp_path / "sdf" / "room.sdf", tmp_path / "back").buildings[0]
    before, after = load_building(urdf), load_building(back)
    expected, found = shapes(before, share), shapes(after, share)
    assert found.keys() == expected.keys()
    for name in expected:
        assert found[name] == pytest.approx(expected[name], abs=2e-4)
    assert {o.name: (o.kind, o.lower, o.upper) for o in after.objects.values()} == {
        o.name: (o.kind, o.lower, o.upper) for o in before.objects.values()
    }
    assert np.sort(outline(after.walls, HEIGHT), axis=None) == pytest.approx(
        np.sort(outline(before.walls, HEIGHT), axis=None), abs=1e-5
    )
    assert notes.left == []


def test_an_rmf_building_has_the_same_doors(urdf: Path, tmp_path: Path) -> None:
    notes = export_building(urdf, tmp_path / "rmf", "rmf")
    path = tmp_path / "rmf" / "room.building.yaml"
    after = load_building(import_building(path, tmp_path / "back").buildings[0])
    before = load_building(urdf)
    for share in (0.0, 1.0):
        expected, found = shapes(before, share), shapes(after, share)
        assert found.keys() == {"swings", "slides"}
        for name, corners in found.items():
            middle = expected[name][:, :2].mean(axis=0)
            assert corners[:, :2].mean(axis=0) == pytest.approx(middle, abs=0.03)
    assert after["swings"].hinge == pytest.approx([3, 0], abs=1e-3)
    assert after["swings"].upper == pytest.approx(1.2)
    assert notes.left == ["'table', as furniture is a model of its own there."]


@pytest.mark.parametrize("thickness", [0.05, 0.1, 0.25])
def test_walls_and_doorways_of_an_rmf_building_are_as_wide_as_before(
    tmp_path: Path, thickness: float
) -> None:
    from shapely import MultiLineString, Point

    walls = Mesh.joined(
        [
            wall((0, 0), (2, 0), thickness),
            wall((3, 0), (6, 0), thickness),
            wall((6, 0), (6, 4), thickness),
            wall((6, 4), (0, 4), thickness),
            wall((0, 4), (0, 0), thickness),
        ]
    )
    items = [hinged(Door("swings", np.array([3.0, 0.0]), np.pi, -1, 1.0, 1.2), 0.04, 2.0)]
    building = Building("room", walls, {item.name: item for item in items})
    urdf = write_buildings(tmp_path / "b", {".": building}, {})[0]
    export_building(urdf, tmp_path / "rmf", "rmf")
    back = import_building(tmp_path / "rmf" / "room.building.yaml", tmp_path / "back")
    assert inspect_building(back.buildings[0]).problems == []
    after = MultiLineString(list(outline(load_building(back.buildings[0]).walls, HEIGHT)))
    thicker = max(0.0, 0.1 - thickness) / 2
    assert after.distance(Point(2.5, 0)) == pytest.approx(0.5, abs=2e-3)
    assert after.distance(Point(3, 2)) == pytest.approx(2 - thickness / 2 - thicker, abs=0.03)
    if thickness >= 0.1:
        assert after.distance(Point(3, 2)) == pytest.approx(2 - thickness / 2, abs=2e-3)


def test_a_range_that_open_rmf_has_otherwise_is_named(urdf: Path, tmp_path: Path) -> None:
    building = load_building(urdf)
    slides = replace(building["slides"], upper=0.6)
    own = write_buildings(tmp_path / "own", {".": building.with_object(slides)}, {})[0]
    doubts = export_building(own, tmp_path / "rmf", "rmf").doubts
    assert doubts[0] == "'slides' slides by 0.60 m, there by its width of 1.00 m."


def test_a_map_shows_walls_inside_and_outside(urdf: Path, tmp_path: Path) -> None:
    from PIL import Image

    notes = export_building(urdf, tmp_path / "map", "map")
    plan = read_map(tmp_path / "map" / "room.yaml")
    pixels = np.asarray(Image.open(tmp_path / "map" / "room.pgm"))[::-1]

    def at(x: float, y: float) -> int:
        column, row = np.floor((np.array([x, y]) - plan.origin[:2]) / plan.resolution).astype(int)
        return int(pixels[row, column])

    assert [at(1, 0), at(6, 2), at(0.04, 2)] == [0, 0, 0]  # walls, with what is within them
    assert [at(3, 1), at(2.5, 0.1), at(1, 2)] == [255, 255, 255]  # the room, its table left out
    assert at(-0.5, 2) == 128  # outside
    assert notes.left == ["3 objects, as they stand in the model."]


def test_a_map_becomes_the_same_walls_again(urdf: Path, tmp_path: Path) -> None:
    options = ExportOptions(resolution=0.02)
    export_building(urdf, tmp_path / "map", "map", options)
    back = building_from_map(tmp_path / "map" / "room.yaml", None, tmp_path / "back")
    from shapely import MultiLineString, Point

    before = MultiLineString(list(outline(load_building(urdf).walls, HEIGHT)))
    after = outline(load_building(back).walls, HEIGHT).reshape(-1, 2)
    assert max(before.distance(Point(point)) for point in after) < 0.03
    assert np.ptp(after, axis=0) == pytest.approx([6.1, 4.1], abs=0.03)


def test_objects_are_drawn_when_asked_for(urdf: Path, tmp_path: Path) -> None:
    export_building(urdf, tmp_path / "map", "map", ExportOptions(objects=True))
    plan = read_map(tmp_path / "map" / "room.yaml")
    column, row = np.floor((np.array([2.5, 0.0]) - plan.origin[:2]) / plan.resolution).astype(int)
    assert plan.occupied[row - 1 : row + 2, column].any()


def test_an_export_is_replaced_only_when_asked_for_by_any_format(
    urdf: Path, tmp_path: Path
) -> None:
    export_building(urdf, tmp_path / "out", "sdf")
    with pytest.raises(BuildingError, match="--overwrite"):
        export_building(urdf, tmp_path / "out", "sdf")
    for to in ("rmf", "map", "sdf"):
        export_building(urdf, tmp_path / "out", to, overwrite=True)
    import_building(tmp_path / "out" / "room.sdf", tmp_path / "back")
    export_building(urdf, tmp_path / "back", "map", overwrite=True)


def test_names_that_sdf_cannot_hold_are_changed_and_listed(urdf: Path, tmp_path: Path) -> None:
    building = load_building(urdf)
    swings = building["swings"]
    names = ["walls", "left/right", "left_right", "front_joint"]
    doors = {name: replace(swings, name=name) for name in names}
    named = write_buildings(tmp_path / "named", {".": replace(building, objects=doors)}, {})[0]
    notes = export_building(named, tmp_path / "sdf", "sdf")
    told = [each for each in notes.doubts if "is called" in each]
    assert [each.split(" in ")[0] for each in told] == [
        "'left/right' is called 'left_right'",
        "'left_right' is called 'left_right_2'",
    ]
    back = import_building(tmp_path / "sdf" / "room.sdf", tmp_path / "back")
    after = load_building(back.buildings[0])
    assert list(after.objects) == ["walls", "left_right", "left_right_2", "front_joint"]
    assert len(after.walls.faces) == len(building.walls.faces)


@pytest.mark.parametrize("to", ["sdf", "rmf", "map"])
def test_a_sidecar_is_not_taken_and_that_is_listed(urdf: Path, tmp_path: Path, to: str) -> None:
    building = load_building(urdf)
    own = write_buildings(
        tmp_path / "own", {".": building}, {".": "building_error: {wall_std_m: 0.03}\n"}
    )[0]
    left = export_building(own, tmp_path / to, to).left
    assert left[-1] == "room.building.yaml, as the format has no deviations."


@pytest.mark.parametrize(
    ("to", "name"),
    [
        ("map", "settings.yaml"),
        ("map", "mymap.pgm"),
        ("rmf", "office.building.yaml"),
        ("sdf", "walls.stl"),
    ],
)
def test_files_of_others_are_never_overwritten(
    urdf: Path, tmp_path: Path, to: str, name: str
) -> None:
    own = tmp_path / "own" / name
    own.parent.mkdir()
    own.write_text("mine")
    with pytest.raises(BuildingError, match="won't be overwritten"):
        export_building(urdf, own.parent, to, overwrite=True)
    own.unlink()
    export_building(urdf, own.parent, to, overwrite=True)
    own.with_name("notes.yaml").write_text("mine")
    with pytest.raises(BuildingError, match=r"objstate didn't write .*notes\.yaml"):
        export_building(urdf, own.parent, to, overwrite=True)
    assert own.with_name("notes.yaml").read_text() == "mine"


@pytest.mark.parametrize(
    ("to", "options", "message"),
    [
        ("dxf", ExportOptions(), "no format to export to"),
        ("map", ExportOptions(resolution=0.0), "The resolution is 0 m"),
        ("map", ExportOptions(height=9.0), "No wall is 9 m above the floor"),
        ("rmf", ExportOptions(height=9.0), "No wall is 9 m above the floor"),
    ],
)
def test_what_cannot_be_exported_is_an_error(
    urdf: Path, tmp_path: Path, to: str, options: ExportOptions, message: str
) -> None:
    with pytest.raises(BuildingError, match=message):
        export_building(urdf, tmp_path / "out", to, options)
    assert not (tmp_path / "out").exists()
