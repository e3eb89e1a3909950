"""Laws of poses, angles and rigid transforms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from objstate.geometry import (
    FloatArray,
    between,
    compose,
    interpolate_pose,
    invert,
    is_rigid,
    pose_from_transform,
    quaternion_from_rotation,
    rotation_about,
    rotation_from_quaternion,
    rotation_from_rpy,
    rpy_from_rotation,
    transform,
    transform_from_pose,
    wrap,
)

metres = st.floats(-1000.0, 1000.0)
angles = st.floats(-20.0, 20.0)
poses = st.tuples(metres, metres, angles).map(np.array)
turns = st.tuples(angles, angles, angles)


def assert_same_pose(one: FloatArray, other: FloatArray) -> None:
    np.testing.assert_allclose(one[..., :2], other[..., :2], atol=1e-9)
    np.testing.assert_allclose(wrap(one[..., 2] - other[..., 2]), 0.0, atol=1e-9)


@given(angles)
def test_wrap_keeps_the_direction_and_stays_in_its_range(angle: float) -> None:
    wrapped = float(wrap(angle))
    assert -np.pi <= wrapped <= np.pi  # pi itself only from the float next below -pi
    assert np.cos(wrapped - angle) == pytest.approx(1.0)
    assert wrap(wrapped) == pytest.approx(wrapped)


def test_wrap_takes_pi_to_minus_pi() -> None:
    np.testing.assert_array_equal(wrap([np.pi, -np.pi, 0.0]), [-np.pi, -np.pi, 0.0])


@given(poses, poses)
def test_between_undoes_compose(a: FloatArray, b: FloatArray) -> None:
    assert_same_pose(compose(a, between(a, b)), b)
    assert_same_pose(between(a, compose(a, b)), b)
    assert_same_pose(between(a, a), np.zeros(3))


@given(poses, poses, poses)
def test_composing_poses_is_multiplying_transforms(
    a: FloatArray, b: FloatArray, c: FloatArray
) -> None:
    product = transform_from_pose(a) @ transform_from_pose(b) @ transform_from_pose(c)
    np.testing.assert_allclose(transform_from_pose(compose(compose(a, b), c)), product, atol=1e-8)
    assert_same_pose(compose(a, compose(b, c)), compose(compose(a, b), c))


@given(poses, poses)
def test_batches_are_composed_pose_by_pose(a: FloatArray, b: FloatArray) -> None:
    batch = np.stack([a, b, compose(a, b)])
    expected = np.stack([compose(each, b) for each in batch])
    np.testing.assert_array_equal(compose(batch, b), expected)
    apart = np.stack([between(each, b) for each in batch])
    np.testing.assert_array_equal(between(batch, b), apart)


@given(poses, st.floats(-5.0, 5.0))
def test_a_pose_round_trips_through_its_transform(pose: FloatArray, z: float) -> None:
    matrix = transform_from_pose(pose, z)
    assert is_rigid(matrix)
    assert matrix[2, 3] == z
    assert_same_pose(pose_from_transform(matrix), pose)


@given(poses, poses)
def test_interpolation_meets_both_ends_and_takes_the_short_way(
    a: FloatArray, b: FloatArray
) -> None:
    assert_same_pose(interpolate_pose(a, b, 0.0), a)
    assert_same_pose(interpolate_pose(a, b, 1.0), b)
    there, back = interpolate_pose(a, b, 0.3), interpolate_pose(b, a, 0.7)
    if abs(abs(wrap(b[2] - a[2])) - np.pi) > 1e-6:  # half a turn has two shortest ways
        assert_same_pose(there, back)
    assert abs(wrap(there[2] - a[2])) <= np.pi * 0.3 + 1e-9


def test_interpolation_across_pi_and_at_many_shares() -> None:
    a, b = np.array([0.0, 0.0, 3.0]), np.array([1.0, 2.0, -3.0])
    between_both = interpolate_pose(a, b, np.array([0.25, 0.5, 0.75]))
    np.testing.assert_allclose(between_both[:, :2], [[0.25, 0.5], [0.5, 1.0], [0.75, 1.5]])
    gap = 2 * np.pi - 6.0
    np.testing.assert_allclose(
        wrap(between_both[:, 2]), wrap(3.0 + gap * np.array([0.25, 0.5, 0.75])), atol=1e-12
    )


@given(turns, st.tuples(metres, metres, metres))
def test_a_transform_times_its_inverse_is_nothing(
    rpy: tuple[float, float, float], translation: tuple[float, float, float]
) -> None:
    matrix = transform(rotation_from_rpy(*rpy), np.array(translation))
    np.testing.assert_allclose(matrix @ invert(matrix), np.eye(4), atol=1e-9)
    both = np.stack([matrix, np.eye(4)])
    np.testing.assert_allclose(both @ invert(both), np.stack([np.eye(4)] * 2), atol=1e-9)


@given(turns)
def test_rotations_agree_with_scipy(rpy: tuple[float, float, float]) -> None:
    reference = Rotation.from_euler("xyz", rpy)
    matrix = rotation_from_rpy(*rpy)
    np.testing.assert_allclose(matrix, reference.as_matrix(), atol=1e-12)
    np.testing.assert_allclose(rotation_from_quaternion(*reference.as_quat()), matrix, atol=1e-12)


@given(turns)
def test_roll_pitch_yaw_and_quaternions_round_trip(rpy: tuple[float, float, float]) -> None:
    matrix = rotation_from_rpy(*rpy)
    np.testing.assert_allclose(rotation_from_rpy(*rpy_from_rotation(matrix)), matrix, atol=1e-8)
    quaternion = quaternion_from_rotation(matrix)
    assert quaternion[3] >= 0
    assert np.linalg.norm(quaternion) == pytest.approx(1.0)
    np.testing.assert_allclose(rotation_from_quaternion(*quaternion), matrix, atol=1e-12)


@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_roll_pitch_yaw_round_trip_where_the_axes_align(pitch: float) -> None:
    matrix = rotation_from_rpy(0.4, pitch, -1.1)
    np.testing.assert_allclose(rotation_from_rpy(*rpy_from_rotation(matrix)), matrix, atol=1e-9)


def test_a_quaternion_of_any_length_has_a_direction_but_zero_has_none() -> None:
    quarter = rotation_about((0, 0, 1), np.pi / 2)
    np.testing.assert_allclose(rotation_from_quaternion(0, 0, 3, 3), quarter, atol=1e-12)
    for nothing in ((0, 0, 0, 0), (np.nan, 0, 0, 1)):
        with pytest.raises(ValueError, match="has no direction"):
            rotation_from_quaternion(*nothing)


@given(angles, angles)
def test_turns_about_one_axis_add_up(first: float, second: float) -> None:
    axis = np.array([1.0, -2.0, 2.0]) / 3.0
    both = rotation_about(axis, first) @ rotation_about(axis, second)
    np.testing.assert_allclose(both, rotation_about(axis, first + second), atol=1e-12)
    np.testing.assert_allclose(both @ axis, axis, atol=1e-12)


def test_mirrors_and_stretches_are_not_rigid() -> None:
    assert is_rigid(np.eye(4))
    assert not is_rigid(np.diag([1.0, 1.0, -1.0, 1.0]))
    assert not is_rigid(np.diag([2.0, 2.0, 2.0, 1.0]))
    assert not is_rigid(transform(np.eye(3), np.array([np.nan, 0.0, 0.0])))
