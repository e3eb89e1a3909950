"""Laws of the beam model p(d | d-hat).

Of the mixture the shares sum to one, but two of its parts are densities over all
ranges: the short readings beyond the expected range are cut off and not given
back, so that the whole is 1 - z_short exp(-lambda_short d-hat).
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import norm

from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray
from objstate.sensing import BeamModel
from objstate.sensing.beam_model import LEAST_DENSITY

RANGE_MAX = 10.0  # m
shares = st.floats(0.01, 2.0)
sigmas = st.floats(0.01, 0.3)
models = st.builds(
    BeamModelSettings,
    z_hit=shares,
    z_short=shares,
    z_max=shares,
    z_rand=shares,
    sigma_hit=sigmas,
    lambda_short=st.floats(0.0, 3.0),
).map(BeamModel)


def probability(model: BeamModel, measured: float, expected: float) -> float:
    log_likelihood = model(np.array([measured]), RANGE_MAX)
    return float(np.exp(log_likelihood(np.array([expected]))[0]))


def probabilities(model: BeamModel, measured: FloatArray, expected: float) -> FloatArray:
    log_likelihood = model(measured, RANGE_MAX)
    return np.exp(log_likelihood(np.full(len(measured), expected)))


def normalized_shares(settings: BeamModelSettings) -> FloatArray:
    shares = np.array([settings.z_hit, settings.z_short, settings.z_max, settings.z_rand])
    return shares / shares.sum()


@settings(max_examples=40)
@given(models, st.floats(0.2, 0.8))
def test_returns_and_the_missing_return_sum_to_one_but_for_the_cut_short_readings(
    model: BeamModel, share: float
) -> None:
    expected, sigma = RANGE_MAX * share, model.settings.sigma_hit
    breaks = [expected - 5 * sigma, expected, expected + 5 * sigma]
    returns, _ = quad(
        lambda d: probability(model, d, expected), 0.0, RANGE_MAX, points=breaks, limit=200
    )
    cut = normalized_shares(model.settings)[1] * np.exp(-model.settings.lambda_short * expected)
    assert returns + probability(model, np.inf, expected) == pytest.approx(1.0 - cut, abs=2e-4)


@settings(max_examples=40)
@given(models)
def test_where_nothing_is_expected_all_sums_to_one_but_for_the_cut_short_readings(
    model: BeamModel,
) -> None:
    returns, _ = quad(lambda d: probability(model, d, np.inf), 0.0, RANGE_MAX)
    s = model.settings
    cut = normalized_shares(s)[1] * np.exp(-s.lambda_short * RANGE_MAX)
    assert returns + probability(model, np.inf, np.inf) == pytest.approx(1.0 - cut, abs=1e-5)


@settings(max_examples=40)
@given(sigmas, st.floats(0.5, 9.5), st.floats(-3.0, 3.0))
def test_the_gaussian_is_the_papers(sigma: float, expected: float, off: float) -> None:
    model = BeamModel(BeamModelSettings(model="gaussian", sigma_hit=sigma))
    measured = np.clip(expected + off * sigma, 0.0, RANGE_MAX)
    assert probability(model, measured, expected) == pytest.approx(
        norm.pdf(measured, expected, sigma), rel=1e-9
    )
    assert probability(model, np.inf, np.inf) == pytest.approx(norm.pdf(0.0, 0.0, sigma))
    at_the_end = max(norm.pdf(RANGE_MAX, expected, sigma), LEAST_DENSITY)
    assert probability(model, np.inf, expected) == pytest.approx(at_the_end, rel=1e-6)


@settings(max_examples=40)
@given(models, st.floats(0.5, 9.5))
def test_of_all_expected_ranges_none_explains_a_return_better_than_its_own_but_for_short_ones(
    model: BeamModel, measured: float
) -> None:
    """A reading just before the expected range may also have been stopped short."""
    s = model.settings
    own = probability(model, measured, measured)
    others = measured + np.linspace(-3.0, 3.0, 301)
    log_likelihood = model(np.array([measured]), RANGE_MAX)
    short = normalized_shares(s)[1] * s.lambda_short * np.exp(-s.lambda_short * measured)
    others_explain = np.exp(log_likelihood(others[:, None]))[:, 0]
    assert (others_explain <= own + short + 1e-12).all()
    assert (others_explain[others <= measured] <= own + 1e-12).all()


@settings(max_examples=40)
@given(models, st.floats(1.0, 9.0))
def test_a_hit_is_likeliest_at_the_expected_range_and_falls_off_beyond(
    model: BeamModel, expected: float
) -> None:
    beyond = expected + np.linspace(0.0, 1.0, 200)
    density = probabilities(model, beyond, expected)
    assert (np.diff(density) <= 1e-12).all()
    before = probabilities(model, 2 * expected - beyond, expected)
    assert (before >= density - 1e-6 * density.max()).all()


def test_the_tabulated_bell_is_the_gaussian() -> None:
    s = BeamModelSettings(z_hit=0.7, z_short=0.0, z_max=1e-12, z_rand=0.3, sigma_hit=0.05)
    measured = np.linspace(4.0, 6.0, 5001)
    exact = 0.7 * norm.pdf(measured, 5.0, 0.05) + 0.3 / RANGE_MAX
    peak = 0.7 * norm.pdf(5.0, 5.0, 0.05)
    found = probabilities(BeamModel(s), measured, 5.0)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-6 * peak)


@given(models, st.floats(0.1, 9.9))
def test_nothing_up_to_range_max_is_evidence_against_a_wall_within(
    model: BeamModel, expected: float
) -> None:
    near, nothing = (probability(model, np.inf, d) for d in (expected, np.inf))
    hit, _, missing, _ = normalized_shares(model.settings)
    assert nothing / near == pytest.approx((hit + missing) / missing)
    assert probability(model, np.inf, RANGE_MAX + 1.0) == pytest.approx(nothing)


@pytest.mark.parametrize("kind", ["mixture", "gaussian"])
def test_blur_widens_as_variances_add(kind: str) -> None:
    narrow = BeamModel(BeamModelSettings(model=kind, sigma_hit=0.03))
    wide = narrow.blurred(0.04)
    measured, same = np.linspace(2.5, 3.5, 50), BeamModelSettings(model=kind, sigma_hit=0.05)
    np.testing.assert_allclose(
        probabilities(wide, measured, 3.0), probabilities(BeamModel(same), measured, 3.0)
    )
    unchanged = probabilities(narrow.blurred(0.0), measured, 3.0)
    np.testing.assert_array_equal(unchanged, probabilities(narrow, measured, 3.0))
    assert probability(wide, 3.0, 3.0) < probability(narrow, 3.0, 3.0)
    assert probability(wide, 3.15, 3.0) > probability(narrow, 3.15, 3.0)


def test_shares_count_only_in_proportion() -> None:
    one = BeamModel(BeamModelSettings())
    s = one.settings
    twice = BeamModel(
        s.model_copy(update={k: 2 * getattr(s, k) for k in ("z_hit", "z_short", "z_max", "z_rand")})
    )
    measured = np.array([0.5, 3.0, np.inf])
    np.testing.assert_allclose(
        probabilities(twice, measured, 3.0), probabilities(one, measured, 3.0)
    )


@pytest.mark.parametrize("kind", ["mixture", "gaussian"])
def test_any_batch_of_expected_ranges_gives_numbers(kind: str) -> None:
    model = BeamModel(BeamModelSettings(model=kind))
    measured = np.array([0.02, 3.0, 9.99, np.inf])
    expected = np.array([0.0, 1e-9, 3.0, 10.0, np.inf])
    grid = np.broadcast_to(expected[:, None], (2, 5, 4))
    log_likelihood = model(measured, RANGE_MAX)(grid)
    assert log_likelihood.shape == (2, 5, 4)
    assert np.isfinite(log_likelihood).all()
    np.testing.assert_array_equal(log_likelihood[0], log_likelihood[1])
    one = model(measured[1:2], RANGE_MAX)(np.array([3.0]))
    assert log_likelihood[0, 2, 1] == one[0]


@pytest.mark.filterwarnings("error")
def test_short_readings_may_be_switched_off() -> None:
    model = BeamModel(BeamModelSettings(lambda_short=0.0))
    before, beyond = probabilities(model, np.array([1.0, 5.0]), 3.0)
    assert before == pytest.approx(beyond)
    assert probability(model, np.inf, 3.0) > 0.0


def test_the_smallest_shares_make_no_reading_impossible() -> None:
    model = BeamModel(BeamModelSettings(z_short=0, z_max=1e-9, z_rand=1e-9))
    assert probability(model, 5.0, 3.0) > 0.0
    assert probability(model, np.inf, 3.0) > 0.0


@pytest.mark.parametrize("kind", ["mixture", "gaussian"])
def test_scans_together_are_each_scan_and_each_is_the_sum_over_its_beams(kind: str) -> None:
    model, rng = (
        BeamModel(BeamModelSettings.model_validate({"model": kind})),
        np.random.default_rng(0),
    )
    measured, expected = rng.uniform(0.5, 9.0, (3, 20)), rng.uniform(0.5, 11.0, (5, 20))
    measured[1, :4] = np.inf
    together = model.totals(measured, expected, RANGE_MAX)
    for scan, totals in zip(measured, together, strict=True):
        beams = model(scan, RANGE_MAX)(expected)
        assert totals == pytest.approx(beams.sum(axis=1), rel=1e-3)
