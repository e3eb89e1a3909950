"""Results come in the order of the tasks, by however many processes."""

from __future__ import annotations

import math
from collections.abc import Iterator

import pytest

from objstate.processes import AHEAD, default_workers, in_order, lasting


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_order(workers: int) -> None:
    assert list(in_order(math.factorial, [5, 2, 4, 0], workers)) == [120, 2, 24, 1]


@pytest.mark.parametrize("workers", [1, 2])
def test_processes_last_for_several_calls(workers: int) -> None:
    with lasting(workers) as each:
        assert list(each(math.factorial, [3, 1])) == [6, 1]
        assert list(each(math.sqrt, iter([16.0, 25.0]))) == [4.0, 5.0]


def test_tasks_are_made_as_they_are_needed() -> None:
    made = []

    def tasks() -> Iterator[int]:
        for number in range(100):
            made.append(number)
            yield number

    with lasting(2) as each:
        results = each(math.factorial, tasks())
        assert next(results) == 1
        assert len(made) <= 2 * AHEAD + 1
        assert next(results) == 1


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_of_a_task_is_raised(workers: int) -> None:
    results = in_order(math.sqrt, [4.0, -1.0, 9.0], workers)
    assert next(results) == 2.0
    with pytest.raises(ValueError, match=r"math domain|nonnegative"):
        next(results)


def test_there_is_at_least_one_worker() -> None:
    assert default_workers() >= 1
