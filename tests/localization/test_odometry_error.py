"""What the odometry is off by is learnt from how scans correct it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from objstate.config import LocalizationSettings, OdometryErrorSettings
from objstate.geometry import FloatArray, compose, square_root, wrap
from objstate.localization import OdometryError, PoseBelief
from objstate.localization.motion import motion_variances
from objstate.particles import Weights

MODEL = LocalizationSettings()
STEP = np.array([0.1, 0.0, 0.0])
NOTHING, EVERYTHING = np.zeros((3, 3)), np.ones(3)


def ahead(x: float, y: float, yaw: float) -> FloatArray:
    """What is off for each metre ahead."""
    return np.column_stack([[x, y, yaw], np.zeros((3, 2))])


def gaussian(mean: FloatArray, covariance: FloatArray) -> PoseBelief:
    """Few samples with exactly this mean and covariance."""
    off = np.sqrt(3.0) * square_root(covariance).T
    return PoseBelief(np.concatenate([mean + off, mean - off]), Weights.uniform(6))


@dataclass
class Robot:
    """A Kalman filter beside the truth: odometry that is off, and readings of some coordinates."""

    error: OdometryError
    rng: np.random.Generator
    systematic: FloatArray  # (3, 3) for each metre ahead, each to the left, each radian
    random: float  # its variance, as a factor on what the alphas say
    reading_std: FloatArray  # (3,)
    told: FloatArray  # (3,) which coordinates are read

    def __post_init__(self) -> None:
        self.truth, self.mean, self.covariance = np.zeros(3), np.zeros(3), np.diag([1e-4] * 3)

    def drive(self, step: FloatArray, steps: int) -> None:
        for _ in range(steps):
            variances = motion_variances(step, MODEL)
            noise = np.sqrt(self.random * np.array([variances.length, 0.0, variances.turn]))
            true_step = step + self.systematic @ step + noise * self.rng.standard_normal(3)
            self.truth = compose(self.truth, true_step)
            reckoned, variances = self.error.drive(step, variances)
            self.mean = compose(self.mean, reckoned)
            cos, sin = np.cos(self.mean[2]), np.sin(self.mean[2])
            turned = np.eye(3)
            turned[:2, 2] = -sin * reckoned[0], cos * reckoned[0]
            along = np.array([cos, sin, 0.0])
            self.covariance = turned @ self.covariance @ turned.T
            self.covariance += variances.length * np.outer(along, along)
            self.covariance[2, 2] += variances.turn
            self.read()

    def read(self) -> None:
        before = gaussian(self.mean, self.covariance)
        noise = np.diag(self.reading_std**2)
        reading = self.truth + self.reading_std * self.rng.standard_normal(3)
        seen = np.diag(self.told)
        gain = self.covariance @ seen @ np.linalg.inv(self.covariance + noise) @ seen
        off = reading - self.mean
        off[2] = wrap(off[2])
        self.mean = self.mean + gain @ off
        self.covariance = (np.eye(3) - gain) @ self.covariance
        self.error.note(before, gaussian(self.mean, self.covariance))


def robot(
    seed: int,
    systematic: FloatArray = NOTHING,
    random: float = 1.0,
    told: FloatArray = EVERYTHING,
) -> Robot:
    error, rng = OdometryError(OdometryErrorSettings()), np.random.default_rng(seed)
    return Robot(error, rng, systematic, random, np.full(3, 0.01), told)


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("random", [0.1, 1.0, 3.0])
def test_factors_come_to_what_the_odometrys_noise_is(seed: int, random: float) -> None:
    driven = robot(seed, random=random)
    driven.drive(STEP, 2000)
    length, turn = driven.error.factors
    assert random / 1.6 < length < 1.6 * random
    assert random / 1.6 < turn < 1.6 * random


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_what_is_off_for_each_metre_is_found_ahead_or_in_reverse(direction: float) -> None:
    systematic = ahead(-0.03, 0.02, 0.01)
    driven = robot(3, systematic, random=0.02)
    driven.drive(direction * STEP, 500)
    np.testing.assert_allclose(driven.error.systematic, systematic, atol=0.005)


def test_turns_and_ways_aside_are_off_by_themselves() -> None:
    """A gyro counts short, wheels slip sideways; what is driven ahead is off by neither."""
    systematic = np.diag([0.0, -0.05, 0.03])
    driven = robot(10, systematic, random=0.02)
    for step in ([0.0, 0.0, 0.1], [0.0, 0.1, 0.0], [0.1, 0.0, 0.0], [0.1, 0.0, 0.1]):
        driven.drive(np.array(step), 300)
    np.testing.assert_allclose(driven.error.systematic, systematic, atol=0.015)


@pytest.mark.parametrize("step", [[0.0, 0.0, 0.1], [0.0, 0.1, 0.0]])
def test_who_never_drives_ahead_learns_nothing_of_that(step: list[float]) -> None:
    driven = robot(11, np.diag([0.0, 0.0, 0.02]))
    driven.drive(np.array(step), 1000)
    assert np.abs(driven.error.systematic[:, 0]).max() < 0.003


def test_what_is_systematic_isnt_taken_for_noise() -> None:
    driven = robot(4, ahead(-0.03, 0.02, 0.0), random=0.1)
    driven.drive(STEP, 2000)
    assert driven.error.factors.length < 0.2


def test_scans_that_say_nothing_teach_nothing() -> None:
    """In an endless corridor, nothing corrects the way along it."""
    driven = robot(5, ahead(-0.05, 0.0, 0.0), random=0.0, told=np.array([0.0, 1.0, 1.0]))
    driven.drive(STEP, 400)
    assert 0.3 < driven.error.factors.length < 2.0
    assert abs(driven.error.systematic[0, 0]) < 0.01


def test_where_scans_see_half_half_is_learnt() -> None:
    """Corrections may be small because scans say little: then they were expected to be."""
    driven = robot(6, random=0.5)
    driven.reading_std = np.array([0.3, 0.01, 0.01])
    driven.drive(STEP, 4000)
    assert 0.3 < driven.error.factors.length < 0.9


def test_a_robot_that_stands_learns_nothing() -> None:
    driven = robot(7)
    driven.drive(STEP, 5)
    told = driven.error.factors, driven.error.systematic.tolist()
    for _ in range(200):
        driven.read()
    assert (driven.error.factors, driven.error.systematic.tolist()) == told


def test_a_start_that_was_told_wrong_isnt_the_odometrys_fault() -> None:
    driven = robot(8, random=0.05)
    driven.truth = np.array([0.4, 0.3, 0.0])
    driven.covariance = np.diag([0.09, 0.09, 0.01])
    driven.reading_std = np.array([0.2, 0.2, 0.05])
    driven.drive(STEP, 100)
    assert np.abs(driven.error.systematic[:2, 0]).max() < 0.02


def test_a_stretch_that_is_forgotten_teaches_nothing() -> None:
    driven = robot(9)
    driven.drive(STEP, 9)  # not a whole stretch yet
    driven.truth = driven.truth + np.array([5.0, 0.0, 0.0])
    driven.error.forget()
    driven.mean = driven.truth.copy()
    driven.drive(STEP, 50)
    assert driven.error.factors.length < 4.0
    assert abs(driven.error.systematic[0, 0]) < 0.1
