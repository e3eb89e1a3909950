"""Bayes' rule by the compiled loop: exact where all states are known, linear between them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.geometry import BoolArray, FloatArray, IntArray, wrap
from objstate.objects import kernels

STATES = 17
SEEDS = st.integers(0, 10_000)


def conditioned(
    prior: FloatArray,
    chosen: IntArray,
    log_likelihood: FloatArray,
    whole: BoolArray | None = None,
) -> tuple[FloatArray, FloatArray]:
    """Rows (p, n) after the likelihood (p, k) of chosen states, and their log evidence (p,)."""
    whole = np.ones(len(chosen), dtype=bool) if whole is None else whole
    after, evidence = np.empty_like(prior), np.empty(len(prior))
    robot, marginal = np.full(len(prior), 1.0 / len(prior)), np.empty(prior.shape[1])
    told = (chosen, whole, log_likelihood)
    kernels.condition(prior, *told, robot, 0.0, 1.0, False, after, evidence, marginal)
    np.testing.assert_allclose(marginal, robot @ after, rtol=1e-9, atol=1e-300)
    return after, evidence


def narrowed(weights: FloatArray, power: float, wraps: bool, parts: int) -> FloatArray:
    """Weights (n,) to a power, by a walk that goes nowhere."""
    out = np.empty_like(weights)
    (mean, std), _ = kernels.widen(weights, power, parts, 0.0, 0.0, 1.0, wraps, 0.05, out)
    assert out.sum() == pytest.approx(1.0)
    if not wraps:
        places = np.arange(len(out))
        assert mean == pytest.approx(out @ places)
        assert std**2 == pytest.approx(out @ (places - mean) ** 2 + 1.0 / 12.0)
    return out


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
@given(SEEDS, st.sets(st.integers(0, STATES - 1)), st.sets(st.integers(0, STATES - 1)))
def test_states_that_all_rows_have_the_same_of_are_states_like_others(
    seed: int, some: set[int], apart: set[int]
) -> None:
    rng = np.random.default_rng(seed)
    chosen = np.array(sorted(some | {0, STATES - 1}))
    whole = np.isin(chosen, list(apart))
    log = rng.normal(-5.0, 6.0, (3, len(chosen)))
    log[:, ~whole] = log[0, ~whole]
    prior = rows_of(rng)
    after, evidence = conditioned(prior, chosen, log, whole)
    written_out, told = conditioned(prior, chosen, log)
    np.testing.assert_allclose(after, written_out, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(evidence, told, atol=1e-8)


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
    mean, std = kernels.moments(weights, -np.pi, cell, True)
    assert wrap(mean + np.pi - cell * (one + further / 2.0)) == pytest.approx(0.0, abs=1e-9)
    assert std**2 == pytest.approx((cell * further / 2.0) ** 2 + cell**2 / 12.0)


@pytest.mark.parametrize("std", [0.7, 1.3, 3.0])
@pytest.mark.parametrize("share", [0.1, 0.4])
@given(st.floats(15.0, 25.0))
def test_a_narrowed_belief_stays_about_its_mean_wherever_that_lies_between_samples(
    std: float, share: float, mean: float
) -> None:
    """Parts between two samples that fall to both widen it, by at most a quarter of a cell squared."""
    places = np.arange(41.0)
    out = narrowed(np.exp(-0.5 * ((places - mean) / std) ** 2), 1.0 / share, False, 20)
    weights = out / out.sum()
    found = weights @ places
    assert found == pytest.approx(mean, abs=0.02)
    assert -0.01 < weights @ (places - found) ** 2 - share * std**2 < 0.25


def test_a_narrowed_direction_is_the_same_all_round() -> None:
    weights = np.exp(-0.5 * (np.minimum(np.arange(24), 24 - np.arange(24)) / 1.5) ** 2)
    here = narrowed(weights, 4.0, True, 6)
    there = narrowed(np.roll(weights, 7), 4.0, True, 6)
    np.testing.assert_allclose(np.roll(here, 7), there, rtol=1e-12)


def test_a_narrowed_belief_at_a_limit_loses_none_beyond_it() -> None:
    weights = np.exp(-np.arange(30.0) / 3.0)
    out = narrowed(weights, 5.0, False, 6)
    assert (out >= 0.0).all()
    assert out[0] == out.max()


@pytest.mark.parametrize("cut", [22, 23, 24, 25])
@pytest.mark.parametrize("power", [1.5, 6.0, 25.0, 100.0])
@pytest.mark.parametrize("mean", [25.0, 25.4])
def test_a_narrowed_belief_with_an_edge_has_no_peak_that_it_did_not_have(
    mean: float, power: float, cut: int
) -> None:
    places = np.arange(60.0)
    weights = np.where(places < cut, 1e-200, np.exp(-0.5 * ((places - mean) / 3.0) ** 2))
    out = narrowed(weights, power, False, 6)
    assert np.isfinite(out).all()
    found = out @ places / out.sum()
    before = weights @ places / weights.sum()
    assert min(mean, before) - 0.3 < found < max(mean, before) + 0.3


@pytest.mark.parametrize("elsewhere", [1e-4, 0.02, 0.3])
@pytest.mark.parametrize("power", [1.5, 10.0])
def test_what_speaks_for_another_state_is_left_where_a_belief_is_narrowed(
    elsewhere: float, power: float
) -> None:
    places = np.arange(101.0)
    here, there = (np.exp(-0.5 * ((places - mean) / 4.0) ** 2) for mean in (30.0, 70.0))
    weights = (1.0 - elsewhere) * here / here.sum() + elsewhere * there / there.sum()
    out = narrowed(weights, power, False, 6)
    assert out[50:].sum() == pytest.approx(weights[50:].sum(), rel=0.01)
    share, off = out[:50] / out[:50].sum(), places[:50] - 30.0
    assert share @ off**2 == pytest.approx(16.0 / power, abs=0.3)


def test_a_belief_on_two_samples_is_narrowed_without_overflow() -> None:
    weights = np.zeros(40)
    weights[[20, 21]] = 0.5
    out = narrowed(weights, 100.0, False, 6)
    assert np.isfinite(out).all()
    assert out @ np.arange(40.0) / out.sum() == pytest.approx(20.5, abs=0.01)
