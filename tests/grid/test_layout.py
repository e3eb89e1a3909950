"""Where cells lie."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.errors import GridError
from objstate.geometry import compose
from objstate.grid import Layout

numbers = st.floats(-50.0, 50.0)


@given(numbers, numbers, st.floats(-3.0, 3.0), st.floats(0.01, 1.0), numbers, numbers)
def test_points_round_trip(
    x: float, y: float, yaw: float, resolution: float, px: float, py: float
) -> None:
    layout, point = Layout(resolution, 4, 5, np.array([x, y, yaw])), np.array([px, py])
    assert layout.to_frame(layout.to_cells(point)) == pytest.approx(point, abs=1e-9)
    by_pose = compose(layout.origin, np.array([2.5 * resolution, 0.5 * resolution, 0.0]))
    assert layout.centres()[0, 2] == pytest.approx(by_pose[:2], abs=1e-9)


@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=9), st.floats(0.02, 2.0))
def test_a_layout_around_points_holds_them(
    points: list[tuple[float, float]], resolution: float
) -> None:
    layout = Layout.around(np.array(points), resolution, margin=0.1)
    assert layout.within(layout.to_cells(np.array(points))).all()


@pytest.mark.parametrize(
    ("given_", "told"),
    [
        ((-0.05, 10, 10), "-0.05 m"),
        ((math.nan, 10, 10), "nan m"),
        ((0.0, 10, 10), "0 m"),
        ((0.05, 0, 10), "0 rows"),
        ((0.05, 10, 10, np.array([0.0, math.nan, 0.0])), "nan"),
        ((0.05, 10, 10, np.zeros(2)), "three finite"),
        ((0.05, 200_000, 200_000), "1e\\+04 m by 1e\\+04 m"),
    ],
)
def test_layouts_that_cant_be_are_refused(given_: tuple, told: str) -> None:  # type: ignore[type-arg]
    with pytest.raises(GridError, match=told):
        Layout(*given_)


def test_layouts_around_nothing_or_everything_are_refused() -> None:
    with pytest.raises(GridError, match="no points"):
        Layout.around(np.empty((0, 2)), 0.05)
    with pytest.raises(GridError, match="not finite"):
        Layout.around(np.array([[0.0, math.inf]]), 0.05)
    with pytest.raises(GridError, match="smaller extent"):
        Layout.around(np.array([[0.0, 0.0], [1e7, 1e7]]), 0.05)
    with pytest.raises(GridError, match="resolution above"):
        Layout.around(np.zeros((1, 2)), -1.0)


def test_other_frames_are_refused() -> None:
    with pytest.raises(GridError, match=r"'map'.*'odom'"):
        Layout(0.05, 2, 2).require_frame("odom")
