"""Latched doors by the Savage-Dickey ratio: laws."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.geometry import FloatArray
from objstate.objects.latch_kernels import limit
from objstate.objects.mixture_kernels import ERRORS, STATE, ZERO

LOWER, UPPER, CELL = 0.0, 1.5, 0.5
MIDDLES = np.array([0.25, 0.75, 1.25, LOWER, UPPER, -0.25, 1.75])  # cells, limits, beyond them
CELLS, ATOM = 3, 3
FREE = np.array([True, True, True, False, False, True, True])


class Prior(NamedTuple):
    """A mixture before a scan."""

    weights: FloatArray
    widths: FloatArray
    means: FloatArray
    covariances: FloatArray


def prior(rng: np.random.Generator) -> Prior:
    """Some Gaussians with errors that go together."""
    root = rng.normal(scale=0.1, size=(len(MIDDLES), ERRORS, ERRORS))
    covariances = root @ root.transpose(0, 2, 1) + 0.01 * np.eye(ERRORS)
    means = rng.normal(scale=0.05, size=(len(MIDDLES), ERRORS))
    return Prior(rng.dirichlet(np.ones(7)), rng.uniform(1e-4, 1e-2, 7), means, covariances)


def seen(
    before: Prior, row: FloatArray, value: float, variance: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means, covariances, log evidence after reading that row . errors + middle has a value."""
    off = value - MIDDLES - before.means @ row
    along = before.covariances @ row
    spread = along @ row + variance
    gains = along / spread[:, None]
    means = before.means + gains * off[:, None]
    covariances = before.covariances - gains[:, :, None] * along[:, None, :]
    log = -0.5 * off**2 / spread - 0.5 * np.log(2.0 * math.pi * spread)
    return means, covariances, log


def leaf_row(rng: np.random.Generator) -> FloatArray:
    """A reading of the leaf's place, beside errors of robot and hinge, but not of the bearing."""
    row = np.append(rng.normal(size=ZERO), 0.0)
    row[STATE] = 1.0
    return row


def at_lower(
    before: Prior, means: FloatArray, covariances: FloatArray, log: FloatArray
) -> tuple[float, FloatArray, FloatArray]:
    """Log evidence, mean and covariance of a door latched at the lower limit."""
    means, covariances, log = limited(before, means, covariances, log)
    return float(log[ATOM]), means[ATOM], covariances[ATOM]


def limited(
    before: Prior, means: FloatArray, covariances: FloatArray, log: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Means, covariances and log evidence of all components, by what limits mean."""
    means, covariances, log = means.copy(), covariances.copy(), np.where(FREE, log, -np.inf)
    limit(
        before.weights,
        MIDDLES,
        before.widths,
        CELLS,
        before.means,
        before.covariances,
        means,
        covariances,
        log,
    )
    return means, covariances, log


def alone(before: Prior, component: int) -> Prior:
    """The same with all weight in one component."""
    weights = np.full(len(MIDDLES), 1e-30)
    weights[component] = 1.0
    return before._replace(weights=weights)


@given(seed=st.integers(0, 2**32 - 1), component=st.integers(0, CELLS - 1))
@settings(max_examples=50, deadline=None)
def test_a_latched_door_is_a_free_one_given_that_it_stands_at_the_limit(
    seed: int, component: int
) -> None:
    """First the limit, then the reading: the same as first the reading, then the limit."""
    rng = np.random.default_rng(seed)
    before, row, variance = alone(prior(rng), component), leaf_row(rng), 0.01
    value = float(MIDDLES[component] + before.means[component] @ row + 0.3 * rng.normal())
    evidence, mean, covariance = at_lower(before, *seen(before, row, value, variance))

    own, cov = before.means[component], before.covariances[component]
    state = np.zeros(ERRORS)
    state[STATE], state[ZERO] = 1.0, -1.0
    off = LOWER - MIDDLES[component] - own @ state
    spread = state @ cov @ state + before.widths[ATOM]
    latched = own + cov @ state * off / spread
    given_limit = cov - np.outer(cov @ state, cov @ state) / spread
    spread = row @ given_limit @ row + variance
    off = value - MIDDLES[component] - latched @ row
    expected = -0.5 * off**2 / spread - 0.5 * math.log(2.0 * math.pi * spread)
    assert evidence == pytest.approx(expected, abs=1e-6)

    last = latched + given_limit @ row * off / spread
    after = given_limit - np.outer(given_limit @ row, given_limit @ row) / spread
    others = [0, 1, 2, 4, 5, 6]
    assert mean[others] == pytest.approx(last[others], abs=1e-7)
    assert covariance[np.ix_(others, others)] == pytest.approx(
        after[np.ix_(others, others)], abs=1e-7
    )
    play = MIDDLES[component] + last @ state - LOWER
    assert mean[STATE] == pytest.approx(play, abs=1e-7)
    assert covariance[STATE, STATE] == pytest.approx(state @ after @ state, abs=1e-7)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_the_evidence_of_several_scans_is_that_of_all_at_once(seed: int) -> None:
    """Which components hold the leaf doesn't matter: the sum of steps is the whole way."""
    rng = np.random.default_rng(seed)
    first = prior(rng)
    total, now = 0.0, first
    every = np.zeros(len(MIDDLES))
    for _ in range(5):
        means, covariances, log = seen(now, leaf_row(rng), 0.1, 0.05)
        every += log
        *_, log = limited(now, means, covariances, log)
        total += float(log[ATOM])
        weights = np.maximum(now.weights * np.exp(log), 1e-300)
        now = Prior(weights, first.widths, means, covariances)
    assert total == pytest.approx(at_lower(first, now.means, now.covariances, every)[0], abs=1e-6)


def test_a_cell_beyond_a_limit_counts_only_while_the_leaf_stands_there() -> None:
    rng = np.random.default_rng(0)
    before = prior(rng)._replace(covariances=np.tile(1e-4 * np.eye(ERRORS), (7, 1, 1)))
    means = np.zeros((7, ERRORS))
    still, gone = means.copy(), means.copy()
    still[:, ZERO] = gone[:, ZERO] = -0.25  # the bearing explains a leaf at -0.25
    gone[5, STATE] = 0.35  # and would explain one at 0.1, where it began at the limit
    gone[5, ZERO] = 0.1
    nothing = np.zeros(7)
    there = at_lower(before._replace(means=still), still, before.covariances, nothing)
    left = at_lower(before._replace(means=still), gone, before.covariances, nothing)
    assert there[0] == pytest.approx(0.0, abs=1e-9)
    assert left[0] < -10.0


@given(value=st.floats(-0.5, 2.0), std=st.floats(0.15, 1.0), cell=st.integers(0, CELLS - 1))
@settings(max_examples=50, deadline=None)
def test_a_free_door_stands_between_its_limits(value: float, std: float, cell: int) -> None:
    """The evidence of a reading is that of a state whose prior ends at the limits."""
    own = np.zeros((ERRORS, ERRORS))
    own[STATE, STATE] = 0.09
    before = Prior(
        np.full(7, 1 / 7), np.full(7, 1e-8), np.zeros((7, ERRORS)), np.tile(own, (7, 1, 1))
    )
    row = np.zeros(ERRORS)
    row[STATE] = 1.0
    *_, log = limited(before, *seen(before, row, value, std**2))
    states = np.linspace(LOWER, UPPER, 20001)
    density = np.exp(-0.5 * (states - MIDDLES[cell]) ** 2 / 0.09)
    likelihood = np.exp(-0.5 * ((value - states) / std) ** 2) / (std * math.sqrt(2.0 * math.pi))
    expected = math.log((density * likelihood).sum() / density.sum())
    assert log[cell] == pytest.approx(expected, abs=2e-3)
