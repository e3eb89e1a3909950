"""Rates of being moved."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.learning import Waits, posterior_rate
from objstate.learning.rates import SHAPE


def waits(hours: list[float], moved: list[bool], watched: float = 0.0) -> Waits:
    """Waits of which it is clear whether there was a move."""
    was_moved = np.array(moved, dtype=float)
    return Waits(watched, np.array(hours), 1.0 - was_moved, was_moved)


@settings(max_examples=40)
@given(st.floats(0.1, 20.0), st.floats(0.0, 50.0))
def test_watching_without_a_move_is_the_conjugate_update(prior: float, hours: float) -> None:
    rate = posterior_rate(waits([], [], watched=hours), prior)
    assert rate.mean == pytest.approx(SHAPE / (SHAPE / prior + hours), rel=1e-2)
    assert rate.lower < rate.mean < rate.upper
    assert rate.moves == 0.0


@settings(max_examples=40)
@given(st.integers(0, 20), st.floats(0.5, 10.0))
def test_moves_that_were_watched_are_the_conjugate_update(moves: int, prior: float) -> None:
    seconds = [1.0 / 3600.0] * moves
    rate = posterior_rate(waits(seconds, [True] * moves, watched=2.0), prior)
    assert rate.mean == pytest.approx((SHAPE + moves) / (SHAPE / prior + 2.0), rel=1e-2)
    assert rate.moves == pytest.approx(moves)


@pytest.mark.parametrize("hours", [0.05, 0.5])
def test_how_seldom_it_was_looked_at_does_not_shift_the_rate(hours: float) -> None:
    true = 2.0
    seen = np.arange(3000) < 3000 * -np.expm1(-true * hours)
    rate = posterior_rate(waits([hours] * 3000, seen.tolist()), 1.0)
    assert rate.mean == pytest.approx(true, rel=0.01)


def test_intervals_hold_the_rates_that_priors_give() -> None:
    rng, inside = np.random.default_rng(5), 0
    for _ in range(300):
        true = rng.gamma(SHAPE, 2.0 / SHAPE)
        hours = rng.uniform(0.02, 0.6, 20)
        rate = posterior_rate(waits(hours.tolist(), (rng.random(20) < -np.expm1(-true * hours)).tolist()), 2.0)  # fmt: skip
        inside += rate.lower <= true <= rate.upper
    assert 0.84 <= inside / 300 <= 0.96


def test_an_unclear_look_counts_by_how_likely_it_is() -> None:
    unclear = Waits(0.0, np.array([1.0]), np.array([1.0]), np.array([1.0]))
    assert posterior_rate(unclear, 2.0).mean == pytest.approx(2.0, rel=1e-2)


def test_waits_of_several_objects_add_up() -> None:
    joined = Waits.joined([waits([1.0], [True], 0.5), waits([2.0], [False], 0.25)])
    assert joined.total == pytest.approx(3.75)
    assert joined.moves(2.0) == pytest.approx(1.0)
