"""Laws of the adjustment's parts."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import diags_array

from objstate.calibration.adjustment import about_laser
from objstate.calibration.blocks import Blocks, NormalEquations
from objstate.calibration.motion import OdometryTrack, counted_steps, links_between
from objstate.calibration.options import CalibrationOptions
from objstate.calibration.walls import WallReader
from objstate.config import Settings
from objstate.geometry import compose, rotation_about, transform
from objstate.records import Rays
from objstate.sensing import ExpectedRanges
from tests.rooms import building, door, enclosure, fan, placed, scan_of

ROOM = building(enclosure(6.0, 4.0))
small = st.floats(-0.2, 0.2)


@settings(max_examples=40)
@given(small, small, small, st.floats(-3.0, 3.0))
def test_casting_from_a_moved_robot_is_casting_from_a_moved_laser(
    x: float, y: float, yaw: float, heading: float
) -> None:
    mount, pose = placed(0.3, -0.1, 0.3), np.array([0.4, -0.2, heading])
    rays = fan(31, mount=mount)
    turn = rotation_about((0.0, 0.0, 1.0), yaw)
    moved = transform(turn @ mount[:3, :3], mount[:3, 3] + [x, y, 0.0])
    motion = about_laser(mount[None, :2, 3], np.array([[x, y, yaw]]))
    expected = ExpectedRanges(ROOM)
    np.testing.assert_allclose(
        expected.walls(compose(pose, motion), rays)[0],
        expected.walls(pose[None], fan(31, mount=moved))[0],
        atol=1e-4,
    )


@settings(max_examples=40)
@given(st.integers(0, 1000))
def test_a_step_solves_linear_least_squares(seed: int) -> None:
    rng = np.random.default_rng(seed)
    jacobian, errors = rng.standard_normal((8, 3, 4)), rng.standard_normal((8, 3))
    columns = np.array([rng.choice(6, 4, replace=False) for _ in range(8)])
    blocks = Blocks(columns, jacobian, np.tile(np.eye(3), (8, 1, 1)), errors)
    equations = NormalEquations.of([blocks], diags_array(np.full(6, 0.5)), np.zeros(6))
    dense = np.zeros((24, 6))
    for k in range(8):
        dense[3 * k : 3 * k + 3, columns[k]] = jacobian[k]
    hessian = dense.T @ dense + 0.5 * np.eye(6)
    step = -np.linalg.solve(hessian, dense.T @ errors.ravel())
    np.testing.assert_allclose(equations.step(), step, atol=1e-9)
    covariance = np.linalg.inv(hessian)[3:, 3:]
    np.testing.assert_allclose(equations.covariance(np.array([3, 4, 5])), covariance, atol=1e-9)
    for chain in range(1, 4):
        information, gradient = equations.marginal(chain, 3)
        np.testing.assert_allclose(information, np.linalg.inv(covariance), atol=1e-9)
        np.testing.assert_allclose(-np.linalg.solve(information, gradient), step[3:], atol=1e-9)


def test_a_wall_that_is_off_reads_alike_at_any_incidence() -> None:
    reader = WallReader(ROOM, Settings(), CalibrationOptions())
    pose, rays = np.array([0.1, 0.2, 0.3]), fan(181)
    further = building(enclosure(6.04, 4.04))  # every wall 2 cm farther out
    scan = scan_of(ExpectedRanges(further).walls(pose[None], rays)[0], rays)
    readings = reader.read(scan, reader.beams_on_walls(scan, pose), pose)
    assert len(readings.distances) > 60
    np.testing.assert_allclose(readings.distances, 0.02, atol=1e-3)
    np.testing.assert_allclose(np.hypot(*readings.gradients[:, :2].T), 1.0, atol=1e-6)


def test_beams_that_may_meet_a_door_are_left_out() -> None:
    place = building(enclosure(6.0, 4.0), door("d", 2.0, -0.4, bearing=1.57, width=0.8))
    reader = WallReader(place, Settings(), CalibrationOptions())
    pose, rays = np.zeros(3), fan(181)
    scan = scan_of(ExpectedRanges(place).walls(pose[None], rays)[0], rays)
    bearings = np.degrees(np.arctan2(*rays.directions[reader.beams_on_walls(scan, pose), 1::-1].T))
    swept = np.degrees(np.arctan2([-0.4, 0.4], [2.0, 2.0]))
    assert not ((bearings > swept[0]) & (bearings < swept[1])).any()
    assert len(bearings) > 30


@settings(max_examples=40)
@given(st.floats(-0.05, 0.05), st.floats(-0.02, 0.02), st.integers(0, 100))
def test_odometry_that_errs_as_it_is_known_to_leaves_nothing(
    share: float, drift: float, seed: int
) -> None:
    rng, errors = np.random.default_rng(seed), np.array([share, drift])
    poses, odometry = [np.array([1.0, 2.0, 0.5])], [np.zeros(3)]
    for step in rng.uniform([0.0, -0.02, -0.2], [0.2, 0.02, 0.2], (10, 3)):
        poses.append(compose(poses[-1], step))
        odometry.append(compose(odometry[-1], counted_steps(step, errors)))
    links = links_between(np.array(odometry), CalibrationOptions())
    left = links.residuals(np.array(poses[:-1]), np.array(poses[1:]), errors)
    np.testing.assert_allclose(left, 0.0, atol=1e-6)


@settings(max_examples=40)
@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_speeds_of_an_even_motion(ahead: float, turn: float) -> None:
    times = np.arange(0.0, 3.0, 0.05)
    poses = [np.zeros(3)]
    for _ in times[1:]:
        poses.append(compose(poses[-1], np.array([ahead * 0.05, 0.0, turn * 0.05])))
    track = OdometryTrack(np.round(times * 1e9).astype(np.int64), np.array(poses))
    (speed,) = track.speeds(np.array([1_500_000_000]))
    np.testing.assert_allclose(speed, [ahead, 0.0, turn], atol=0.03)


def test_a_track_is_held_at_its_ends() -> None:
    track = OdometryTrack(np.array([10, 20]), np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(track.at(np.array([0, 15, 99]))[:, 0], [0.0, 0.5, 1.0])


def test_pieces_are_told_apart_by_place_and_by_the_way_they_face() -> None:
    reader = WallReader(ROOM, Settings(), CalibrationOptions())
    pose, rays = np.zeros(3), Rays(np.tile([0.0, 0.0, 0.3], (4, 1)), np.array(SIDES))
    scan = scan_of(np.array([3.0, 2.0, 3.0, 2.0]), rays)
    readings = reader.read(scan, np.ones(4, dtype=bool), pose)
    assert len(set(readings.pieces(100.0).tolist())) == 4
    assert len(set(readings.pieces(1.0).tolist())) == 4


SIDES = [[0.999, 0.04, 0.0], [0.04, 0.999, 0.0], [-0.999, 0.04, 0.0], [0.04, -0.999, 0.0]]
