"""Scan points lie where the beams ended, and the picture shows them there."""

from __future__ import annotations

import base64
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from objstate.building import load_building, outline
from objstate.editing.drives import picture, points_of
from objstate.geometry import FloatArray, transform
from objstate.run import RunOptions
from objstate.simulation import simulate
from tests.report.pages import ROOM, SCENE, make_result

HEIGHT = 0.3  # m


def test_the_picture_is_dark_where_points_lie() -> None:
    points = np.array([[1.0, 0.5]] * 20 + [[0.1, 1.9], [9.0, 9.0]])
    low, high = np.zeros(2), np.array([2.0, 2.0])
    shown = picture(points, low, high)
    assert shown is not None
    assert (shown.x, shown.y, shown.points) == (0.0, 0.0, 21)
    content = base64.b64decode(shown.url.partition(",")[2])
    alpha = np.asarray(Image.open(io.BytesIO(content)).convert("RGBA"))[..., 3]
    rows, columns = alpha.shape
    assert (columns * 0.02, rows * 0.02) == pytest.approx((shown.width, shown.height))
    assert alpha[rows - 1 - 25, 50] == 255  # rows count from the top
    assert 0 < alpha[rows - 1 - 95, 5] < 255
    assert np.count_nonzero(alpha) == 2
    assert picture(points[:0], low, high) is None


def share_on_walls(points: FloatArray, urdf: Path) -> float:
    """The share of points within 8 cm of a wall or a closed door."""
    from shapely import distance, multilinestrings
    from shapely import points as as_points

    building = load_building(urdf)
    shapes = [outline(building.walls, HEIGHT)]
    near = distance(multilinestrings(list(np.concatenate(shapes))), as_points(points)) < 0.08
    return float(near.mean())


def test_points_of_a_result_and_of_its_log_lie_on_the_walls(tmp_path: Path) -> None:
    result, told = make_result(tmp_path), list[str]()
    urdf = tmp_path / "room.urdf"
    kept = points_of([result], load_building(urdf), tell=told.append)
    assert len(kept) > 300
    assert share_on_walls(kept, urdf) > 0.6
    anew = points_of([tmp_path / "log" / "log.mcap"], load_building(urdf), tell=told.append)
    assert len(anew) > len(kept)
    assert share_on_walls(anew, urdf) > 0.6
    assert told == []


def test_a_result_of_another_building_is_told(tmp_path: Path) -> None:
    result, told = make_result(tmp_path), list[str]()
    other = tmp_path / "other"
    other.mkdir()
    moved = ROOM.replace('<origin xyz="2 2 0"/>', '<origin xyz="2.1 2 0"/>')
    (other / "room.urdf").write_text(moved)
    points_of([result], load_building(other / "room.urdf"), tell=told.append)
    assert told == [
        f"{result}: estimated in another building, {tmp_path / 'room.urdf'}. Does that have the "
        "same frame?"
    ]
    (tmp_path / "room.urdf").write_text(moved)  # edited since
    points_of([result], load_building(tmp_path / "room.urdf"), tell=told.append)
    assert len(told) == 1


def test_readings_off_all_walls_are_told(tmp_path: Path) -> None:
    result, told = make_result(tmp_path), list[str]()
    urdf = tmp_path / "room.urdf"
    building = load_building(urdf)
    aside = replace(building, walls=building.walls.moved(transform(np.eye(3), (0.6, 0.6, 0.0))))
    points_of([result], aside, tell=told.append)
    assert f"{result}: only " in told[-1]
    assert "Is the drive of this building" in told[-1]


def test_a_robot_that_was_lost_is_told(tmp_path: Path) -> None:
    (tmp_path / "room.urdf").write_text(ROOM)
    (tmp_path / "room.scene.yaml").write_text(SCENE)
    log, told = simulate(tmp_path / "room.scene.yaml", tmp_path / "log").log, list[str]()
    run = RunOptions(initial_pose=np.array([3.0, 1.0, 2.0]))
    points_of([log], load_building(tmp_path / "room.urdf"), run, tell=told.append)
    assert any(f"{log}: The robot was probably lost for" in each for each in told)
