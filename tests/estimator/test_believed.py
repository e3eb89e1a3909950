"""What is believed of every object, and the way back to what was."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from objstate.building.model import Mesh
from objstate.config import Settings
from objstate.errors import SettingsError
from objstate.estimator.believed import Believed
from objstate.objects import ConditionalBelief, Descent
from objstate.particles import Weights
from objstate.world import World
from tests.rooms import building, door, enclosure, table

PLACE = building(
    Mesh.joined([enclosure(6.0, 6.0)]), door("door", 0.0, 1.0), table("table", 1.0, -1.0)
)
SECOND = 10**9


def believed() -> Believed:
    return Believed(PLACE, Settings(), 0, {})


def narrowed(state: Believed, stamp_ns: int, samples: int = 4) -> dict[str, ConditionalBelief]:
    """All objects after a scan that told much."""
    out = {}
    for name in PLACE.objects:
        each = state.given(name, samples, stamp_ns)
        rows = each.given * np.exp(-0.1 * np.arange(each.given.shape[1]))
        rows /= rows.sum(axis=1, keepdims=True)
        out[name] = each.averaged(rows, np.full(samples, 1.0 / samples))
    return out


def test_going_back_leads_to_what_was_trusted() -> None:
    state = believed()
    state.keep_in_view(narrowed(state, SECOND))
    state.trust()
    trusted = dict(state.marginals)
    state.trust()  # what is trusted is what was believed one such moment before
    for second in (2, 3):
        state.keep_in_view(narrowed(state, second * SECOND))
    assert state.marginals["door"].stamp_ns == 3 * SECOND
    state.go_back()
    for name, belief in trusted.items():
        assert state.marginals[name] is belief
    given = state.given("door", 5, SECOND).given
    np.testing.assert_allclose(given, np.tile(trusted["door"].weights.values, (5, 1)))


def test_going_back_twice_changes_nothing_more() -> None:
    state = believed()
    state.keep_in_view(narrowed(state, SECOND))
    state.trust()
    trusted = state.marginals["door"]
    state.trust()
    state.keep_in_view(narrowed(state, 2 * SECOND))
    state.go_back()
    state.go_back()
    assert state.marginals["door"] is trusted


def test_what_collapses_keeps_its_marginal_and_no_more() -> None:
    state = believed()
    state.keep_in_view(narrowed(state, SECOND))
    marginal = state.marginals["door"]
    state.collapse()
    assert state.marginals["door"] is marginal
    assert len(state.given("door", 7, SECOND).given) == 7


@pytest.mark.parametrize("name", ["door", "table"])
def test_what_nobody_moved_has_drifted_from_where_it_was(name: str) -> None:
    state = believed()
    state.keep_in_view(narrowed(state, SECOND))
    before, after = state.marginals[name], state.unmoved(name, 101 * SECOND)
    drift = state.filters[name].drift_variance(100.0)
    np.testing.assert_array_equal(after.mean, before.mean)
    np.testing.assert_allclose(after.std**2, before.std**2 + drift)


def test_what_no_beam_points_at_waits_for_the_next_scan_while_it_is_near() -> None:
    """A table's scan hands the door's robot samples on; without it near, they are forgotten."""
    rows = narrowed(believed(), SECOND)
    door = rows["door"]
    rows["door"] = replace(door, given=np.roll(door.given, 1, axis=1) * np.arange(1, 5)[:, None])
    ancestors = np.array([3, 1, 1])
    for near, told in ((["door", "table"], rows["door"].given[ancestors]), (["table"], None)):
        state = believed()
        state.keep_in_view(rows)
        state.keep_in_view({"table": rows["table"]}, Descent(0.0, ancestors), near)
        given = state.given("door", 3, SECOND).given
        marginal = np.tile(state.marginals["door"].weights.values, (3, 1))
        np.testing.assert_array_equal(given, marginal if told is None else told)


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


@pytest.mark.parametrize(
    ("rule", "told"),
    [
        ({"match": "door", "resolution_deg": 1.0}, "'door' has 361 states, where .* need 91"),
        ({"match": "table", "scouts": 40}, "'table' has 80 scouts, where .* need 40"),
    ],
)
def test_beliefs_on_other_samples_than_the_settings_give_are_refused(
    rule: dict[str, object], told: str
) -> None:
    other = Settings.model_validate({"objects": [rule]})
    name = str(rule["match"])
    known = {name: replace(believed().marginals[name], stamp_ns=0)}
    with pytest.raises(SettingsError, match=told):
        Believed(PLACE, other, 0, known)
    fit = World.of(PLACE.objects, other, list(known.values())).at(SECOND).beliefs
    assert Believed(PLACE, other, 0, fit).marginals[name] is fit[name]


def test_a_published_belief_of_furniture_lacks_the_scouts_that_a_filter_needs() -> None:
    state = believed()
    published = state.filters["table"].widened(state.marginals["table"], 1.0, 0.0)
    with pytest.raises(SettingsError, match=r"'table' has 0 scouts, where .* need 80"):
        Believed(PLACE, Settings(), 0, {"table": published})
