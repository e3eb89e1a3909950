"""What came of looking: confirmed, moved, lost or hidden."""

from dataclasses import replace

import numpy as np
import pytest

from objstate.gaze import Floor, belief_entropy
from objstate.maintenance import Expectation, Outcome, outcome, scattered
from objstate.objects import ObjectBelief
from tests.gaze.places import chest, prior, surely, two_rooms

ROOMS = two_rooms(chest("chest", 2.0, 1.0))
DOOR = surely(prior(ROOMS["door"]), 0.5)


def came_of(after: ObjectBelief, seen_ns: int | None) -> Outcome:
    return outcome(Expectation.of(DOOR), DOOR, replace(after, last_observed_ns=seen_ns))


def test_a_door_where_it_was_is_confirmed() -> None:
    assert came_of(surely(DOOR, 0.5), 1) is Outcome.CONFIRMED


def test_a_door_found_elsewhere_has_moved() -> None:
    assert came_of(surely(DOOR, 1.2), 1) is Outcome.MOVED


def test_a_door_that_is_nowhere_for_sure_is_lost() -> None:
    assert came_of(prior(ROOMS["door"]), 1) is Outcome.LOST


def test_what_no_beam_reached_is_hidden() -> None:
    assert came_of(surely(DOOR, 1.2), None) is Outcome.HIDDEN


def test_another_object_is_no_outcome() -> None:
    with pytest.raises(ValueError, match="'door' was expected"):
        outcome(Expectation.of(DOOR), DOOR, prior(ROOMS["chest"]))


def test_the_region_holds_95_percent() -> None:
    belief = prior(ROOMS["door"])
    assert Expectation.of(belief).share_inside(belief) == pytest.approx(0.95, abs=0.01)


def test_a_lost_object_could_be_anywhere_on_the_floor_and_keeps_its_name() -> None:
    floor = Floor.of(ROOMS)
    for name in ("chest", "door"):
        before = prior(ROOMS[name])
        lost = scattered(before, floor, np.random.default_rng(0))
        assert lost.item is before.item
        assert belief_entropy(lost) >= belief_entropy(before) - 1e-9
    lost = scattered(prior(ROOMS["chest"]), floor, np.random.default_rng(0))
    middle, width = np.array([0.0, 0.0]), np.array([8.0, 4.0])
    assert np.abs(lost.states[:, :2] - middle).max(axis=0) == pytest.approx(width / 2, abs=0.5)
