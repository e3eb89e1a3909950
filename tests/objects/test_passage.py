"""The passage of doors for robots with a length."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.shapes import Box
from objstate.objects.passage import clear_widths, lattice_clear_widths
from tests.rooms import door, placed, sliding_door

WIDTH = 0.9
ANGLES = np.linspace(0.0, np.pi, 61)[:, None]
WIDE_DOOR = door("door", 1.0, 2.0, bearing=0.7, limits=(0.0, np.pi))
SHEET = Box((WIDTH, 0.0001, 2.0)).mesh().moved(placed(WIDTH / 2, 0.0, 1.0))
THIN_DOOR = replace(WIDE_DOOR, mesh=SHEET)


def thin(angle: np.ndarray, length: float) -> np.ndarray:
    """The passage of a leaf without thickness, by the formula of the docstring."""
    disc = WIDTH * np.where(angle < np.pi / 2, np.sin(angle), 1.0)
    with np.errstate(divide="ignore"):
        blocked = np.minimum(WIDTH * np.cos(angle), length / np.tan(angle))
    return np.minimum(disc, WIDTH - np.where(angle < np.pi / 2, blocked, 0.0))


@settings(max_examples=40)
@given(st.floats(0.05, 3.0))
def test_a_rectangle_has_what_the_leaf_leaves_as_far_as_it_reaches(length: float) -> None:
    widths = clear_widths(THIN_DOOR, ANGLES, length)
    np.testing.assert_allclose(widths, thin(ANGLES[:, 0], length), atol=0.002)


@settings(max_examples=40)
@given(st.floats(0.0, 2.0), st.floats(0.0, 2.0))
def test_a_longer_robot_has_no_more_room(one: float, other: float) -> None:
    short, long = sorted((one, other))
    assert (clear_widths(WIDE_DOOR, ANGLES, long) <= clear_widths(WIDE_DOOR, ANGLES, short)).all()


def test_a_leaf_at_half_a_right_angle_stops_a_long_robot_but_no_disc() -> None:
    half = np.array([[np.pi / 4]])
    assert clear_widths(WIDE_DOOR, half)[0] == pytest.approx(0.62, abs=0.01)
    assert clear_widths(WIDE_DOOR, half, 0.8)[0] == pytest.approx(0.25, abs=0.01)


def test_a_door_that_opens_the_other_way_is_the_same() -> None:
    other = door("door", 0.0, 0.0, limits=(-np.pi, 0.0))
    np.testing.assert_allclose(
        clear_widths(other, -ANGLES, 0.7), clear_widths(WIDE_DOOR, ANGLES, 0.7), atol=1e-9
    )


def test_a_sliding_door_does_not_mind_the_length() -> None:
    rail, offsets = sliding_door("s", 0.0, 0.0), np.linspace(0.0, 0.9, 10)[:, None]
    np.testing.assert_array_equal(clear_widths(rail, offsets, 2.0), clear_widths(rail, offsets))


def test_remembered_widths_are_the_computed() -> None:
    kept = lattice_clear_widths(WIDE_DOOR, 0.0, np.pi, 61, 0.5)
    np.testing.assert_array_equal(kept, clear_widths(WIDE_DOOR, ANGLES, 0.5))
    with pytest.raises(ValueError, match="read-only"):
        kept[0] = 1.0
