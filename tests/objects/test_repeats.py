"""What repeats earlier readings."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given

from objstate.objects.repeats import NO_ENDS, Ends, counted, follow, shares, standing


def fresh(ends: Ends) -> np.ndarray:
    return shares(ends) / ends.times


ANGLES = np.linspace(-0.5, 0.5, 61)
DIRECTIONS = np.column_stack([np.cos(ANGLES), np.sin(ANGLES)])
ORIGINS = np.zeros_like(DIRECTIONS)
VARIANCE = 1e-4  # m^2
RANGE_MAX = 25.0  # m


def wall(distance: float) -> np.ndarray:
    return distance / np.cos(ANGLES)


def scans(*measured: np.ndarray) -> Ends:
    ends = NO_ENDS
    for each in measured:
        ends = follow(ends, ORIGINS, DIRECTIONS, each, VARIANCE, 0.0, RANGE_MAX)
    return ends


def test_a_surface_counts_once_however_often_it_is_seen() -> None:
    ends = scans(*[wall(2.0)] * 5)
    assert ends.times[1:-1] == pytest.approx(5.0, rel=0.1)
    once = fresh(scans(wall(2.0)))
    assert fresh(ends)[1:-1].sum() == pytest.approx(once[1:-1].sum() / 5.0, rel=0.1)


def test_a_surface_that_moved_counts_again() -> None:
    assert scans(wall(2.0), wall(2.5)).times == pytest.approx(1.0, abs=1e-3)


def test_the_tail_of_the_noise_is_no_other_surface() -> None:
    """A reading that is 2.5 deviations off a surface which was met in ten scans."""
    last = wall(2.0)
    last[30] += 2.5 * np.sqrt(2.0 * VARIANCE)
    assert scans(*[wall(2.0)] * 10, last).times[30] > 9.0


@pytest.mark.parametrize("step_deg", [0.5, 1.0, 2.0])
def test_a_surface_is_the_same_to_a_laser_whose_beams_meet_it_elsewhere(step_deg: float) -> None:
    """Every other scan uses the beams between those of the last one, and ranges have noise."""
    ends, rng, count = NO_ENDS, np.random.default_rng(0), 20
    for k in range(40):
        angles = np.radians(60.0 + step_deg * (np.arange(count) + 0.5 * (k % 2)))
        directions = np.column_stack([np.cos(angles), np.sin(angles)])
        measured = 2.0 / np.sin(angles) + 0.015 * rng.standard_normal(count)
        ends = follow(ends, np.zeros((count, 2)), directions, measured, 0.015**2, 0.0, RANGE_MAX)
    assert np.median(ends.times) > 10.0
    assert ends.times[[0, -1]].min() > 5.0  # also at both ends of what the laser sees


def test_what_appears_between_two_surfaces_was_not_met_before() -> None:
    """A wall at 2 m hides half of one at 5 m; then something stands where neither is seen."""
    before = np.where(np.arange(len(ANGLES)) < 30, wall(2.0), wall(5.0))
    after = before.copy()
    after[30:34] = [2.2, 2.5, 3.0, 3.5]
    times = scans(*[before] * 10, after).times
    assert times[[29, 35]].min() > 8.0
    assert times[30:34].max() < 1.5


@pytest.mark.parametrize("beam", [20, 30])
def test_a_thin_thing_is_the_same_to_the_one_beam_that_meets_it(beam: int) -> None:
    """A pole of 3 cm before a wall, met by a beam a little aside in each scan."""
    readings = [wall(5.0) for _ in range(10)]
    for each in readings:
        each[beam] = 2.0
    ends = NO_ENDS
    for turn, each in enumerate(readings):
        aside = 0.002 * turn - 0.01  # rad
        directions = np.column_stack([np.cos(ANGLES + aside), np.sin(ANGLES + aside)])
        ends = follow(ends, ORIGINS, directions, each, VARIANCE, 0.0, RANGE_MAX)
    assert ends.times[beam] > 5.0


def test_a_beam_beside_an_edge_tells_again_where_it_is() -> None:
    """A post at 1 m hides a part of what is behind, which is another wall in each scan."""
    post = (np.arange(len(ANGLES)) >= 25) & (np.arange(len(ANGLES)) <= 35)
    ends = scans(*[np.where(post, wall(1.0), wall(5.0 + 0.5 * k)) for k in range(10)])
    told = counted(ends, ORIGINS)
    assert ends.times[~post].max() < 1.1
    assert told[[24, 36]].min() > 6.0
    assert told[[23, 37]] == pytest.approx(ends.times[[23, 37]])  # they pass wall
    assert told[post] == pytest.approx(ends.times[post])  # it hides, and is hidden by nothing


@pytest.mark.parametrize("measured", [2.0, np.inf])
def test_one_beam_that_reads_the_same_again_repeats_itself(measured: float) -> None:
    ends = NO_ENDS
    for _ in range(10):
        ends = follow(
            ends, ORIGINS[:1], DIRECTIONS[:1], np.array([measured]), VARIANCE, 0.0, RANGE_MAX
        )
    assert ends.times[0] > 7.0


def test_beams_without_return_repeat_each_other_and_no_surface() -> None:
    empty = np.full(len(ANGLES), np.inf)
    ends = scans(wall(2.0), empty)
    assert ends.times == pytest.approx(1.0, abs=1e-3)
    assert not ends.returned.any()
    assert fresh(ends) == pytest.approx(1.0, abs=1e-3)
    assert scans(empty, empty, empty).times == pytest.approx(3.0, abs=0.2)
    assert scans(empty, wall(2.0)).times == pytest.approx(1.0, abs=1e-3)


def test_what_is_dense_counts_by_its_length() -> None:
    """The readings of a wall tell as much with three times as many beams."""
    angles = np.linspace(-0.5, 0.5, 181)
    directions = np.column_stack([np.cos(angles), np.sin(angles)])
    origins = np.zeros_like(directions)
    near = 0.5 / np.cos(angles)
    dense = fresh(follow(NO_ENDS, origins, directions, near, VARIANCE, 0.0, RANGE_MAX)).sum()
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


def test_what_stood_there_before_is_expected_to_stand_there() -> None:
    assert standing(scans(wall(2.0))) == pytest.approx(0.0)
    assert standing(scans(wall(2.0), wall(2.5))) == pytest.approx(0.0, abs=1e-3)
    again = standing(scans(wall(2.0), wall(2.0)))
    assert (again[1:-1] > 1.0).all()  # 1/m, more than a reading of anything unexpected
    assert np.isfinite(again).all()
