"""Bayes' rule by the compiled loop: exact where all states are known, linear between them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.geometry import FloatArray, IntArray, wrap
from objstate.objects import lattice

STATES = 17
SEEDS = st.integers(0, 10_000)


def conditioned(
    prior: FloatArray, chosen: IntArray, log_likelihood: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Weights (p, n) after the likelihood (p, k) of chosen states for each robot sample, and log evidence (p,)."""
    after, evidence = np.empty_like(prior), np.empty(len(prior))
    for row in range(len(prior)):
        told = (chosen, log_likelihood[row : row + 1], np.ones(1), 0.0, 1.0, False)
        lattice.condition(prior[row], *told, evidence[row : row + 1], after[row])
    return after, evidence


def rows_of(rng: np.random.Generator, rows: int = 3) -> FloatArray:
    return rng.dirichlet(np.ones(STATES), rows)


@settings(max_examples=40)
@given(SEEDS, st.floats(-2000.0, 2000.0))
def test_it_is_bayes_rule_where_all_states_are_known(seed: int, level: float) -> None:
    rng = np.random.default_rng(seed)
    prior, log = rows_of(rng), rng.normal(0.0, 4.0, (3, STATES))
    after, evidence = conditioned(prior, np.arange(STATES), log + level)
    pairs = prior * np.exp(log)
    np.testing.assert_allclose(after, pairs / pairs.sum(axis=1, keepdims=True), atol=1e-12)
    np.testing.assert_allclose(evidence, np.log(pairs.sum(axis=1)) + level, atol=1e-9)


@settings(max_examples=40)
@given(SEEDS, st.sets(st.integers(1, STATES - 2)))
def test_between_known_states_the_likelihood_is_linear(seed: int, inner: set[int]) -> None:
    rng = np.random.default_rng(seed)
    chosen = np.array(sorted(inner | {0, STATES - 1}))
    prior, log = rows_of(rng), rng.normal(0.0, 4.0, (3, len(chosen)))
    after, evidence = conditioned(prior, chosen, log)
    for row in range(len(prior)):
        likelihood = np.interp(np.arange(STATES), chosen, np.exp(log[row]))
        pairs = prior[row] * likelihood
        np.testing.assert_allclose(after[row], pairs / pairs.sum(), rtol=1e-9, atol=1e-15)
        assert evidence[row] == pytest.approx(np.log(pairs.sum()), abs=1e-9)


@settings(max_examples=40)
@given(SEEDS)
def test_robot_samples_vote_by_their_weights(seed: int) -> None:
    rng = np.random.default_rng(seed)
    prior, log, robot = (
        rows_of(rng, 1)[0],
        rng.normal(0.0, 4.0, (3, STATES)),
        rng.dirichlet(np.ones(3)),
    )
    each, told = conditioned(np.tile(prior, (3, 1)), np.arange(STATES), log)
    evidence, weights = np.empty(3), np.empty(STATES)
    lattice.condition(prior, np.arange(STATES), log, robot, 0.0, 1.0, False, evidence, weights)
    np.testing.assert_allclose(weights, robot @ each, rtol=1e-9, atol=1e-300)
    np.testing.assert_allclose(evidence, told)


@settings(max_examples=40)
@given(SEEDS, st.floats(1.0, 5000.0))
def test_weights_are_never_negative_and_always_sum_to_one(seed: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    chosen = np.array([0, 3, 4, 9, STATES - 1])
    after, evidence = conditioned(rows_of(rng), chosen, rng.normal(0.0, spread, (3, 5)))
    assert (after >= 0.0).all()
    np.testing.assert_allclose(after.sum(axis=1), 1.0, atol=1e-9)
    assert np.isfinite(evidence).all()


def test_a_robot_sample_that_cannot_have_read_this_keeps_what_it_believed() -> None:
    """Its pose is wrong, not the door: the evidence says so."""
    prior = np.zeros((2, STATES))
    prior[0, 0] = 1.0
    prior[1] = 1.0 / STATES
    log = np.zeros((2, STATES))
    log[:, :-1] = -5000.0
    after, evidence = conditioned(prior, np.arange(STATES), log)
    np.testing.assert_array_equal(after[0], prior[0])
    assert after[1, -1] == pytest.approx(1.0)
    assert np.isfinite(evidence[0])
    assert evidence[0] < evidence[1] - 100.0


@settings(max_examples=40)
@given(st.integers(0, 23), st.integers(0, 11))
def test_the_mean_of_two_directions_lies_in_their_middle(one: int, further: int) -> None:
    weights, cell = np.zeros(24), 2.0 * np.pi / 24
    for place in (one, (one + further) % 24):
        weights[place] += 0.5
    mean, std = lattice.moments(weights, -np.pi, cell, True)
    assert wrap(mean + np.pi - cell * (one + further / 2.0)) == pytest.approx(0.0, abs=1e-9)
    assert std**2 == pytest.approx((cell * further / 2.0) ** 2 + cell**2 / 12.0)
