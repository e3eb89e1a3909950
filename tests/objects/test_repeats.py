"""What repeats earlier readings."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from objstate.objects.repeats import NO_ENDS, Ends, follow, fresh

ANGLES = np.linspace(-0.5, 0.5, 61)
DIRECTIONS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
ORIGINS = np.zeros_like(DIRECTIONS)
VARIANCE = 1e-4  # m^2


def wall(distance: float) -> np.ndarray:
    return distance / np.cos(ANGLES)


def scans(*measured: np.ndarray) -> Ends:
    ends = NO_ENDS
    for each in measured:
        ends = follow(ends, ORIGINS, DIRECTIONS, each, VARIANCE, 0.0)
    return ends


def test_a_surface_counts_once_however_often_it_is_seen() -> None:
    ends = scans(*[wall(2.0)] * 5)
    assert ends.times[1:-1] == pytest.approx(5.0, rel=0.1)
    once = fresh(scans(wall(2.0)))
    assert fresh(ends)[1:-1].sum() == pytest.approx(once[1:-1].sum() / 5.0, rel=0.1)


def test_a_surface_that_moved_counts_again() -> None:
    assert scans(wall(2.0), wall(2.5)).times == pytest.approx(1.0, abs=1e-3)


def test_beams_without_return_are_met_for_the_first_time() -> None:
    empty = np.full(len(ANGLES), np.inf)
    ends = scans(wall(2.0), empty)
    assert (ends.times == 1.0).all()
    assert np.isnan(ends.points).all()
    assert (fresh(ends) == 1.0).all()
    assert (scans(empty, wall(2.0)).times == 1.0).all()


def test_what_is_dense_counts_by_its_length() -> None:
    """The readings of a wall tell as much with three times as many beams."""
    angles = np.linspace(-0.5, 0.5, 181)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    origins = np.zeros_like(directions)
    near = 0.5 / np.cos(angles)
    dense = fresh(follow(NO_ENDS, origins, directions, near, VARIANCE, 0.0)).sum()
    sparse = fresh(scans(wall(0.5))).sum()
    assert dense == pytest.approx(sparse, rel=0.05)


@given(
    st.lists(
        st.lists(st.one_of(st.floats(0.05, 20.0), st.just(np.inf)), min_size=61, max_size=61),
        min_size=1,
        max_size=4,
    )
)
def test_no_beam_counts_more_than_once_and_none_for_nothing(ranges: list[list[float]]) -> None:
    ends = scans(*(np.array(each) for each in ranges))
    assert ((ends.times >= 1.0) & (ends.times <= len(ranges))).all()
    counted = fresh(ends)
    assert ((counted >= 0.0) & (counted <= 1.0)).all()
