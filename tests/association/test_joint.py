"""Joint association: which object is where, and how probably two were swapped."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.association import Joint, Motion, Readings

MOTION = Motion(starts=0.01, speed=0.5, acceleration=2.0)
PLACES = np.array([[-0.2, 0.0], [0.0, 0.0], [0.2, 0.0]])
SPACING, STEP, NOISE = 0.08, 1.0 / 30.0, 4e-6


def readings(places: np.ndarray) -> Readings:
    return Readings(places, np.tile(NOISE * np.eye(2), (len(places), 1, 1)))


def seen(joint: Joint, share: float = 0.98) -> np.ndarray:
    return np.full((*joint.tracks.chances.shape[:2], 2), share)


def moved(joint: Joint, places: np.ndarray, share: float = 0.98) -> Joint:
    joint = joint.predicted(STEP)
    return joint.updated(readings(places), seen(joint, share))


def test_the_order_of_readings_does_not_matter() -> None:
    joint = Joint.at(PLACES, 0.005, MOTION, SPACING)
    a, b = moved(joint, PLACES), moved(joint, PLACES[[2, 0, 1]])
    assert a.best.positions == pytest.approx(b.best.positions)
    assert a.weights == pytest.approx(b.weights)


def test_weights_and_identities_are_distributions() -> None:
    joint = Joint.at(PLACES, 0.15, MOTION, SPACING)  # anyone may be anywhere
    for _ in range(3):
        joint = moved(joint, PLACES)
    assert joint.weights.sum() == pytest.approx(1.0)
    assert (np.diff(joint.weights) <= 0.0).all()
    identities = joint.identities()
    assert identities.sum(axis=0) == pytest.approx(np.ones(3))
    assert identities.sum(axis=1) == pytest.approx(np.ones(3))
    assert joint.kept < 0.9


def test_what_is_known_equally_little_of_two_stays_even() -> None:
    middle = np.array([[-0.05, 0.0], [0.05, 0.0]])
    joint = Joint.at(np.zeros((2, 2)), 0.05, MOTION, SPACING)
    for _ in range(30):
        joint = moved(joint, middle)
    assert joint.identities() == pytest.approx(np.full((2, 2), 0.5), abs=1e-6)


def test_objects_that_cross_slowly_in_sight_keep_their_names() -> None:
    joint = Joint.at(PLACES[:2], 0.005, MOTION, SPACING)
    for angle in np.linspace(0.0, np.pi, 60):
        arc = 0.1 * np.array([np.cos(angle), np.sin(angle)])
        joint = moved(joint, np.array([-0.1, 0.0]) + np.stack([-arc, arc]))
    assert joint.best.positions == pytest.approx(PLACES[[1, 0]], abs=0.01)
    assert joint.kept > 0.999


def test_a_long_time_out_of_sight_leaves_doubt() -> None:
    joint = Joint.at(PLACES[:2], 0.005, Motion(starts=1.0, speed=0.5), SPACING)
    for _ in range(60):
        joint = joint.predicted(STEP)
        joint = joint.updated(readings(PLACES[:0]), seen(joint, 0.0))
    joint = moved(joint, PLACES[:2])
    assert 0.4 < joint.kept < 0.9


def test_a_reading_of_nothing_is_left_alone() -> None:
    joint = Joint.at(PLACES, 0.005, MOTION, SPACING)
    for _ in range(5):
        joint = moved(joint, np.vstack([PLACES, [[1.0, 1.0]]]))
    assert joint.best.positions == pytest.approx(PLACES, abs=1e-3)


def test_solid_objects_are_not_in_one_another() -> None:
    joint = Joint.at(PLACES[:2], 0.005, MOTION, SPACING)
    one = PLACES[:1] + 0.5 * (PLACES[1] - PLACES[0])
    for _ in range(10):
        joint = moved(joint, one, share=0.5)
    first, second = joint.best.positions
    assert np.hypot(*(first - second)) > SPACING


def test_what_went_out_of_sight_is_found_wherever_it_turns_up() -> None:
    joint, there = Joint.at(PLACES, 0.005, MOTION, SPACING), np.array([[1.5, 0.5]])
    for _ in range(3):  # two are seen; the last one is behind something
        joint = joint.predicted(STEP)
        joint = joint.updated(readings(PLACES[:2]), np.array([[[0.98] * 2, [0.98] * 2, [0.0] * 2]]))
    for _ in range(5):
        joint = moved(joint, np.vstack([PLACES[:2], there]))
    assert joint.best.positions == pytest.approx(np.vstack([PLACES[:2], there]), abs=0.005)
    assert joint.kept > 0.99


def test_what_was_just_seen_does_not_jump() -> None:
    joint = moved(Joint.at(PLACES, 0.005, MOTION, SPACING), PLACES)
    joint = moved(joint, np.vstack([PLACES[:2], [[1.5, 0.5]]]))
    assert joint.best.positions == pytest.approx(PLACES, abs=0.005)
