"""A map and a table of doors become a building that looks like the map, leaves aside."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from objstate.building import building_from_map, load_building, outline
from objstate.building.door_table import SENSE, Door, door_rows, read_doors
from objstate.building.model import Kind
from objstate.building.written import list_files
from objstate.errors import BuildingError
from objstate.geometry import BoolArray, FloatArray
from objstate.interchange import export_building

DATA = Path(__file__).resolve().parents[3] / "shared" / "data"
FREE, OCCUPIED, UNKNOWN = 254, 0, 205
RESOLUTION = 0.05
HEADER = "door,hinge_x,hinge_y,closed_bearing_deg,opens,width_m,upper_limit_deg\n"
WIDER = HEADER.replace("\n", ",upper_limit_m,type\n")
SHOWN = HEADER.replace("\n", ",in_map_deg\n")
HEIGHT = 0.3  # m, of the laser


def plan() -> np.ndarray:
    """Pixels of a corridor 6 m by 2 m whose upper wall has a doorway from x = 2 to 3 m."""
    image = np.full((60, 120), FREE, dtype=np.uint8)
    image[[10, 50], :] = OCCUPIED
    image[10, 40:60] = FREE
    return image


def save(folder: Path, pixels: np.ndarray, suffix: str = "pgm", **keys: object) -> Path:
    Image.fromarray(pixels).save(folder / f"plan.{suffix}")
    entries = {
        "image": f"plan.{suffix}",
        "resolution": RESOLUTION,
        "origin": [0.0, 0.0, 0.0],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    } | keys
    path = folder / "plan.yaml"
    path.write_text("".join(f"{k}: {v}\n" for k, v in entries.items() if v is not None))
    return path


def table(folder: Path, *rows: str) -> Path:
    path = folder / "doors.csv"
    path.write_text(HEADER + "".join(f"{row}\n" for row in rows))
    return path


def wall_segments(urdf: Path) -> FloatArray:
    return outline(load_building(urdf).walls, HEIGHT)


def distance_to_walls(urdf: Path, points: list[tuple[float, float]]) -> list[float]:
    from shapely import MultiLineString, Point

    walls = MultiLineString(list(wall_segments(urdf)))
    return [walls.distance(Point(point)) for point in points]


def test_a_corridor_becomes_a_few_faces_at_its_place(tmp_path: Path) -> None:
    urdf = building_from_map(save(tmp_path, plan()), None, tmp_path / "out", wall_height=3.0)
    building = load_building(urdf)
    assert urdf == tmp_path / "out" / "plan.urdf"
    assert not building.objects
    assert len(building.walls.faces) < 30
    assert np.ptp(building.walls.vertices[:, 2]) == pytest.approx(3.0)
    on, off = distance_to_walls(urdf, [(1.0, 2.475), (1.0, 1.5)])
    assert on < 1e-3
    assert off == pytest.approx(0.975, abs=1e-3)


def test_the_surface_is_the_edge_or_the_centre_of_the_cells(tmp_path: Path) -> None:
    source = save(tmp_path, plan())
    ys = {}
    for surface in ("edge", "centre"):
        urdf = building_from_map(source, None, tmp_path / surface, surface=surface)
        ys[surface] = np.unique(np.round(wall_segments(urdf)[..., 1], 4)).tolist()
    assert ys == {"edge": [0.45, 0.5, 2.45, 2.5], "centre": [0.475, 2.475]}


def test_the_origin_s_yaw_turns_the_map_about_its_corner(tmp_path: Path) -> None:
    source = save(tmp_path, plan(), origin=[10.0, -5.0, np.pi / 2])
    urdf = building_from_map(source, None, tmp_path / "out")
    (on,) = distance_to_walls(urdf, [(10.0 - 2.475, -5.0 + 1.0)])
    assert on < 1e-3


def test_a_door_hangs_at_its_hinge_and_opens_its_way(tmp_path: Path) -> None:
    doors = table(tmp_path, "left,2.0,2.475,0,ccw,0.95,110", "right,3,2.475,180,cw,0.5,90")
    building = load_building(building_from_map(save(tmp_path, plan()), doors, tmp_path / "out"))
    for name, state, tip in (
        ("left", 0.0, (2.95, 2.475)),
        ("left", np.pi / 2, (2.0, 3.425)),
        ("right", 0.0, (2.5, 2.475)),
        ("right", np.pi / 2, (3.0, 2.975)),
    ):
        door = building[name]
        width = door.mesh.vertices[:, 0].max()
        at = door.transforms(np.array([[state]]))[0] @ [width, 0, 0, 1]
        np.testing.assert_allclose(at[:2], tip, atol=1e-9)
    assert building["left"].upper == pytest.approx(np.radians(110))
    np.testing.assert_allclose(np.ptp(building["left"].mesh.vertices, axis=0), [0.95, 0.04, 2.0])


def draw(image: np.ndarray, start: tuple[float, float], end: tuple[float, float]) -> BoolArray:
    """Occupy the cells on a line in metres; returns which."""
    steps = np.linspace(start, end, 200)
    columns = np.floor(steps[:, 0] / RESOLUTION).astype(int)
    rows = len(image) - 1 - np.floor(steps[:, 1] / RESOLUTION).astype(int)
    drawn = np.zeros(image.shape, dtype=bool)
    drawn[rows, columns] = True
    image[drawn] = OCCUPIED
    return drawn


@pytest.mark.parametrize("opening", [0, 20, 45, 80, 110])
def test_a_leaf_baked_in_at_any_angle_is_cleared_and_the_walls_stay(
    tmp_path: Path, opening: float
) -> None:
    image, turn = plan(), np.radians(opening)
    image = np.pad(image, ((20, 0), (0, 0)), constant_values=FREE)  # a metre more above
    tip = (2.0 + 0.95 * np.cos(turn), 2.475 + 0.95 * np.sin(turn))
    draw(image, (2.0, 2.475), tip)
    doors = table(tmp_path, "door,2.0,2.475,0,ccw,0.95,110")
    heard: list[str] = []
    urdf = building_from_map(save(tmp_path, image), doors, tmp_path / "out", report=heard.append)
    middle = (2.0 + 0.6 * np.cos(turn), 2.475 + 0.6 * np.sin(turn))
    cleared, left, right = distance_to_walls(urdf, [middle, (1.9, 2.475), (3.025, 2.475)])
    assert cleared > 0.3
    assert left < 1e-3
    assert right < 1e-3
    assert any("Door 'door'" in line and "cleared" in line for line in heard)


def test_a_wall_behind_the_open_leaf_is_kept(tmp_path: Path) -> None:
    image = np.pad(plan(), ((40, 0), (0, 0)), constant_values=FREE)
    draw(image, (2.0, 2.475), (2.0, 4.4))  # a partition at 90 degrees, where the leaf stops
    doors = table(tmp_path, "door,2.0,2.475,0,ccw,0.95,90")
    heard: list[str] = []
    urdf = building_from_map(save(tmp_path, image), doors, tmp_path / "out", report=heard.append)
    (near,) = distance_to_walls(urdf, [(2.025, 3.0)])
    assert near < 0.03
    assert any("kept as a wall" in line for line in heard)


def test_a_wall_that_ends_at_the_swing_area_is_kept(tmp_path: Path) -> None:
    image = np.pad(plan(), ((40, 0), (0, 0)), constant_values=FREE)
    draw(image, (0.5, 3.0), (1.96, 3.0))  # meets the open leaf at a right angle from outside
    doors = table(tmp_path, "door,2.0,2.475,0,ccw,0.95,90")
    urdf = building_from_map(save(tmp_path, image), doors, tmp_path / "out")
    (near,) = distance_to_walls(urdf, [(1.9, 3.0)])
    assert near < 0.05


@pytest.mark.parametrize(("in_map", "wall_is_left", "leaf_is_left"), [
    ("", False, False), ("45", True, False), ("0", True, True),
])  # fmt: skip
def test_only_the_leaf_is_cleared_where_the_table_says_how_far_open_the_map_shows_it(
    tmp_path: Path, in_map: str, wall_is_left: bool, leaf_is_left: bool
) -> None:
    image = np.pad(plan(), ((40, 0), (0, 0)), constant_values=FREE)
    turn = np.radians(45.0)
    draw(image, (2.0, 2.475), (2.0 + 0.9 * np.cos(turn), 2.475 + 0.9 * np.sin(turn)))
    draw(image, (1.3, 2.8), (1.9, 2.8))  # a wall where the leaf would turn on to 180 degrees
    doors = tmp_path / "doors.csv"
    doors.write_text(f"{SHOWN}door,2.0,2.475,0,ccw,0.95,180,{in_map}\n")
    urdf = building_from_map(save(tmp_path, image), doors, tmp_path / "out")
    wall, leaf = distance_to_walls(urdf, [(1.6, 2.8), (2.4, 2.875)])
    assert (wall < 0.05) == wall_is_left
    assert (leaf < 0.05) == leaf_is_left


@pytest.mark.parametrize("angle", [0.05, 0.4, 0.785, 1.2])
def test_a_slanted_wall_is_followed_closely_and_without_bias(tmp_path: Path, angle: float) -> None:
    along, aside = (
        np.array([np.cos(angle), np.sin(angle)]),
        np.array([-np.sin(angle), np.cos(angle)]),
    )
    row, column = np.mgrid[0:160, 0:160][:, ::-1] + 0.5
    offset = np.stack([column, row], axis=-1) * RESOLUTION - [1.0, 1.0]
    strip = (offset @ along > 0) & (offset @ along < 5) & (np.abs(offset @ aside) < 0.1)
    source = save(tmp_path, np.where(strip, OCCUPIED, FREE).astype(np.uint8))
    urdf = building_from_map(source, None, tmp_path / "out", surface="edge")
    segments = wall_segments(urdf) - [1.0, 1.0]
    sides = segments[np.ptp(segments @ along, axis=1) > 1.0] @ aside  # (k, 2) of both ends
    assert len(sides) <= 4
    assert np.abs(np.abs(sides) - 0.1).max() < 0.75 * RESOLUTION
    assert abs(np.abs(sides).mean() - 0.1) < 0.25 * RESOLUTION


def test_speckle_goes_and_is_counted(tmp_path: Path) -> None:
    image = plan()
    image[30, 20] = image[30, 60] = image[30, 61] = OCCUPIED
    heard: list[str] = []
    urdf = building_from_map(save(tmp_path, image), None, tmp_path / "out", report=heard.append)
    assert min(distance_to_walls(urdf, [(1.0, 1.5), (3.0, 1.5)])) > 0.9
    assert "2 specks of fewer than 3 cells left out (3 cells)." in heard
    kept = building_from_map(
        save(tmp_path, image), None, tmp_path / "all", surface="edge", min_cells=1
    )
    assert max(distance_to_walls(kept, [(1.025, 1.475), (3.05, 1.475)])) <= 0.025 + 1e-6


def test_a_hole_in_a_thick_wall_adds_no_faces(tmp_path: Path) -> None:
    image = plan()
    image[48:53, :] = OCCUPIED
    solid = building_from_map(save(tmp_path, image), None, tmp_path / "solid")
    image[50, 30:32] = UNKNOWN
    holed = building_from_map(save(tmp_path, image), None, tmp_path / "holed")
    np.testing.assert_allclose(wall_segments(holed), wall_segments(solid))


@pytest.mark.parametrize(
    ("change", "keys"),
    [
        (lambda image: image, {}),
        (lambda image: 255 - image, {"negate": 1}),
        (lambda image: np.where(image == 0, 100, 0).astype(np.uint8), {"mode": "raw"}),
        (lambda image: image, {"mode": "scale"}),
        (lambda image: np.repeat(image[..., None], 3, axis=2), {}),
        (lambda image: np.dstack([image] * 3 + [np.full_like(image, 255)]), {"mode": "scale"}),
    ],
)
def test_every_way_of_writing_a_map_gives_the_same_walls(
    tmp_path: Path, change: object, keys: dict[str, object]
) -> None:
    image = plan()
    image[20:30, 70:80] = UNKNOWN
    source = save(tmp_path, change(image), suffix="png", **keys)  # type: ignore[operator]
    urdf = building_from_map(source, None, tmp_path / "out")
    plain = building_from_map(save(tmp_path, plan()), None, tmp_path / "plain")
    np.testing.assert_allclose(wall_segments(urdf), wall_segments(plain))


def test_plain_text_pgm_is_read(tmp_path: Path) -> None:
    source = save(tmp_path, plan())
    pixels = "\n".join(" ".join(map(str, row)) for row in plan())
    (tmp_path / "plan.pgm").write_text(f"P2\n# by hand\n120 60\n255\n{pixels}\n")
    walls = wall_segments(building_from_map(source, None, tmp_path / "out"))
    plain = building_from_map(save(tmp_path, plan()), None, tmp_path / "plain")
    np.testing.assert_allclose(walls, wall_segments(plain))


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ({"resolution": None}, "resolution: is required"),
        ({"resolution": 0}, "resolution: must be greater than or equal to 0.0001, not 0"),
        ({"origin": "[0, 0]"}, "origin"),
        ({"image": "other.pgm"}, "does not exist"),
        ({"image": "plan.yaml"}, "can't be read"),
        ({"mode": "colour"}, "mode: must be 'trinary', 'scale' or 'raw', not 'colour'"),
        ({"negate": 1, "occupied_thresh": 1.0}, "no occupied cell"),
    ],
)
def test_maps_that_cannot_be_used_are_refused(
    tmp_path: Path, keys: dict[str, object], message: str
) -> None:
    with pytest.raises(BuildingError, match=message):
        building_from_map(save(tmp_path, plan(), **keys), None, tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("", "lacks the columns 'door', 'hinge_x'"),
        (HEADER.replace("width_m", "width"), r"unknown column 'width' \(for 'width_m'\?\)"),
        (HEADER + "a,1,2,0,left,0.9,90\n", "line 2: door 'a' opens 'left'"),
        (HEADER + "a,1,2,0,cw,0.9,90\na,1,2,0,cw,0.9,90\n", "second time, in line 3"),
        (HEADER + "a,1,x,0,cw,0.9,90\n", "'x' in column 'hinge_y'"),
        (HEADER + 'a,"1,5",2,0,cw,0.9,90\n', "'1,5' in column 'hinge_x'.* with a point"),
        (HEADER + "a,1,nan,0,cw,0.9,90\n", "'nan' in column 'hinge_y'"),
        (HEADER + "a,1,2,0,cw,0.9\n", "line 2 must hold 7 values"),
        (HEADER + "a,1,2,0,cw,0.9,90,7\n", "line 2 must hold 7 values"),
        (HEADER + ",1,2,0,cw,0.9,90\n", "names no door"),
        (HEADER + "a,1,2,0,cw,-0.9,90\n", "width above 0"),
        (HEADER + "a,1,2,0,cw,0.9,0\n", "angle above 0"),
        (HEADER + "a,1,2,0,slides,0.9,90\n", "slides, but opens up to 90 degrees"),
        (WIDER + "a,1,2,0,slides,0.9,,30\n", "line 2 must hold 9 values"),
        (WIDER + "a,1,2,0,slides,0.9,,30,sliding\n", "slides by 30 m"),
        (WIDER + "a,1,2,0,slides,0.9,,x,sliding\n", "'x' in column 'upper_limit_m'"),
        (WIDER + "a,1,2,0,slides,0.9,,,hinged\n", "is hinged, but opens 'slides'"),
        (WIDER + "a,1,2,0,cw,0.9,90,0.5,hinged\n", "turns, but slides by 0.5 m"),
        (HEADER.replace("\n", ",width_m\n"), "has the column 'width_m' 2 times"),
        (WIDER + "a,1,2,0,cw,0.9,90,,sliding\n", "is sliding, but opens 'cw'"),
        (SHOWN + "a,1,2,0,cw,0.9,90,-5\n", "has -5 as in_map_deg; give an angle from 0 to 360"),
        (SHOWN + "a,1,2,0,slides,0.9,,30\n", "has 30 as in_map_deg; .* to a door that turns"),
    ],
)
def test_door_tables_that_cannot_be_used_are_refused(
    tmp_path: Path, content: str, message: str
) -> None:
    (tmp_path / "doors.csv").write_text(content)
    with pytest.raises(BuildingError, match=message):
        building_from_map(save(tmp_path, plan()), tmp_path / "doors.csv", tmp_path / "out")


@given(
    st.sampled_from(sorted(SENSE.values())), st.floats(-3.0, 3.0), st.floats(0.3, 2.0),
    st.floats(0.15, 1.5),
)  # fmt: skip
def test_a_table_says_what_it_was_written_of(
    sense: int, bearing: float, width: float, upper: float
) -> None:
    in_map = upper / 2.0 if sense else None
    door = Door("a", np.array([1.0, -2.0]), bearing, sense, width, upper, in_map=in_map)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "doors.csv"
        path.write_text(door_rows([door, Door("b", np.zeros(2), 0.0, 1, 0.9, 1.5)]))
        read, other = read_doors(path)
    assert (read.sense, other.sense, other.in_map) == (sense, 1, None)
    assert read.in_map == (None if in_map is None else pytest.approx(in_map, abs=1e-3))
    found = [*read.hinge, read.closed_bearing, read.width, read.upper]
    assert found == pytest.approx([1.0, -2.0, bearing, width, upper], abs=1e-4)


@pytest.mark.parametrize(("limit", "upper"), [("0.6", 0.6), ("", 0.9)])
def test_a_leaf_that_slides_is_cleared_where_it_closes(
    tmp_path: Path, limit: str, upper: float
) -> None:
    pixels = plan()
    pixels[10, 40:60] = OCCUPIED  # closed while it was mapped
    doors = tmp_path / "doors.csv"
    doors.write_text(f"{WIDER}slider,2.0,2.475,0,slides,0.9,,{limit},sliding\n")
    urdf = building_from_map(save(tmp_path, pixels), doors, tmp_path / "out")
    item = load_building(urdf)["slider"]
    assert (item.kind, item.lower, item.upper) == (Kind.SLIDING, 0.0, pytest.approx(upper))
    closed, opened = (item.mesh.moved(item.transforms(np.array([[s]]))[0]) for s in (0.0, upper))
    for mesh, begin in ((closed, 2.0), (opened, 2.0 - upper)):
        assert mesh.vertices[:, 0].min() == pytest.approx(begin)
        assert mesh.vertices[:, 0].max() == pytest.approx(begin + 0.9)
    through, beside = distance_to_walls(urdf, [(2.5, 2.475), (1.5, 2.475)])
    assert through > 0.3
    assert beside < 0.03


def test_improbable_candidates_are_no_doors_and_are_counted(tmp_path: Path) -> None:
    rows = "a,2,0.5,0,cw,0.9,90,0.5\nb,3,2.5,180,cw,0.9,90,0.49\nc,3,2.5,180,cw,0.9,90,0.054\n"
    (tmp_path / "doors.csv").write_text(HEADER.replace("\n", ",probability\n") + rows)
    told: list[str] = []
    urdf = building_from_map(
        save(tmp_path, plan()), tmp_path / "doors.csv", tmp_path / "out", report=told.append
    )
    assert list(load_building(urdf).objects) == ["a"]
    assert told[0] == "2 of 3 doors left out, as their probability is below 0.5."


def test_an_empty_table_gives_walls_alone(tmp_path: Path) -> None:
    urdf = building_from_map(save(tmp_path, plan()), table(tmp_path), tmp_path / "out")
    assert not load_building(urdf).objects


def test_only_an_earlier_building_is_overwritten_and_only_when_asked(tmp_path: Path) -> None:
    source, out = save(tmp_path, plan()), tmp_path / "out"
    building_from_map(source, None, out)
    with pytest.raises(BuildingError, match=r"exists already.*--overwrite"):
        building_from_map(source, None, out)
    building_from_map(source, None, out, wall_height=1.0, overwrite=True)
    assert np.ptp(load_building(out / "plan.urdf").walls.vertices[:, 2]) == pytest.approx(1.0)
    (out / "thesis.tex").write_text("years of work")
    with pytest.raises(BuildingError, match=r"objstate didn't write .*thesis\.tex"):
        building_from_map(source, None, out, overwrite=True)
    assert (out / "thesis.tex").exists()
    own = tmp_path / "own"
    own.mkdir()
    for name in ("plan.urdf", "drawn_by_hand.urdf"):
        (own / name).write_text("<robot/>")
    with pytest.raises(BuildingError, match=r"has no \.objstate\.json"):
        building_from_map(source, None, own, overwrite=True)
    assert len(list(own.iterdir())) == 2
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "out", "own", "plan.pgm", "plan.yaml",
    ]  # fmt: skip


@pytest.mark.parametrize("names", [("office.urdf", "walls.stl"), ("walls.stl",), ("doors.csv",)])
def test_files_of_others_are_never_overwritten(tmp_path: Path, names: tuple[str, ...]) -> None:
    own = tmp_path / "own"
    own.mkdir()
    for name in names:
        (own / name).write_text("<robot name='office'/>")
    with pytest.raises(BuildingError, match=r"has no \.objstate\.json"):
        building_from_map(save(tmp_path, plan()), None, own, overwrite=True)
    assert {path.name for path in own.iterdir()} == set(names)


def test_inputs_and_what_a_person_decided_are_never_overwritten(tmp_path: Path) -> None:
    source, out = save(tmp_path, plan()), tmp_path / "out"
    urdf = building_from_map(source, None, out)
    (out / "decisions.json").write_text('{"doors": []}')
    list_files(out)
    with pytest.raises(BuildingError, match=r"decisions\.json holds what a person decided"):
        building_from_map(source, None, out, overwrite=True)
    (out / "decisions.json").unlink()
    export_building(urdf, tmp_path / "map", "map")
    with pytest.raises(BuildingError, match=r"plan\.yaml lies in .*give another --out"):
        building_from_map(tmp_path / "map" / "plan.yaml", None, tmp_path / "map", overwrite=True)
    with pytest.raises(BuildingError, match=r"plan\.urdf lies in .*give another --out"):
        export_building(urdf, out, "map", overwrite=True)
    assert urdf.exists()


def test_a_building_without_a_list_of_its_files_is_known_by_its_urdf(tmp_path: Path) -> None:
    source, out = save(tmp_path, plan()), tmp_path / "out"
    building_from_map(source, None, out)
    (out / ".objstate.json").unlink()
    building_from_map(source, None, out, overwrite=True)
    (out / ".objstate.json").unlink()
    (out / "notes.txt").write_text("mine")
    with pytest.raises(BuildingError, match=r"objstate didn't write .*notes\.txt"):
        building_from_map(source, None, out, overwrite=True)


def test_door_names_need_no_care_in_the_urdf(tmp_path: Path) -> None:
    doors = table(tmp_path, '"Smith & Sons\' <back>",2.0,2.475,0,ccw,0.95,110')
    building = load_building(building_from_map(save(tmp_path, plan()), doors, tmp_path / "out"))
    assert list(building.objects) == ["Smith & Sons' <back>"]


@pytest.mark.parametrize(
    ("source", "doors", "most"),
    [
        ("wean-hall/wean.yaml", "wean-hall/doors.csv", 2700),
        ("olin-ac109-neato/ac109_1.yaml", None, 800),
        ("olin-mac-tb4/mac_1st_floor_final.yaml", None, 9500),
    ],
)
def test_recorded_maps_become_light_buildings(
    tmp_path: Path, source: str, doors: str | None, most: int
) -> None:
    if not (DATA / source).exists():
        pytest.skip(f"the recorded map {DATA / source} is not here")
    urdf = building_from_map(DATA / source, doors and DATA / doors, tmp_path / "out")
    building = load_building(urdf)
    assert len(building.objects) == (3 if doors else 0)
    assert len(building.walls.faces) < most  # a box for each cell: 76 476, 24 300 and 192 828


def test_lengths_and_surfaces_that_make_no_wall_are_refused(tmp_path: Path) -> None:
    source = save(tmp_path, plan())
    for wrong in (
        {"wall_height": 0.0},
        {"wall_height": float("nan")},
        {"door_height": 1e300},
        {"tolerance": -1.0},
        {"min_cells": -1},
        {"surface": "middle"},
    ):
        (name,) = wrong
        with pytest.raises(BuildingError, match=name):
            building_from_map(source, None, tmp_path / "out", **wrong)  # type: ignore[arg-type]


def test_a_map_far_from_the_origin_keeps_its_digits(tmp_path: Path) -> None:
    source = save(tmp_path, plan(), origin=[500_000.0, 5_000_000.0, 0.0])
    urdf = building_from_map(source, None, tmp_path / "out")
    (on,) = distance_to_walls(urdf, [(500_001.0, 5_000_002.475)])
    assert on < 1e-5
