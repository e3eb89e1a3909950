"""Meshes as boxes."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Mesh
from objstate.run.scene.solids import solids
from tests.rooms import block, fence


@pytest.mark.parametrize("yaw", [0.0, 0.3, 1.2, -2.0])
def test_boxes_come_back_as_they_are(yaw: float) -> None:
    first, second = block(1.0, 2.0, 3.0, 0.2, yaw), block(4.0, -1.0, 0.5, 0.5, 0.1)
    found = solids(Mesh.joined([first, second]))
    assert len(found) == 2
    assert sorted(found[0].size) == pytest.approx([0.2, 2.5, 3.0])
    assert found[0].place[:3, 3] == pytest.approx([1.0, 2.0, 1.25])
    corners = np.stack(np.meshgrid(*3 * [[-0.5, 0.5]]), axis=-1).reshape(-1, 3) * found[0].size
    placed = corners @ found[0].place[:3, :3].T + found[0].place[:3, 3]
    gaps = np.linalg.norm(placed[:, None] - first.vertices, axis=2)
    assert gaps.min(axis=1) == pytest.approx(0.0, abs=1e-6)


def test_boxes_that_touch_stay_apart() -> None:
    row = Mesh.joined([block(k, 0.0, 1.0, 1.0) for k in range(4)])
    assert [sorted(each.size) for each in solids(row)] == [pytest.approx([1.0, 1.0, 2.5])] * 4


def test_triangles_that_share_no_corners_are_joined_again() -> None:
    box = block(0.0, 0.0, 2.0, 1.0)
    apart = Mesh(
        box.vertices[box.faces].reshape(-1, 3), np.arange(3 * len(box.faces)).reshape(-1, 3)
    )
    (found,) = solids(apart)
    assert sorted(found.size) == pytest.approx([1.0, 2.0, 2.5])


def test_what_is_no_box_becomes_sheets_along_its_outline() -> None:
    corners = np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 4.0]])
    found = solids(fence(corners))
    assert sorted(each.size[0] for each in found) == pytest.approx([3.0, 4.0, 5.0])
    assert all(each.size[2] == pytest.approx(2.5) for each in found)


def test_nothing_is_nothing() -> None:
    assert solids(Mesh.empty()) == []
