"""Whole calibrations of small drives whose lasers are really mounted elsewhere than their scans say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from objstate.calibration import CalibrationOptions, calibrate
from objstate.errors import LogError
from objstate.estimator import Estimator
from objstate.geometry import FloatArray, compose
from objstate.records import Odometry, Rays, Record, Scan
from objstate.sensing import ExpectedRanges
from tests.rooms import LASER_HEIGHT, building, enclosure, fan, placed, scan_of

ROOM = building(enclosure(6.0, 4.0))
STEP = 0.05  # s between odometry readings
SCAN_EVERY = 4
NOMINAL = placed(0.2, 0.0, LASER_HEIGHT)
NOISE = 0.01  # m


def mounted(x: float, y: float, yaw_deg: float) -> FloatArray:
    """The nominal mounting off by so much."""
    return placed(0.2 + x, y, LASER_HEIGHT, (0.0, 0.0, float(np.radians(yaw_deg))))


def around(seconds: float) -> list[FloatArray]:
    """Poses of a robot that drives in eights, now faster and now slower."""
    pose, poses = np.array([-0.5, -0.6, 0.0]), []
    for k in range(round(seconds / STEP)):
        poses.append(pose)
        time = k * STEP
        speed = 0.4 + 0.3 * np.sin(1.7 * time)
        turn = 1.2 * np.sign(np.sin(0.55 * time)) * abs(np.sin(0.55 * time)) ** 0.5
        pose = compose(pose, np.array([speed * STEP, 0.0, turn * STEP]))
    return poses


def straight(seconds: float) -> list[FloatArray]:
    """Poses of a robot that drives straight at one speed."""
    return [np.array([-2.0 + 0.5 * k * STEP, 0.2, 0.0]) for k in range(round(seconds / STEP))]


def records(
    poses: list[FloatArray], mount: FloatArray, ahead: float = 0.0, seed: int = 0
) -> list[Record]:
    """What is recorded with a laser at ``mount``, whose scans claim the nominal one and run ahead."""
    rng, expected = np.random.default_rng(seed), ExpectedRanges(ROOM)
    real, claimed = fan(121, mount=mount), fan(121, mount=NOMINAL)
    late = round(ahead / STEP)  # a scan that is stamped now was taken so many steps ago
    out: list[Record] = []
    for k, pose in enumerate(poses):
        stamp = 10**9 + round(k * STEP * 1e9)
        out.append(Odometry(stamp, pose))
        if k % SCAN_EVERY == 0 and k >= late:
            out.append(_scan(expected, poses[k - late], real, claimed, rng, stamp, pose))
    return out


def _scan(
    expected: ExpectedRanges,
    pose: FloatArray,
    real: Rays,
    claimed: Rays,
    rng: np.random.Generator,
    stamp: int,
    odometry: FloatArray,
) -> Scan:
    ranges = expected.walls(pose[None], real)[0]
    noisy = ranges + NOISE * rng.standard_normal(len(ranges))
    return scan_of(noisy, claimed, stamp, odometry=odometry)


def at(start: FloatArray) -> Estimator:
    return Estimator(ROOM, initial_pose=start)


@pytest.fixture(scope="module")
def eights() -> list[FloatArray]:
    return around(20.0)


def test_a_laser_askew_is_found_within_its_deviations(eights: list[FloatArray]) -> None:
    truth = np.array([0.02, -0.03, np.radians(1.5), 0.0])
    log = records(eights, mounted(0.02, -0.03, 1.5))
    (laser,) = calibrate(log, ROOM, {"laser": NOMINAL}, at(eights[0])).lasers
    assert laser.told.all()
    assert (np.abs(laser.correction - truth) < 3.0 * laser.std).all()
    assert (laser.std < [0.01, 0.01, np.radians(0.3), 0.015]).all()
    np.testing.assert_allclose(laser.corrected_mount, mounted(0.02, -0.03, 1.5), atol=0.015)


def test_a_clock_that_is_ahead_is_found(eights: list[FloatArray]) -> None:
    log = records(eights, NOMINAL, ahead=STEP)
    (laser,) = calibrate(log, ROOM, {"laser": NOMINAL}, at(eights[0])).lasers
    assert laser.told[3]
    assert abs(laser.correction[3] - STEP) < 3.0 * laser.std[3]
    assert laser.corrected_clock_offset > 0.6 * STEP


def test_a_straight_drive_tells_neither_clock_nor_place() -> None:
    poses = straight(8.0)
    log = records(poses, mounted(0.03, 0.02, 1.0))
    (laser,) = calibrate(log, ROOM, {"laser": NOMINAL}, at(poses[0])).lasers
    assert laser.told.tolist() == [False, False, True, False]
    assert abs(laser.correction[2] - np.radians(1.0)) < 3.0 * laser.std[2]
    np.testing.assert_allclose(laser.corrected_mount[:3, 3], NOMINAL[:3, 3])
    assert laser.corrected_clock_offset == 0.0


def test_a_robot_that_stands_tells_nothing() -> None:
    poses = [np.array([0.3, 0.2, 0.4])] * 80
    log = records(poses, mounted(0.02, -0.03, 1.5))
    (laser,) = calibrate(log, ROOM, {"laser": NOMINAL}, at(poses[0])).lasers
    assert not laser.told.any()
    np.testing.assert_allclose(laser.corrected_mount, NOMINAL)


def test_the_same_records_give_the_same_numbers(eights: list[FloatArray]) -> None:
    log, options = records(eights[:120], mounted(0.0, 0.0, 1.0)), CalibrationOptions(rounds=3)
    first, second = (
        calibrate(log, ROOM, {"laser": NOMINAL}, at(eights[0]), options) for _ in range(2)
    )
    assert (first.lasers[0].correction == second.lasers[0].correction).all()
    assert (first.lasers[0].std == second.lasers[0].std).all()


def test_readings_of_something_else_are_doubted(eights: list[FloatArray]) -> None:
    rng = np.random.default_rng(1)
    log = [
        replace(each, ranges=each.ranges * rng.uniform(0.2, 0.9, len(each)))
        if isinstance(each, Scan)
        else each
        for each in records(eights[:120], NOMINAL)
    ]
    found = calibrate(log, ROOM, {"laser": NOMINAL}, at(eights[0]))
    assert any("is it the building of the log" in warning for warning in found.warnings)


def test_a_mounting_far_off_is_told(eights: list[FloatArray]) -> None:
    log = records(eights[:200], mounted(0.0, -0.2, 0.0))
    found = calibrate(log, ROOM, {"laser": NOMINAL}, at(eights[0]))
    assert any("'laser'" in warning and "(y)" in warning for warning in found.warnings)


def test_a_robot_that_nobody_placed_is_an_error() -> None:
    with pytest.raises(LogError, match="localized nowhere"):
        calibrate(records(straight(2.0), NOMINAL), ROOM, {"laser": NOMINAL})
