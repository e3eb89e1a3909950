"""Laws of beliefs given robot samples: rows are distributions, averaging is the marginal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import DoorSettings
from objstate.geometry import FloatArray
from objstate.objects import ConditionalBelief, Descent
from objstate.objects.doors import LatticeFilter
from objstate.particles import Weights
from tests.rooms import door

FILTER = LatticeFilter(door("door", 0.0, 0.0), DoorSettings(resolution_deg=5.0))
PRIOR = FILTER.prior(np.random.default_rng(0))
SEEDS = st.integers(0, 10_000)
ROBOTS = st.integers(1, 8)
SHARES = st.floats(0.0, 1.0)


def tables(seed: int, robots: int) -> tuple[ConditionalBelief, FloatArray]:
    """What each robot sample believes, and the robot weights (l,) that average it."""
    rng = np.random.default_rng(seed)
    rows = rng.dirichlet(np.ones(len(PRIOR.states)), robots)
    robot = rng.dirichlet(np.ones(robots))
    return ConditionalBelief.independent(PRIOR, robots).averaged(rows, robot), robot


@settings(max_examples=30)
@given(SEEDS, ROBOTS)
def test_averaging_is_the_marginal(seed: int, robots: int) -> None:
    believed, robot = tables(seed, robots)
    written_out = [
        sum(weight * row[s] for weight, row in zip(robot, believed.given, strict=True))
        for s in range(len(PRIOR.states))
    ]
    np.testing.assert_allclose(believed.belief.weights.values, written_out, atol=1e-14)


@settings(max_examples=30)
@given(SEEDS, ROBOTS, SHARES, st.floats(0.0, 5000.0))
def test_whatever_is_done_rows_sum_to_one(
    seed: int, robots: int, share: float, seconds: float
) -> None:
    believed, _ = tables(seed, robots)
    ancestors = np.random.default_rng(seed).integers(0, robots, 5)
    predicted = FILTER.predict_each(believed, seconds, np.random.default_rng(0))
    for each in (
        believed.handed_on(Descent(share)),
        believed.handed_on(Descent(share, ancestors)),
        predicted,
    ):
        np.testing.assert_allclose(each.given.sum(axis=1), 1.0, atol=1e-12)
        assert (each.given >= 0.0).all()


@settings(max_examples=30)
@given(SEEDS, ROBOTS, SHARES)
def test_blending_keeps_the_marginal_and_brings_the_rows_nearer_to_it(
    seed: int, robots: int, share: float
) -> None:
    believed, robot = tables(seed, robots)
    blended = believed.handed_on(Descent(share))
    marginal = believed.belief.weights.values
    np.testing.assert_allclose(robot @ blended.given, marginal, atol=1e-14)
    off = (1.0 - share) * (believed.given - marginal)
    np.testing.assert_allclose(blended.given - marginal, off, atol=1e-14)


@settings(max_examples=30)
@given(SEEDS, ROBOTS, st.floats(0.0, 5000.0))
def test_the_mean_of_predicted_rows_is_the_predicted_marginal(
    seed: int, robots: int, seconds: float
) -> None:
    believed, robot = tables(seed, robots)
    later = FILTER.predict_each(believed, seconds, np.random.default_rng(0))
    np.testing.assert_allclose(robot @ later.given, later.belief.weights.values, atol=1e-12)


def test_a_resampled_robot_sample_believes_what_its_ancestor_did() -> None:
    believed, _ = tables(0, 4)
    after = believed.handed_on(Descent(0.0, np.array([2, 2, 0, 3, 3])))
    np.testing.assert_array_equal(after.given, believed.given[[2, 2, 0, 3, 3]])
    assert after.belief is believed.belief


@settings(max_examples=30)
@given(SEEDS, ROBOTS, SHARES, SHARES, st.booleans(), st.booleans())
def test_what_is_handed_on_twice_may_be_handed_on_at_once(
    seed: int, robots: int, share: float, later: float, resampled: bool, again: bool
) -> None:
    believed, _ = tables(seed, robots)
    rng, size = np.random.default_rng(seed), 5 if resampled else robots
    one = Descent(share, rng.integers(0, robots, 5) if resampled else None)
    other = Descent(later, rng.integers(0, size, 7) if again else None)
    twice, at_once = believed.handed_on(one).handed_on(other), believed.handed_on(one.then(other))
    for each in ("given", "presence", "inherited"):
        np.testing.assert_allclose(getattr(at_once, each), getattr(twice, each), atol=1e-14)


@settings(max_examples=30)
@given(SEEDS, ROBOTS, SHARES, st.floats(0.0, 5000.0))
def test_what_is_handed_on_may_be_predicted_at_once(
    seed: int, robots: int, share: float, seconds: float
) -> None:
    believed, robot = tables(seed, robots)
    believed = believed.apportioned(PRIOR, robot)
    ancestors = np.random.default_rng(seed).integers(0, robots, 5)
    descent, rng = Descent(share, ancestors), np.random.default_rng(0)
    written_out = FILTER.predict_each(believed.handed_on(descent), seconds, rng)
    at_once = FILTER.predict_each(believed, seconds, rng, descent)
    for each in ("given", "presence", "inherited"):
        np.testing.assert_allclose(getattr(at_once, each), getattr(written_out, each), atol=1e-14)
    np.testing.assert_allclose(
        at_once.belief.weights.values, written_out.belief.weights.values, atol=1e-14
    )


@settings(max_examples=30)
@given(SEEDS, ROBOTS, st.booleans())
def test_a_door_is_settled_by_the_steps_that_it_stands_for(
    seed: int, robots: int, goes_round: bool
) -> None:
    believed, _ = tables(seed, robots)
    if goes_round:
        turning = replace(believed.belief, item=replace(PRIOR.item, wraps=True))
        believed = replace(believed, belief=turning)
    before = replace(believed.belief, shared=np.array([0.02]))
    believed = replace(believed, belief=before, inherited=np.array([0.01]))
    seen = np.random.default_rng(seed + 1).dirichlet(np.ones(robots))
    settled = believed.settled(before, seen)
    steps = believed.averaged(believed.given, seen).apportioned(before, seen)
    np.testing.assert_array_equal(settled.given, believed.given)
    np.testing.assert_allclose(settled.inherited, steps.inherited, rtol=1e-9)
    for each in ("mean", "std", "shared"):
        np.testing.assert_allclose(
            getattr(settled.belief, each), getattr(steps.belief, each), rtol=1e-9, atol=1e-12
        )
    moments = replace(settled.belief, stamp_ns=1)  # which has to work them out
    np.testing.assert_allclose(moments.mean, settled.belief.mean, rtol=1e-9)
    np.testing.assert_allclose(moments.std, settled.belief.std, rtol=1e-9)


@pytest.mark.parametrize("robots", [1, 7])
def test_at_first_every_robot_sample_believes_the_same(robots: int) -> None:
    believed = ConditionalBelief.independent(PRIOR, robots)
    np.testing.assert_array_equal(believed.given, np.tile(PRIOR.weights.values, (robots, 1)))


# --- what errors of the robot cause -------------------------------------------------


@settings(max_examples=30)
@given(SEEDS, ROBOTS)
def test_what_robot_samples_disagree_about_is_shared_and_the_rest_is_theirs(
    seed: int, robots: int
) -> None:
    believed, robot = tables(seed, robots)
    belief = believed.apportioned(PRIOR, robot).belief
    off = PRIOR.states[:, 0] - believed.belief.mean
    means = believed.given @ off
    within = robot @ (believed.given @ off**2 - means**2)
    cell = PRIOR.cell[0] ** 2 / 12.0
    assert belief.shared[0] + within + cell == pytest.approx(belief.std[0] ** 2)
    np.testing.assert_array_equal(belief.weights.values, believed.belief.weights.values)


@settings(max_examples=30)
@given(SEEDS, ROBOTS, SHARES)
def test_what_is_forgotten_of_the_robots_errors_stays_in_the_belief(
    seed: int, robots: int, share: float
) -> None:
    believed, robot = tables(seed, robots)
    before = believed.apportioned(PRIOR, robot)
    blended = before.handed_on(Descent(share))
    after = blended.averaged(blended.given, robot).apportioned(blended.belief, robot)
    np.testing.assert_allclose(after.belief.shared, before.belief.shared, rtol=1e-6, atol=1e-15)


def test_of_former_errors_is_left_what_a_scan_leaves_of_the_mean() -> None:
    wide, narrow = (
        PRIOR.with_weights(Weights.of(np.exp(-0.5 * ((PRIOR.states[:, 0] - 0.8) / std) ** 2)))
        for std in (0.4, 0.2)
    )
    seen = ConditionalBelief.independent(replace(wide, shared=np.array([0.01])), 3)
    given = np.tile(narrow.weights.values, (3, 1))
    after = seen.averaged(given, np.full(3, 1.0 / 3.0)).apportioned(wide, np.full(3, 1.0 / 3.0))
    left = (narrow.std / wide.std) ** 2
    np.testing.assert_allclose(after.belief.shared, 0.01 * left**2, rtol=1e-9)
