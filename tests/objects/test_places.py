"""Laws of places: competing ones stay apart, copies keep what they are copies of."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.geometry import FloatArray
from objstate.objects.places import copies, occupied
from objstate.particles import Weights, systematic

NARROW = np.array([0.004, 0.004, np.radians(0.3)])
WIDEST = np.array([0.02, 0.02, np.radians(4.0)])
SEEDS = st.integers(0, 10_000)


def about(middle: tuple[float, float, float], rng: np.random.Generator, count: int) -> FloatArray:
    return np.array(middle) + NARROW * rng.standard_normal((count, 3))


def copied(
    off: FloatArray, weights: FloatArray, count: int, rng: np.random.Generator
) -> FloatArray:
    off = off - weights @ off / weights.sum()
    return copies(off, weights, systematic(Weights.of(weights), count, rng), WIDEST, rng)


@settings(max_examples=20)
@given(SEEDS)
def test_two_headings_that_compete_do_not_blur_each_other(seed: int) -> None:
    rng = np.random.default_rng(seed)
    off = np.concatenate(
        [about((0.0, 0.0, 0.0), rng, 60), about((0.05, -0.1, np.radians(55.0)), rng, 20)]
    )
    out = copied(off, np.full(80, 1.0 / 80.0), 400, rng)
    turned = out[:, 2] > np.radians(55.0 / 4.0)
    assert turned.mean() == pytest.approx(0.25, abs=0.01)
    for part, before in ((out[turned], off[60:]), (out[~turned], off[:60])):
        np.testing.assert_array_less(part.std(axis=0), 2.0 * before.std(axis=0))
        np.testing.assert_array_less(0.8 * before.std(axis=0), part.std(axis=0))


@settings(max_examples=20)
@given(SEEDS)
def test_copies_of_samples_in_one_place_keep_their_mean_and_their_deviations(seed: int) -> None:
    rng = np.random.default_rng(seed)
    off, weights = about((0.0, 0.0, 0.0), rng, 100), rng.dirichlet(np.full(100, 5.0))
    off -= weights @ off
    out = copied(off, weights, 300, rng)
    np.testing.assert_allclose(out.mean(axis=0), 0.0, atol=1e-9)
    np.testing.assert_allclose(out.std(axis=0), np.sqrt(weights @ off**2), rtol=0.2)


def test_copies_of_a_sample_that_is_alone_are_spread_as_widely_as_may_be() -> None:
    out = copied(np.zeros((1, 3)), np.ones(1), 4000, np.random.default_rng(0))
    np.testing.assert_allclose(out.std(axis=0), WIDEST, rtol=0.05)


def test_cells_that_touch_make_one_place_and_others_do_not() -> None:
    row = np.column_stack([np.linspace(0.0, 0.5, 50), np.zeros((50, 2))])
    for aside, is_one in ((0.0, True), (np.radians(40.0), False)):
        both = np.concatenate([row, row + np.array([0.0, 0.0, aside])])
        weights = np.random.default_rng(0).dirichlet(np.full(100, 0.3))
        out = copied(both, weights, 7, np.random.default_rng(1))
        is_kept = np.abs(out.mean(axis=0)).max() < 1e-9  # as only that of a single place is
        assert is_kept == is_one


def test_cells_are_counted_as_if_filled_evenly() -> None:
    off = np.array([[0.1 * k, 0.0, 0.0] for k in range(4)])
    assert occupied(off, np.full(4, 0.25)) == 4
    assert occupied(off, np.array([1.0, 0.0, 0.0, 0.0])) == 1
