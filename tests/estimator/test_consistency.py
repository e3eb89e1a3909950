"""Whether beliefs are as sure as they say, learnt from made-up filters of a number at rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from objstate.building.model import Kind
from objstate.config import ConsistencySettings, DoorSettings
from objstate.estimator.consistency import Consistency
from objstate.objects import ObjectBelief
from objstate.objects.doors import LatticeFilter
from objstate.particles import Weights
from tests.rooms import door

SETTINGS = ConsistencySettings(weight=1.0)
DOORS = 30
SCANS = 26
NOISE = 0.05  # rad of one reading
FILTER = LatticeFilter(door("door", 0.0, 0.0), DoorSettings(resolution_deg=0.1))
PRIOR = FILTER.prior(np.random.default_rng(0))


def gaussian(name: str, mean: float, std: float) -> ObjectBelief:
    weights = Weights.of(norm.pdf(PRIOR.states[:, 0], mean, std))
    return replace(PRIOR.with_weights(weights), item=replace(PRIOR.item, name=name))


def learnt(believed_noise: float, seed: int = 0) -> float:
    """The factor, when Kalman filters take readings to be as exact as ``believed_noise``."""
    consistency = Consistency(SETTINGS)
    teach(consistency, believed_noise, seed)
    return consistency.factor(Kind.HINGED)


def teach(consistency: Consistency, believed_noise: float, seed: int = 0) -> None:
    """Let Kalman filters take readings to be as exact as ``believed_noise``."""
    rng = np.random.default_rng(seed)
    for k in range(DOORS):
        name, true = f"door_{k}", 0.8
        mean, variance = true + 0.06 * rng.standard_normal(), 0.06**2
        before = gaussian(name, mean, np.sqrt(variance))
        for _ in range(SCANS):
            gain = variance / (variance + believed_noise**2)
            mean += gain * (true + NOISE * rng.standard_normal() - mean)
            variance *= 1.0 - gain
            after = gaussian(name, mean, np.sqrt(variance))
            consistency.note(before, after)
            before = after


def test_the_factor_is_one_for_filters_that_are_right() -> None:
    assert np.mean([learnt(NOISE, seed) for seed in range(3)]) == pytest.approx(1.0, abs=0.3)


def test_filters_that_say_too_little_are_to_be_narrower() -> None:
    assert learnt(3.0 * NOISE) < 0.5


def test_filters_that_say_too_much_are_to_be_wider() -> None:
    assert learnt(NOISE / 3.0) > 2.0


def test_without_evidence_the_factor_is_one() -> None:
    assert Consistency(SETTINGS).factor(Kind.HINGED) == 1.0
    assert Consistency(SETTINGS).factor(Kind.PLANAR) == 1.0


def test_each_class_learns_for_itself_and_unsettled_beliefs_teach_nothing() -> None:
    consistency, wide = Consistency(SETTINGS), gaussian("door", 0.8, 0.3)
    for _ in range(50):
        consistency.note(wide, gaussian("door", 0.9, 0.25))
    assert consistency.factor(Kind.HINGED) == 1.0
    for _ in range(50):
        before, after = gaussian("door", 0.8, 0.05), gaussian("door", 0.9, 0.04)
        consistency.note(before, after)
    assert consistency.factor(Kind.HINGED) > 1.0
    assert consistency.factor(Kind.SLIDING) == 1.0


@pytest.mark.parametrize("believed_noise", [NOISE / 100.0, NOISE * 100.0])
def test_the_factor_keeps_between_its_bounds(believed_noise: float) -> None:
    assert SETTINGS.least <= learnt(believed_noise) <= SETTINGS.most


def test_that_a_door_may_have_been_moved_teaches_nothing_of_widths() -> None:
    consistency, rng, states = (
        Consistency(SETTINGS),
        np.random.default_rng(0),
        PRIOR.states[:, 0],
    )
    a_while = 10.0  # s
    for k in range(DOORS):
        belief = gaussian(f"door_{k}", 0.8 + 0.06 * rng.standard_normal(), 0.06)
        for _ in range(SCANS):
            predicted = FILTER.predict(belief, a_while, rng)
            told = norm.logpdf(0.8 + NOISE * rng.standard_normal(), states, NOISE)
            after = predicted.with_weights(predicted.weights.reweight(told)[0])
            if predicted.settled:
                consistency.note(belief.drifted(FILTER.drift_variance(a_while)), after)
            belief = after
    assert consistency.factor(Kind.HINGED) == pytest.approx(1.0, abs=0.3)


def test_a_door_that_somebody_moves_teaches_nothing() -> None:
    consistency, (here, there) = (
        Consistency(SETTINGS),
        (gaussian("door", a, 0.02) for a in (0.4, 1.2)),
    )
    for before, after in [(here, there), (there, here)] * 20:
        consistency.note(before, after)
    assert consistency.factor(Kind.HINGED) == 1.0
