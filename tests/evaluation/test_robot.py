"""The robot's own error."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.errors import TruthError
from objstate.evaluation import compare_paths
from objstate.geometry import compose
from objstate.records import Path

SECOND = 1_000_000_000


def path(*poses: tuple[float, float, float, float]) -> Path:
    """A path of (second, x, y, yaw)."""
    table = np.array(poses)
    return Path((table[:, 0] * SECOND).astype(np.int64), table[:, 1:])


def test_the_true_path_is_interpolated_in_time_and_yaw_the_short_way() -> None:
    true = path((0, 0, 0, 3.0), (1, 2, 0, -3.0))
    estimated = path((0.25, 0.5, 0.3, 3.0 + (2 * np.pi - 6.0) / 4 - 0.1))
    errors = compare_paths(estimated, true)
    assert errors.count == 1
    assert errors.position.mean == pytest.approx(0.3)
    assert errors.yaw.mean == pytest.approx(0.1)


def test_a_path_has_no_distance_from_itself() -> None:
    same = path((0, 0, 0, 0), (0.5, 1, 0, 0.5), (1, 1, 1, 3.1), (1.5, 0, 1, -3.1))
    errors = compare_paths(same, same)
    assert errors.count == 4
    assert (errors.position.mean, errors.yaw.p90) == pytest.approx((0.0, 0.0))


def test_the_end_is_the_last_pose_compared() -> None:
    true = path((0, 0, 0, 0), (1, 0, 0, 0), (2, 0, 0, 0))
    estimated = path((0, 0, 0, 0), (1, 1, 0, 0), (2, 0, 3, -0.5), (9, 100, 0, 0))
    errors = compare_paths(estimated, true)
    assert errors.count == 3
    assert errors.position.end == pytest.approx(3.0)
    assert errors.position.median == pytest.approx(1.0)
    assert errors.yaw.end == pytest.approx(0.5)


def test_nothing_is_compared_across_a_long_gap_of_the_true_path() -> None:
    true = path((0, 0, 0, 0), (1, 0, 0, 0), (60, 59, 0, 0), (61, 59, 0, 0))
    errors = compare_paths(path((0.5, 0, 0, 0), (30, 0, 0, 0), (60.5, 59, 0, 0)), true)
    assert errors.count == 2
    assert errors.position.p90 == pytest.approx(0.0)


def test_paths_of_different_times_are_refused_with_both_spans() -> None:
    with pytest.raises(TruthError, match=r"100\.000 to 100\.500 s.*0\.000 to 1\.000 s"):
        compare_paths(path((100, 0, 0, 0), (100.5, 0, 0, 0)), path((0, 0, 0, 0), (1, 0, 0, 0)))


def test_a_single_true_pose_is_no_path() -> None:
    with pytest.raises(TruthError, match="fewer than two poses"):
        compare_paths(path((0, 0, 0, 0)), path((0, 0, 0, 0)))


def walk(seed: int, noise: float = 0.0) -> Path:
    """A curved drive of 20 m, a pose each 0.1 s."""
    rng = np.random.default_rng(seed)
    yaw = np.cumsum(np.full(201, 0.02))
    steps = 0.1 * np.column_stack([np.cos(yaw), np.sin(yaw)])
    poses = np.column_stack([np.cumsum(steps, axis=0), yaw]) + noise * rng.normal(size=(201, 3))
    return Path((np.arange(201) * 0.1 * SECOND).astype(np.int64), poses)


@given(x=st.floats(-50, 50), y=st.floats(-50, 50), yaw=st.floats(-3, 3))
def test_alignment_takes_back_any_movement(x: float, y: float, yaw: float) -> None:
    true = walk(0)
    moved = Path(true.stamps_ns, compose(np.array([x, y, yaw]), true.poses))
    aligned = compare_paths(moved, true, align=True)
    assert aligned.position.rms == pytest.approx(0.0, abs=1e-9)
    assert aligned.yaw.rms == pytest.approx(0.0, abs=1e-9)
    raw = compare_paths(moved, true)
    assert raw.relative_position is not None
    assert raw.relative_position.rms == pytest.approx(0.0, abs=1e-9)  # no matter where


def test_no_movement_fits_better_than_the_alignment() -> None:
    true, estimated = walk(0), walk(1, noise=0.1)
    aligned = compare_paths(estimated, true, align=True)
    assert aligned.aligned_by is not None
    for step in 0.01 * np.vstack([np.eye(3), -np.eye(3)]):
        other = np.asarray(aligned.aligned_by) + step
        worse = compare_paths(Path(true.stamps_ns, compose(other, estimated.poses)), true)
        assert worse.position.rms > aligned.position.rms


def test_relative_errors_are_of_each_metre_of_way() -> None:
    true = path(*[(k, 0.5 * k, 0, 0) for k in range(9)])  # 4 m
    longer = path(*[(k, 0.55 * k, 0, 0) for k in range(9)])  # a scale of 1.1
    errors = compare_paths(longer, true)
    assert errors.pairs == 4
    assert errors.relative_position is not None
    assert errors.relative_position.rms == pytest.approx(0.1)
    assert compare_paths(path((0, 0, 0, 0)), true).relative_position is None


def test_a_robot_that_stands_still_cannot_be_aligned() -> None:
    still = path((0, 1, 1, 0), (1, 1, 1, 0))
    with pytest.raises(TruthError, match="stood still"):
        compare_paths(still, still, align=True)
