"""Filters of objects that stand or move."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.association import Motion, Tracks

STANDS = Motion(walk=2.2e-4)
BOTH = Motion(starts=0.01, stops=1.0, speed=0.5, acceleration=1.0)
MOVES = Motion(starts=1.0, stops=0.0, speed=0.5, acceleration=1.0)
NOISE = np.eye(2) * 1e-6


def test_the_variance_of_what_stands_grows_with_time_alone() -> None:
    tracks = Tracks.at(np.zeros(2), 0.01, STANDS)
    once, often = tracks.predicted(3.0), tracks
    for _ in range(30):
        often = often.predicted(0.1)
    assert once.position_covariance == pytest.approx((1e-4 + 3.0 * 2.2e-4) * np.eye(2))
    assert often.position_covariance == pytest.approx(once.position_covariance)


def test_the_variance_of_what_moves_does_not_depend_on_the_steps() -> None:
    once = Tracks.at(np.zeros(2), 0.01, MOVES).predicted(1.0)
    often = Tracks.at(np.zeros(2), 0.01, MOVES)
    for _ in range(10):
        often = often.predicted(0.1)
    assert often.covariance == pytest.approx(once.covariance)


@pytest.mark.parametrize("velocity", [0.0, 0.4])
def test_the_mode_follows_from_the_readings(velocity: float) -> None:
    tracks = Tracks.at(np.zeros(2), 0.01, BOTH)
    for k in range(1, 16):
        tracks, _ = tracks.predicted(0.05).updated(np.array([velocity * 0.05 * k, 0.0]), NOISE)
    moving = tracks.chances[1]
    assert moving > 0.95 if velocity else moving < 0.05
    assert tracks.mean[2] == pytest.approx(velocity, abs=0.05)


def test_one_mode_is_a_kalman_filter() -> None:
    tracks, log = Tracks.at(np.zeros(2), 1.0, STANDS).updated(np.array([1.0, -1.0]), np.eye(2))
    assert tracks.positions == pytest.approx([0.5, -0.5])
    assert tracks.position_covariance == pytest.approx(0.5 * np.eye(2))
    assert log == pytest.approx(-np.log(4.0 * np.pi) - 0.5)


def test_covariances_stay_symmetric_and_positive() -> None:
    rng, tracks = np.random.default_rng(0), Tracks.at(np.zeros((3, 2)), 0.01, BOTH)
    for _ in range(300):
        tracks, _ = tracks.predicted(0.03).updated(0.01 * rng.standard_normal((3, 2)), NOISE)
    assert (np.linalg.eigvalsh(tracks.covariances) > 0.0).all()
    assert tracks.covariances == pytest.approx(np.swapaxes(tracks.covariances, -1, -2), abs=1e-12)
    assert tracks.chances.sum(axis=-1) == pytest.approx(np.ones(3))


def test_what_should_be_seen_and_is_not_speaks_against_a_mode() -> None:
    tracks = Tracks.at(np.zeros(2), 0.01, BOTH).predicted(1.0)
    after, log = tracks.unseen(np.array([0.9, 0.0]))
    assert after.chances[0] < tracks.chances[0]
    assert np.exp(log) == pytest.approx(1.0 - 0.9 * tracks.chances[0])


def test_corners_have_the_mean_and_the_spread() -> None:
    tracks = Tracks.at(np.array([1.0, 2.0]), 0.1, BOTH).predicted(0.2)
    corners = tracks.corners()
    assert corners.mean(axis=-2) == pytest.approx(tracks.means[:, :2])
    off = corners - tracks.means[:, None, :2]
    spread = np.einsum("mci,mcj->mij", off, off) / 5.0
    assert spread == pytest.approx(tracks.covariances[:, :2, :2])
