"""Rates of movements that doors tell each other."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.estimator.doors import Rates
from objstate.objects.mixture import FACTORS, FACTORS_PRIOR, half_cauchy


def sharp(index: int) -> np.ndarray:
    """The likelihood (r,) of a door whose readings fit one rate."""
    out = np.full(len(FACTORS), 1e-12)
    out[index] = 1.0
    return out


def test_what_others_tell_is_the_sum_over_their_rates_and_the_usual_one() -> None:
    rates, rng = Rates(), np.random.default_rng(1)
    likelihoods = rng.uniform(0.01, 1.0, (2, len(FACTORS)))
    for name, each in zip(("a", "b"), likelihoods, strict=True):
        rates.observe(name, each)
    own = np.array([half_cauchy(FACTORS / usual) for usual in FACTORS])
    joint = np.einsum("u,ua,ub,uc->abc", FACTORS_PRIOR, own, own, own)
    joint *= likelihoods[0][:, None, None] * likelihoods[1][None, :, None]
    expected = joint.sum(axis=(0, 1)) / joint.sum()
    assert rates.given_others("c") == pytest.approx(expected)


def test_a_door_is_not_told_of_its_own_readings() -> None:
    rates = Rates()
    before = rates.given_others("a")
    rates.observe("a", sharp(-1))
    assert rates.given_others("a") == pytest.approx(before)


def test_one_restless_door_does_not_outvote_quiet_ones() -> None:
    rates = Rates()
    for name in "abcd":
        rates.observe(name, sharp(1))
    rates.observe("e", sharp(-1))
    assert np.argmax(rates.given_others("f")) == 1
