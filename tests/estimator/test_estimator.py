"""Whole drives along a small corridor, with known truth."""

from __future__ import annotations

import gc
import weakref
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from benchmarks.altered import Altered
from objstate.building.model import Mesh
from objstate.config import BuildingErrorSettings, Settings
from objstate.errors import BuildingError, LogError, SettingsError
from objstate.estimator import Estimator
from objstate.geometry import FloatArray, wrap
from objstate.objects.mixture import DoorMixture
from objstate.records import (
    Estimate,
    GaussianRobotBelief,
    InitialPose,
    Odometry,
    Record,
    RobotBelief,
    Scan,
)
from objstate.sensing import ExpectedRanges
from tests.estimator.drives import START, START_NS, Drive, corridor, drive, truth
from tests.rooms import block, building, fan, fence, placed, scan_of, table

CORRIDOR = corridor()
TOLD = np.diag([0.1, 0.1, 0.05]) ** 2
SECONDS = 4.0  # of a short drive, past the first door


@cache
def long_drive(seed: int) -> Drive:
    return drive(seed)


@cache
def short_drive() -> Drive:
    return drive(0, SECONDS)


def fed(estimator: Estimator, records: list[Record]) -> list[Estimate]:
    return [row for record in records for row in estimator.feed(record)]


def door_errors(rows: list[Estimate]) -> dict[str, float]:
    """Degrees from the truth of each door's last observed estimate."""
    last = {row.object: row for row in rows if row.observed}
    return {
        name: float(np.degrees(abs(last[name].mean - state[0]))) for name, state in truth().items()
    }


def as_told(drive: Drive, records: list[Record] | None = None) -> list[Record]:
    told = InitialPose(START_NS - 1, START, TOLD)
    return [told, *(drive.records if records is None else records)]


# --- whole drives -------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_a_drive_finds_every_door_and_the_robot(seed: int) -> None:
    driven = long_drive(seed)
    estimator, rows, robot_errors = Estimator(CORRIDOR, seed=seed, initial_pose=START), [], []
    for record in driven.records:
        rows += estimator.feed(record)
        if isinstance(record, Scan):
            assert estimator.robot is not None
            off = estimator.robot.mean - driven.poses[record.stamp_ns]
            robot_errors.append(float(np.hypot(*off[:2])))
    errors = door_errors(rows)
    assert np.mean(list(errors.values())) < 1.5
    assert max(errors.values()) < 4.0
    settled = robot_errors[len(robot_errors) // 4 :]
    assert np.mean(settled) < 0.03
    assert estimator.scans_without_pose == 0
    assert estimator.lost == ()


@pytest.mark.parametrize("schedule", ["beams", "alternate"])
def test_marginal_inference_finds_the_doors_by_either_schedule(schedule: str) -> None:
    updates = {"inference": "marginal", "schedule": schedule}
    settings = Settings.model_validate({"object_updates": updates})
    rows = fed(Estimator(CORRIDOR, settings, initial_pose=START), long_drive(1).records)
    assert np.mean(list(door_errors(rows).values())) < 2.5


def test_one_laser_localizes_while_another_observes() -> None:
    lasers = {"front": fan(91), "rear": fan(91, towards=np.pi)}
    driven = drive(2, lasers=lasers)
    settings = Settings.model_validate(
        {
            "object_updates": {"inference": "marginal", "schedule": ["rear"]},
        }
    )
    rows = fed(Estimator(CORRIDOR, settings, initial_pose=START), driven.records)
    assert np.mean(list(door_errors(rows).values())) < 2.0


@pytest.mark.parametrize("kind", ["samples", "gaussian"])
def test_a_recorded_robot_belief_serves_in_place_of_localization(kind: str) -> None:
    driven, rng = long_drive(0), np.random.default_rng(0)
    records: list[Record] = []
    for record in driven.records:
        if isinstance(record, Scan):
            records.append(recorded(kind, record.stamp_ns, driven.poses[record.stamp_ns], rng))
        records.append(record)
    estimator = Estimator(CORRIDOR, belief="recorded")
    rows = fed(estimator, records)
    assert np.mean(list(door_errors(rows).values())) < 2.0
    assert estimator.scans_without_pose == 0
    assert estimator.warnings == []


def recorded(
    kind: str, stamp_ns: int, pose: FloatArray, rng: np.random.Generator
) -> RobotBelief | GaussianRobotBelief:
    std = np.array([0.02, 0.02, 0.01])
    if kind == "gaussian":
        return GaussianRobotBelief(stamp_ns, pose, np.diag(std**2))
    return RobotBelief(stamp_ns, pose + std * rng.standard_normal((100, 3)), np.full(100, 0.01))


@pytest.mark.parametrize(
    ("inference", "std", "most_m"), [("joint", 0.2, 0.12), ("marginal", 0.6, 0.5)]
)
def test_a_recorded_belief_that_is_too_wide_for_objects_near_it_is_noted(
    inference: str, std: float, most_m: float
) -> None:
    driven = short_drive()
    scans = [record for record in driven.records if isinstance(record, Scan)]
    middle_ns = scans[len(scans) // 2].stamp_ns
    records: list[Record] = []
    for record in driven.records:
        if isinstance(record, Scan):
            now = 0.01 if record.stamp_ns < middle_ns else std
            covariance = np.diag([now, now, 0.01]) ** 2
            pose = driven.poses[record.stamp_ns]
            records.append(GaussianRobotBelief(record.stamp_ns, pose, covariance))
        records.append(record)
    settings = Settings.model_validate({"object_updates": {"inference": inference}})
    estimator = Estimator(CORRIDOR, settings, belief="recorded")
    rows = fed(estimator, records)
    wide = estimator.too_wide
    assert wide.first_ns is not None
    assert all(row.stamp_ns < middle_ns <= wide.first_ns for row in rows)
    assert std < wide.position_std < 2.0 * std
    assert wide.total_ns == wide.last_ns - wide.first_ns > 0
    assert wide.limit.position_std == most_m
    assert np.isfinite(wide.limit.yaw_std) == (inference == "joint")


def test_between_recorded_beliefs_the_odometry_carries_on() -> None:
    driven = short_drive()
    first = RobotBelief(START_NS, np.tile(START, (50, 1)), np.full(50, 0.02))
    estimator = Estimator(CORRIDOR, belief="recorded")
    fed(estimator, [driven.records[0], first, *driven.records[1:]])
    end = driven.poses[max(driven.poses)]
    assert estimator.robot is not None
    assert np.hypot(*(estimator.robot.mean - end)[:2]) < 0.15


def test_a_tilted_laser_is_cast_against_triangles_and_finds_the_door() -> None:
    tilted = fan(61, mount=placed(0.1, 0.0, 0.6, (0.03, -0.05, 0.0)))
    driven = drive(0, SECONDS, lasers={"tilted": tilted})
    estimator = Estimator(CORRIDOR, initial_pose=START)
    fed(estimator, driven.records)
    end = driven.poses[max(driven.poses)]
    assert estimator.robot is not None
    assert np.hypot(*(estimator.robot.mean - end)[:2]) < 0.1
    belief = estimator.objects["a"]
    assert belief.last_observed_ns is not None
    assert np.degrees(abs(belief.mean[0] - truth()["a"][0])) < 2.0


# --- the same and another -----------------------------------------------------------


def test_the_same_seed_gives_the_same_estimates_to_the_last_bit() -> None:
    one, two = (
        fed(Estimator(CORRIDOR, seed=5, initial_pose=START), short_drive().records)
        for _ in range(2)
    )
    assert one == two
    assert len(one) > 0


def test_another_seed_differs_but_agrees() -> None:
    one, two = (
        fed(Estimator(CORRIDOR, seed=seed, initial_pose=START), long_drive(0).records)
        for seed in (5, 6)
    )
    assert one != two
    for name, error in door_errors(one).items():
        assert error == pytest.approx(door_errors(two)[name], abs=1.5)


# --- the start ----------------------------------------------------------------------


def test_scans_before_any_pose_are_counted_and_tell_nothing() -> None:
    estimator, records = Estimator(CORRIDOR), short_drive().records
    scans = sum(isinstance(record, Scan) for record in records)
    assert fed(estimator, records) == []
    assert estimator.scans_without_pose == scans > 0
    assert estimator.robot is None
    assert all(belief.stamp_ns is None for belief in estimator.objects.values())


def test_a_pose_told_by_the_log_starts_the_robot_there() -> None:
    estimator = Estimator(CORRIDOR)
    rows = fed(estimator, as_told(short_drive()))
    assert any(row.observed for row in rows)
    end = short_drive().poses[max(short_drive().poses)]
    assert estimator.robot is not None
    assert np.hypot(*(estimator.robot.mean - end)[:2]) < 0.06


def test_a_pose_told_by_the_caller_outranks_the_logs() -> None:
    estimator = Estimator(CORRIDOR, initial_pose=START)
    before = estimator.robot
    estimator.feed(InitialPose(START_NS, START + 3.0, TOLD))
    assert estimator.robot is before


def test_a_robot_told_anew_is_where_it_was_told() -> None:
    estimator = Estimator(CORRIDOR)
    fed(estimator, as_told(short_drive()))
    elsewhere = np.array([7.0, 0.2, 3.0])
    estimator.feed(InitialPose(max(short_drive().poses), elsewhere, TOLD / 100))
    assert estimator.robot is not None
    np.testing.assert_allclose(estimator.robot.mean[:2], elsewhere[:2], atol=0.01)


def test_told_anew_in_view_of_a_door_other_robot_samples_learn_about_it() -> None:
    """However many they are: those that had a belief of it by themselves are gone."""
    settings = Settings.model_validate({"localization": {"max_particles": 250}})
    driven = short_drive()
    estimator = Estimator(CORRIDOR, settings, initial_pose=START)
    half = len(driven.records) // 2
    fed(estimator, driven.records[:half])
    stamp = max(each for each in driven.poses if each <= driven.records[half - 1].stamp_ns)
    estimator.feed(InitialPose(stamp, driven.poses[stamp], TOLD))
    rows = fed(estimator, driven.records[half:])
    last = [row for row in rows if row.object == "a" and row.observed][-1]
    assert np.degrees(abs(last.mean - truth()["a"][0])) < 2.0


def test_without_a_told_pose_the_first_recorded_belief_starts_localization_with_a_warning() -> None:
    estimator = Estimator(CORRIDOR)
    estimator.feed(GaussianRobotBelief(START_NS, START, TOLD))
    estimator.feed(GaussianRobotBelief(START_NS + 1, START + 2.0, TOLD))
    assert estimator.robot is not None
    np.testing.assert_allclose(estimator.robot.mean, START, atol=0.02)
    (warning,) = estimator.warnings
    assert "no /initialpose" in warning


def test_a_pose_and_anywhere_exclude_each_other() -> None:
    with pytest.raises(SettingsError, match="exclude each other"):
        Estimator(CORRIDOR, initial_pose=START, global_start=True)


def test_a_pose_of_the_same_nanosecond_as_a_scan_may_come_before_or_after_it() -> None:
    records = short_drive().records
    first = next(k for k, record in enumerate(records) if isinstance(record, Scan))
    told = InitialPose(records[first].stamp_ns, START, TOLD)
    for place, missed in ((first, 0), (first + 1, 1)):
        estimator = Estimator(CORRIDOR)
        rows = fed(estimator, [*records[:place], told, *records[place:]])
        assert estimator.scans_without_pose == missed
        last = [row for row in rows if row.object == "a" and row.observed][-1]
        assert np.degrees(abs(last.mean - truth()["a"][0])) < 2.0


@pytest.mark.parametrize("scan_first", [True, False])
def test_odometry_and_scan_of_one_nanosecond_may_come_in_either_order(scan_first: bool) -> None:
    records = list(short_drive().records)
    if scan_first:
        for k in range(len(records) - 1):
            if isinstance(records[k], Odometry) and isinstance(records[k + 1], Scan):
                records[k], records[k + 1] = records[k + 1], records[k]
    estimator = Estimator(CORRIDOR, initial_pose=START)
    fed(estimator, records)
    end = short_drive().poses[max(short_drive().poses)]
    assert estimator.robot is not None
    assert np.hypot(*(estimator.robot.mean - end)[:2]) < 0.06


# --- what comes back ----------------------------------------------------------------


def test_rows_bear_the_stamps_of_their_scans() -> None:
    estimator = Estimator(CORRIDOR, initial_pose=START)
    told = 0
    for record in short_drive().records:
        rows = estimator.feed(record)
        assert not rows or isinstance(record, Scan)
        for row in rows:
            told += 1
            assert row.stamp_ns == record.stamp_ns
            assert row.object in CORRIDOR.objects
            assert row.coordinate == "angle"
            assert row.lower <= row.mean <= row.upper
            assert row.std > 0.0
            belief = estimator.objects[row.object]
            assert belief.stamp_ns == row.stamp_ns
            assert (belief.last_observed_ns == row.stamp_ns) is row.observed
    assert told > 0


def test_objects_beyond_the_distance_are_not_touched() -> None:
    settings = Settings.model_validate({"object_updates": {"max_distance": 1.0}})
    estimator = Estimator(CORRIDOR, settings, initial_pose=START)
    rows = fed(estimator, short_drive().records)
    assert {row.object for row in rows} == {"a"}
    assert all(estimator.objects[name].stamp_ns is None for name in ("b", "c", "d"))


def test_objects_given_out_are_not_changed_by_later_records() -> None:
    estimator = Estimator(CORRIDOR, initial_pose=START)
    records = short_drive().records
    fed(estimator, records[: len(records) // 2])
    held = estimator.objects
    weights = {name: belief.weights.values.copy() for name, belief in held.items()}
    fed(estimator, records[len(records) // 2 :])
    for name, belief in held.items():
        np.testing.assert_array_equal(belief.weights.values, weights[name])
    assert estimator.objects["a"].stamp_ns != held["a"].stamp_ns


def test_a_scan_that_somebody_blocks_observes_nothing() -> None:
    estimator, records = Estimator(CORRIDOR, initial_pose=START), short_drive().records
    fed(estimator, records)
    scan = next(record for record in reversed(records) if isinstance(record, Scan))
    blocked = scan_of(np.full(len(scan), 0.2), scan.rays, scan.stamp_ns + 10**8)
    seen = {name: belief.last_observed_ns for name, belief in estimator.objects.items()}
    rows = estimator.feed(replace(blocked, odometry=scan.odometry))
    assert rows
    assert not any(row.observed for row in rows)
    assert seen == {name: belief.last_observed_ns for name, belief in estimator.objects.items()}


def test_objects_behind_walls_and_closed_doors_are_not_observed() -> None:
    """One stands behind the corridor's wall, one in the room behind the closed door 'a'."""
    hidden = [table("walled", 1.3, 1.6, size=(0.4, 0.4)), table("shut", 2.95, 1.6, size=(0.4, 0.4))]
    place = building(CORRIDOR.walls, *CORRIDOR.objects.values(), *hidden)
    states = truth() | {each.name: each.home for each in hidden}
    driven = drive(0, SECONDS, place=place, states=states)
    stays = {"prior_std_m": 0.03, "dynamics": {"moves_per_hour": 0}}
    rules = [{"match": each.name} | stays for each in hidden]
    settings = Altered.model_validate({"objects": rules, "changes": {"nudge_m": 0.01}})
    estimator = Estimator(place, settings, initial_pose=START)
    rows = fed(estimator, driven.records)
    assert {"a", "walled", "shut"} <= {row.object for row in rows}
    assert estimator.objects["a"].is_certain
    assert not any(row.observed for row in rows if row.object == "walled")
    late = START_NS + 2 * 10**9  # when the door is known to be closed
    assert not any(row.observed for row in rows if row.object == "shut" and row.stamp_ns > late)


def unusable(last: Scan) -> dict[str, Any]:
    """What can't be fed after a scan, by what is said of it."""
    then, three = last.stamp_ns + 10**9, np.zeros(3)
    return {
        "time order": Odometry(START_NS, three),
        "pose of the Odometry": Odometry(then, np.array([np.nan, 0.0, 0.0])),
        "finite array of shape .3,.": Odometry(then, np.zeros(2)),
        "in time order": Odometry(then // 10**9, three),
        "ranges below zero": replace(last, stamp_ns=then, ranges=-last.ranges),
        "one range for each ray": replace(last, stamp_ns=then, ranges=last.ranges[:5]),
        "odometry of the Scan": replace(last, stamp_ns=then, odometry=three * np.nan),
        "mean of the InitialPose": InitialPose(then, three + np.inf, TOLD),
        "covariance of the Gaussian": GaussianRobotBelief(then, three, np.eye(6)),
        "not positive semidefinite": InitialPose(then, three, -np.eye(3)),
        "poses of the RobotBelief": RobotBelief(then, np.zeros((4, 3)), np.full(5, 0.2)),
        "weights of the RobotBelief of .* below zero": RobotBelief(
            then, np.zeros((3, 3)), np.array([1.0, 1.0, -1.0])
        ),
        "weights of the RobotBelief of .* all zero": RobotBelief(then, np.zeros((0, 3)), three[:0]),
        "must be a finite array": Odometry(then, three.astype(object)),
    }


@pytest.mark.parametrize("said", unusable(scan_of(np.ones(9), fan(9), START_NS)))
def test_a_record_that_cannot_be_used_is_refused_and_changes_nothing(said: str) -> None:
    records = short_drive().records
    half = len(records) // 2
    whole, spared = (Estimator(CORRIDOR, initial_pose=START) for _ in range(2))
    fed(whole, records[:half])
    fed(spared, records[:half])
    last = [record for record in records[:half] if isinstance(record, Scan)][-1]
    with pytest.raises(LogError, match=said):
        spared.feed(unusable(last)[said])
    assert fed(spared, records[half:]) == fed(whole, records[half:])


def test_odometry_may_begin_before_the_zero_of_its_clock() -> None:
    """As where what a simulation sends at 0 gets its recording time on the simulation's clock."""
    estimator = Estimator(CORRIDOR, initial_pose=START)
    assert estimator.feed(Odometry(-(10**8), np.zeros(3))) == []
    scan = scan_of(np.ones(9), fan(9), -(10**8), odometry=np.zeros(3))
    assert {row.stamp_ns for row in estimator.feed(scan)} <= {-(10**8)}
    for late in (Odometry(-2 * 10**8, np.zeros(3)), replace(scan, stamp_ns=-2 * 10**8)):
        with pytest.raises(LogError, match="-200000000 ns came after one of -100000000 ns"):
            estimator.feed(late)


def test_records_of_any_kind_are_refused_out_of_time_order() -> None:
    """A scan of before the last odometry reading would be taken as seen from where the robot is."""
    records = short_drive().records
    scan = next(record for record in records if isinstance(record, Scan))
    start = InitialPose(scan.stamp_ns, START, None)
    for late in (scan, start):
        estimator = Estimator(CORRIDOR, initial_pose=START)
        estimator.feed(Odometry(scan.stamp_ns + 1, np.zeros(3)))
        with pytest.raises(LogError, match=f"{type(late).__name__} of .* came after one of"):
            estimator.feed(late)


@pytest.mark.parametrize("given", ["office.urdf", Path("office.urdf"), None])
def test_a_building_that_is_not_loaded_is_refused(given: Any) -> None:
    with pytest.raises(TypeError, match=r"is no Building; give .*load_building"):
        Estimator(given)


@pytest.mark.parametrize("given", ["settings.yaml", Path("settings.yaml"), {}])
def test_settings_that_are_not_loaded_are_refused(given: Any) -> None:
    with pytest.raises(TypeError, match=r"is no Settings; give .*load_settings"):
        Estimator(CORRIDOR, given)


@pytest.mark.parametrize("given", [{"a": None}, ["a"], "a"])
def test_what_is_no_beliefs_by_name_is_refused(given: Any) -> None:
    with pytest.raises(TypeError, match="is no belief about an object; give a dict of beliefs"):
        Estimator(CORRIDOR, beliefs=given)


def test_a_start_in_degrees_is_refused() -> None:
    with pytest.raises(SettingsError, match=r"yaw of 90 rad is more .* give math.radians\(90\)"):
        Estimator(CORRIDOR, initial_pose=np.array([2.0, 0.0, 90.0]))


def test_what_is_no_record_is_refused() -> None:
    records: Any = short_drive().records
    for other in (records, None, truth()):
        with pytest.raises(TypeError, match="is no record; feed the Odometry, Scan"):
            Estimator(CORRIDOR).feed(other)


@pytest.mark.parametrize("pose", [(np.nan, 0.0, 0.0), (1.0, 2.0), "0,0,0", 5])
def test_a_start_that_is_no_pose_is_refused(pose: Any) -> None:
    with pytest.raises(SettingsError, match="give x, y in metres and yaw in radians"):
        Estimator(CORRIDOR, initial_pose=pose)


@pytest.mark.parametrize("seed", ["0", -1, 1.5, None])
def test_a_seed_that_is_none_is_refused(seed: Any) -> None:
    with pytest.raises(SettingsError, match="give a whole number, 0 or more"):
        Estimator(CORRIDOR, seed=seed)


def test_a_start_anywhere_is_said_by_true_or_false() -> None:
    said: Any = "no"
    with pytest.raises(SettingsError, match="global_start is 'no'; give True or False"):
        Estimator(CORRIDOR, global_start=said)


def test_another_robot_belief_than_the_known_ones_is_refused() -> None:
    misspelt: Any = "recoded"
    with pytest.raises(SettingsError, match="'recoded' is unknown; give own or recorded"):
        Estimator(CORRIDOR, belief=misspelt)


def test_scans_of_nothing_but_discarded_beams_change_no_robot_belief() -> None:
    estimator = Estimator(CORRIDOR, initial_pose=START)
    before = estimator.robot
    rows = estimator.feed(scan_of(np.full(181, np.nan), fan(181), START_NS))
    assert estimator.robot is before
    assert not any(row.observed for row in rows)


def test_an_object_asked_for_later_is_less_certain_and_the_asking_changes_nothing() -> None:
    estimator = Estimator(CORRIDOR, initial_pose=START)
    fed(estimator, short_drive().records)
    now = estimator.objects["a"]
    assert now.stamp_ns is not None
    later = estimator.object_at("a", now.stamp_ns + 3600 * 10**9)
    assert later.std[0] > 3.0 * now.std[0]
    assert later.last_observed_ns == now.last_observed_ns
    np.testing.assert_array_equal(estimator.objects["a"].weights.values, now.weights.values)
    with pytest.raises(BuildingError, match="no object 'x'"):
        estimator.object_at("x", now.stamp_ns)
    with pytest.raises(TypeError, match="is no integer; give nanoseconds since 1970"):
        estimator.object_at("a", now.stamp_ns / 1e9)  # type: ignore[arg-type]
    again = estimator.object_at("a", now.stamp_ns + 3600 * 10**9)
    np.testing.assert_array_equal(again.weights.values, later.weights.values)


def test_what_is_known_from_before_takes_the_place_of_the_prior() -> None:
    taught = Estimator(CORRIDOR, initial_pose=START)
    fed(taught, short_drive().records)
    known = {"a": replace(taught.objects["a"], stamp_ns=START_NS)}
    estimator = Estimator(CORRIDOR, initial_pose=START, beliefs=known)
    assert estimator.objects["a"].stamp_ns == START_NS
    np.testing.assert_allclose(estimator.objects["a"].mean, known["a"].mean, atol=0.01)
    assert estimator.objects["b"].stamp_ns is None
    later = estimator.object_at("a", START_NS + 600 * 10**9)
    assert known["a"].std[0] < later.std[0] < Estimator(CORRIDOR).objects["a"].std[0]
    with pytest.raises(BuildingError, match="no object 'x'"):
        Estimator(CORRIDOR, beliefs={"x": known["a"]})
    with pytest.raises(BuildingError, match="given for 'b' is about 'a'"):
        Estimator(CORRIDOR, beliefs={"b": known["a"]})


def test_a_door_may_be_known_less_surely_than_any_other() -> None:
    own = {"a": {"hinge_std_m": 0.5, "bearing_std_deg": 20.0}}
    settings = Settings.model_validate({"building_error": {"doors": own}})
    estimator = Estimator(CORRIDOR, settings, initial_pose=START)
    rows = fed(estimator, short_drive().records)
    assert np.isfinite([value for row in rows for value in (row.mean, row.std)]).all()
    joint = estimator.objects["a"].joint
    assert isinstance(joint, DoorMixture)
    # a prior is exchanged for a narrower one: for a wider one there may be none
    assert joint.statics == pytest.approx((0.5**2, np.radians(20.0) ** 2))


def test_an_uncertain_robot_updates_no_objects() -> None:
    wide = InitialPose(START_NS - 1, START, np.diag([4.0, 4.0, 0.1]))
    estimator = Estimator(CORRIDOR)
    assert fed(estimator, [wide, *short_drive().records[:2]]) == []
    assert all(belief.stamp_ns is None for belief in estimator.objects.values())


def test_a_start_whose_error_is_unknown_may_be_off_by_decimetres() -> None:
    driven = short_drive()
    estimator = Estimator(CORRIDOR)
    off = START + np.array([0.3, 0.2, 0.1])
    fed(estimator, [InitialPose(START_NS - 1, off, None), *driven.records])
    assert estimator.robot is not None
    end = driven.poses[max(driven.poses)]
    assert np.hypot(*(estimator.robot.mean - end)[:2]) < 0.1


def test_a_robot_of_an_uncertain_start_is_lost_from_that_start_on_and_not_from_1970_on() -> None:
    wide = InitialPose(START_NS - 1, START, np.diag([1.0, 1.0, 0.1]))
    estimator = Estimator(CORRIDOR)
    fed(estimator, [wide, *short_drive().records])
    assert estimator.lost[0][0] == START_NS - 1
    assert not estimator.is_lost


def test_a_robot_that_is_told_an_uncertain_start_after_its_last_scan_is_lost_for_no_time() -> None:
    records = short_drive().records
    for before in ([], records):
        estimator = Estimator(CORRIDOR)
        fed(estimator, before)
        told_ns = max(record.stamp_ns for record in records) + 10**9
        estimator.feed(InitialPose(told_ns, START, np.diag([1.0, 1.0, 0.1])))
        assert estimator.lost == ((told_ns, told_ns),)


@pytest.mark.parametrize("seed", range(3))
def test_a_robot_started_anywhere_in_a_hall_without_symmetry_finds_itself(seed: int) -> None:
    sides = [(0.0, -3.0), (10.0, -3.0), (10.0, 2.0), (6.0, 3.0), (0.0, 3.0)]
    hall = building(
        Mesh.joined([fence(np.array(sides)), block(4.0, -1.5, 1.0, 2.0), block(1.5, 2.0, 0.6, 1.2)])
    )
    driven = drive(seed, place=hall, states={})
    estimator = Estimator(hall, seed=seed, global_start=True)
    fed(estimator, driven.records)
    end = driven.poses[max(driven.poses)]
    assert estimator.robot is not None
    assert np.hypot(*(estimator.robot.mean - end)[:2]) < 0.1
    assert abs(wrap(estimator.robot.mean[2] - end[2])) < np.radians(3.0)


# --- a robot that stands ------------------------------------------------------------


def test_however_often_a_robot_looks_from_one_place_its_own_error_stays_in_what_it_says() -> None:
    settings = Altered(
        building_error=BuildingErrorSettings(bearing_std_deg=0.001, hinge_std_m=0.05),
        changes={"resolution_deg": 0.1},  # its own width doesn't count
    )
    estimator = Estimator(CORRIDOR, settings, belief="recorded")
    pose, rays, rng = np.array([5.0, 0.3, -1.5]), fan(181), np.random.default_rng(0)
    exact = ExpectedRanges(CORRIDOR).scene(truth(), pose[None], rays)[0]
    yaw_std = np.radians(1.0)
    told = np.diag([0.03, 0.03, yaw_std]) ** 2
    for k in range(60):
        stamp_ns = START_NS + k * 10**8
        ranges = exact + 0.03 * rng.standard_normal(len(exact))
        estimator.feed(GaussianRobotBelief(stamp_ns, pose, told))
        estimator.feed(scan_of(ranges, rays, stamp_ns, odometry=np.zeros(3)))
    assert estimator.objects["b"].std[0] > 0.7 * yaw_std


def test_nothing_keeps_an_estimator_or_its_building_once_it_is_done_with() -> None:
    place = corridor()
    estimator = Estimator(place, initial_pose=START)
    for record in drive(0, 3.0).records:
        estimator.feed(record)
    kept = [weakref.ref(estimator), weakref.ref(place), weakref.ref(place.walls)]
    del estimator, place
    gc.collect()
    assert [reference() for reference in kept] == [None, None, None]
