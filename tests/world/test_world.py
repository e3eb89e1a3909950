"""A world answers for every moment: as it was known then, and by the dynamics later."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.altered import Altered
from objstate.config import DoorSettings, Settings
from objstate.errors import WorldError
from objstate.objects import filter_for
from objstate.particles import entropy
from objstate.world import World
from tests.world.examples import DOOR, HOUR, OBJECTS, SECOND, at_angle, desk_at


def test_a_new_world_believes_the_priors() -> None:
    world = World.of(OBJECTS)
    now = world.at(7)
    assert set(now) == {"door", "desk"}
    assert now["door"].std[0] > 0.4  # uniform over a quarter turn
    assert now["desk"].mean[:2] == pytest.approx([3.0, 1.0], abs=0.05)
    assert now["door"].stamp_ns == 7
    assert world.latest_ns is None


def test_each_moment_is_answered_with_what_was_known_then() -> None:
    world = World.of(OBJECTS, beliefs=[at_angle(0.2, 5 * HOUR), at_angle(1.2, 6 * HOUR)])
    assert world.at(4 * HOUR)["door"].std[0] > 0.4
    assert world.at(5 * HOUR)["door"].mean[0] == pytest.approx(0.2, abs=0.01)
    faded = world.at(6 * HOUR - 1)["door"].weights.values
    assert faded[30:64].sum() > 1.5 * faded[100:134].sum()  # about 0.2 rad, in quarter degrees
    assert world.at()["door"].mean[0] == pytest.approx(1.2, abs=0.01)


def test_a_belief_fades_to_where_doors_rest() -> None:
    world = World.of(OBJECTS, beliefs=[at_angle(0.2, 0)])
    stamps = (0, 60 * SECOND, HOUR)
    told = [entropy(world.at(stamp)["door"].weights.values) for stamp in stamps]
    assert told == sorted(told)
    late, later = (world.at(hours * HOUR)["door"].weights.values for hours in (100, 200))
    np.testing.assert_allclose(late, later, rtol=1e-4)
    assert late[0] > late[90] < late[-1]  # closed or open as far as it goes, rather than between


def test_a_prediction_is_the_filters_own() -> None:
    belief = at_angle(0.2, 0)
    expected = filter_for(DOOR, Settings()).predict(belief, 90.0, np.random.default_rng(0))
    seen = World.of(OBJECTS, beliefs=[belief]).at(90 * SECOND)["door"]
    np.testing.assert_array_equal(seen.weights.log, expected.weights.log)


def test_the_order_in_which_beliefs_come_does_not_count() -> None:
    beliefs = [at_angle(angle, stamp * HOUR) for stamp, angle in enumerate((0.1, 0.9, 0.4))]
    forth, back = World.of(OBJECTS, beliefs=beliefs), World.of(OBJECTS, beliefs=beliefs[::-1])
    assert [b.stamp_ns for b in back.history("door")] == [0, HOUR, 2 * HOUR]
    for stamp in range(0, 3 * HOUR, HOUR // 2):
        np.testing.assert_array_equal(
            forth.at(stamp)["door"].weights.log, back.at(stamp)["door"].weights.log
        )


def test_worlds_are_values() -> None:
    before = World.of(OBJECTS, beliefs=[at_angle(0.2, 0)])
    held = before.at(HOUR)
    after = before.with_beliefs([at_angle(1.2, HOUR)])
    assert held["door"].mean[0] != pytest.approx(1.2, abs=0.1)
    assert before.latest_ns == 0
    assert after.latest_ns == HOUR
    assert after.at()["door"].mean[0] == pytest.approx(1.2, abs=0.01)


def test_the_same_question_has_the_same_samples() -> None:
    world = World.of(OBJECTS, beliefs=[desk_at(3.5, 0)])
    first, again = world.at(HOUR)["desk"], world.at(HOUR)["desk"]
    np.testing.assert_array_equal(first.states, again.states)
    assert not np.array_equal(first.states, world.at(HOUR + 1)["desk"].states)


def test_a_snapshot_is_a_mapping_of_names_to_beliefs() -> None:
    now = World.of(OBJECTS).at(0)
    assert isinstance(now, Mapping)
    assert list(now.keys()) == list(now) == list(OBJECTS)
    assert dict(now.items()) == now.beliefs
    assert list(now.values()) == [now[name] for name in now]
    assert now.get("door") is now["door"]
    assert now.get("dor") is None
    assert now.get("dor", 1) == 1
    assert {now: 1}[now] == 1


def test_an_unknown_object_is_named_with_the_known_ones() -> None:
    with pytest.raises(WorldError, match=r"no object 'dor'; its objects: desk, door\."):
        World.of(OBJECTS).at(0)["dor"]
    with pytest.raises(WorldError, match="no stamp"):
        World.of(OBJECTS, beliefs=[replace(at_angle(0.2, 0), stamp_ns=None)])


@pytest.mark.parametrize("resolution", [0.25, 1.0, 2.0])
def test_a_lattice_of_another_resolution_is_read_off(resolution: float) -> None:
    settings = Altered(changes={"resolution_deg": resolution})
    world = World.of(OBJECTS, settings, [at_angle(0.8, 0, std=0.1)])
    assert DoorSettings(resolution_deg=resolution).resolution_deg == resolution
    later = world.at(SECOND)["door"]
    assert later.cell[0] == pytest.approx(np.radians(resolution), rel=0.1)
    assert later.mean[0] == pytest.approx(0.8, abs=0.01)
    assert later.std[0] == pytest.approx(0.1, rel=0.1)


def test_any_number_of_free_samples_is_a_belief() -> None:
    settings = Altered(changes={"samples": 500})
    world = World.of(OBJECTS, settings, [desk_at(3.5, 0)])
    desk = world.at(0)["desk"]
    assert desk.mean[:2] == pytest.approx([3.5, 1.0], abs=0.01)
