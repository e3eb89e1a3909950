"""A change of ways is found where there is one, and only there."""

import numpy as np
import pytest

from objstate.statistics.change_points import change_of_numbers, change_of_shares


def test_a_door_that_is_left_open_from_a_day_on_is_found() -> None:
    rng = np.random.default_rng(0)
    shares = np.concatenate([rng.random(40) < 0.2, rng.random(20) < 0.9]).astype(float)
    found = change_of_shares(shares)
    assert found is not None
    assert found.probability > 0.99
    assert abs(found.place - 40) <= 3
    assert found.before < 0.4
    assert found.after > 0.7


def test_weekends_are_no_change() -> None:
    days = np.arange(70)
    weekend = (days % 7 >= 5).astype(int)
    shares = np.where(weekend == 1, 0.0, 1.0)[np.argsort(weekend, kind="stable")]
    kinds = np.sort(weekend)  # workdays first, then the weekends
    alike, told = change_of_shares(shares), change_of_shares(shares, kinds.tolist())
    assert alike is not None
    assert told is not None
    assert alike.probability > 0.99
    assert told.probability < 0.05


def test_a_wheel_that_wears_is_found_and_noise_is_not() -> None:
    rng = np.random.default_rng(1)
    noise = 0.02 + 0.003 * rng.standard_normal(200)
    drifted = noise + np.where(np.arange(200) < 150, 0.0, 0.01)
    found = change_of_numbers(drifted)
    assert found is not None
    assert found.probability > 0.99
    assert abs(found.place - 150) <= 5
    assert found.after - found.before == pytest.approx(0.01, abs=0.002)


def test_false_alarms_are_as_rare_as_the_prior_says() -> None:
    rng = np.random.default_rng(2)
    numbers = [change_of_numbers(rng.standard_normal(60)) for _ in range(200)]
    shares = [change_of_shares((rng.random(60) < 0.3).astype(float)) for _ in range(200)]
    for found in (numbers, shares):
        assert np.mean([each is not None and each.probability > 0.5 for each in found]) < 0.04


def test_neither_scale_nor_direction_of_time_matters() -> None:
    rng = np.random.default_rng(3)
    values = np.concatenate([rng.standard_normal(20), 2 + rng.standard_normal(20)])
    one, scaled, back = (change_of_numbers(v) for v in (values, 1e-6 * values, values[::-1]))
    assert one is not None
    assert scaled is not None
    assert back is not None
    assert one.probability == pytest.approx(scaled.probability)
    assert one.probability == pytest.approx(back.probability)
    assert back.place == len(values) - one.place


def test_few_values_tell_nothing() -> None:
    assert change_of_numbers(np.arange(5.0)) is None
    assert change_of_shares(np.ones(5)) is None
