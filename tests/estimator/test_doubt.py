"""The record of a robot's being lost."""

from __future__ import annotations

from objstate.config import LocalizationSettings
from objstate.estimator.doubt import Doubt

SETTINGS = LocalizationSettings(lost_after=4.0)
SECOND = 10**9


def test_a_robot_that_fits_was_never_lost() -> None:
    doubt = Doubt(SETTINGS)
    for second in range(5):
        doubt.dispel(second * SECOND)
    assert doubt.stretches(9 * SECOND) == ()
    assert not doubt.is_lost


def test_it_was_lost_since_it_last_fitted_and_up_to_now() -> None:
    doubt = Doubt(SETTINGS)
    doubt.dispel(2 * SECOND)
    doubt.rise()
    assert doubt.is_lost
    assert doubt.stretches(7 * SECOND) == ((2 * SECOND, 7 * SECOND),)


def test_it_is_lost_until_it_fits_again_or_was_found() -> None:
    doubt = Doubt(SETTINGS)
    doubt.rise()
    doubt.dispel(3 * SECOND)
    doubt.rise()
    doubt.found(5 * SECOND)
    assert doubt.stretches(9 * SECOND) == ((0, 3 * SECOND), (3 * SECOND, 5 * SECOND))
    assert not doubt.is_lost


def test_where_no_place_fits_better_it_was_never_lost_and_the_next_search_waits() -> None:
    """Twice as long each time, until the track fits again."""
    doubt = Doubt(SETTINGS)
    now = 10 * SECOND
    for wait in (8, 16, 32):
        assert doubt.may_search(now)
        doubt.rise()
        doubt.settle(now)
        assert doubt.stretches(now) == ()
        assert not doubt.may_search(now + wait * SECOND - 1)
        now += wait * SECOND
    doubt.dispel(now)
    assert doubt.may_search(now)
    doubt.settle(now)
    assert doubt.may_search(now + 8 * SECOND)
