"""Actions in two rooms with a door between them."""

from dataclasses import replace

import numpy as np
import pytest

from objstate.building.model import Building, Mesh
from objstate.errors import SettingsError
from objstate.gaze import Sensor
from objstate.geometry import wrap
from objstate.maintenance import (
    ChoiceSettings,
    Coordinator,
    CoordinatorSettings,
    GainWeight,
    Plan,
    any_of,
    entropy_above,
    next_tasks,
    older_than,
)
from tests.gaze.places import chest, priors, surely, two_rooms
from tests.rooms import enclosure, wall

ROOMS = two_rooms(chest("near", 2.5, 1.2), chest("far", -3.0, 1.2))
LASER = Sensor("laser")
AT = np.array([1.0, 0.0, 0.0])


@pytest.fixture(scope="module")
def coordinator() -> Coordinator:
    return Coordinator(ROOMS, [LASER])


def test_actions_are_ranked_and_their_figures_agree(coordinator: Coordinator) -> None:
    actions = coordinator.actions(priors(ROOMS), AT)
    s = coordinator.settings.choice
    assert {each.object for each in actions} == set(ROOMS.objects)
    assert 2 <= len([each for each in actions if each.object == "door"]) <= 4
    utility = [each.utility for each in actions]
    assert utility == sorted(utility, reverse=True)
    for each in actions:
        assert each.gain == pytest.approx(sum(each.gains.values()))
        assert each.cost == pytest.approx(each.distance / s.cost_scale)
        assert each.utility == pytest.approx(each.worth / s.gain_norm - s.cost_weight * each.cost)
        assert each.distance == pytest.approx(np.hypot(*np.diff(each.way, axis=0).T).sum())
        assert each.way[-1] == pytest.approx(each.pose[:2])
        assert each.way[0] == pytest.approx(AT[:2], abs=0.2)


def test_the_second_time_gives_the_same(coordinator: Coordinator) -> None:
    first, second = (coordinator.actions(priors(ROOMS), AT) for _ in range(2))
    assert [(a.object, a.utility) for a in first] == [(a.object, a.utility) for a in second]


@pytest.mark.parametrize("counting", ["gain", "lasting gain"])
@pytest.mark.parametrize("cost_weight", [0.2, 2.0, 50.0])
def test_what_is_chosen_is_the_best_of_all_actions(counting: str, cost_weight: float) -> None:
    choice = ChoiceSettings.model_validate({"counting": counting, "cost_weight": cost_weight})
    coordinator = Coordinator(ROOMS, [LASER], CoordinatorSettings(choice=choice))
    beliefs = priors(ROOMS)
    chosen = coordinator.choose(beliefs, AT)
    best = coordinator.best(coordinator.actions(beliefs, AT))
    assert (chosen is None) == (best is None) == (cost_weight == 50.0)
    if chosen is not None and best is not None:
        assert (chosen.object, chosen.utility) == (best.object, best.utility)


def test_gains_alone_are_worth_what_they_are() -> None:
    settings = CoordinatorSettings(choice=ChoiceSettings(counting="gain"))
    for each in Coordinator(ROOMS, [LASER], settings).actions(priors(ROOMS), AT):
        assert each.worth == pytest.approx(each.gain)


def test_the_last_weight_that_matches_counts() -> None:
    weights = (GainWeight(match="*", weight=5.0), GainWeight(match="[nf]*", weight=0.0))
    settings = CoordinatorSettings(choice=ChoiceSettings(counting="gain"), weights=weights)
    for each in Coordinator(ROOMS, [LASER], settings).actions(priors(ROOMS), AT):
        assert each.worth == pytest.approx(5.0 * each.gains.get("door", 0.0))


def test_a_closed_door_makes_the_room_behind_it_dear(coordinator: Coordinator) -> None:
    open_, shut = priors(ROOMS), priors(ROOMS)
    open_["door"] = surely(open_["door"], np.pi / 2)
    shut["door"] = surely(shut["door"], 0.0)
    ways = [coordinator.floor.ways_from(AT[:2], beliefs) for beliefs in (open_, shut)]
    cell = coordinator.floor.nearest(np.array([-2.0, 0.0]))
    assert ways[0].costs[cell] < ways[1].costs[cell] - 10.0


def test_what_is_on_the_way_counts(coordinator: Coordinator) -> None:
    beliefs = priors(ROOMS)
    beliefs["door"] = surely(beliefs["door"], np.pi / 2)
    for_far = coordinator.actions(beliefs, np.array([3.2, -1.0, 2.0]), only=["far"])
    assert any("near" in each.gains or "door" in each.gains for each in for_far)
    assert {each.object for each in for_far} == {"far"}


def test_a_robot_that_must_stay_updates_only_what_it_sees(coordinator: Coordinator) -> None:
    actions = coordinator.actions(priors(ROOMS), AT, may_drive=False)
    assert {each.object for each in actions} == {"near"}
    assert all(each.distance == 0.0 and each.cost == 0.0 for each in actions)


def test_who_has_just_looked_gains_nothing_by_staying(coordinator: Coordinator) -> None:
    seen = {name: replace(each, last_observed_ns=0) for name, each in priors(ROOMS).items()}
    pose = coordinator.actions(seen, AT, only=["near"])[0].pose
    for beliefs, gains in ((priors(ROOMS), True), (seen, False)):
        actions = coordinator.actions(beliefs, pose, only=["near"])
        (here,) = (each for each in actions if each.distance == 0.0)
        assert (here.gains.get("near", 0.0) > 0.5) is gains
        assert all(each.gains["near"] > 0.5 for each in actions if each.distance > 0.5)
    assert coordinator.actions(seen, pose, only=["near"], may_drive=False)[0].gain > 0.5


def test_a_sensor_that_sees_farther_is_another_action() -> None:
    both = Coordinator(ROOMS, [LASER, Sensor("short", range_max=1.0)])
    actions = both.actions(priors(ROOMS), AT, only=["near"])
    best = {name: max(a.gain for a in actions if a.sensor == name) for name in both.sensors}
    assert best["laser"] > best["short"]


def test_what_is_known_is_not_worth_a_way() -> None:
    rooms = two_rooms()
    coordinator = Coordinator(rooms, [LASER])
    known = {"door": surely(priors(rooms)["door"], 0.7)}
    assert coordinator.best(coordinator.actions(known, AT)) is None


def test_plans_come_first_in_their_order_then_the_best(coordinator: Coordinator) -> None:
    beliefs = priors(ROOMS)
    ranked = coordinator.actions(beliefs, AT)
    plans = [Plan("grab", "far"), Plan("pass", "door"), Plan("release", "near")]
    found = next_tasks(coordinator, ranked, beliefs, 0, plans=plans)
    assert [each.action.object for each in found[:2]] == ["far", "door"]
    assert found[0].reason == "before: grab far"
    assert found[1].reason.startswith("before: pass door, clear with probability 0.")
    assert found[2].action is coordinator.best(ranked)
    assert len(found) == 3
    assert "nats of" in found[2].reason


def test_a_plan_is_followed_whatever_it_gains() -> None:
    rooms = two_rooms()
    settings = CoordinatorSettings(choice=ChoiceSettings(gain_threshold=100.0))
    coordinator = Coordinator(rooms, [LASER], settings)
    beliefs = priors(rooms)
    ranked = coordinator.actions(beliefs, AT)
    found = next_tasks(coordinator, ranked, beliefs, 0, plans=[Plan("pass", "door")])
    assert [each.action.object for each in found] == ["door"]


def test_a_door_that_is_known_to_be_open_is_passed_without_a_look(coordinator: Coordinator) -> None:
    beliefs = priors(ROOMS)
    beliefs["door"] = surely(beliefs["door"], np.pi / 2)
    found = next_tasks(coordinator, coordinator.actions(beliefs, AT), beliefs, 0,
                       plans=[Plan("pass", "door")])  # fmt: skip
    assert not [each for each in found if each.reason.startswith("before")]


def test_triggers_fire_without_a_plan(coordinator: Coordinator) -> None:
    beliefs = {
        name: replace(each, last_observed_ns=None if name == "far" else 0)
        for name, each in priors(ROOMS).items()
    }
    ranked = coordinator.actions(beliefs, AT)
    trigger = any_of(older_than(hours=1.0), entropy_above(1e6))
    found = next_tasks(coordinator, ranked, beliefs, 10**9, trigger=trigger)
    assert [each.action.object for each in found[:-1]] == ["far"]
    assert found[0].reason == "the trigger asks for it"
    later = next_tasks(coordinator, ranked, beliefs, 2 * 3600 * 10**9, trigger=trigger)
    assert {each.action.object for each in later[:-1]} == set(ROOMS.objects)


def test_a_rear_laser_turns_its_back_on_what_it_looks_at() -> None:
    both = Coordinator(ROOMS, [LASER, Sensor("rear", field_of_view=1.0, yaw=np.pi)])
    actions = both.actions(priors(ROOMS), AT, only=["near"])
    yaws = {
        name: sorted(float(wrap(a.pose[2])) for a in actions if a.sensor == name)
        for name in both.sensors
    }
    turned = sorted(wrap(np.array(yaws["laser"]) + np.pi).tolist())
    assert yaws["rear"] == pytest.approx(turned)
    assert all(each.gains["near"] > 0.5 for each in actions)


def test_a_plan_with_an_unknown_object_is_refused(coordinator: Coordinator) -> None:
    with pytest.raises(SettingsError, match=r"'pass gate': there is no such object; .* door"):
        next_tasks(coordinator, [], priors(ROOMS), 0, plans=[Plan("pass", "gate")])


def test_a_plan_whose_object_is_seen_from_nowhere_is_refused() -> None:
    shut = Building("shut", Mesh.joined([enclosure(8.0, 4.0), wall((0.0, -2.0), (0.0, 2.0))]),
                    ROOMS.objects)  # fmt: skip
    beliefs = priors(shut)
    coordinator = Coordinator(shut, [LASER])
    ranked = coordinator.actions(beliefs, AT)
    assert "far" not in {each.object for each in ranked}
    with pytest.raises(SettingsError, match="'grab far': the robot can see 'far' from no place"):
        next_tasks(coordinator, ranked, beliefs, 0, plans=[Plan("grab", "far")])


def test_a_robot_without_sensors_is_refused() -> None:
    with pytest.raises(SettingsError, match="without a sensor"):
        Coordinator(ROOMS, [])


def test_two_sensors_of_one_name_are_refused() -> None:
    with pytest.raises(SettingsError, match="Two sensors are called 'laser'"):
        Coordinator(ROOMS, [LASER, Sensor("laser", range_max=3.0)])


def test_a_place_that_is_none_is_refused(coordinator: Coordinator) -> None:
    nowhere = np.array([np.nan, 0.0, 0.0])
    for choose in (coordinator.choose, coordinator.actions):
        with pytest.raises(SettingsError, match="finite place on the floor"):
            choose(priors(ROOMS), nowhere)


def test_actions_on_unknown_objects_are_refused(coordinator: Coordinator) -> None:
    with pytest.raises(SettingsError, match=r"no object 'gate'; there are .*door"):
        coordinator.actions(priors(ROOMS), AT, only=["door", "gate"])
