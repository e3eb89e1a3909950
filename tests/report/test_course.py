"""What of a path is known."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.records import Path
from objstate.report.course import Course

SECOND = 10**9


def course(lost: list[tuple[int, int]], searching: bool = False) -> Course:
    """A metre a second along x for 20 s; while it is lost the belief lies 100 m beside."""
    seconds = np.arange(21)
    aside = np.array([100.0 * any(a <= s < b for a, b in lost) for s in seconds])
    poses = np.column_stack([seconds.astype(float), aside, np.zeros(21)])
    stretches = [(a * SECOND, b * SECOND) for a, b in lost]
    return Course(Path(seconds * SECOND, poses), stretches, searching, 0, 20.0)


def test_a_robot_that_is_never_lost_drives_all_of_its_path() -> None:
    found = course([])
    assert (found.localized, found.driven) == (1.0, 20.0)
    assert [len(part) for part in found.known] == [21]
    assert found.doubtful == []


def test_what_lies_in_lost_stretches_is_neither_driven_nor_joined() -> None:
    found = course([(5, 10), (15, 17)])
    assert found.localized == pytest.approx(13 / 20)
    assert found.driven == 4 + 4 + 3
    assert [part[:, 0].tolist()[0] for part in found.known] == [0.0, 10.0, 17.0]
    assert [len(part) for part in found.doubtful] == [5, 2]
    assert {part[0, 1] for part in found.doubtful} == {100.0}


def test_before_it_was_found_there_is_no_path() -> None:
    found = course([(0, 8), (15, 17)], searching=True)
    assert [part[0, 0] for part in found.doubtful] == [15.0]
    assert found.drawn[:, 0].min() == 8.0


def test_stretches_beyond_the_log_count_as_far_as_it_lasts() -> None:
    assert course([(10, 500)]).localized == pytest.approx(0.5)
