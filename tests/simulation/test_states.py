"""Objects move when and where the scene says, within what they can do."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.errors import SettingsError
from objstate.simulation.scene import Change, ObjectRule, PlanarState
from objstate.simulation.states import StateHistory, histories, true_states


def told(room: Path, *rules: ObjectRule, seed: int = 0) -> dict[str, StateHistory]:
    return histories(load_building(room), rules, np.random.default_rng(seed))


def test_a_swing_starts_and_ends_gently_where_it_should(room: Path) -> None:
    change = Change(at=10.0, to=1.5, duration=2.0)
    door = told(room, ObjectRule(name="door", initial=0.5, changes=(change,)))["door"]
    angles = np.array([door.at(t)[0] for t in np.linspace(9.0, 13.0, 401)])
    assert angles[0] == 0.5
    assert angles[-1] == 1.5
    assert door.at(11.0)[0] == pytest.approx(1.0)
    steps = np.diff(angles)
    assert (steps >= 0).all()
    assert steps[101] < steps[200] / 5


def test_truth_holds_from_each_stamp_on(room: Path) -> None:
    change = Change(at=1.0, to=PlanarState(x=0.0, y=0.0, yaw=3.0), duration=1.0)
    history = told(room, ObjectRule(name="table", changes=(change,)))
    rows = list(true_states(history, 10**18, 0.05))
    assert [row.stamp_ns for row in rows] == sorted(row.stamp_ns for row in rows)
    xs = [(row.stamp_ns - 10**18, row.value) for row in rows
          if (row.object, row.coordinate) == ("table", "x")]  # fmt: skip
    assert xs[0] == (0, -3.0)
    assert xs[-1] == (2 * 10**9, 0.0)
    assert len(xs) == 22
    assert max(abs(b[1] - a[1]) for a, b in pairwise(xs)) < 0.25
    assert {row.object for row in rows} == {"door", "slider", "table"}


def test_furniture_turns_the_short_way(room: Path) -> None:
    rule = ObjectRule(
        name="table",
        initial=PlanarState(x=0, y=0, yaw=3.0),
        changes=(Change(at=0.0, to=PlanarState(x=0, y=0, yaw=-3.0), duration=1.0),),
    )
    assert abs(told(room, rule)["table"].at(0.5)[2]) == pytest.approx(np.pi)


def test_random_states_keep_within_limits_and_follow_the_generator(room: Path) -> None:
    rule = ObjectRule(initial="random", spread_xy=0.2, spread_yaw=0.1)
    many = [told(room, rule, seed=seed) for seed in range(30)]
    angles = np.array([states["door"].initial[0] for states in many])
    assert 0.0 <= angles.min() < 0.4
    assert 1.2 < angles.max() <= 1.6
    places = np.array([states["table"].initial for states in many])
    assert np.abs(places - [-3, -1.5, 0.3]).max(axis=0) == pytest.approx([0.2, 0.2, 0.1], rel=0.3)
    again = told(room, rule, seed=7)
    assert again["door"].initial == many[7]["door"].initial


def test_first_rule_that_matches_holds(room: Path) -> None:
    states = told(room, ObjectRule(name="door", initial=1.0), ObjectRule(name="*r", initial=0.5))
    assert states["door"].initial == 1.0
    assert states["slider"].initial == 0.5
    np.testing.assert_allclose(states["table"].initial, [-3, -1.5, 0.3])


@pytest.mark.parametrize(
    ("rule", "message"),
    [
        (ObjectRule(name="gate"), "matches no object"),
        (ObjectRule(name="door", initial=2.0), "limits are 0.0 and 1.6"),
        (ObjectRule(name="door", initial=PlanarState(x=0, y=0)), "as a number"),
        (ObjectRule(name="table", initial=1.0), "{x, y, yaw}"),
    ],
)
def test_impossible_states_are_named(room: Path, rule: ObjectRule, message: str) -> None:
    with pytest.raises(SettingsError, match=message):
        told(room, rule)
