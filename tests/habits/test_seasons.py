"""Habits of two seasons: what is learnt of each, and what one tells of the other."""

from datetime import UTC, date, datetime, timedelta
from zoneinfo import ZoneInfo

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.geometry import FloatArray
from objstate.habits.building import DoorHabits
from objstate.habits.calendar import (
    CELL_S,
    FREE,
    NANOSECONDS,
    PER_DAY,
    WARM,
    WORKING,
    Calendar,
    Season,
)
from objstate.habits.design import Design
from objstate.habits.forecast import Forecast
from objstate.habits.looks import RegionLooks
from objstate.habits.model import prior
from objstate.habits.moves import MoveDesign, Moves
from objstate.habits.site import RESTS, fitted_site
from objstate.habits.summary import Figure, week_habit, week_moves

HOUR = 3600 * NANOSECONDS
SUMMER, SOUTH = Season((5, 1), (9, 30)), Season((11, 1), (3, 31))
CALENDAR = Calendar(warm=SUMMER)
LOOKED = (1, 5, 8, 10, 12, 14, 16, 18, 21)  # h
BOUNDS = (0.17,)


@settings(max_examples=30, deadline=None)
@given(
    st.dates(date(1999, 1, 1), date(2040, 12, 31)),
    st.sampled_from(["UTC", "Europe/Berlin", "Australia/Sydney", "Asia/Kathmandu"]),
    st.sampled_from([SUMMER, SOUTH]),
)
def test_a_key_is_the_season_beside_the_key_without_seasons(
    day: date, zone: str, season: Season
) -> None:
    plain, seasonal = Calendar(ZoneInfo(zone)), Calendar(ZoneInfo(zone), warm=season)
    first = int(datetime(day.year, day.month, day.day, tzinfo=UTC).timestamp()) // CELL_S
    keys = seasonal.keys(first, first + 2 * PER_DAY)
    assert np.array_equal(keys % (2 * PER_DAY), plain.keys(first, first + 2 * PER_DAY))
    for cell, key in zip(range(first, first + 2 * PER_DAY), keys.tolist(), strict=True):
        local = seasonal.local(cell * CELL_S * NANOSECONDS).date()
        assert key // (2 * PER_DAY) == season.has(local)


def test_a_season_may_pass_new_year() -> None:
    warm = Calendar(warm=SOUTH, holidays=frozenset({date(2026, 1, 26)}))
    days = [date(2025, 10, 31), date(2025, 11, 1), date(2026, 1, 1), date(2026, 1, 26)]
    days += [date(2026, 3, 31), date(2026, 4, 1), date(2026, 2, 28)]
    kinds = [warm.kind(day) for day in days]
    assert kinds == [WORKING, WARM + FREE, WARM, WARM + FREE, WARM, WORKING, WARM + FREE]


def test_without_a_warm_season_the_parameters_are_those_of_the_others() -> None:
    plain, seasonal = Design(3), Design(3, seasons=True)
    assert seasonal.parameters > plain.parameters
    assert len(plain.matrix) == 2 * PER_DAY
    cold = seasonal.matrix[: 2 * PER_DAY]
    used = (cold != 0.0).any(axis=(0, 1))
    assert np.array_equal(cold[..., used], plain.matrix)
    assert seasonal.mean[used] == pytest.approx(plain.mean)
    assert np.allclose(seasonal.covariance[np.ix_(used, used)], plain.covariance)
    assert seasonal.mean[~used] == pytest.approx(0.0)


def office(since: date, days: int, *, stands_open: bool) -> RegionLooks:
    """Looks at a door that stands open from 9 to 17 h of working days, or is shut."""
    stamps, regions = [], []
    for day in (since + timedelta(days=k) for k in range(days)):
        midnight = int(datetime(day.year, day.month, day.day, tzinfo=UTC).timestamp())
        for hour in LOOKED:
            stamps.append(midnight * NANOSECONDS + hour * HOUR)
            regions.append(int(stands_open and day.weekday() < 5 and 9 <= hour < 17))
    return RegionLooks.certain(np.array(stamps), np.array(regions), 2)


COLD = office(date(2026, 4, 13), 14, stands_open=False)
BOTH = RegionLooks.of(
    *(
        np.concatenate(each)
        for each in zip(
            *(
                (p.stamps_ns, p.likelihood)
                for p in (COLD, office(date(2026, 5, 4), 14, stands_open=True))
            ),
            strict=True,
        )
    )
)


def taught(looks: RegionLooks) -> Forecast:
    site = fitted_site(BOUNDS, CALENDAR, looks, np.zeros(RESTS))
    after = DoorHabits(CALENDAR, {"d": site}, {"d": "hinged"}).forecast("d").habits
    return Forecast(site.design, CALENDAR, after, 64)


@pytest.fixture(scope="module")
def both() -> Forecast:
    return taught(BOTH)


@pytest.fixture(scope="module")
def winter() -> Forecast:
    return taught(COLD)


def share_open(forecast: Forecast, *moment: int) -> FloatArray:
    """Of each draw, at a time of UTC."""
    at = int(datetime(*moment, tzinfo=UTC).timestamp()) * NANOSECONDS  # type: ignore[misc, arg-type]
    state = forecast.marginal(at)
    return np.asarray(state[:, 2] + state[:, 3])


def test_a_door_that_stands_open_in_summer_alone_is_foretold_in_both_seasons(
    both: Forecast,
) -> None:
    for year in (2026, 2027):
        assert share_open(both, year, 7, 28, 13).mean() > 0.7
        assert share_open(both, year, 7, 28, 3).mean() < 0.1
        assert np.median(share_open(both, year, 2, 3, 13)) < 0.2
    week = week_habit(both, date(2026, 10, 1))
    assert week.season == "cold"
    warm = week_habit(both, date(2026, 9, 30))
    assert warm.season == "warm"
    assert warm.shares[1].lower > week.shares[1].value


def test_a_season_that_nobody_saw_stays_unsure(winter: Forecast) -> None:
    seen, unseen = (Figure.of(share_open(winter, 2026, month, 3, 13)) for month in (2, 8))
    assert seen.upper < 0.3
    assert unseen.upper - unseen.lower > 2.0 * (seen.upper - seen.lower)
    assert unseen.upper > 0.5


def test_what_seasons_share_carries_over(winter: Forecast) -> None:
    before = Forecast(winter.design, CALENDAR, prior(winter.design), 64)
    shares = [share_open(each, 2026, 8, 4, 13).mean() for each in (winter, before)]
    assert shares[0] < 0.7 * shares[1]


def test_furniture_has_seasons_too() -> None:
    design = MoveDesign(seasons=True)
    moves = Moves(design, CALENDAR, prior(design))
    warm, cold = (week_moves(moves, date(2026, month, 1)) for month in (8, 2))
    assert (warm.season, cold.season) == ("warm", "cold")
    spread = [np.log(each.moves_per_day.upper / each.moves_per_day.lower) for each in (warm, cold)]
    assert spread[0] > spread[1]
    plain = MoveDesign()
    assert week_moves(Moves(plain, Calendar(), prior(plain)), date(2026, 8, 1)).season is None


def test_a_usual_week_has_no_holidays(both: Forecast) -> None:
    rests = Calendar(holidays=frozenset(date(2026, 7, day) for day in range(1, 32)), warm=SUMMER)
    during = week_habit(Forecast(both.design, rests, both.habits, 16), date(2026, 7, 15))
    before = week_habit(Forecast(both.design, CALENDAR, both.habits, 16), date(2026, 7, 15))
    assert during == before
