"""What looks tell of habits."""

import numpy as np
import pytest

from objstate.geometry import FloatArray
from objstate.habits import model
from objstate.habits.calendar import NANOSECONDS, Calendar, Season
from objstate.habits.design import Design
from objstate.habits.forecast import Forecast
from objstate.habits.looks import RegionLooks
from objstate.habits.model import evidence_of, fit, prior

HOUR = 3600 * NANOSECONDS
MONDAY = 18262 * 24 * HOUR + 5 * 24 * HOUR  # 6 January 2020
DESIGN, CALENDAR = Design(2), Calendar()


def office(days: int, hours: tuple[float, ...]) -> RegionLooks:
    """Looks at a door that is open on working days from 9 to 17 h, at some hours of each day."""
    stamps = [MONDAY + int((24 * day + hour) * HOUR) for day in range(days) for hour in hours]
    opened = [day % 7 < 5 and 9 <= hour < 17 for day in range(days) for hour in hours]
    return RegionLooks.certain(np.array(stamps), np.array(opened, dtype=np.int64), 2)


def forecast_of(looks: RegionLooks) -> Forecast:
    """By what they tell."""
    return Forecast(DESIGN, CALENDAR, fit(DESIGN, CALENDAR, looks)[0], draws=64)


def shares_open(forecast: Forecast, hour: float) -> FloatArray:
    """On a Wednesday after the looks, for each draw of the habits."""
    state = forecast.marginal(MONDAY + int((24 * (28 + 2) + hour) * HOUR))
    return np.asarray(state[:, 2] + state[:, 3])


def test_score_is_the_derivative_of_the_likelihood() -> None:
    rng = np.random.default_rng(1)
    stamps = MONDAY + np.sort(rng.integers(0, 5 * 24 * HOUR, 40))
    looks = RegionLooks.of(stamps, rng.uniform(0.1, 1.0, (40, 2)))
    theta = DESIGN.mean + 0.3 * rng.standard_normal(DESIGN.parameters)
    found, step = evidence_of(DESIGN, CALENDAR, looks)(theta), 1e-4
    for k in (20, 55, 100, DESIGN.parameters - 1):
        off = step * np.eye(DESIGN.parameters)[k]
        high, low = (evidence_of(DESIGN, CALENDAR, looks)(theta + sign * off) for sign in (1, -1))
        slope = (high.log_likelihood - low.log_likelihood) / (2 * step)
        assert found.score[k] == pytest.approx(slope, rel=1e-4, abs=1e-6)


@pytest.mark.parametrize("seasons", [False, True])
def test_whole_days_tell_what_their_cells_do(
    seasons: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(2)
    calendar = Calendar(warm=Season((5, 1), (9, 30)) if seasons else None)
    design = Design(3, calendar.seasons)
    weeks = np.sort(rng.choice(40, 6, replace=False)) * 7 * 24 * HOUR
    stamps = MONDAY + weeks + rng.integers(0, 24 * HOUR, len(weeks))
    looks = RegionLooks.of(stamps, rng.uniform(0.1, 1.0, (len(weeks), 3)))
    theta = design.mean + 0.3 * rng.standard_normal(design.parameters)
    found = evidence_of(design, calendar, looks)(theta)
    with monkeypatch.context() as only:
        only.setattr(model, "by_days", lambda cells, kinds, least: cells)
        expected = evidence_of(design, calendar, looks)(theta)
    assert found.log_likelihood == pytest.approx(expected.log_likelihood, rel=1e-12)
    assert np.allclose(found.score, expected.score, rtol=1e-9, atol=1e-12)
    assert np.allclose(found.information, expected.information, rtol=1e-9, atol=1e-12)
    assert np.allclose(found.state, expected.state, rtol=1e-9)


def test_a_look_that_tells_nothing_changes_nothing() -> None:
    looks = RegionLooks.of(np.array([MONDAY, MONDAY + HOUR]), np.ones((2, 2)))
    after, _ = fit(DESIGN, CALENDAR, looks)
    assert after.mean == pytest.approx(prior(DESIGN).mean, abs=1e-6)
    assert np.allclose(after.covariance, prior(DESIGN).covariance, atol=1e-6)


def test_habits_tell_day_from_night() -> None:
    forecast = forecast_of(office(28, (1, 5, 10, 12, 14, 16, 20, 23)))
    assert shares_open(forecast, 13).mean() > 0.7
    assert shares_open(forecast, 3).mean() < 0.05


def test_hours_that_nobody_looked_at_stay_unknown() -> None:
    forecast = forecast_of(office(28, (10, 12, 14, 16)))
    assert shares_open(forecast, 13).mean() > 0.8
    night = shares_open(forecast, 2)
    assert night.min() < 0.001
    assert night.max() > 0.05


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
