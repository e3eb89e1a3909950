"""Walls follow the cells they stand for, with few corners and without gaps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from shapely import LinearRing, Polygon

from objstate.building.contours import border_loops, straighten
from objstate.geometry import BoolArray, FloatArray

TOLERANCE = 0.75  # cells


def wall_at(angle: float, length: float, thickness: float) -> BoolArray:
    """Cells whose middles lie in a strip through (10, 10) cells that rises by ``angle``."""
    row, column = np.mgrid[0:90, 0:90] + 0.5
    along = (column - 10) * np.cos(angle) + (row - 10) * np.sin(angle)
    aside = (row - 10) * np.cos(angle) - (column - 10) * np.sin(angle)
    return np.asarray((along >= 0) & (along <= length) & (aside >= 0) & (aside <= thickness))


@given(arrays(bool, (7, 9)))
@settings(max_examples=80)
def test_the_loops_enclose_exactly_the_occupied_cells(occupied: BoolArray) -> None:
    areas = np.array([Polygon(loop).area for loop in border_loops(occupied)])
    senses = np.array([LinearRing(loop).is_ccw for loop in border_loops(occupied)])
    # each of a loop's corners is cut by 1/8 cell: 1/2 lost in all, or won around a hole
    whole = np.where(senses, areas + 0.5, -(areas + 0.5))
    assert whole.sum() == pytest.approx(occupied.sum())


@given(st.floats(0.0, np.pi / 2), st.floats(2.0, 6.0))
@example(0.080078125, 4.5)  # where no two sides meet in one corner
@settings(max_examples=60)
def test_a_slanted_wall_becomes_its_true_line_and_few_corners(
    angle: float, thickness: float
) -> None:
    (loop,) = border_loops(wall_at(angle, 70.0, thickness))
    corners = straighten(loop, TOLERANCE, 0.0)
    assert len(corners) <= 10  # four sides, one seen as two; where two meet, a corner or an edge
    sides = np.roll(corners, -1, axis=0) - corners
    long = sides[np.linalg.norm(sides, axis=1) > 25]
    assert len(long) in (2, 3)  # rarely one side is seen as two
    turn = np.arctan2(long[:, 1], long[:, 0]) - angle
    bent = np.abs((turn + np.pi / 2) % np.pi - np.pi / 2)
    assert bent.max() < 1 / 25  # a cell on their length


@given(arrays(bool, (12, 12)), st.sampled_from([0.0, 0.5]))
@settings(max_examples=60)
def test_no_wall_strays_from_its_cells(occupied: BoolArray, inset: float) -> None:
    for loop in border_loops(occupied):
        corners = straighten(loop, TOLERANCE, inset)
        if len(corners) < 3:
            corners = np.repeat(corners, 2, axis=0)
        straight = LinearRing(corners)
        assert max(straight.distance(point) for point in as_points(loop)) < 3 * TOLERANCE + inset


def as_points(loop: FloatArray) -> list:
    from shapely import points

    return list(points(loop))


def test_a_rectangle_of_cells_comes_out_with_its_four_corners() -> None:
    occupied = np.zeros((20, 30), dtype=bool)
    occupied[5:9, 4:24] = True
    (loop,) = border_loops(occupied)
    expected = {(4, 5), (24, 5), (24, 9), (4, 9)}
    assert {tuple(map(round, corner)) for corner in straighten(loop, TOLERANCE, 0.0)} == expected


def test_faces_move_to_the_cells_centres_but_ends_of_walls_stay() -> None:
    occupied = np.zeros((20, 30), dtype=bool)
    occupied[5:9, 4:24] = True  # 20 by 4 cells
    (loop,) = border_loops(occupied)
    assert Polygon(straighten(loop, TOLERANCE, 0.5)).area == pytest.approx(20 * 3)


def test_a_wall_of_one_cell_survives_at_its_centre_and_its_full_length() -> None:
    occupied = np.zeros((20, 30), dtype=bool)
    occupied[7, 4:24] = True
    (loop,) = border_loops(occupied)
    corners = straighten(loop, TOLERANCE, 0.5)
    np.testing.assert_allclose(corners[:, 1], 7.5, atol=1e-9)
    assert np.ptp(corners[:, 0]) == pytest.approx(20.0, abs=0.6)


def test_cells_that_touch_at_a_corner_stay_joined() -> None:
    assert len(border_loops(np.eye(6, dtype=bool))) == 1


def test_a_room_has_an_outer_and_an_inner_loop() -> None:
    room = np.ones((10, 10), dtype=bool)
    room[2:8, 2:8] = False
    assert len(border_loops(room)) == 2
