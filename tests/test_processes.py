"""Results come in the order of the tasks, by however many processes."""

from __future__ import annotations

import math

import pytest

from objstate.processes import default_workers, in_order


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_order(workers: int) -> None:
    assert list(in_order(math.factorial, [5, 2, 4, 0], workers)) == [120, 2, 24, 1]


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_of_a_task_is_raised(workers: int) -> None:
    results = in_order(math.sqrt, [4.0, -1.0, 9.0], workers)
    assert next(results) == 2.0
    with pytest.raises(ValueError, match=r"math domain|nonnegative"):
        next(results)


def test_there_is_at_least_one_worker() -> None:
    assert default_workers() >= 1
