"""When a task wants what verified."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import Settings
from objstate.errors import SettingsError, WorldError
from objstate.objects import ObjectBelief, filter_for
from objstate.particles import Weights
from objstate.world import Allowed, Task, World, load_tasks
from objstate.world.allowed import AllowedOf
from objstate.world.due import variances_of
from tests.world.examples import DESK, DOOR, HOUR, OBJECTS, SECOND, at_angle, desk_at

WORLD = World.of(OBJECTS, beliefs=[at_angle(0.6, 0), desk_at(3.1, 0)])
DAY = 86_400.0


def task(**allowed: float) -> Task:
    return Task(name="some", default=Allowed(**allowed))


@settings(max_examples=25, deadline=None)
@given(st.floats(0.0005, 0.1))
def test_variances_cross_what_is_allowed_at_the_moment_that_is_said(most: float) -> None:
    for key in ("angle", "x", "yaw"):
        found = WORLD.due(task(**{key: most}), DAY)
        variance = variances_of(WORLD, known(key))
        k = 2 if key == "yaw" else 0
        for each in found:
            assert each.coordinate == key
            seconds = each.due_ns / SECOND
            assert variance(seconds)[k] >= most * (1.0 - 1e-9)
            if each.due_ns > SECOND:
                assert variance(0.995 * seconds)[k] <= most * (1.0 + 1e-9)
        if not found:
            assert variance(DAY)[k] <= most


def known(key: str) -> ObjectBelief:
    return WORLD.history("door" if key == "angle" else "desk")[-1]


@pytest.mark.parametrize("seconds", [10.0, 1800.0, 4 * 3600.0])
def test_variances_of_furniture_are_those_of_predicted_samples(seconds: float) -> None:
    rng = np.random.default_rng(0)
    states = np.array([3.3, 0.8, 0.3]) + 0.02 * rng.standard_normal((100_000, 3))
    there = ObjectBelief(DESK, states, Weights.uniform(len(states)), np.zeros(3), 0.7, 0, 0)
    filter_ = filter_for(DESK, Settings())
    later = filter_.predict(there, seconds, rng)
    expected = np.append(later.std**2, later.presence * (1.0 - later.presence))
    assert variances_of(WORLD, there)(seconds) == pytest.approx(expected, rel=0.03)


def test_the_soonest_comes_first_and_what_is_too_uncertain_is_due_now() -> None:
    found = WORLD.due(task(angle=1e-9, x=0.002, y=0.004), DAY)
    assert [each.coordinate for each in found] == ["angle", "x", "y"]
    assert found[0].due_ns == round(SECOND / 30)
    stamps = [each.due_ns for each in found]
    assert stamps == sorted(stamps)
    late = WORLD.due(task(x=0.002), DAY, stamp_ns=24 * HOUR)
    assert late[0].due_ns == 24 * HOUR
    assert late[0].variance > late[0].allowed


def test_what_is_learnt_later_does_not_count() -> None:
    task = Task(name="pass", default=Allowed(angle=0.01))
    seen = World.of({"door": DOOR}, beliefs=[at_angle(0.2, 0)])
    again = seen.with_beliefs([at_angle(0.2, 10 * SECOND)])
    assert seen.due(task, 3600.0, 0)[0].due_ns > 10 * SECOND
    assert again.due(task, 3600.0, 0) == seen.due(task, 3600.0, 0)


def test_a_task_that_allows_less_asks_sooner() -> None:
    stamps = [WORLD.due(task(angle=most), DAY)[0].due_ns for most in (0.02, 0.01, 0.002)]
    assert stamps == sorted(stamps, reverse=True)
    assert len(set(stamps)) == 3


def test_rules_win_over_the_default_coordinate_by_coordinate() -> None:
    some = Task(
        name="dock",
        default=Allowed(x=0.1, angle=0.2),
        objects=(AllowedOf(match="d*", x=0.01), AllowedOf(match="desk", yaw=0.5, x=None)),
    )
    assert some.allowed("door") == {"x": 0.01, "angle": 0.2}
    assert some.allowed("desk") == {"yaw": 0.5, "angle": 0.2}
    assert some.allowed("cup") == {"x": 0.1, "angle": 0.2}


def test_an_object_is_not_verified_more_often_than_the_task_says() -> None:
    often = task(angle=0.0)
    slow = often.model_copy(update={"most_per_second": 0.5})
    assert WORLD.due(slow, DAY)[0].due_ns - WORLD.due(often, DAY)[0].due_ns > SECOND


def test_presence_is_an_attribute() -> None:
    sure = replace(desk_at(3.0, 0), presence=0.999)
    found = World.of(OBJECTS, beliefs=[sure]).due(task(present=0.01), DAY)
    assert [(each.object, each.coordinate) for each in found] == [("desk", "present")]
    assert 0.0 < found[0].due_ns < DAY * SECOND


def test_what_was_never_seen_is_due_as_its_prior_says() -> None:
    assert World.of({"door": DOOR}).due(task(angle=0.001), 0.0)[0].due_ns == 0
    assert World.of({"door": DOOR}).due(task(angle=10.0), DAY) == ()


@pytest.mark.parametrize("horizon", [-1.0, np.nan, np.inf])
def test_a_horizon_that_is_none_is_refused(horizon: float) -> None:
    with pytest.raises(WorldError, match="horizon"):
        WORLD.due(task(angle=0.1), horizon)


def test_tasks_come_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "tasks.yaml").write_text(
        "tasks:\n"
        "  - {name: explore, default: {x: 0.001, y: 0.001}}\n"
        "  - {name: pass, objects: [{match: door, angle: 0.001}]}\n"
    )
    tasks = load_tasks(tmp_path / "tasks.yaml")
    assert load_tasks(str(tmp_path / "tasks.yaml")) == tasks
    assert tasks.named(None).name == "explore"
    assert tasks.named("pass").allowed("door") == {"angle": 0.001}
    with pytest.raises(SettingsError, match="no task 'sleep'; there are explore, pass"):
        tasks.named("sleep")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("tasks: []", "at least 1"),
        ("tasks: [{name: a, default: {x: -1}}]", "greater than or equal to 0"),
        ("tasks: [{name: a, default: {z: 1}}]", "z"),
        ("tasks: [{name: a}, {name: a}]", "two tasks are called 'a'"),
    ],
)
def test_files_that_list_no_tasks_are_refused(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "tasks.yaml").write_text(text)
    with pytest.raises(SettingsError, match=said):
        load_tasks(tmp_path / "tasks.yaml")
