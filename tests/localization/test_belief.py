"""Laws of a belief's mean and spread, and of the samples that stand for it."""

from __future__ import annotations

import copy
import pickle

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from objstate.geometry import FloatArray, wrap
from objstate.localization import PoseBelief
from objstate.particles import Weights

places = st.tuples(st.floats(-50, 50), st.floats(-50, 50)).map(np.array)


@given(places, st.floats(-np.pi, np.pi))
def test_mean_and_covariance_do_not_see_where_pi_is(place: FloatArray, turn: float) -> None:
    rng = np.random.default_rng(3)
    poses, weights = rng.normal(0.0, [0.3, 0.2, 0.1], (50, 3)), Weights.of(rng.random(50))
    moved = poses + np.array([*place, turn])
    moved[:, 2] = wrap(moved[:, 2])
    here, there = PoseBelief(poses, weights), PoseBelief(moved, weights)
    off = there.mean - here.mean - np.array([*place, turn])
    np.testing.assert_allclose([*off[:2], wrap(off[2])], 0.0, atol=1e-9)
    np.testing.assert_allclose(there.covariance, here.covariance, atol=1e-8)


def test_covariance_is_numpys() -> None:
    rng = np.random.default_rng(0)
    belief = PoseBelief(rng.normal(0.0, 0.1, (40, 3)), Weights.of(rng.random(40)))
    reference = np.cov(belief.poses[:, :2].T, aweights=belief.weights.values, ddof=0)
    np.testing.assert_allclose(belief.covariance[:2, :2], reference)
    np.testing.assert_allclose(belief.position_std**2, np.linalg.eigvalsh(reference)[1])


def test_a_belief_whose_samples_are_not_drawn_yet_can_be_pickled_and_copied() -> None:
    draws = np.random.default_rng(0).standard_normal((30, 3))
    belief = PoseBelief.whitened(np.array([1.0, 2.0, 3.1]), np.diag([0.01, 0.02, 0.03]), draws)
    for other in (pickle.loads(pickle.dumps(belief)), copy.deepcopy(belief)):
        np.testing.assert_array_equal(other.mean, belief.mean)
        np.testing.assert_array_equal(other.poses, belief.poses)
