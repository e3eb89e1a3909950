"""Laws of weighted samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import chi2, norm

from objstate.errors import ObjstateError
from objstate.geometry import FloatArray
from objstate.particles import (
    ImpossibleEvidenceError,
    Weights,
    entropy,
    kld_sample_size,
    largest_step,
    quantiles,
    systematic,
)

shares = st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30).filter(lambda w: sum(w) > 1e-6)
weight_arrays = shares.map(np.array)
log_likelihoods = st.floats(-2000.0, 2000.0)


@given(weight_arrays, st.floats(1e-6, 1e6))
def test_weights_sum_to_one_whatever_they_were(given_weights: FloatArray, scale: float) -> None:
    weights = Weights.of(given_weights * scale)
    assert weights.values.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(weights.values, given_weights / given_weights.sum(), atol=1e-12)
    assert 1.0 - 1e-9 <= weights.effective_size <= len(weights) + 1e-9


@pytest.mark.parametrize("bad", [[0.0, 0.0], [1.0, -0.1], [np.nan, 1.0], [np.inf, 1.0]])
def test_weights_that_are_none_are_refused(bad: list[float]) -> None:
    with pytest.raises(ValueError, match="non-negative, finite and not all zero"):
        Weights.of(np.array(bad))


@given(weight_arrays, log_likelihoods)
def test_the_same_evidence_for_all_changes_nothing_and_is_the_evidence(
    given_weights: FloatArray, constant: float
) -> None:
    weights = Weights.of(given_weights)
    after, evidence = weights.reweight(np.full(len(weights), constant))
    np.testing.assert_allclose(after.values, weights.values, atol=1e-12)
    assert evidence == pytest.approx(constant, abs=1e-9)


@given(weight_arrays, st.integers(0, 1000))
def test_reweighting_is_bayes_rule(given_weights: FloatArray, seed: int) -> None:
    likelihood = np.random.default_rng(seed).uniform(0.01, 5.0, len(given_weights))
    weights = Weights.of(given_weights)
    after, evidence = weights.reweight(np.log(likelihood))
    joint = weights.values * likelihood
    np.testing.assert_allclose(after.values, joint / joint.sum(), atol=1e-12)
    assert np.exp(evidence) == pytest.approx(joint.sum())


@given(st.integers(0, 1000))
def test_evidence_taken_in_two_parts_is_the_same_as_at_once(seed: int) -> None:
    rng = np.random.default_rng(seed)
    one, two = rng.normal(0.0, 300.0, (2, 20))
    weights = Weights.of(rng.dirichlet(np.ones(20)))
    halfway, first = weights.reweight(one)
    after, second = halfway.reweight(two)
    at_once, total = weights.reweight(one + two)
    np.testing.assert_allclose(after.values, at_once.values, atol=1e-9)
    assert first + second == pytest.approx(total)


@pytest.mark.parametrize("impossible", [-np.inf, np.nan])
def test_evidence_that_no_sample_explains_is_the_named_error(impossible: float) -> None:
    with pytest.raises(ImpossibleEvidenceError, match="z_rand and z_max") as caught:
        Weights.uniform(5).reweight(np.full(5, impossible))
    assert isinstance(caught.value, ObjstateError)


def test_a_sample_that_explains_nothing_loses_its_weight_alone() -> None:
    after, evidence = Weights.uniform(4).reweight(np.array([-np.inf, 0.0, 0.0, -np.inf]))
    np.testing.assert_allclose(after.values, [0.0, 0.5, 0.5, 0.0])
    assert evidence == pytest.approx(np.log(0.5))


def test_effective_size_counts_the_samples_that_carry_the_belief() -> None:
    assert Weights.uniform(7).effective_size == pytest.approx(7.0)
    assert Weights.of(np.array([0.0, 3.0, 0.0])).effective_size == pytest.approx(1.0)
    assert Weights.of(np.array([1.0, 1.0, 0.0])).effective_size == pytest.approx(2.0)


@given(weight_arrays, st.integers(1, 200), st.integers(0, 2**32 - 1))
def test_resampling_is_within_one_copy_of_expectation(
    given_weights: FloatArray, count: int, seed: int
) -> None:
    weights = Weights.of(given_weights)
    chosen = systematic(weights, count, np.random.default_rng(seed))
    assert len(chosen) == count
    assert (np.diff(chosen) >= 0).all()
    copies = np.bincount(chosen, minlength=len(weights))
    assert (np.abs(copies - count * weights.values) < 1.0 + 1e-9).all()
    assert not copies[weights.values == 0.0].any()


def test_resampling_is_unbiased() -> None:
    rng = np.random.default_rng(0)
    weights = Weights.of(rng.dirichlet(np.full(12, 0.5)))
    draws = 4000
    copies = np.zeros(12)
    for _ in range(draws):
        copies += np.bincount(systematic(weights, 5, rng), minlength=12)
    sampling_error = 0.5 / np.sqrt(draws)  # copies of one draw differ by at most one
    np.testing.assert_allclose(copies / draws, 5 * weights.values, atol=5 * sampling_error)


def test_the_same_seed_draws_the_same_samples() -> None:
    weights = Weights.of(np.arange(1.0, 40.0))
    one, two = (systematic(weights, 100, np.random.default_rng(9)) for _ in range(2))
    np.testing.assert_array_equal(one, two)


def test_quantiles_of_even_samples_are_those_of_the_uniform() -> None:
    values = (np.arange(1000) + 0.5) / 1000
    wanted = np.array([0.05, 0.25, 0.5, 0.95])
    np.testing.assert_allclose(quantiles(values, np.full(1000, 1e-3), wanted), wanted, atol=1e-9)


@given(st.floats(-10.0, 10.0), st.floats(0.01, 10.0), st.integers(0, 100))
def test_quantiles_of_a_weighted_grid_are_those_of_the_normal(
    mean: float, std: float, seed: int
) -> None:
    grid = np.random.default_rng(seed).permutation(np.linspace(-6.0, 6.0, 2001))
    weights = norm.pdf(grid) / norm.pdf(grid).sum()
    wanted = np.array([0.05, 0.5, 0.9, 0.95])
    found = quantiles(mean + std * grid, weights, wanted)
    np.testing.assert_allclose(found, norm.ppf(wanted, mean, std), atol=1e-3 * std)


def test_a_quantile_never_leaves_the_samples() -> None:
    values, weights = np.array([2.0, 1.0, 4.0]), np.array([0.2, 0.5, 0.3])
    np.testing.assert_array_equal(quantiles(values, weights, np.array([0.0, 1.0])), [1.0, 4.0])
    assert quantiles(np.array([3.0]), np.ones(1), np.array([0.5]))[0] == 3.0


@pytest.mark.parametrize(
    ("occupied_bins", "chi_square"),
    [(11, 23.209), (31, 50.892), (51, 76.154), (101, 135.807)],  # tables, 1 - delta = 0.99
)
def test_kld_sample_size_is_half_the_chi_square_quantile_over_the_error(
    occupied_bins: int, chi_square: float
) -> None:
    """Fox 2003; the code uses Wilson and Hilferty's approximation of the quantile."""
    exact = chi_square / (2 * 0.05)
    assert kld_sample_size(occupied_bins, 0.05, 2.3263) == pytest.approx(exact, rel=0.005)


@given(st.integers(3, 5000), st.floats(0.01, 0.5), st.floats(0.5, 3.0))
def test_kld_sample_size_follows_the_chi_square(bins: int, pf_err: float, pf_z: float) -> None:
    """To 2 % up to a quantile of 0.9987; beyond it, Wilson and Hilferty err more on few bins."""
    exact = chi2.ppf(norm.cdf(pf_z), bins - 1) / (2 * pf_err)
    assert abs(kld_sample_size(bins, pf_err, pf_z) - exact) <= 1.0 + 0.02 * exact


@given(st.integers(1, 3000), st.floats(0.01, 0.5), st.floats(0.0, 3.5))
def test_kld_sample_size_grows_with_bins_and_certainty_and_falls_with_the_error(
    bins: int, pf_err: float, pf_z: float
) -> None:
    here = kld_sample_size(bins, pf_err, pf_z)
    assert kld_sample_size(bins + 1, pf_err, pf_z) >= here >= 1
    assert kld_sample_size(bins, pf_err, pf_z + 0.1) >= here
    assert kld_sample_size(bins, pf_err * 1.5, pf_z) <= here


@given(weight_arrays)
def test_entropy_lies_between_certainty_and_ignorance(given_weights: FloatArray) -> None:
    weights = given_weights / given_weights.sum()
    assert -1e-12 <= entropy(weights) <= np.log(len(weights)) + 1e-12


def test_entropy_at_its_bounds() -> None:
    assert entropy(np.array([0.0, 1.0, 0.0])) == 0.0
    assert entropy(np.full(8, 1 / 8)) == pytest.approx(3 * np.log(2))


@given(st.integers(0, 1000), st.floats(0.01, 0.9), st.floats(0.1, 1.0))
def test_the_largest_step_leaves_enough_effective_samples_and_no_more(
    seed: int, share: float, most: float
) -> None:
    rng = np.random.default_rng(seed)
    weights, evidence = Weights.uniform(100), rng.normal(0.0, 30.0, 100)
    step = largest_step(weights, evidence, most, share * 100)
    left = weights.reweight(step * evidence)[0].effective_size
    assert 0.0 < step <= most
    assert left >= 0.9 * min(share * 100, 100.0) or step < 1e-3
    if step < most:
        beyond = weights.reweight((step + 2e-3) * evidence)[0].effective_size
        assert beyond <= share * 100


def test_weak_evidence_is_taken_whole_and_steps_never_stop_short_of_zero() -> None:
    weights = Weights.uniform(10)
    assert largest_step(weights, np.linspace(0.0, 0.1, 10), 0.7, 5.0) == 0.7
    overwhelming = np.where(np.arange(10) == 3, 0.0, -np.inf)
    assert largest_step(weights, overwhelming, 1.0, 5.0) > 0.0
