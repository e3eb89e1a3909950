"""Furniture that looks alike, seen together."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from objstate.errors import WorldError
from objstate.maintenance import Detection, seen_together
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from tests.rooms import table
from tests.world.examples import at_angle

LEFT, RIGHT = np.array([0.0, 0.0, 0.0]), np.array([1.0, 0.0, 0.0])
NOISE = np.diag([0.02, 0.02, 0.05]) ** 2
SIZE = (0.5, 0.5, 0.8)


def belief(name: str, middle: np.ndarray, std: float, count: int = 4000) -> ObjectBelief:
    rng = np.random.default_rng(len(name) + int(10 * middle[0]))
    spread = np.array([std, std, 0.05])
    states = middle + spread * rng.standard_normal((count, 3))
    item = table(name, float(middle[0]), float(middle[1]))
    return ObjectBelief(item, states, Weights.uniform(count), np.zeros(3), 0.95, 5, 1)


def detected(middle: np.ndarray, clutter: float = 0.05) -> Detection:
    return Detection(middle, NOISE, SIZE, clutter=clutter)


SIGHT = {"a": 0.95, "b": 0.95}


def test_what_stands_apart_keeps_its_name() -> None:
    known = {"a": belief("a", LEFT, 0.05), "b": belief("b", RIGHT, 0.05)}
    found = seen_together(known, [detected(RIGHT), detected(LEFT)], SIGHT)
    assert found.chances["a"].argmax() == 1
    assert found.chances["b"].argmax() == 0
    assert found.unswapped > 0.999
    assert found.beliefs["a"].mean == pytest.approx(LEFT, abs=0.02)
    assert found.beliefs["b"].presence > 0.999


def test_what_may_have_swapped_is_in_both_places() -> None:
    middle = (LEFT + RIGHT) / 2.0
    known = {"a": belief("a", middle, 0.6), "b": belief("b", middle, 0.6)}
    known["b"] = replace(known["a"], item=known["b"].item)  # alike in what is known, too
    found = seen_together(known, [detected(LEFT), detected(RIGHT)], SIGHT)
    assert found.unswapped == pytest.approx(0.5, abs=0.01)
    for each in found.beliefs.values():
        near_left = float(each.weights.values[each.states[:, 0] < 0.5].sum())
        assert near_left == pytest.approx(0.5, abs=0.01)


def test_one_reading_is_not_of_two() -> None:
    known = {"a": belief("a", LEFT, 0.3), "b": belief("b", LEFT + 0.1, 0.3)}
    found = seen_together(known, [detected(LEFT)], SIGHT)
    assert found.chances["a"][0] + found.chances["b"][0] <= 1.0 + 1e-9
    assert all(chance.sum() == pytest.approx(1.0) for chance in found.chances.values())


def test_what_should_be_seen_and_is_not_becomes_less_probable_and_the_hidden_does_not() -> None:
    known = {"a": belief("a", LEFT, 0.05), "b": belief("b", RIGHT, 0.05)}
    found = seen_together(known, [detected(LEFT)], {"a": 0.95, "b": 0.95})
    hidden = seen_together(known, [detected(LEFT)], {"a": 0.95, "b": 0.0})
    assert found.beliefs["b"].presence < 0.6
    assert hidden.beliefs["b"].presence == pytest.approx(0.95)


def test_a_reading_far_off_is_of_something_else() -> None:
    known = {"a": belief("a", LEFT, 0.05), "b": belief("b", RIGHT, 0.05)}
    far = detected(np.array([5.0, 5.0, 0.0]))
    found = seen_together(known, [detected(LEFT), far, detected(RIGHT)], SIGHT)
    assert found.chances["a"][1] < 1e-6
    assert found.chances["b"][1] < 1e-6


def test_order_does_not_matter() -> None:
    known = {"a": belief("a", LEFT, 0.4), "b": belief("b", RIGHT, 0.4)}
    forth = seen_together(known, [detected(LEFT), detected(RIGHT)], SIGHT)
    back = seen_together(known, [detected(RIGHT), detected(LEFT)], SIGHT)
    assert forth.chances["a"][[1, 0, 2]] == pytest.approx(back.chances["a"])
    assert forth.unswapped == pytest.approx(back.unswapped)


def test_doors_and_missing_probabilities_are_refused() -> None:
    with pytest.raises(WorldError, match="is a door"):
        seen_together({"door": at_angle(0.2, 1)}, [], {"door": 0.5})
    with pytest.raises(WorldError, match="in_sight has no probability for 'b'"):
        seen_together({"b": belief("b", RIGHT, 0.05)}, [], {})
