"""Laws of exchanging the priors of a door's static errors, and of reading its state off."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import BuildingErrorSettings, DoorSettings
from objstate.geometry import FloatArray
from objstate.lazy import altered
from objstate.objects.doors import LatticeFilter
from objstate.objects.mixture import DoorMixture, Doorway, States, Statics
from objstate.objects.mixture_kernels import ERRORS, ORIGIN, STATE, ZERO
from tests.rooms import door

WIDE = Statics(0.03**2, math.radians(3.0) ** 2)
NARROW = Statics(0.004**2, math.radians(0.5) ** 2)
STATIC = [ORIGIN, ORIGIN + 1, ZERO]  # the errors of hinge and bearing


def mixture(seed: int) -> DoorMixture:
    """A posterior under the wide prior: what readings added to its precision is at random."""
    rng = np.random.default_rng(seed)
    blank = DoorMixture.unknown(
        Doorway(door("door", 0.0, 0.0, 0.0), DoorSettings(), BuildingErrorSettings()), WIDE
    )
    count = len(blank.means)
    rows = rng.standard_normal((count, 4, ERRORS)) / 0.01
    prior = blank.covariances + 1e-4 * np.diag([1.0] * 3 + [0.0] * (ERRORS - 3))
    covariances = np.linalg.inv(np.linalg.inv(prior) + rows.transpose(0, 2, 1) @ rows)
    covariances = 0.5 * (covariances + covariances.transpose(0, 2, 1))
    resting, moving = rng.dirichlet(np.ones(2 * len(blank.resting))).reshape(2, -1)
    means = rng.multivariate_normal(np.zeros(ERRORS), 1e-4 * np.eye(ERRORS), count)
    return altered(blank, resting=resting, moving=moving, means=means, covariances=covariances)


def exchanged(whole: DoorMixture, to: Statics) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Log factors of weights, means and covariances by the whole matrices of information.

    Of components between the limits, and of these.
    """
    count = len(whole.resting)
    whole = altered(
        whole, means=whole.means[:count], covariances=whole.covariances[:count], beyond=np.zeros(0)
    )
    added = np.zeros((ERRORS, ERRORS))
    added[STATIC, STATIC] = 1.0 / np.array([to.hinge, to.hinge, to.bearing]) - 1.0 / np.array(
        [WIDE.hinge, WIDE.hinge, WIDE.bearing]
    )
    covariances = np.linalg.inv(np.linalg.inv(whole.covariances) + added)
    means = whole.means - np.einsum("cij,jk,ck->ci", covariances, added, whole.means)
    inside = np.eye(ERRORS) + added @ whole.covariances
    spent = np.einsum("ci,ij,cj->c", whole.means, added, means)
    return -0.5 * np.log(np.linalg.det(inside)) - 0.5 * spent, means, covariances


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_another_prior_is_added_information(seed: int) -> None:
    whole = mixture(seed)
    states = whole.under([WIDE, NARROW])
    log, means, covariances = exchanged(whole, NARROW)
    factors = np.exp(log - log.max())
    total = (whole.weights * factors).sum()
    assert states.resting[0] == pytest.approx(whole.resting)
    assert states.resting[1] == pytest.approx(whole.resting * factors / total, rel=1e-6)
    assert states.moving[1] == pytest.approx(whole.moving * factors / total, rel=1e-6)
    middles = whole.door.states
    assert states.means[1] == pytest.approx(middles + means[:, STATE] - means[:, ZERO], abs=1e-9)
    both = covariances[:, STATE, STATE] + covariances[:, ZERO, ZERO]
    both -= 2.0 * covariances[:, STATE, ZERO]
    assert states.variances[1] == pytest.approx(both, rel=1e-6)


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=10, deadline=None)
def test_the_evidence_of_a_prior_is_what_weights_change_by(seed: int) -> None:
    whole, tried = mixture(seed), np.geomspace(1e-6, WIDE.hinge, 5)
    told = whole.log_evidence("hinge", tried)
    for k, variance in enumerate(tried):
        log, _, _ = exchanged(whole, WIDE._replace(hinge=variance))
        log += math.log(WIDE.hinge / variance)
        assert told[k] == pytest.approx(np.log(whole.weights @ np.exp(log)), abs=1e-6)


def test_a_state_is_read_off_as_normal_distributions_and_atoms() -> None:
    opening = mixture(0).door
    belief = LatticeFilter(opening.item, DoorSettings()).prior(np.random.default_rng(0))
    count = len(opening.states)
    resting, moving = np.zeros((2, count)), np.zeros((2, count))
    resting[0, 10], moving[0, 10], resting[0, -2], resting[1, -1] = 0.5, 0.25, 0.25, 1.0
    means, variances = np.tile(opening.states, (2, 1)), np.full((2, count), 0.02**2)
    weights, p_moving = opening.on_lattice(States(resting, moving, means, variances), belief)
    off = (belief.states[:, 0] - opening.states[10]) / 0.02
    near = np.exp(-0.5 * off**2)
    expected = 0.75 * near / near.sum()
    expected[0] += 0.25
    assert weights[0] == pytest.approx(expected, abs=2e-4)
    assert p_moving[0][np.abs(off) < 3.0] == pytest.approx(1.0 / 3.0, abs=1e-6)
    assert weights[1][-1] == pytest.approx(1.0)
