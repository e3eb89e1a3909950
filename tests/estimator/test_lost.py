"""A robot that is carried elsewhere, and one that doesn't know where it starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from objstate.building.model import Mesh
from objstate.config import SearchSettings
from objstate.errors import BuildingError
from objstate.estimator import Estimator
from objstate.estimator.joint import JointUpdate
from objstate.estimator.monitor import MOMENT_S
from objstate.geometry import FloatArray, between, compose, wrap
from objstate.records import Estimate, InitialPose, Odometry, RobotBelief, Scan
from tests.estimator.drives import START, START_NS, Drive, corridor, drive, truth
from tests.rooms import wall

CORRIDOR = corridor()
SECOND = 10**9
KIDNAPPED_S = 5.0
FOUND_S = 10.0  # in a corridor of two doors that looks much alike a few metres on
JUMPED_S = 2.5  # two keyframes that are a second apart, and the scan that finds it
CLOSE = np.diag([0.0025, 0.0025, 0.001])  # covariance of a pose that was told


@cache
def kidnapped(seed: int) -> Drive:
    """Along the corridor past door b, then carried back to the start; the odometry goes on."""
    first, second = drive(seed, KIDNAPPED_S), drive(seed + 100, 9.0)
    end = max(first.poses) + SECOND // 5
    shift = end - START_NS
    offset = first.records[-1].odometry
    records, poses = list(first.records), dict(first.poses)
    start = second.records[0].pose
    for record in second.records:
        if isinstance(record, Scan):
            at = compose(offset, between(start, record.odometry))
            records.append(replace(record, stamp_ns=record.stamp_ns + shift, odometry=at))
        else:
            at = compose(offset, between(start, record.pose))
            records.append(replace(record, stamp_ns=record.stamp_ns + shift, pose=at))
    poses |= {stamp + shift: pose for stamp, pose in second.poses.items()}
    return Drive(records, poses)


def error(estimator: Estimator, pose: FloatArray) -> float:
    assert estimator.robot is not None
    return float(np.hypot(*(estimator.robot.mean - pose)[:2]))


@pytest.mark.parametrize("seed", range(2))
def test_a_kidnapped_robot_is_found_and_says_that_it_was_lost_and_no_object_is_spoilt(
    seed: int,
) -> None:
    driven, rows = kidnapped(seed), list[Estimate]()
    estimator = Estimator(CORRIDOR, seed=seed, initial_pose=START)
    for record in driven.records:
        rows += estimator.feed(record)
    assert not estimator.is_lost
    assert error(estimator, driven.poses[max(driven.poses)]) < 0.06
    ((since_ns, until_ns),) = estimator.lost
    assert since_ns >= START_NS + (KIDNAPPED_S - MOMENT_S) * SECOND
    assert until_ns < START_NS + (KIDNAPPED_S + FOUND_S) * SECOND
    assert all(row.lost is False for row in rows if row.stamp_ns < since_ns)
    assert not any(row.lost and row.observed for row in rows)
    for name, state in truth().items():
        belief = estimator.objects[name]
        if belief.last_observed_ns is not None and belief.std[0] < np.radians(3.0):
            assert abs(np.degrees(belief.mean[0] - state[0])) < 4.0


def test_a_belief_that_a_jump_of_the_odometry_made_wide_is_lost_until_it_is_found() -> None:
    driven, jump = drive(5, 9.0), np.array([60.0, -40.0, 2.0])
    estimator, errors = Estimator(CORRIDOR, initial_pose=START), dict[float, float]()
    for record in driven.records:
        since = (record.stamp_ns - START_NS) / SECOND - KIDNAPPED_S
        match record:
            case Scan(odometry=np.ndarray() as odometry) if since >= 0.0:
                estimator.feed(replace(record, odometry=compose(jump, odometry)))
            case Odometry() if since >= 0.0:
                estimator.feed(replace(record, pose=compose(jump, record.pose)))
            case _:
                estimator.feed(record)
        if isinstance(record, Scan):
            errors[since] = error(estimator, driven.poses[record.stamp_ns])
    assert max(each for since, each in errors.items() if since > JUMPED_S) < 0.1
    ((since_ns, until_ns),) = estimator.lost
    assert abs((since_ns - START_NS) / SECOND - KIDNAPPED_S) <= 0.3
    assert (until_ns - START_NS) / SECOND - KIDNAPPED_S < JUMPED_S


def test_a_robot_that_may_be_anywhere_is_lost_until_it_is_found() -> None:
    driven = drive(3, 9.0)
    estimator, was_lost = Estimator(CORRIDOR, global_start=True), []
    for record in driven.records:
        estimator.feed(record)
        if isinstance(record, Scan):
            was_lost.append(estimator.is_lost)
            if not estimator.is_lost:
                assert error(estimator, driven.poses[record.stamp_ns]) < 0.3
    assert was_lost[0]
    assert not was_lost[-1]
    end = driven.poses[max(driven.poses)]
    assert estimator.robot is not None
    assert abs(wrap(estimator.robot.mean[2] - end[2])) < np.radians(3.0)
    assert len(estimator.lost) == 1


def test_a_lost_robot_was_lost_at_the_last_record_too() -> None:
    estimator, lasted = Estimator(CORRIDOR, global_start=True), []
    for record in drive(0, 1.0).records:
        estimator.feed(record)
        if isinstance(record, Scan) and estimator.is_lost and estimator.lost:
            begin, end = estimator.lost[-1]
            lasted.append(begin <= record.stamp_ns < end)
    assert lasted
    assert all(lasted)


def test_what_a_lost_robot_saw_tells_of_no_hinge(monkeypatch: pytest.MonkeyPatch) -> None:
    estimator = Estimator(CORRIDOR, initial_pose=START)
    for record in drive(0, KIDNAPPED_S).records:
        estimator.feed(record)
    seen = {name for name, each in estimator.objects.items() if each.stamp_ns is not None}
    off = dict.fromkeys(seen, np.array([0.1, 0.0]))
    monkeypatch.setattr(JointUpdate, "hung_elsewhere", property(lambda _: off))
    assert seen
    assert estimator.hung_elsewhere == off
    monkeypatch.setattr(Estimator, "lost", property(lambda _: ((0, 10**19),)))
    assert estimator.hung_elsewhere == {}


def test_a_drive_without_kidnapping_is_never_lost() -> None:
    estimator = Estimator(CORRIDOR, initial_pose=START)
    for record in drive(4, 8.0).records:
        estimator.feed(record)
        assert not estimator.is_lost
    assert estimator.lost == ()


@pytest.mark.parametrize("walls", [Mesh.empty(), wall((0.0, -1.0), (9.0, -1.0))])
def test_a_robot_that_may_be_anywhere_needs_walls_around_it_but_one_that_was_told_none(
    walls: Mesh,
) -> None:
    place = replace(CORRIDOR, walls=walls)
    records = drive(0, 4.0, place=place).records
    told = Estimator(place, initial_pose=START)
    for record in records:
        told.feed(record)
    assert told.robot is not None
    assert np.isfinite(told.robot.mean).all()
    anywhere = Estimator(place, global_start=True)
    first = next(record for record in records if isinstance(record, Scan))
    with pytest.raises(BuildingError, match="--global"):
        anywhere.feed(first)


def without_beams(scan: Scan) -> Scan:
    nothing = np.arange(0)
    return replace(scan, ranges=scan.ranges[nothing], rays=scan.rays.take(nothing))


def all_discarded(scan: Scan) -> Scan:
    return replace(scan, ranges=np.full(len(scan), np.nan))


@pytest.mark.parametrize("told", [True, False])
@pytest.mark.parametrize("blinded", [without_beams, all_discarded])
def test_scans_that_say_nothing_only_move_the_robot_on(
    blinded: Callable[[Scan], Scan], told: bool
) -> None:
    """Here every other scan; without them the same comes out, by the odometry that they carry."""
    blind, spared = (
        Estimator(CORRIDOR, initial_pose=START if told else None, global_start=not told)
        for _ in range(2)
    )
    for k, record in enumerate(r for r in drive(2, 5.0).records if isinstance(r, Scan)):
        if k % 2:
            assert blind.feed(blinded(record)) == []
            spared.feed(Odometry(record.stamp_ns, record.odometry))
        else:
            blind.feed(record)
            spared.feed(record)
    assert blind.robot is not None
    assert spared.robot is not None
    np.testing.assert_array_equal(blind.robot.poses, spared.robot.poses)
    for name, belief in blind.objects.items():
        np.testing.assert_array_equal(belief.mean, spared.objects[name].mean)
    assert blind.lost == spared.lost


def test_a_lost_robot_that_is_told_its_pose_knows_it_from_then_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By an odometry that jumps, where no search is ever due."""
    driven, jump, told_ns = drive(5, 9.0), np.array([600.0, -400.0, 2.0]), None
    for name, never in (("min_d", 1e3), ("min_a", 6.0), ("every_s", 1e3)):
        monkeypatch.setattr(SearchSettings, name, never)
    estimator = Estimator(CORRIDOR)
    estimator.feed(InitialPose(START_NS, START, CLOSE))
    for record in driven.records:
        if not isinstance(record, Scan):
            continue
        is_late = record.stamp_ns >= START_NS + KIDNAPPED_S * SECOND
        odometry = compose(jump, record.odometry) if is_late else record.odometry
        estimator.feed(replace(record, odometry=odometry))
        if record.stamp_ns == START_NS + (KIDNAPPED_S + 0.2) * SECOND:
            assert estimator.is_lost
            told_ns = record.stamp_ns
            estimator.feed(InitialPose(told_ns, driven.poses[told_ns], CLOSE))
        if told_ns is not None:
            assert not estimator.is_lost
    ((since_ns, until_ns),) = estimator.lost
    assert since_ns < until_ns == told_ns
    assert error(estimator, driven.poses[max(driven.poses)]) < 0.06


def test_a_recorded_belief_is_no_start_for_a_robot_that_may_be_anywhere() -> None:
    estimator = Estimator(CORRIDOR, global_start=True)
    estimator.feed(RobotBelief(START_NS, START[None], np.ones(1)))
    assert estimator.robot is None
    assert estimator.warnings == []
