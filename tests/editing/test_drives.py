"""Scan points lie where the beams ended, and the picture shows them there."""

from __future__ import annotations

import base64
import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from objstate.building import load_building, outline
from objstate.editing.drives import picture, points_of
from objstate.geometry import FloatArray
from tests.report.pages import make_result

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
    result = make_result(tmp_path)
    urdf = tmp_path / "room.urdf"
    kept = points_of([result], load_building(urdf))
    assert len(kept) > 300
    assert share_on_walls(kept, urdf) > 0.6
    anew = points_of([tmp_path / "log" / "log.mcap"], load_building(urdf))
    assert len(anew) > len(kept)
    assert share_on_walls(anew, urdf) > 0.6
