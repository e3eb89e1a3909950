"""What is believed of every object."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.altered import Altered
from objstate.building.model import Mesh
from objstate.config import Settings
from objstate.errors import SettingsError
from objstate.estimator.believed import Believed
from objstate.objects import ObjectBelief
from objstate.particles import Weights
from objstate.world import World
from tests.rooms import building, door, enclosure, table

PLACE = building(
    Mesh.joined([enclosure(6.0, 6.0)]), door("door", 0.0, 1.0), table("table", 1.0, -1.0)
)
SECOND = 10**9


def believed() -> Believed:
    return Believed(PLACE, Settings(), 0, {})


def narrowed(state: Believed, stamp_ns: int) -> dict[str, ObjectBelief]:
    """All objects after a scan that told much."""
    out = {}
    for name in PLACE.objects:
        each = state.at(name, stamp_ns)
        weights = each.weights.values * np.exp(-0.1 * np.arange(len(each.weights)))
        out[name] = each.with_weights(Weights.of(weights))
    return out


def test_what_was_believed_before_is_restored() -> None:
    state = believed()
    state.keep(narrowed(state, SECOND).items())
    before = dict(state.marginals)
    for second in (2, 3):
        state.keep(narrowed(state, second * SECOND).items())
    assert state.marginals["door"].stamp_ns == 3 * SECOND
    state.restore(before)
    for name, belief in before.items():
        assert state.marginals[name] is belief


def test_an_object_asked_for_later_is_predicted() -> None:
    state = believed()
    certain = np.zeros(len(state.marginals["door"].states))
    certain[50] = 1.0
    told = state.at("door", SECOND).with_weights(Weights.of(certain))
    state.keep([("door", told)])
    later = state.at("door", 3601 * SECOND)
    assert later.stamp_ns == 3601 * SECOND
    assert later.std[0] > 5.0 * told.std[0]
    assert state.marginals["door"] is told


def test_beliefs_on_other_samples_than_the_settings_give_are_refused() -> None:
    other, name = Altered(changes={"resolution_deg": 1.0}), "door"
    known = {name: replace(believed().marginals[name], stamp_ns=0)}
    with pytest.raises(SettingsError, match=r"'door' has 361 states, where .* need 91"):
        Believed(PLACE, other, 0, known)
    fit = World.of(PLACE.objects, other, list(known.values())).at(SECOND).beliefs
    assert Believed(PLACE, other, 0, fit).marginals[name] is fit[name]
