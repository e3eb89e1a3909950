"""Shapes as cells (algorithms 3 and 4, eqs. 6.9 to 6.25)."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from objstate.errors import GridError
from objstate.geometry import FloatArray
from objstate.grid import (
    Drawing,
    Layout,
    beam,
    circle,
    ellipse,
    expected_occupancy,
    gaussian,
    polygon,
    rectangle,
    spread_of,
)

LAYOUT = Layout(0.1, 60, 80, np.array([-4.0, -3.0, 0.0]))
coordinates = st.floats(-2.9, 2.9)
yaws = st.floats(-math.pi, math.pi)


def printed_bresenham(x0: int, y0: int, x1: int, y1: int) -> list[tuple[int, int]]:
    """Algorithm 4 as printed."""
    steep = abs(y1 - y0) > abs(x1 - x0)
    if steep:
        x0, y0, x1, y1 = y0, x0, y1, x1
    if x0 > x1:
        x0, x1, y0, y1 = x1, x0, y1, y0
    dx, dy = x1 - x0, abs(y1 - y0)
    error, change, y = 0.0, dy / dx if dx else 0.0, y0
    cells = []
    for x in range(x0, x1 + 1):
        cells.append((y, x) if steep else (x, y))
        error += change
        if error >= 0.5:
            y += 1 if y0 < y1 else -1
            error -= 1.0
    return cells


def cells_of(drawing: Drawing) -> set[tuple[int, int]]:
    columns = drawing.layout.columns
    return {(int(k) % columns, int(k) // columns) for k in drawing.where}


@given(st.integers(0, 79), st.integers(0, 59), st.integers(0, 79), st.integers(0, 59))
def test_beams_are_algorithm_4(x0: int, y0: int, x1: int, y1: int) -> None:
    ends = LAYOUT.to_frame(np.array([[x0, y0], [x1, y1]]) + 0.5)
    drawn = cells_of(beam(LAYOUT, *ends, reach=100.0, obstacle=True))
    printed = set(printed_bresenham(x0, y0, x1, y1))
    assert len(drawn) == len(printed) == max(abs(x1 - x0), abs(y1 - y0)) + 1
    assert {(x0, y0), (x1, y1)} <= drawn
    forwards = x1 > x0 if abs(x1 - x0) >= abs(y1 - y0) else y1 > y0
    far = sorted([abs(x1 - x0), abs(y1 - y0)])
    if forwards and not any(
        (2 * i * far[0] + far[1]) % max(1, 2 * far[1]) == 0 for i in range(far[1])
    ):
        assert drawn == printed  # but for ties, where rounded sums of the printed one decide


def test_beams_count_less_with_the_distance() -> None:
    drawn = beam(LAYOUT, np.array([0.05, 0.05]), np.array([2.05, 0.05]), 4.0, obstacle=True)
    away = np.arange(21) * 0.1
    expected = 0.5 - 0.5 * (1.0 - away / 4.0)  # eq. (6.9)
    expected[-1] = 1.0 - expected[-1]
    assert drawn.values == pytest.approx(expected, abs=1e-6)
    free = beam(LAYOUT, np.array([0.05, 0.05]), np.array([2.05, 0.05]), 4.0, obstacle=False)
    assert (free.values < 0.5).all()


@given(coordinates, coordinates, st.floats(0.05, 2.0), st.floats(0.05, 2.0), yaws)
def test_ellipses_hold_the_cells_within_them(
    x: float, y: float, a: float, b: float, yaw: float
) -> None:
    drawn = ellipse(LAYOUT, np.array([x, y]), (a, b), yaw, 0.9)
    centre = np.floor(LAYOUT.to_cells(np.array([x, y]))) + 0.5
    away = LAYOUT.centres() - LAYOUT.to_frame(centre)
    along = away @ np.array([math.cos(yaw), math.sin(yaw)])
    across = away @ np.array([-math.sin(yaw), math.cos(yaw)])
    distance = np.hypot(along / a, across / b)  # eq. (6.13)
    drawn_cells = np.zeros(LAYOUT.size, dtype=bool)
    drawn_cells[drawn.where] = True
    differ = drawn_cells.reshape(LAYOUT.shape) != (distance <= 1.0)
    assert np.abs(distance[differ] - 1.0).max(initial=0.0) < 1e-6
    assert (drawn.values == np.float32(0.9)).all()


def test_a_circle_has_its_area() -> None:
    assert len(circle(LAYOUT, np.zeros(2), 2.0, 1.0).where) * 0.01 == pytest.approx(
        math.pi * 4.0, rel=0.02
    )


@given(coordinates, coordinates, st.floats(0.1, 0.8), st.floats(0.1, 0.8), yaws)
def test_gaussians_fall_with_the_mahalanobis_distance(
    x: float, y: float, a: float, b: float, yaw: float
) -> None:
    covariance = spread_of((a, b), yaw)
    drawn = gaussian(LAYOUT, np.array([x, y]), covariance, 0.9, share=0.8)
    assert drawn.values.max() == np.float32(0.9)
    least = 0.5 + 0.4 * math.exp(-chi2.ppf(0.8, 2) / 2.0)  # eq. (6.21)
    assert (drawn.values >= least - 1e-6).all()
    about_zero = gaussian(LAYOUT, np.array([x, y]), covariance, 1.0, share=0.8, about=0.0)
    assert about_zero.values == pytest.approx((drawn.values - 0.5) / 0.4, abs=1e-5)


def test_spreads_are_symmetric_and_turned() -> None:
    spread = spread_of((2.0, 1.0), math.pi / 2)
    assert spread == pytest.approx(np.diag([1.0, 4.0]))
    skew = spread_of((2.0, 1.0), 0.7)
    assert np.linalg.eigvalsh(skew) == pytest.approx([1.0, 4.0])
    assert skew @ np.array([math.cos(0.7), math.sin(0.7)]) == pytest.approx(
        4.0 * np.array([math.cos(0.7), math.sin(0.7)])
    )


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(coordinates, coordinates), min_size=3, max_size=8), yaws)
def test_polygons_hold_all_cells_that_they_touch(
    corners: list[tuple[float, float]], yaw: float
) -> None:
    hull = shapely.MultiPoint(corners).convex_hull
    if hull.geom_type != "Polygon" or hull.area < 1e-3:
        return
    layout = Layout(0.1, 60, 80, np.array([-4.0, -3.0, yaw / 10]))
    outline = shapely.get_coordinates(hull)[:-1]
    drawn = np.zeros(layout.size, dtype=bool)
    drawn[polygon(layout, outline, 1.0).where] = True
    corners_of = layout.centres().reshape(-1, 1, 2) + 0.05 * np.sqrt(2) * np.stack(
        [[np.cos(t), np.sin(t)] for t in layout.origin[2] + np.pi / 4 + np.pi / 2 * np.arange(4)]
    )
    squares = shapely.polygons(corners_of)
    assert drawn[shapely.intersects(squares, hull.buffer(-1e-9))].all()
    assert not drawn[~shapely.intersects(squares, hull.buffer(1e-9))].any()


def test_polygons_may_have_a_notch() -> None:
    u = np.array([[-2, -2], [2, -2], [2, 2], [1, 2], [1, -1], [-1, -1], [-1, 2], [-2, 2]], float)
    plane = polygon(LAYOUT, u * 0.97, 1.0).plane()
    at = LAYOUT.to_cells(np.array([[0.05, 1.05], [1.55, 1.05], [0.05, -1.55]])).astype(int)
    assert plane[at[:, 1], at[:, 0]].tolist() == [0.5, 1.0, 1.0]


def test_rectangles_lie_at_their_yaw() -> None:
    long = rectangle(LAYOUT, np.array([0.05, 0.05]), (2.0, 0.1), math.pi / 2, 1.0)
    assert {x for x, _ in cells_of(long)} == {40}
    assert len(long.where) == pytest.approx(21, abs=1)


def square(x: float, y: float, side: float) -> FloatArray:
    return np.array([[x, y], [x + side, y], [x + side, y + side], [x, y + side]])


def test_expected_occupancy_is_the_mass_of_footprints() -> None:
    outlines = [square(0.01, 0.01, 0.58), square(0.31, 0.01, 0.58)]
    drawn = expected_occupancy(LAYOUT, outlines, np.array([0.5, 0.3]))
    plane = drawn.plane(elsewhere=0.0)
    assert plane[32, 41] == np.float32(0.5)  # the first alone
    assert plane[32, 44] == np.float32(0.8)  # both, with 0.2 for its absence
    assert plane[32, 47] == np.float32(0.3)
    assert plane.sum() == pytest.approx(0.8 * 36)


def test_what_lies_off_the_grid_is_cut_off() -> None:
    for drawn in (
        circle(LAYOUT, np.array([100.0, 0.0]), 1.0, 1.0),
        polygon(LAYOUT, square(50.0, 50.0, 1.0), 1.0),
        beam(LAYOUT, np.array([10.0, 10.0]), np.array([11.0, 11.0]), 5.0, obstacle=True),
    ):
        assert not len(drawn.where)
    half = circle(LAYOUT, np.array([4.0, 0.0]), 1.0, 1.0)
    assert len(half.where) * 0.01 == pytest.approx(math.pi / 2, rel=0.1)


def test_scaled_values_say_less() -> None:
    drawn = circle(LAYOUT, np.zeros(2), 0.2, 0.9)
    assert drawn.scaled(0.5).values == pytest.approx(np.full(len(drawn.where), 0.7))
    assert drawn.scaled(0.5, about=0.0).values == pytest.approx(np.full(len(drawn.where), 0.45))


@pytest.mark.parametrize(
    ("draw", "told"),
    [
        (lambda: circle(LAYOUT, np.zeros(2), -1.0, 1.0), "semiaxis"),
        (lambda: circle(LAYOUT, np.array([math.nan, 0.0]), 1.0, 1.0), "not finite"),
        (lambda: beam(LAYOUT, np.zeros(2), np.ones(2), 0.0, obstacle=True), "reach"),
        (lambda: rectangle(LAYOUT, np.zeros(2), (math.inf, 1.0), 0.0, 1.0), "side"),
        (lambda: gaussian(LAYOUT, np.zeros(2), -np.eye(2), 1.0), "eigenvalues"),
        (lambda: gaussian(LAYOUT, np.zeros(2), np.array([[1, 2], [0, 1.0]]), 1.0), "symmetric"),
        (lambda: gaussian(LAYOUT, np.zeros(2), np.full((2, 2), np.nan), 1.0), "finite matrix"),
        (lambda: gaussian(LAYOUT, np.zeros(2), np.eye(2), 1.0, share=1.0), "share 1"),
        (lambda: expected_occupancy(LAYOUT, [np.eye(2)], np.ones(2)), "1 footprints"),
        (lambda: expected_occupancy(LAYOUT, [np.eye(2)], np.array([-1.0])), "not negative"),
    ],
)
def test_shapes_that_cant_be_are_refused(draw, told: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(GridError, match=told):
        draw()
