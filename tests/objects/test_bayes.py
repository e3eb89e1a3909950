"""Eqs. (8) and (9) of Schulz and Burgard 2001, against sums and products written out."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import DoorSettings
from objstate.geometry import FloatArray
from objstate.objects.bayes import marginal_log_likelihood
from objstate.objects.doors import LatticeFilter
from objstate.particles import Weights
from tests.objects.views import evidence_by
from tests.rooms import door


def posterior_written_out(
    likelihood: list[list[float]], prior: list[float], robot: list[float]
) -> list[float]:
    """p(s | o) = sum_l p(o | s, l) p(s) p(l) / p(o | l), p(o | l) = sum_s p(o | s, l) p(s)."""
    posterior = []
    for s, prior_of_s in enumerate(prior):
        total = 0.0
        for row, weight in zip(likelihood, robot, strict=True):
            evidence = 0.0
            for each, prior_of_each in zip(row, prior, strict=True):
                evidence += each * prior_of_each
            total += row[s] * prior_of_s * weight / evidence
        posterior.append(total)
    return posterior


def tables(seed: int, robots: int, states: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    rng = np.random.default_rng(seed)
    likelihood = np.exp(rng.normal(0.0, 3.0, (robots, states)))
    return likelihood, rng.dirichlet(np.ones(states)), rng.dirichlet(np.ones(robots))


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 6), st.integers(1, 9))
def test_the_posterior_is_the_one_written_out(seed: int, robots: int, states: int) -> None:
    likelihood, prior, robot = tables(seed, robots, states)
    expected = posterior_written_out(likelihood.tolist(), prior.tolist(), robot.tolist())
    assert math.fsum(expected) == pytest.approx(1.0)  # each robot sample's votes sum to its weight
    weights = Weights.of(prior)
    marginal = marginal_log_likelihood(np.log(likelihood), weights, Weights.of(robot))
    after, evidence = weights.reweight(marginal)
    np.testing.assert_allclose(after.values, expected, rtol=1e-9)
    assert evidence == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000), st.floats(-1000.0, 1000.0))
def test_a_factor_on_all_of_a_robot_samples_likelihoods_changes_nothing(
    seed: int, factor: float
) -> None:
    likelihood, prior, robot = tables(seed, 4, 6)
    weights, robot_weights = Weights.of(prior), Weights.of(robot)
    log_likelihood = np.log(likelihood)
    scaled = log_likelihood + factor * np.arange(4)[:, None]
    np.testing.assert_allclose(
        marginal_log_likelihood(scaled, weights, robot_weights),
        marginal_log_likelihood(log_likelihood, weights, robot_weights),
        atol=1e-9,
    )


def test_with_one_robot_sample_it_is_bayes_rule() -> None:
    likelihood, prior, _ = tables(0, 1, 5)
    weights = Weights.of(prior)
    after, _ = weights.reweight(
        marginal_log_likelihood(np.log(likelihood), weights, Weights.uniform(1))
    )
    joint = likelihood[0] * prior
    np.testing.assert_allclose(after.values, joint / joint.sum())


def test_a_robot_sample_without_weight_has_no_vote() -> None:
    likelihood, prior, _ = tables(1, 2, 5)
    weights = Weights.of(prior)
    both = marginal_log_likelihood(np.log(likelihood), weights, Weights.of(np.array([1.0, 0.0])))
    one = marginal_log_likelihood(np.log(likelihood[:1]), weights, Weights.uniform(1))
    np.testing.assert_allclose(both, one, atol=1e-12)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.floats(0.1, 1.0))
def test_a_door_filter_updates_by_these_equations(seed: int, tempering: float) -> None:
    rng = np.random.default_rng(seed)
    poses, robot = rng.normal(0.0, 0.3, (5, 3)), rng.dirichlet(np.ones(5))

    def formula(states: FloatArray, poses: FloatArray) -> FloatArray:
        return np.asarray(-2.0 * (states[:, 0] - 0.7 - poses[:, :1]) ** 2)

    filter_ = LatticeFilter(door("door", 0.0, 0.0), DoorSettings(resolution_deg=10.0))
    belief = filter_.prior(rng)
    evidence = evidence_by(formula, poses, Weights.of(robot), tempering)
    after = filter_.update(belief, evidence, rng)
    likelihood = np.exp(tempering * formula(belief.states, poses))
    expected = posterior_written_out(
        likelihood.tolist(), belief.weights.values.tolist(), robot.tolist()
    )
    np.testing.assert_allclose(after.weights.values, expected, rtol=1e-9)
