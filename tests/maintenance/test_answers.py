"""Verification, falsification and detection as distributions."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.errors import WorldError
from objstate.maintenance import (
    Detection,
    Expectation,
    Falsification,
    Outcome,
    Verification,
    as_object,
    associated,
    falsified,
    outcome,
    verified,
)
from objstate.maintenance.answers import CLUTTER, NEW, agreement, combined
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from tests.gaze.places import chest, prior, two_rooms

ROOMS = two_rooms(chest("chest", 2.0, 1.0))
DOOR, CHEST = prior(ROOMS["door"]), prior(ROOMS["chest"])
COV = np.diag([0.05, 0.05, 0.1]) ** 2
WORDS = st.dictionaries(st.sampled_from(["cup", "mug", "bin"]), st.floats(0.01, 1.0), min_size=1)


def normal(values: dict[str, float]) -> dict[str, float]:
    return {name: value / sum(values.values()) for name, value in values.items()}


def test_a_verified_door_is_where_it_was_measured_and_its_presence_stays() -> None:
    after = verified(DOOR, Verification("door", np.array([0.7]), np.array([[0.03**2]])))
    assert after.mean[0] == pytest.approx(0.7, abs=0.01)
    assert after.std[0] == pytest.approx(0.03, abs=0.006)
    assert after.presence == DOOR.presence
    assert after.last_observed_ns == DOOR.stamp_ns


def test_verified_furniture_is_the_product_of_belief_and_measurement() -> None:
    rng = np.random.default_rng(0)
    states = np.array([2.0, 1.0, 0.0]) + 0.1 * rng.standard_normal((50_000, 3))
    belief = CHEST.with_samples(states, Weights.uniform(len(states)))
    measured = Verification("chest", np.array([2.1, 1.0, 0.0]), 0.1**2 * np.eye(3))
    after = verified(belief, measured)
    assert after.mean[0] == pytest.approx(2.05, abs=0.005)
    assert after.std[:2] == pytest.approx(0.1 / np.sqrt(2.0), rel=0.05)
    assert after.presence == belief.presence


@given(st.floats(0.01, 0.99), st.floats(-20.0, 20.0))
def test_falsification_is_bayes_rule_of_the_presence_alone(presence: float, ratio: float) -> None:
    before = replace(CHEST, presence=presence)
    after = falsified(before, Falsification("chest", ratio))
    there = presence / (presence + (1.0 - presence) * np.exp(ratio))
    assert after.presence == pytest.approx(there, abs=2e-6)
    assert (after.states == before.states).all()


def test_an_object_that_is_falsified_again_and_again_is_absent() -> None:
    belief, now = replace(CHEST, last_observed_ns=0), 0
    before = belief
    for now in range(1, 4):
        belief = falsified(replace(belief, stamp_ns=now), Falsification("chest", 2.0))
    assert outcome(Expectation.of(before), before, belief) is Outcome.ABSENT


def test_a_desk_that_probably_is_not_there_is_not_confirmed() -> None:
    gone = replace(CHEST, presence=0.02, last_observed_ns=1)
    assert outcome(Expectation.of(CHEST), CHEST, gone) is Outcome.ABSENT


def test_doors_cannot_be_gone() -> None:
    with pytest.raises(WorldError, match="is a door"):
        falsified(DOOR, Falsification("door", 1.0))


def test_answers_about_another_object_or_of_another_form_are_refused() -> None:
    with pytest.raises(WorldError, match="can't update 'door'"):
        verified(DOOR, Verification("chest", np.zeros(1), np.eye(1)))
    with pytest.raises(WorldError, match=r"needs a mean \(1,\)"):
        verified(DOOR, Verification("door", np.zeros(3), np.eye(3)))


def seen_at(x: float, **more: object) -> Detection:
    return Detection(np.array([x, 1.0, 0.0]), COV, (1.0, 0.5, 0.7), **more)  # type: ignore[arg-type]


def test_a_detection_is_known_new_or_clutter() -> None:
    known = {"chest": CHEST, "door": DOOR}
    near, far = associated(seen_at(2.05), known), associated(seen_at(-3.0), known)
    assert near.best == "chest"
    assert far.best == NEW
    assert far.probabilities[CLUTTER] == pytest.approx(0.05, abs=0.01)
    assert associated(seen_at(-3.0, clutter=0.9), known).best == CLUTTER
    for each in (near, far):
        assert sum(each.probabilities.values()) == pytest.approx(1.0)
        assert "door" not in each.probabilities


def test_attributes_tell_two_objects_apart_that_stand_together() -> None:
    cup, bin_ = (replace(CHEST, attributes={"class": {word: 0.99}}) for word in ("cup", "bin"))
    seen = seen_at(2.0, attributes={"class": {"cup": 0.7, "mug": 0.3}})
    found = associated(seen, {"a": cup, "b": bin_}).probabilities
    assert found["a"] > 20.0 * found["b"]


def test_a_new_object_stands_where_it_was_detected() -> None:
    seen = seen_at(-3.0, attributes={"class": {"cup": 1.0}}, clutter=0.2)
    found: ObjectBelief = as_object("cup_1", seen)
    assert found.mean[:2] == pytest.approx([-3.0, 1.0], abs=0.02)
    assert found.presence == pytest.approx(0.8)
    assert found.attributes["class"] == {"cup": 1.0}
    top = found.item.mesh.vertices
    assert np.ptp(top, axis=0) == pytest.approx([1.0, 0.5, 0.7])
    assert top[:, 2].min() == pytest.approx(0.0)


@given(WORDS, WORDS)
def test_attributes_are_combined_by_bayes_rule(
    one: dict[str, float], two: dict[str, float]
) -> None:
    first, second = normal(one), normal(two)
    together, back = combined(first, second), combined(second, first)
    assert sum(together.values()) == pytest.approx(1.0)
    assert together == pytest.approx(back)
    assert agreement(first, second) == pytest.approx(agreement(second, first))


def test_a_verified_attribute_grows_surer() -> None:
    seen = Verification(
        "chest", np.array([2.0, 1.0, 0.0]), COV, {"class": {"cup": 0.7, "mug": 0.3}}
    )
    once = verified(CHEST, seen)
    assert once.attributes["class"] == {"cup": 0.7, "mug": 0.3}
    assert verified(once, seen).attributes["class"]["cup"] == pytest.approx(0.49 / 0.58)
