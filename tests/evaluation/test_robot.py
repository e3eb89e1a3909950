"""The robot's own error."""

import numpy as np
import pytest

from objstate.errors import TruthError
from objstate.evaluation import compare_paths
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
