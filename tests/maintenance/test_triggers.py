"""Triggers fire where they should, and combine as logic does."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.errors import SettingsError
from objstate.maintenance import (
    TABLE_1,
    Plan,
    Situation,
    Trigger,
    all_of,
    any_of,
    before,
    entropy_above,
    named,
    older_than,
    unless,
)
from tests.gaze.places import prior, surely, two_rooms

HOUR_NS = 3600 * 10**9
ROOMS = two_rooms()
DOOR = prior(ROOMS["door"])


def constant(value: bool) -> Trigger:
    return lambda situation: value


@given(st.lists(st.booleans(), max_size=4))
def test_triggers_combine_as_logic_does(values: list[bool]) -> None:
    situation, triggers = Situation(DOOR, 0), [constant(value) for value in values]
    assert any_of(*triggers)(situation) == any(values)
    assert all_of(*triggers)(situation) == all(values)
    assert unless(any_of(*triggers))(situation) == all_of(*map(unless, triggers))(situation)


def test_what_was_never_seen_is_older_than_anything() -> None:
    assert older_than(hours=1e6)(Situation(DOOR, 0))


def test_age_is_counted_from_when_the_object_was_last_seen() -> None:
    seen = replace(DOOR, last_observed_ns=5 * HOUR_NS)
    assert older_than(hours=1.0)(Situation(seen, int(6.5 * HOUR_NS)))
    assert not older_than(hours=2.0)(Situation(seen, int(6.5 * HOUR_NS)))


def test_entropy_tells_the_known_from_the_unknown() -> None:
    trigger = entropy_above(-2.0)
    assert trigger(Situation(DOOR, 0))
    assert not trigger(Situation(surely(DOOR, 0.5), 0))


@pytest.mark.parametrize(
    ("plan", "asks"),
    [("pass door", True), ("grab door", True), ("go to door", True), ("release door", False),
     ("pass other", False)],
)  # fmt: skip
def test_table_1_asks_before_acting_on_the_object(plan: str, asks: bool) -> None:
    assert TABLE_1(Situation(DOOR, 0, Plan.parse(plan))) == asks


def test_without_a_plan_nothing_is_asked_for() -> None:
    assert not TABLE_1(Situation(DOOR, 0))


def test_names_match_patterns() -> None:
    assert named("d*r")(Situation(DOOR, 0))
    assert not named("desk_*")(Situation(DOOR, 0))


@pytest.mark.parametrize("text", ["open door", "pass", "pass ", ""])
def test_what_is_no_plan_is_refused(text: str) -> None:
    with pytest.raises(SettingsError, match="as in 'pass door_07'"):
        Plan.parse(text)


def test_a_verb_that_no_plan_has_is_refused() -> None:
    with pytest.raises(SettingsError, match="No plan says 'kick'"):
        before("kick")
    with pytest.raises(SettingsError, match="No plan says 'kick'"):
        Plan("kick", "door")


def test_a_plan_reads_as_it_was_written() -> None:
    assert str(Plan.parse("go to desk 2")) == "go to desk 2"
