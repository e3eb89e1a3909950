"""What came of looking: confirmed, moved, lost or hidden."""

from dataclasses import replace

import numpy as np
import pytest

from objstate.estimator import Estimator
from objstate.gaze import Floor, Sensor, belief_entropy
from objstate.geometry import FloatArray, wrap
from objstate.maintenance import Expectation, Outcome, outcome, scattered
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from objstate.records import RobotBelief
from objstate.sensing import ExpectedRanges
from tests.gaze.places import chest, prior, surely, two_rooms
from tests.rooms import scan_of

ROOMS = two_rooms(chest("chest", 2.0, 1.0))
DOOR = surely(prior(ROOMS["door"]), 0.5)


def came_of(after: ObjectBelief, seen_ns: int | None) -> Outcome:
    return outcome(Expectation.of(DOOR), DOOR, replace(after, last_observed_ns=seen_ns))


def test_a_door_where_it_was_is_confirmed() -> None:
    assert came_of(surely(DOOR, 0.5), 1) is Outcome.CONFIRMED


def test_a_door_found_elsewhere_has_moved() -> None:
    assert came_of(surely(DOOR, 1.2), 1) is Outcome.MOVED


def test_a_door_that_is_nowhere_for_sure_is_lost() -> None:
    assert came_of(prior(ROOMS["door"]), 1) is Outcome.LOST


def test_what_no_beam_reached_is_hidden() -> None:
    assert came_of(surely(DOOR, 1.2), None) is Outcome.HIDDEN


def test_another_object_is_no_outcome() -> None:
    with pytest.raises(ValueError, match="'door' was expected"):
        outcome(Expectation.of(DOOR), DOOR, prior(ROOMS["chest"]))


def test_the_region_holds_95_percent() -> None:
    belief = prior(ROOMS["door"])
    assert Expectation.of(belief).share_inside(belief) >= 0.95
    spread = np.exp(-0.5 * ((belief.states[:, 0] - 0.7) / 0.1) ** 2)
    between = belief.with_weights(Weights.of(spread))
    assert Expectation.of(between).share_inside(between) == pytest.approx(0.95, abs=0.01)


def test_a_lost_object_could_be_anywhere_on_the_floor_and_keeps_its_name() -> None:
    floor = Floor.of(ROOMS)
    for name in ("chest", "door"):
        before = prior(ROOMS[name])
        lost = scattered(before, floor, np.random.default_rng(0))
        assert lost.item is before.item
        assert belief_entropy(lost) >= belief_entropy(before) - 1e-9
    lost = scattered(prior(ROOMS["chest"]), floor, np.random.default_rng(0))
    middle, width = np.array([0.0, 0.0]), np.array([8.0, 4.0])
    assert np.abs(lost.states[:, :2] - middle).max(axis=0) == pytest.approx(width / 2, abs=0.5)


@pytest.mark.parametrize("truth", [(2.2, 0.8, 0.2), (2.8, -1.0, 0.6), (1.5, -0.9, 1.2)])
def test_a_lost_object_is_the_same_object_when_it_is_seen_again(truth: tuple[float, ...]) -> None:
    before = prior(ROOMS["chest"])
    lost = replace(scattered(before, Floor.of(ROOMS), np.random.default_rng(1)), stamp_ns=0)
    found = seen_from(
        lost,
        np.array(truth),
        np.array([[0.8, 0.0, 0.0], [1.2, 0.3, -0.4], [2.2, 0.1, 0.0], [1.6, 0.4, -0.8]]),
    )
    assert found.item is before.item
    assert found.is_certain
    off = found.item.symmetry.nearest(found.mean[None], truth[2])[0] - truth
    assert np.abs(off[:2]).max() < 0.08
    assert abs(wrap(off[2])) < 0.15
    assert outcome(Expectation.of(lost), lost, found) is Outcome.CONFIRMED  # it could be anywhere


def seen_from(belief: ObjectBelief, truth: FloatArray, poses: FloatArray) -> ObjectBelief:
    """The belief after a robot that knows where it is has looked from some poses (k, 3)."""
    laser, rng, stamp = Sensor("laser", sigma=0.02), np.random.default_rng(0), 0
    name = belief.item.name
    estimator = Estimator(ROOMS, seed=0, belief="recorded", beliefs={name: belief})
    states = {other: item.home for other, item in ROOMS.objects.items()} | {name: truth}
    for pose in poses:
        estimator.feed(RobotBelief(stamp, pose[None], np.ones(1)))
        exact = ExpectedRanges(ROOMS).scene(states, pose[None], laser.rays())[0]
        for _ in range(5):
            stamp += 10**8
            ranges = exact + laser.sigma * rng.standard_normal(len(exact))
            estimator.feed(scan_of(ranges, laser.rays(), stamp_ns=stamp))
    return estimator.objects[name]
