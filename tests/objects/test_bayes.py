"""Bayes' rule for an object and uncertain robots, against sums and products written out.

Where every robot sample believes the same before the scan, the marginal after it is
that of eqs. (8) and (9), Schulz and Burgard 2001.
"""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import DoorSettings
from objstate.geometry import FloatArray
from objstate.objects import Update
from objstate.objects.doors import LatticeFilter
from objstate.particles import Weights
from tests.objects.views import Formula, evidence_by
from tests.rooms import door

FILTER = LatticeFilter(door("door", 0.0, 0.0), DoorSettings(resolution_deg=10.0))
STATES = FILTER.prior(np.random.default_rng(0)).states
SEEDS = st.integers(0, 10_000)


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


def tables(seed: int, robots: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """p(o | s, l) (l, s), p(s) and p(l)."""
    rng = np.random.default_rng(seed)
    likelihood = np.exp(rng.normal(0.0, 3.0, (robots, len(STATES))))
    return likelihood, rng.dirichlet(np.full(len(STATES), 5.0)), rng.dirichlet(np.ones(robots))


def told(log_likelihood: FloatArray) -> Formula:
    """A scan that tells log p(o | s, l) (l, s) of the lattice's states."""

    def formula(states: FloatArray, poses: FloatArray) -> FloatArray:
        cell = STATES[1, 0] - STATES[0, 0]
        return log_likelihood[:, np.rint(states[:, 0] / cell).astype(int)]

    return formula


def update(
    log_likelihood: FloatArray, prior: FloatArray, robot: FloatArray, tempering: float = 1.0
) -> Update:
    """The door's belief, of weights (s,), after a scan."""
    weights, rng = Weights.of(robot), np.random.default_rng(0)
    poses = np.zeros((len(robot), 3))
    believed = FILTER.prior(rng).with_weights(Weights.of(prior))
    evidence = evidence_by(told(log_likelihood), poses, weights, tempering)
    after = FILTER.update(believed, evidence, rng)
    assert after is not None
    return after


@settings(max_examples=50)
@given(SEEDS, st.integers(1, 6), st.floats(0.1, 1.0))
def test_the_posterior_is_the_one_written_out(seed: int, robots: int, tempering: float) -> None:
    likelihood, prior, robot = tables(seed, robots)
    after = update(np.log(likelihood), prior, robot, tempering)
    tempered = (likelihood**tempering).tolist()
    expected = posterior_written_out(tempered, prior.tolist(), robot.tolist())
    assert math.fsum(expected) == pytest.approx(1.0)  # each robot sample's votes sum to its weight
    np.testing.assert_allclose(after.belief.weights.values, expected, rtol=1e-9)


@settings(max_examples=30)
@given(SEEDS, st.floats(-1000.0, 1000.0))
def test_a_factor_on_all_of_a_robot_samples_likelihoods_is_evidence_and_nothing_else(
    seed: int, factor: float
) -> None:
    likelihood, prior, robot = tables(seed, 4)
    factors = factor * np.arange(4)
    one = update(np.log(likelihood), prior, robot)
    scaled = update(np.log(likelihood) + factors[:, None], prior, robot)
    np.testing.assert_allclose(scaled.belief.weights.values, one.belief.weights.values, atol=1e-9)
    np.testing.assert_allclose(scaled.log_evidence, one.log_evidence + factors, atol=1e-9)


def test_with_one_robot_sample_it_is_bayes_rule() -> None:
    likelihood, prior, _ = tables(0, 1)
    after = update(np.log(likelihood), prior, np.ones(1))
    joint = likelihood[0] * prior
    np.testing.assert_allclose(after.belief.weights.values, joint / joint.sum())
    np.testing.assert_allclose(after.log_evidence, np.log(joint.sum()))


def test_a_robot_sample_without_weight_has_no_vote() -> None:
    likelihood, prior, _ = tables(1, 2)
    both = update(np.log(likelihood), prior, np.array([1.0, 0.0]))
    one = update(np.log(likelihood[:1]), prior, np.ones(1))
    np.testing.assert_allclose(both.belief.weights.values, one.belief.weights.values, atol=1e-12)
