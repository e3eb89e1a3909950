"""Laws of the odometry motion model."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.config import LocalizationSettings
from objstate.geometry import (
    FloatArray,
    between,
    compose,
    wrap,
)
from objstate.localization import PoseBelief
from objstate.localization.motion import motion_variances, sample_motion
from objstate.particles import Weights

NOISELESS = LocalizationSettings(alpha1=0, alpha2=0, alpha3=0, alpha4=0)
COUNT = 6000

poses = st.tuples(st.floats(-50, 50), st.floats(-50, 50), st.floats(-3, 3)).map(np.array)
steps = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(-1, 1)).map(np.array)


def spread(samples: FloatArray) -> FloatArray:
    """(3,) standard deviations."""
    return np.sqrt(np.diag(PoseBelief(samples, Weights.uniform(len(samples))).covariance))


def driven(step: FloatArray, times: int, settings: LocalizationSettings, seed: int) -> FloatArray:
    rng, samples = np.random.default_rng(seed), np.zeros((COUNT, 3))
    for _ in range(times):
        samples = sample_motion(samples, step, motion_variances(step, settings), rng)
    return samples


@given(poses, steps)
def test_without_noise_every_sample_moves_as_the_odometry_did(
    pose: FloatArray, step: FloatArray
) -> None:
    samples = np.stack([pose, -pose, np.zeros(3)])
    moved = sample_motion(
        samples, step, motion_variances(step, NOISELESS), np.random.default_rng(0)
    )
    expected = compose(samples, step)
    np.testing.assert_allclose(moved[:, :2], expected[:, :2], atol=1e-9)
    np.testing.assert_allclose(wrap(moved[:, 2] - expected[:, 2]), 0.0, atol=1e-9)


@pytest.mark.parametrize(
    "step", [[0.3, 0.0, 0.0], [-0.3, 0.0, 0.05], [0.0, 0.2, 0.0], [0.1, 0.0, -0.4]]
)
def test_the_mean_is_the_step(step: list[float]) -> None:
    start = np.array([3.0, -2.0, 2.0])
    rng = np.random.default_rng(1)
    variances = motion_variances(np.array(step), LocalizationSettings())
    moved = sample_motion(np.tile(start, (40_000, 1)), np.array(step), variances, rng)
    mean = PoseBelief(moved, Weights.uniform(40_000)).mean
    error = 5 * spread(moved) / 200
    # turning noise draws the mean position back: by its variance, half of it at most
    error[:2] += 0.5 * np.hypot(*step[:2]) * spread(moved)[2] ** 2
    assert (np.abs(between(start, mean) - np.array(step)) <= error + 1e-9).all()


@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_the_spread_after_a_drive_does_not_depend_on_the_odometrys_rate(turn: float) -> None:
    """2 m at 0.7 m/s are 3 s, at less than 2 Hz or at 50 Hz."""
    settings = LocalizationSettings()
    slow, fast = (
        driven(np.array([2.0, 0.0, turn]) / count, count, settings, count) for count in (5, 150)
    )
    np.testing.assert_allclose(spread(slow), spread(fast), rtol=0.08)


def test_two_equal_steps_spread_as_much_as_both_at_once_while_short() -> None:
    settings = LocalizationSettings()
    step = np.array([settings.update_min_d, 0.0, 0.0])
    once, twice = driven(step, 1, settings, 0), driven(step / 2, 2, settings, 1)
    np.testing.assert_allclose(spread(once)[[0, 2]], spread(twice)[[0, 2]], rtol=0.05)


def test_the_deviations_are_amcls_at_the_length_for_which_the_alphas_are_meant() -> None:
    """Two turns of variance alpha2 d^2 / 2 each, and a length of variance alpha3 d^2."""
    settings = LocalizationSettings(alpha1=0, alpha2=0.03, alpha3=0.02, alpha4=0)
    length = settings.update_min_d
    moved = driven(np.array([length, 0.0, 0.0]), 1, settings, 2)
    along, _, yaw = spread(moved)
    assert yaw == pytest.approx(np.sqrt(0.03) * length, rel=0.05)
    assert along == pytest.approx(np.sqrt(0.02) * length, rel=0.05)


@pytest.mark.parametrize(
    ("alpha", "step", "grows"),
    [
        ("alpha1", [0.0, 0.0, 0.3], 2),
        ("alpha2", [0.3, 0.0, 0.0], 2),
        ("alpha3", [0.3, 0.0, 0.0], 0),
        ("alpha4", [0.0, 0.0, 0.3], 0),
    ],
)
def test_each_alpha_spreads_what_it_is_named_for(alpha: str, step: list[float], grows: int) -> None:
    spreads = [
        spread(driven(np.array(step), 5, NOISELESS.model_copy(update={alpha: value}), 3))
        for value in (0.0, 0.02, 0.08)
    ]
    assert spreads[0].max() < 1e-9
    assert spreads[2][grows] == pytest.approx(2 * spreads[1][grows], rel=0.1)


def test_driving_backwards_spreads_as_much_as_driving_forwards() -> None:
    settings = LocalizationSettings()
    forwards = driven(np.array([0.1, 0.0, 0.0]), 20, settings, 4)
    backwards = driven(np.array([-0.1, 0.0, 0.0]), 20, settings, 5)
    assert backwards[:, 0].mean() == pytest.approx(-forwards[:, 0].mean(), abs=0.02)
    np.testing.assert_allclose(spread(backwards), spread(forwards), rtol=0.08)


def test_the_same_seed_gives_the_same_samples() -> None:
    step, settings = np.array([0.1, 0.0, 0.1]), LocalizationSettings()
    np.testing.assert_array_equal(driven(step, 3, settings, 7), driven(step, 3, settings, 7))
