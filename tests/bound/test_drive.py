"""The bound over a drive: what is learnt, what is forgotten, and that it can be reached."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.bound import bounds_of
from objstate.geometry import FloatArray
from objstate.sensing.expected import ExpectedRanges
from objstate.simulation.drive import Simulation
from objstate.simulation.lasers import reading
from tests.bound.conftest import LASER, Drive

DOOR = ("door", "angle")
HALF_OPEN = [{"name": "door", "initial": 0.4}]
THERE_AND_BACK = {"waypoints": [{"x": -2, "y": -1}, {"x": 2, "y": -1}, {"x": -2, "y": -1}]}


def test_every_scan_of_a_robot_at_rest_narrows_the_bound(drive: Drive) -> None:
    bounds = bounds_of(drive(objects=HALF_OPEN))
    for deviations in (*bounds.deviations.values(), *bounds.robot.T):
        assert (np.diff(deviations) < 0).all()


def test_scans_of_a_robot_at_rest_add_up_like_readings_of_one_value(drive: Drive) -> None:
    start = {"sigma_xy": 0.0, "sigma_yaw": 0.0}  # with the pose known, only the readings count
    bounds = bounds_of(drive(objects=HALF_OPEN, initial_pose=start))
    prior = (1.5 / np.sqrt(12)) ** -2  # the door may be anywhere between its limits
    told = bounds.deviations[DOOR] ** -2.0 - prior
    np.testing.assert_allclose(told, told[0] * np.arange(1, len(told) + 1), rtol=1e-9)


def test_a_moved_door_is_unknown_until_it_is_seen_again(drive: Drive) -> None:
    moved = [{"name": "door", "initial": 0.4, "changes": [{"at": 0.9, "to": 0.6, "duration": 0.2}]}]
    still, changed = (bounds_of(drive(objects=rules)) for rules in (HALF_OPEN, moved))
    before = still.stamps_ns < 1_600_000_000_900_000_000
    np.testing.assert_array_equal(still.deviations[DOOR][before], changed.deviations[DOOR][before])
    assert (changed.deviations[DOOR][~before] > still.deviations[DOOR][~before]).all()


def test_a_robot_that_knows_less_of_itself_learns_less_of_the_door(drive: Drive) -> None:
    blind = {"beams": 21, "angle_min": 0.1, "angle_max": 0.5, "mount": {"yaw": 0.3}}
    noises = [
        {"translation_noise": noise, "rotation_noise": noise, "drift_noise": noise}
        for noise in (0.0, 0.03, 0.3)
    ]
    finals = [
        bounds_of(drive(route=THERE_AND_BACK, lasers=[LASER | blind], odometry=noise))
        for noise in noises
    ]
    assert np.diff([bounds.deviations[DOOR][-1] for bounds in finals]).min() > 0
    assert np.diff([bounds.robot[-1, 2] for bounds in finals]).min() > 0


def test_a_bound_is_looked_up_at_the_scan_that_was_taken_in_last(drive: Drive) -> None:
    bounds = bounds_of(drive())
    stamps = bounds.stamps_ns[[0, 2]] + np.array([0, 7])
    np.testing.assert_array_equal(bounds.at(DOOR, stamps), bounds.deviations[DOOR][[0, 2]])


def test_the_best_estimate_from_one_scan_errs_by_the_bound(drive: Drive) -> None:
    simulation = drive(objects=HALF_OPEN, lasers=[LASER | {"rate": 0.5}])
    bounds = bounds_of(simulation)
    assert len(bounds.stamps_ns) == 1
    limits = np.append(bounds.robot[0], bounds.deviations[DOOR])
    errors = best_estimates(simulation, np.random.default_rng(5), count=300)
    np.testing.assert_allclose(np.sqrt(np.mean(errors**2, axis=0)), limits, rtol=0.12)


def best_estimates(simulation: Simulation, rng: np.random.Generator, count: int) -> FloatArray:
    """(count, 4) errors of pose and angle, each the likeliest from its own noisy scan."""
    expected = ExpectedRanges(simulation.building)
    _, exposure = next(simulation.exposures())
    table = exposure.states["table"]
    sigma = np.array([0.2, 0.2, 0.1, 1.5 / np.sqrt(12)])  # of what is known before, as in the scene

    def ranges(guess: FloatArray) -> FloatArray:
        states = {"door": guess[3:], "table": table}
        return expected.scene(states, guess[None, :3], exposure.rays)[0]

    truth = np.append(exposure.robot, exposure.states["door"])
    seen = expected.object("table", table[None], exposure.robot[None], exposure.rays)[0, 0]
    kept = np.isinf(seen) & (ranges(truth) <= exposure.laser.range_max)  # the table is unknown
    steps = 1e-3 * np.eye(4)
    slopes = np.stack([(ranges(truth + s) - ranges(truth - s)) / 2e-3 for s in steps], axis=1)
    kept &= (np.abs(slopes) < 20).all(axis=1)  # not on an edge
    weighted = np.vstack([slopes[kept] / exposure.laser.sigma, np.diag(1 / sigma)])
    errors = []
    for _ in range(count):
        off = reading(ranges(truth), exposure.laser, rng)[kept] - ranges(truth)[kept]
        first = rng.standard_normal(4)
        right = np.append(off / exposure.laser.sigma, first)
        errors.append(np.linalg.lstsq(weighted, right, rcond=None)[0])
    return np.array(errors)


def test_a_start_from_anywhere_ends_as_well(drive: Drive) -> None:
    told = bounds_of(drive(objects=HALF_OPEN)).deviations[DOOR][-1]
    anywhere = bounds_of(drive(objects=HALF_OPEN, initial_pose=None)).deviations[DOOR][-1]
    assert told <= anywhere == pytest.approx(told, rel=0.05)
