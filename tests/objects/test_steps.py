"""What is stored of a door for smoothing holds its posterior."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import BuildingErrorSettings, DoorSettings, FurnitureSettings
from objstate.lazy import altered
from objstate.objects import ObjectBelief
from objstate.objects.doors import LatticeFilter
from objstate.objects.furniture_mixture import ORDER, FurnitureMixture, Piece
from objstate.objects.mixture import PACES, DoorMixture, Doorway, Statics
from objstate.objects.steps import DoorStep, FurnitureStep, Past, remembered, step_of
from objstate.particles import Weights
from tests.rooms import door, table

LEAF = door("door", 0.0, 0.0)
DOOR = Doorway(LEAF, DoorSettings(), BuildingErrorSettings())
STATICS = Statics(0.03**2, math.radians(3.0) ** 2)
SECOND = 1_000_000_000


def lattice() -> ObjectBelief:
    return LatticeFilter(LEAF, DoorSettings()).prior(np.random.default_rng(0))


def mixture(seed: int, stamp_ns: int = 0) -> DoorMixture:
    """One with few heavy components and random Gaussians."""
    rng, blank = np.random.default_rng(seed), DoorMixture.unknown(DOOR, STATICS)
    count = len(PACES), 2, len(DOOR.states)
    weights = rng.gamma(0.05, size=count).transpose(1, 0, 2) + 1e-12
    weights[1, :, DOOR.cells :] = 0.0
    weights /= weights.sum(axis=(0, 2), keepdims=True)
    root = rng.normal(scale=0.01, size=blank.covariances.shape)
    return altered(
        blank,
        by_pace=weights,
        log_paces=rng.normal(size=len(PACES)),
        paces=np.full(len(PACES), 1.0 / len(PACES)),
        means=rng.normal(scale=0.01, size=blank.means.shape),
        covariances=root @ root.transpose(0, 2, 1) + 1e-6 * np.eye(root.shape[-1]),
        stamp_ns=stamp_ns,
    )


def narrow(place: int, stamp_ns: int, off: float = 0.0) -> DoorMixture:
    """A door that surely rests in one component, off its middle."""
    whole = mixture(0, stamp_ns)
    means, resting = whole.means.copy(), np.zeros(len(DOOR.states))
    means[place, 3], resting[place] = off, 1.0
    return altered(whole.weighed(resting, np.zeros(len(resting))), means=means)


def held(*mixtures: DoorMixture) -> Past:
    """The past of a belief that had these mixtures."""
    belief = lattice()
    for each in mixtures:
        belief = remembered(altered(belief, joint=each, stamp_ns=each.stamp_ns))
    assert belief.past is not None
    return belief.past


@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_a_step_publishes_what_its_mixture_does_under_any_statics(seed: int) -> None:
    whole, narrower = mixture(seed), Statics(0.005**2, math.radians(0.2) ** 2)
    step = step_of(whole)
    assert isinstance(step, DoorStep)
    for statics in (STATICS, narrower):
        posteriors = step.posterior(step.blank), whole
        (kept, _), (before, _) = (
            each.door.on_lattice(each.under([statics]), lattice()) for each in posteriors
        )
        assert kept == pytest.approx(before, abs=1e-4)
        for p, (kept, before) in enumerate(
            zip(*(each.by_pace_under([statics]).resting[0] for each in posteriors), strict=True)
        ):
            assert kept == pytest.approx(before, abs=0.01), f"pace {p}"


def test_steps_that_are_alike_are_kept_once_a_second() -> None:
    still = [narrow(5, k * SECOND // 10) for k in range(31)]
    stamps = [step.stamp_ns for step in held(*still).steps]
    assert stamps[0] == 0
    assert stamps[-1] == 3 * SECOND
    assert len(stamps) <= 5
    assert max(np.diff(stamps)) <= SECOND


def test_steps_that_differ_are_kept_all() -> None:
    moved = [narrow(5 + k % 2, k * SECOND // 10) for k in range(10)]
    assert len(held(*moved).steps) == 10
    shifted = [narrow(5, k * SECOND // 10, off=0.01 * k) for k in range(10)]
    assert len(held(*shifted).steps) == 10


def test_a_belief_that_is_taken_back_takes_its_past_along() -> None:
    first = remembered(altered(lattice(), joint=narrow(5, 0), stamp_ns=0))
    remembered(altered(first, joint=narrow(9, SECOND), stamp_ns=SECOND))
    after = remembered(altered(first, joint=narrow(6, 2 * SECOND), stamp_ns=2 * SECOND))
    assert after.past is not None
    assert [step.stamp_ns for step in after.past.steps] == [0, 2 * SECOND]


def test_a_belief_on_a_lattice_goes_on_with_the_past() -> None:
    first = remembered(altered(lattice(), joint=narrow(5, 0), stamp_ns=0))
    states = first.states[:, 0]
    weights = np.exp(-0.5 * ((states - 0.6) / 0.01) ** 2)
    own = altered(first, joint=None, weights=Weights.of(weights), stamp_ns=SECOND)
    after = remembered(own)
    assert after.past is not None
    last = after.past.step
    assert isinstance(last, DoorStep)
    read = last.posterior(last.blank).on_lattice(first)
    assert float(read.mean[0]) == pytest.approx(0.6, abs=1e-3)
    assert float(read.std[0]) == pytest.approx(0.01, rel=0.1)


def test_a_belief_without_a_mixture_has_no_past() -> None:
    assert remembered(altered(lattice(), stamp_ns=0)).past is None


def test_a_step_of_furniture_publishes_what_its_mixture_does() -> None:
    chest, rng = Piece(table("table", 0.0, 0.0), FurnitureSettings()), np.random.default_rng(1)
    blank = FurnitureMixture.unknown(chest)
    weights = rng.dirichlet(np.full(len(blank.weights), 0.1))
    step = step_of(altered(blank, weights=weights, stamp_ns=SECOND))
    assert isinstance(step, FurnitureStep)
    assert step.absent + step.weights.sum() == pytest.approx(1.0)
    mean = weights[1:] @ blank.places[1:] / weights[1:].sum()
    assert step.weights @ step.places / step.weights.sum() == pytest.approx(mean, abs=1e-3)
    heavy = int(np.argmax(step.weights))
    kept = blank.covariances[1 + int(np.argmax(weights[1:]))][np.ix_(ORDER, ORDER)]
    assert step.covariances[heavy] == pytest.approx(kept, rel=1e-5)
