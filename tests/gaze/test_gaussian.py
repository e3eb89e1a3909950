"""Gains along a way equal what the beliefs themselves gain when they are led along it."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.gaze.gaussian import PointBeliefs, gains_along, straight_ways
from objstate.gaze.sensors import Sensor
from objstate.geometry import FloatArray

SENSOR = Sensor("eye", range_min=0.4, range_max=2.0, field_of_view=np.radians(90.0), sigma=0.1)


def some_beliefs(seed: int, coordinates: int = 2) -> PointBeliefs:
    rng = np.random.default_rng(seed)
    means = rng.uniform(0.0, 5.0, (6, coordinates))
    return PointBeliefs(means, rng.uniform(0.01, 2.0, means.shape), rng.uniform(0.0, 0.01, 6))


def led_along(beliefs: PointBeliefs, way: FloatArray) -> tuple[float, float]:
    """Sum of the gains of all updates, and of what they leave at the end."""
    unseen, summed = beliefs, 0.0
    for pose in way:
        unseen, before = unseen.predicted(), beliefs.predicted()
        seen = SENSOR.sees(pose, beliefs.means[:, :2])
        beliefs = before.updated(seen, before.means, SENSOR.sigma**2)
        summed += float((before.entropies - beliefs.entropies).sum())
    return summed, float((unseen.entropies - beliefs.entropies).sum())


@given(st.integers(0, 10_000), st.sampled_from([2, 3]))
def test_the_compiled_gain_is_that_of_the_beliefs_led_along(seed: int, coordinates: int) -> None:
    beliefs = some_beliefs(seed, coordinates)
    start = np.random.default_rng(seed + 1).uniform(0.0, 5.0, 2)
    ways, lengths = straight_ways(start, beliefs.means[:, :2], 0.5)
    every = gains_along(beliefs, ways, lengths, SENSOR)
    at_end = gains_along(beliefs, ways, lengths, SENSOR, "at the end")
    for k, (way, length) in enumerate(zip(ways, lengths, strict=True)):
        assert (every[k], at_end[k]) == pytest.approx(led_along(beliefs, way[:length]), abs=1e-9)


def test_what_is_left_at_the_end_is_no_more_than_all_updates_gained() -> None:
    beliefs = some_beliefs(3)
    ways, lengths = straight_ways(np.zeros(2), beliefs.means, 0.2)
    every = gains_along(beliefs, ways, lengths, SENSOR)
    assert (gains_along(beliefs, ways, lengths, SENSOR, "at the end") <= every + 1e-9).all()
    assert every.max() > 1.0


@given(st.floats(0.05, 3.0), st.floats(-5.0, 5.0), st.floats(-5.0, 5.0))
def test_straight_ways_end_in_their_goals_by_equal_steps(stride: float, x: float, y: float) -> None:
    goal = np.array([[x, y]])
    ways, (length,) = straight_ways(np.zeros(2), goal, stride)
    assert ways[0, length - 1, :2] == pytest.approx(goal[0])
    places = np.vstack([np.zeros(2), ways[0, :length, :2]])
    steps = np.hypot(*np.diff(places, axis=0).T)
    assert (steps <= stride + 1e-9).all()
    assert steps[:-1] == pytest.approx(stride)


def test_a_measured_object_is_better_known_and_others_are_not() -> None:
    beliefs = some_beliefs(1)
    measured = np.array([True, False, False, False, False, False])
    after = beliefs.updated(measured, beliefs.means + 0.1, 0.01)
    assert after.entropies[0] < beliefs.entropies[0]
    assert (after.entropies[1:] == beliefs.entropies[1:]).all()
    assert (after.means[1:] == beliefs.means[1:]).all()
