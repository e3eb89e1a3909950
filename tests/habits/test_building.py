"""Doors learn from each other, and regions are found."""

import numpy as np
import pytest

from objstate.geometry import FloatArray
from objstate.habits.building import Habits
from objstate.habits.calendar import NANOSECONDS, Calendar
from objstate.habits.design import Design
from objstate.habits.looks import RegionLooks
from objstate.habits.model import prior
from objstate.habits.regions import region_bounds, region_of
from objstate.habits.site import RESTS, Site, fitted_site

HOUR = 3600 * NANOSECONDS
MONDAY = 18267 * 24 * HOUR  # 6 January 2020
BOUNDS = (0.17,)


def site(opened: range, days: int = 5) -> Site:
    """Of a door that is open at these hours, seen every other hour."""
    hours = np.arange(0, 24 * days, 2)
    states = np.isin(hours % 24, opened).astype(np.int64)
    looks = RegionLooks.certain(MONDAY + hours * HOUR, states, 2)
    return fitted_site(BOUNDS, Calendar(), looks, np.zeros(RESTS))


def share_open(habits: Habits, name: str, hour: int) -> float:
    forecast = habits.forecast(name)
    return float(forecast.regions(forecast.marginal(MONDAY + (7 * 24 + hour) * HOUR))[1])


def test_what_nobody_looked_at_is_expected_to_be_like_its_class() -> None:
    day, never = site(range(9, 17)), Site.empty(BOUNDS)
    classes = {"a": "hinged", "b": "hinged", "new": "hinged", "gate": "sliding"}
    sites = {"a": day, "b": day, "new": never, "gate": never}
    habits = Habits(Calendar(), sites, classes)
    alone = Habits(Calendar(), {"new": never}, {"new": "hinged"})
    noon = [share_open(habits, name, 12) for name in ("a", "new", "gate")]
    assert noon == sorted(noon, reverse=True)
    assert share_open(alone, "new", 12) < noon[2]


def test_a_door_of_which_much_is_known_keeps_to_that() -> None:
    night, day = site(range(6)), site(range(9, 17))
    both = Habits(Calendar(), {"n": night, "d": day}, {"n": "hinged", "d": "hinged"})
    assert share_open(both, "d", 12) > 0.6
    assert share_open(both, "n", 12) < 0.4


def test_without_other_doors_the_prior_is_that_of_a_single_one() -> None:
    before = Habits(Calendar(), {}, {}).before(Design(3), "hinged")
    assert before.mean == pytest.approx(prior(Design(3)).mean)
    assert np.allclose(before.covariance, prior(Design(3)).covariance)


def test_looks_one_after_the_other_tell_about_what_they_tell_together() -> None:
    hours = np.arange(0, 24 * 7, 3)
    states = np.isin(hours % 24, range(9, 17)).astype(np.int64)
    looks = RegionLooks.certain(MONDAY + hours * HOUR, states, 2)
    rests, one = np.zeros(RESTS), Site.empty(BOUNDS)
    for k in range(0, len(looks), 8):
        one = one.with_looks(Calendar(), looks.part(slice(k, k + 8)), rests)
    all_ = fitted_site(BOUNDS, Calendar(), looks, rests)
    assert one.looks == all_.looks
    shares = [
        share_open(Habits(Calendar(), {"d": each}, {"d": "a"}), "d", 12) for each in (one, all_)
    ]
    assert shares[0] == pytest.approx(shares[1], abs=0.2)
    assert min(shares) > 0.5


def places(*means: float) -> FloatArray:
    rng = np.random.default_rng(0)
    return np.concatenate([mean + 0.03 * rng.standard_normal(40) for mean in means])


def test_regions_are_those_that_the_places_have() -> None:
    assert region_bounds(np.zeros(100), 0.17, 0.07) == (0.17,)
    assert len(region_bounds(places(0.0, 1.4), 0.17, 0.07)) == 1
    bounds = region_bounds(places(0.0, 0.6, 1.4), 0.17, 0.07)
    assert bounds == pytest.approx((0.17, 1.0), abs=0.1)
    wide = region_bounds(places(0.0, 0.5, 1.2, 1.9), 0.17, 0.07)
    assert region_of(np.array([0.0, 0.5, 1.2, 1.9]), wide).tolist() == [0, 1, 2, 3]
