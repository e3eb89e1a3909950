"""Beliefs come back from bytes as they were, and damage is told."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate import packing
from objstate.errors import WorldError
from objstate.world.codec import pack_belief, pack_object, unpack_belief, unpack_object
from tests.rooms import door, sliding_door
from tests.world.examples import DESK, DOOR, at_angle, desk_at

NARROWEST = 0.01


@settings(max_examples=40)
@given(st.floats(0.0, 1.57), st.floats(NARROWEST, 2.0))
def test_a_door_comes_back(angle: float, std: float) -> None:
    belief = at_angle(angle, 7, std)
    back = unpack_belief(pack_belief(belief), DOOR, 7, 7)
    np.testing.assert_allclose(back.weights.log, belief.weights.log, rtol=1e-6, atol=1e-6)
    np.testing.assert_array_equal(back.states, belief.states)
    np.testing.assert_array_equal(back.cell, belief.cell)
    assert (back.stamp_ns, back.last_observed_ns) == (7, 7)
    assert back.weights.values.sum() == pytest.approx(1.0, abs=1e-12)


def test_a_door_comes_back_where_it_was_found_to_hang() -> None:
    belief = at_angle(0.7, 7)
    hung = replace(belief, item=DOOR.hung_at(DOOR.hinge + np.array([0.12, -0.2])))
    back = unpack_belief(pack_belief(hung), DOOR, 7, 7).item
    np.testing.assert_array_equal(back.origin, hung.item.origin)
    assert unpack_belief(pack_belief(belief), DOOR, 7, 7).item is DOOR


@settings(max_examples=20)
@given(st.floats(-5000.0, 5000.0))
def test_furniture_comes_back_from_any_place(x: float) -> None:
    belief = desk_at(x, 7)
    back = unpack_belief(pack_belief(belief), DESK, 7, None)
    np.testing.assert_allclose(back.states, belief.states, atol=1e-6)
    np.testing.assert_allclose(back.weights.values, belief.weights.values, rtol=1e-6)


def test_attributes_come_back() -> None:
    known = {"class": {"cup": 0.7, "mug": 0.3}}
    for belief in (at_angle(0.5, 1), desk_at(1.0, 1)):
        of = replace(belief, attributes=known)
        assert unpack_belief(pack_belief(of), of.item, 1, 1).attributes == known
        assert unpack_belief(pack_belief(belief), belief.item, 1, 1).attributes == {}


def test_a_belief_is_small() -> None:
    assert len(pack_belief(at_angle(0.7, 0))) < 2000
    assert len(pack_belief(desk_at(3.0, 0))) < 4000


@pytest.mark.parametrize(
    "item",
    [DOOR, DESK, door("t", 1, 2, limits=(-np.pi, np.pi), wraps=True), sliding_door("s", 1, 2)],
)
def test_objects_come_back(item) -> None:
    back = unpack_object(pack_object(item), item.name)
    assert (back.name, back.kind, back.wraps) == (item.name, item.kind, item.wraps)
    assert (back.lower, back.upper) == (item.lower, item.upper)
    states = np.full((3, len(item.coordinates)), 0.3)
    np.testing.assert_array_equal(back.transforms(states), item.transforms(states))
    np.testing.assert_array_equal(back.mesh.vertices, item.mesh.vertices)


@settings(max_examples=60)
@given(st.data())
def test_any_changed_byte_is_told(data: st.DataObject) -> None:
    packed = bytearray(pack_belief(at_angle(0.7, 0)))
    place = data.draw(st.integers(0, len(packed) - 1))
    packed[place] ^= data.draw(st.integers(1, 255))
    with pytest.raises(
        WorldError, match=r"belief of 'door' at 0 ns (is damaged|was written by a newer)"
    ):
        unpack_belief(bytes(packed), DOOR, 0, None)


def test_a_cut_off_belief_is_told() -> None:
    for length in (0, 5, 40):
        with pytest.raises(WorldError, match="damaged"):
            unpack_belief(pack_belief(at_angle(0.7, 0))[:length], DOOR, 0, None)


def test_a_newer_form_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packing, "VERSION", 2)
    newer = pack_belief(at_angle(0.7, 0))
    monkeypatch.undo()
    with pytest.raises(WorldError, match="newer objstate"):
        unpack_belief(newer, DOOR, 0, None)
