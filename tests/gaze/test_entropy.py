"""Entropies obey the laws of differential entropy, and agree with one another."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.config import Settings
from objstate.gaze.entropy import (
    belief_entropy,
    diagonal_entropy,
    gaussian_entropy,
    histogram_entropy,
    particle_filter_entropy,
)
from objstate.geometry import FloatArray
from objstate.objects import filter_for
from objstate.particles import Weights
from tests.rooms import door, table

scales = st.floats(0.01, 100.0)


@given(scales, scales)
def test_stretching_a_gaussian_adds_the_logarithm_of_the_stretch(a: float, b: float) -> None:
    covariance = np.array([[2.0, 0.3], [0.3, 1.0]])
    stretch = np.diag([a, b])
    stretched = stretch @ covariance @ stretch.T
    gained = gaussian_entropy(stretched) - gaussian_entropy(covariance)
    assert gained == pytest.approx(np.log(a * b), abs=1e-9)


def test_a_unit_gaussian_has_the_known_entropy() -> None:
    assert gaussian_entropy(np.eye(1)) == pytest.approx(0.5 * np.log(2 * np.pi * np.e))


@given(st.lists(scales, min_size=3, max_size=3))
def test_independent_coordinates_add_up(variances: list[float]) -> None:
    alone = sum(float(diagonal_entropy(np.array([each]))) for each in variances)
    assert diagonal_entropy(np.array(variances)) == pytest.approx(alone)
    assert gaussian_entropy(np.diag(variances)) == pytest.approx(alone)


def test_a_singular_covariance_has_no_entropy() -> None:
    with pytest.raises(ValueError, match="positive definite"):
        gaussian_entropy(np.zeros((2, 2)))


@given(st.integers(1, 50), scales)
def test_a_uniform_histogram_is_as_wide_as_it_is(count: int, cell: float) -> None:
    weights = np.full(count, 1.0 / count)
    assert histogram_entropy(weights, cell) == pytest.approx(np.log(count * cell))


def test_a_particle_filter_knows_as_much_as_a_kalman_filter() -> None:
    """Eq. (4) on a linear Gaussian model, for which eq. (3) is exact."""
    rng = np.random.default_rng(0)
    before, motion, noise, measured = 1.0, 0.5, 0.3, 0.4
    former = np.sqrt(before) * rng.standard_normal((3000, 1))
    states = former + np.sqrt(motion) * rng.standard_normal(former.shape)

    def transition(new: FloatArray, old: FloatArray) -> FloatArray:
        off = new[:, None, 0] - old[None, :, 0]
        return np.asarray(np.exp(-0.5 * off**2 / motion) / np.sqrt(2 * np.pi * motion))

    log_likelihood = -0.5 * (measured - states[:, 0]) ** 2 / noise
    log_likelihood -= 0.5 * np.log(2 * np.pi * noise)
    uniform = Weights.uniform(len(former))
    found = particle_filter_entropy(states, former, uniform, log_likelihood, transition)
    predicted = before + motion
    exact = gaussian_entropy(np.array([[predicted * noise / (predicted + noise)]]))
    assert found == pytest.approx(float(exact), abs=0.05)


def test_an_unseen_door_is_at_a_limit_or_as_uncertain_as_these_are_wide() -> None:
    item = door("door", 0.0, 0.0, limits=(0.0, 1.5))
    prior = filter_for(item, Settings()).prior(np.random.default_rng(0))
    limit = np.radians(5.0)
    uniform, ajar = 0.5 / 1.5, 0.05 / limit  # per rad; a sixth of the closed ones within 5 degrees
    expected = -uniform * (1.5 - limit) * np.log(uniform)
    expected -= (uniform + ajar) * limit * np.log(uniform + ajar)
    expected -= 0.25 * np.log(0.25 / limit) + 0.2 * np.log(0.2 / limit)
    assert belief_entropy(prior) == pytest.approx(expected, abs=0.03)


def test_unseen_furniture_is_as_uncertain_as_its_prior() -> None:
    prior = filter_for(table("desk", 0.0, 0.0), Settings()).prior(np.random.default_rng(0))
    spread = np.diag([0.2, 0.2, np.radians(15.0)]) ** 2
    assert belief_entropy(prior) == pytest.approx(float(gaussian_entropy(spread)), abs=0.15)
