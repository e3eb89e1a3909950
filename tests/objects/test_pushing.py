"""Furniture that is pushed: the velocity beside the errors, as one Kalman filter would have it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import FurnitureSettings
from objstate.objects import pushing
from objstate.objects.furniture_mixture import ORDER, FurnitureMixture, Piece
from objstate.objects.pushing import MOTION, Velocities
from tests.rooms import table

XY = np.ix_([0], [4, 5], [4, 5])


def started() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Place (1, 3), covariance (1, 7, 7) and columns (1, 10) of what begins to move."""
    covariance = np.zeros((1, 7, 7))
    covariance[0, ORDER, ORDER] = np.array([0.02, 0.03, 0.01]) ** 2
    velocity = Velocities(np.zeros((1, 2)), np.zeros((1, 2, 2)), 0.25 * np.eye(2)[None])
    return np.zeros((1, 3)), covariance, velocity.columns


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10**6), st.floats(0.02, 0.5))
def test_a_velocity_is_filtered_as_by_one_kalman_filter_over_place_and_velocity(
    seed: int, step: float
) -> None:
    rng = np.random.default_rng(seed)
    place, covariance, motions = started()
    mean, whole = np.zeros(4), np.zeros((4, 4))
    whole[:2, :2], whole[2:, 2:] = covariance[XY][0], 0.25 * np.eye(2)
    transition = np.block([[np.eye(2), step * np.eye(2)], [np.zeros((2, 2)), np.eye(2)]])
    noise = MOTION.dynamics(step)[1][1]
    for _ in range(5):
        pushing.advance(step, place, covariance, motions)
        mean, whole = transition @ mean, transition @ whole @ transition.T + noise
        assert place[0, :2] == pytest.approx(mean[:2], abs=1e-9)
        read, spread = rng.normal(0.0, 0.5, 2), np.diag(rng.uniform(0.001, 0.1, 2))
        gain = whole[:, :2] @ np.linalg.inv(whole[:2, :2] + spread)
        before, shift = covariance.copy(), np.zeros((1, 2))
        shift[0] = (gain @ (read - mean[:2]))[:2]
        mean, whole = mean + gain @ (read - mean[:2]), whole - gain @ whole[:2]
        place[:, :2] += shift
        covariance[XY] = whole[:2, :2]
        motions = pushing.corrected(motions, before, covariance, shift)
        velocity = Velocities.of(motions)
        assert velocity.mean[0] == pytest.approx(mean[2:], abs=1e-9)
        assert velocity.covariance[0] == pytest.approx(whole[2:, 2:], abs=1e-9)
        assert velocity.cross[0] == pytest.approx(whole[2:, :2], abs=1e-9)


def known(motion: str) -> FurnitureMixture:
    """A piece of which the place is known."""
    piece = Piece(
        table("trolley", 0.0, 0.0),
        FurnitureSettings.model_validate(
            {"motion": motion, "dynamics": {"moves_per_hour": 0.0, "drift_m": 0.0}}
        ),
    )
    mixture = FurnitureMixture.unknown(piece)
    weights = np.full(len(mixture.weights), 1e-30)
    weights[[0, 1]] = 0.05, 0.95
    return FurnitureMixture(piece, weights, *(
        mixture.places, mixture.robots, mixture.covariances, mixture.motions
    ))  # fmt: skip


@settings(max_examples=20, deadline=None)
@given(st.floats(0.01, 20.0))
def test_it_starts_and_stops_at_its_rates_and_absence_stays(seconds: float) -> None:
    later = known("pushed").later(seconds, np.eye(3), np.zeros((3, 3)), np.eye(3))
    assert later.weights.sum() == pytest.approx(1.0)
    assert later.presence == pytest.approx(0.95)
    assert later.p_moving == pytest.approx(MOTION.switches(seconds)[0, 1], rel=1e-6)
    twice = later.later(seconds, np.eye(3), np.zeros((3, 3)), np.eye(3))
    assert twice.p_moving == pytest.approx(MOTION.switches(2.0 * seconds)[0, 1], rel=0.01)


def test_what_is_only_carried_has_no_velocity() -> None:
    later = known("carried").later(1.0, np.eye(3), np.zeros((3, 3)), np.eye(3))
    assert later.motions.shape == (len(later.weights), 0)
    assert later.p_moving == 0.0
