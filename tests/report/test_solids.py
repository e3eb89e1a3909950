"""The areas inside walls."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from objstate.building.model import Mesh
from objstate.report.solids import oriented_section, solid_areas, windings
from tests.rooms import block


def area(meshes: list[Mesh], height: float = 0.3) -> float:
    """What the even-odd rule fills of the rings."""
    found = shapely.Polygon()
    for ring in solid_areas(Mesh.joined(meshes), height):
        found = found.symmetric_difference(shapely.Polygon(ring))
    return float(found.area)


def test_boxes_that_overlap_are_one_area() -> None:
    assert area([block(0.0, 0.0, 4.0, 0.2)]) == pytest.approx(0.8)
    crossing = [block(0.0, 0.0, 4.0, 0.2), block(0.0, 0.0, 0.2, 4.0)]
    assert area(crossing) == pytest.approx(2 * 0.8 - 0.04)
    assert area([crossing[0], crossing[0]]) == pytest.approx(0.8)


def test_a_room_stays_empty() -> None:
    sides = [block(0.0, y, 4.2, 0.2) for y in (-2.0, 2.0)]
    sides += [block(x, 0.0, 0.2, 4.2) for x in (-2.0, 2.0)]
    assert area(sides) == pytest.approx(4.2**2 - 3.8**2)


def test_above_and_below_there_is_nothing() -> None:
    box = block(0.0, 0.0, 1.0, 1.0)
    for height in (box.vertices[:, 2].min() - 0.1, box.vertices[:, 2].max() + 0.1):
        assert solid_areas(box, float(height)) == []
    assert solid_areas(Mesh.empty(), 0.3) == []


def test_a_sheet_has_no_area() -> None:
    corners = np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 0.0, 2.0], [0.0, 0.0, 2.0]])
    assert solid_areas(Mesh(corners, np.array([[0, 1, 2], [0, 2, 3]])), 0.3) == []


def test_a_section_winds_once_about_what_is_inside() -> None:
    section = oriented_section(block(0.0, 0.0, 1.0, 1.0), 0.3)
    points = np.array([[0.1, 0.2], [0.7, 0.2], [-0.7, 0.2], [0.1, 0.9]])
    assert windings(points, section).tolist() == [1, 0, 0, 0]
