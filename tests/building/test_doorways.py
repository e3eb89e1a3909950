"""Doors that don't stand in a doorway are named, and no door that does."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from objstate.building import building_from_map, inspect_building, load_building
from objstate.building.model import MovableObject
from objstate.building.problems import find_problems
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, transform_from_pose

ROOT = Path(__file__).resolve().parents[2]
WEAN_HALL = ROOT.parent / "shared" / "data" / "wean-hall"
MODELS = sorted((ROOT / "models").glob("*/*.urdf"))
HEADER = "door,hinge_x,hinge_y,closed_bearing_deg,opens,width_m,upper_limit_deg\n"
HEIGHT = 0.3  # m, of the laser


def moved(x: float, y: float, yaw: float) -> Callable[[MovableObject], MovableObject]:
    """A door moved in the frame of its joint, in which the closed leaf lies along x."""

    def change(door: MovableObject) -> MovableObject:
        return replace(door, origin=door.origin @ transform_from_pose([x, y, yaw]))

    return change


def widened(door: MovableObject) -> MovableObject:
    scale = np.array([80.0, 1.0, 1.0])
    return replace(door, mesh=replace(door.mesh, vertices=door.mesh.vertices * scale))


SLIPS = {
    "a hinge 20 cm off its wall": moved(0.0, 0.2, 0.0),
    "a hinge 20 cm off its wall, on the other side": moved(0.0, -0.2, 0.0),
    "a hinge in the middle of a room": moved(0.0, 1.0, 0.0),
    "a bearing that is reversed": moved(0.0, 0.0, np.pi),
    "a bearing that is turned left": moved(0.0, 0.0, np.pi / 2),
    "a bearing that is turned right": moved(0.0, 0.0, -np.pi / 2),
    "a leaf of eighty times its width": widened,
}


@pytest.mark.parametrize("urdf", MODELS, ids=lambda path: path.stem)
def test_no_door_of_the_models_is_named(urdf: Path) -> None:
    assert find_problems(load_building(urdf), HEIGHT) == []


@pytest.mark.parametrize("urdf", MODELS, ids=lambda path: path.stem)
@pytest.mark.parametrize("slip", SLIPS)
def test_every_door_that_is_put_wrong_is_named(urdf: Path, slip: str) -> None:
    right = load_building(urdf)
    for name, door in right.objects.items():
        if door.kind.value != "hinged":
            continue
        objects = {**right.objects, name: SLIPS[slip](door)}
        problems = find_problems(replace(right, objects=objects), HEIGHT)
        assert any(f"'{name}'" in problem for problem in problems), name


def plan() -> np.ndarray:
    """Pixels of a corridor 6 m by 2 m whose upper wall has a doorway from x = 2 to 3 m."""
    image = np.full((100, 120), 254, dtype=np.uint8)
    image[[50, 90], :] = 0
    image[50, 40:60] = 254
    return image


def problems_of(folder: Path, *rows: str) -> list[str]:
    Image.fromarray(plan()).save(folder / "plan.pgm")
    (folder / "plan.yaml").write_text(
        "image: plan.pgm\nresolution: 0.05\norigin: [0, 0, 0]\noccupied_thresh: 0.65\n"
    )
    (folder / "doors.csv").write_text(HEADER + "".join(f"{row}\n" for row in rows))
    urdf = building_from_map(folder / "plan.yaml", folder / "doors.csv", folder / "out")
    return inspect_building(urdf).problems


@pytest.mark.parametrize(
    "row", ["a,2.0,2.475,0,ccw,0.95,110", "a,3.0,2.475,180,cw,0.9,90", "a,2.03,2.5,2,cw,1.0,90"]
)
def test_a_door_in_its_doorway_is_not_named(tmp_path: Path, row: str) -> None:
    assert problems_of(tmp_path, row) == []


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("a,2.0,2.475,180,cw,0.95,110", "turned by 180 degrees.*reversed"),
        ("a,3.0,2.475,3.14,cw,0.95,110", "with 3.14 rad instead of degrees"),
        ("a,2.0,2.475,90,cw,0.95,80", "free edge of 'a' is 0.9"),
        ("a,2.0,2.675,0,ccw,0.95,110", "hinge of 'a' is 0.2. m away"),
        ("a,2.0,2.275,0,ccw,0.95,110", "hinge of 'a' is 0.2. m away"),
        ("a,2.5,1.5,0,ccw,0.95,110", "hinge of 'a' is .* away from any wall"),
        ("a,2.0,2.475,0,ccw,1.5,110", "1.50 m long, but a wall stands 1.0"),
        ("a,2.0,2.475,0,ccw,0.5,110", "free edge of 'a' is 0.5"),
        ("a,2000,2475,0,ccw,0.95,110", "away from any wall"),
    ],
)
def test_a_row_that_fits_no_doorway_of_the_map_is_named(
    tmp_path: Path, row: str, message: str
) -> None:
    (problem,) = problems_of(tmp_path, row)
    assert re.search(message, problem), problem


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("a,2.0,2.475,0,ccw,80,110", r"80 m wide; .* \(0.8\?\)"),
        ("a,2.0,2.475,0,ccw,950,110", r"950 m wide; .* \(0.95\?\)"),
        ("a,2.0,2.475,0,ccw,0.95,1.57", r"instead of radians \(90\?\)"),
    ],
)
def test_numbers_in_another_unit_are_refused(tmp_path: Path, row: str, message: str) -> None:
    with pytest.raises(BuildingError, match=message):
        problems_of(tmp_path, row)


def test_two_leaves_that_meet_need_no_frame_between_them(tmp_path: Path) -> None:
    leaves = ["a,2.0,2.475,0,ccw,0.5,110", "b,3.0,2.475,180,cw,0.5,90"]
    assert problems_of(tmp_path, *leaves) == []


def test_a_leaf_beside_an_open_doorway_is_cleared_if_that_has_a_door(tmp_path: Path) -> None:
    def gap_behind(image: FloatArray) -> None:
        image[50, 40:60] = 0  # the door was closed when the map was made
        image[50, 20:39] = 254

    Image.fromarray(image := plan()).save(tmp_path / "plan.pgm")
    gap_behind(image)
    Image.fromarray(image).save(tmp_path / "shut.pgm")
    (tmp_path / "shut.yaml").write_text("image: shut.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    heard: dict[str, list[str]] = {}
    for name, rows in {
        "alone": ["a,2.0,2.475,0,ccw,0.95,110"],
        "both": ["a,2.0,2.475,0,ccw,0.95,110", "b,1.0,2.475,0,ccw,0.9,110"],
    }.items():
        (tmp_path / "doors.csv").write_text(HEADER + "".join(f"{row}\n" for row in rows))
        told = heard[name] = []
        building_from_map(
            tmp_path / "shut.yaml", tmp_path / "doors.csv", tmp_path / name, report=told.append
        )
    assert any("give the door behind its hinge" in line for line in heard["alone"])
    assert not any("behind its hinge" in line for line in heard["both"])
    assert inspect_building(tmp_path / "both" / "shut.urdf").problems == []


@pytest.mark.parametrize(
    ("deep", "in_map", "is_cleared"),
    [(3, "", True), (3, "0", True), (9, "", False), (9, "0", True)],
)
def test_a_closed_leaf_behind_its_wall_s_face_is_cleared(
    tmp_path: Path, deep: int, in_map: str, is_cleared: bool
) -> None:
    """Behind its hinge the map shows nothing up to another recess, as it would behind a doorway.

    Nobody drew the far face of the wall. Some cells deeper than walls are thick the leaf could close
    along another wall, unless the table was compared with the map.
    """
    image = plan()
    image[50 - deep, 40:60] = 0  # a closed leaf
    image[50 - deep : 50, [39, 60]] = 0  # between its jambs
    image[50 - deep : 50, [18, 21]] = 0  # another recess, with its leaf
    image[50 - deep, 18:22] = 0
    image[50, 19:21] = 254
    Image.fromarray(image).save(tmp_path / "plan.pgm")
    (tmp_path / "plan.yaml").write_text("image: plan.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    y = 2.475 + 0.05 * deep
    (tmp_path / "doors.csv").write_text(
        f"{HEADER.strip()},in_map_deg\na,2.0,{y},0,ccw,0.95,110,{in_map}\n"
    )
    told: list[str] = []
    building_from_map(
        tmp_path / "plan.yaml", tmp_path / "doors.csv", tmp_path / "out", report=told.append
    )
    (line,) = (each for each in told if "Door 'a'" in each)
    assert ("cells cleared" in line) == is_cleared


@pytest.mark.skipif(not WEAN_HALL.exists(), reason=f"no recorded map in {WEAN_HALL}")
@pytest.mark.parametrize(
    "doors", [WEAN_HALL / "doors.csv", ROOT / "benchmarks" / "wean_hall_doors.csv"]
)
def test_no_door_of_a_recorded_corridor_is_named(tmp_path: Path, doors: Path) -> None:
    urdf = building_from_map(WEAN_HALL / "wean.yaml", doors, tmp_path / "out")
    assert inspect_building(urdf).problems == []
