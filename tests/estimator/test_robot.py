"""The robot's belief: when the filter is in use, and what it leaves behind."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Building
from objstate.config import Settings
from objstate.estimator.believed import Believed
from objstate.estimator.robot import TIGHT_M, Robot
from objstate.estimator.scenery import Scenery
from objstate.geometry import FloatArray
from objstate.sensing import BeamModel, Sensing
from tests.estimator.drives import corridor

CLOSE = np.diag([0.02, 0.02, 0.01]) ** 2
WIDE = np.diag([2.0, 2.0, 0.5]) ** 2
PLACE = corridor()


def robot(place: Building = PLACE, *, localizes: bool = True) -> Robot:
    chosen = Settings()
    sensing = Sensing(place, BeamModel(chosen.beam_model))
    scenery = Scenery(chosen, Believed(place, chosen, 0, {}))
    return Robot(chosen, sensing, scenery, 0, localizes=localizes)


def driven(one: Robot, *steps: FloatArray) -> Robot:
    for k, step in enumerate((np.zeros(3), *steps)):
        one.drive(step, k * 10**8)
    return one


def test_nothing_is_known_before_a_pose_is_told() -> None:
    one = driven(robot(), np.array([0.1, 0.0, 0.0]))
    assert one.belief is None
    assert one.odometry is not None


@pytest.mark.parametrize(("covariance", "is_tight"), [(CLOSE, True), (WIDE, False)])
def test_the_filter_begins_where_the_pose_is_known_to_centimetres(
    covariance: FloatArray, is_tight: bool
) -> None:
    one = robot()
    one.start(np.array([1.0, 2.0, 0.3]), covariance)
    assert one.is_tight == is_tight
    assert not one.follows_precisely(is_linear=False)
    assert one.follows_precisely(is_linear=True) == is_tight
    assert one.is_filtered == is_tight


def test_a_recorded_belief_is_not_filtered_and_moves_as_it_is() -> None:
    one = robot(localizes=False)
    one.start(np.array([1.0, 2.0, 0.0]), CLOSE)
    assert one.belief is not None
    before = one.belief.poses
    assert not driven(one, np.array([0.5, 0.0, 0.0])).follows_precisely(is_linear=True)
    ahead = 0.5 * np.column_stack([np.cos(before[:, 2]), np.sin(before[:, 2])])
    np.testing.assert_allclose(one.belief.poses[:, :2], before[:, :2] + ahead)


def test_samples_of_the_filter_follow_its_mean_and_outlast_it() -> None:
    one = robot()
    one.start(np.array([1.0, 2.0, 0.0]), CLOSE)
    assert one.follows_precisely(is_linear=True)
    assert one.belief is not None
    before = one.belief.mean
    driven(one, np.array([0.5, 0.0, 0.0]))
    after = one.belief.mean
    step = 0.5 * np.array([np.cos(before[2]), np.sin(before[2])])
    np.testing.assert_allclose(after[:2] - before[:2], step, atol=1e-6)
    assert one.belief.position_std < TIGHT_M
    one.leave_filter()
    assert not one.is_filtered
    np.testing.assert_array_equal(one.belief.mean, after)


def test_a_pose_that_is_told_replaces_the_filter_and_leaves_what_it_learnt() -> None:
    one = robot()
    one.start(np.array([1.0, 2.0, 0.0]), CLOSE)
    assert one.follows_precisely(is_linear=True)
    wall_std = one.wall_std
    one.start(np.array([7.0, 2.0, 0.0]), CLOSE)
    assert one.belief is not None
    assert one.belief.mean[0] == pytest.approx(7.0, abs=0.01)
    assert not one.is_filtered
    assert one.follows_precisely(is_linear=True)
    assert one.wall_std == pytest.approx(wall_std)
