"""What looks tell of habits."""

import numpy as np
import pytest

from objstate.habits.calendar import NANOSECONDS, Calendar
from objstate.habits.design import Design
from objstate.habits.forecast import Forecast
from objstate.habits.looks import RegionLooks
from objstate.habits.model import evidence, fit, prior

HOUR = 3600 * NANOSECONDS
MONDAY = 18262 * 24 * HOUR + 5 * 24 * HOUR  # 6 January 2020
DESIGN, CALENDAR = Design(2), Calendar()


def office(days: int, hours: tuple[float, ...]) -> RegionLooks:
    """Looks at a door that is open on working days from 9 to 17 h, at some hours of each day."""
    stamps = [MONDAY + int((24 * day + hour) * HOUR) for day in range(days) for hour in hours]
    opened = [day % 7 < 5 and 9 <= hour < 17 for day in range(days) for hour in hours]
    return RegionLooks.certain(np.array(stamps), np.array(opened, dtype=np.int64), 2)


def share_open(looks: RegionLooks, hour: float) -> float:
    """Of a Wednesday after the looks."""
    forecast = Forecast(DESIGN, CALENDAR, fit(DESIGN, CALENDAR, looks)[0])
    at = MONDAY + int((24 * (28 + 2) + hour) * HOUR)
    return float(forecast.regions(forecast.marginal(at))[1])


def test_score_is_the_derivative_of_the_likelihood() -> None:
    rng = np.random.default_rng(1)
    stamps = MONDAY + np.sort(rng.integers(0, 5 * 24 * HOUR, 40))
    looks = RegionLooks.of(stamps, rng.uniform(0.1, 1.0, (40, 2)))
    theta = DESIGN.mean + 0.3 * rng.standard_normal(DESIGN.parameters)
    found, step = evidence(DESIGN, CALENDAR, looks, theta), 1e-4
    for k in (20, 55, 100, DESIGN.parameters - 1):
        off = step * np.eye(DESIGN.parameters)[k]
        high, low = (evidence(DESIGN, CALENDAR, looks, theta + sign * off) for sign in (1, -1))
        slope = (high.log_likelihood - low.log_likelihood) / (2 * step)
        assert found.score[k] == pytest.approx(slope, rel=1e-4, abs=1e-6)


def test_a_look_that_tells_nothing_changes_nothing() -> None:
    looks = RegionLooks.of(np.array([MONDAY, MONDAY + HOUR]), np.ones((2, 2)))
    after, _ = fit(DESIGN, CALENDAR, looks)
    assert after.mean == pytest.approx(prior(DESIGN).mean, abs=1e-6)
    assert np.allclose(after.covariance, prior(DESIGN).covariance, atol=1e-6)


def test_habits_tell_day_from_night() -> None:
    looks = office(28, (1, 5, 10, 12, 14, 16, 20, 23))
    assert share_open(looks, 13) > 0.8
    assert share_open(looks, 3) < 0.1


def test_hours_that_nobody_looked_at_stay_unknown() -> None:
    looks = office(28, (10, 12, 14, 16))
    assert share_open(looks, 13) > 0.8
    assert 0.15 < share_open(looks, 2) < 0.85


def test_a_look_counts_for_less_the_longer_ago_it_was() -> None:
    forecast = Forecast(DESIGN, CALENDAR, prior(DESIGN))
    before = forecast.marginal(MONDAY)

    def open_after(look: list[float], hours: int) -> float:
        state = forecast.given(before, np.array(look))
        later = forecast.later(state, MONDAY, MONDAY + hours * HOUR)
        return float(forecast.regions(later)[1])

    told = [open_after([0.0, 1.0], hours) - open_after([1.0, 0.0], hours) for hours in range(9)]
    assert told[0] == pytest.approx(1.0)
    assert all(np.diff(told) < 0.0)
    assert told[-1] >= 0.0
