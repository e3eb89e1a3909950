"""What a run takes back from a world while its robot is lost and found."""

from __future__ import annotations

import time
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

from objstate.config import Settings
from objstate.errors import WorldError
from objstate.estimator import Estimator
from objstate.objects import ObjectBelief
from objstate.records import NANOSECONDS
from objstate.run.memory import Memory
from objstate.world.looks import Looks
from tests.estimator.drives import corridor
from tests.rooms import fan, scan_of

SECONDS_IN_DAY = 86_400


class Doubting(Estimator):
    """An estimator whose robot is lost in given stretches."""

    stretches: tuple[tuple[int, int], ...] = ()

    @property
    def lost(self) -> tuple[tuple[int, int], ...]:
        return self.stretches


class Noting(Looks):
    """Looks that note from when on they were taken back."""

    def __init__(self) -> None:
        super().__init__(0)
        self.taken_back: list[int] = []

    def take_back(self, since_ns: int, instead: Iterable[ObjectBelief]) -> None:
        self.taken_back.append(since_ns)
        super().take_back(since_ns, instead)


def test_what_is_learnt_is_taken_back_once_for_each_time_that_the_robot_is_lost(
    tmp_path: Path,
) -> None:
    estimator, looks = Doubting(corridor()), Noting()
    memory = Memory.opened(tmp_path / "w.world", estimator.building, Settings(), "log", 0, {})
    memory.looks = looks
    record = scan_of(np.full(3, 1.0), fan(3))
    first, second = (1, 4), (5, 7)
    for stretches in [(), ((1, 3),), (first,), (first,), (first, (5, 6)), (first, second)]:
        estimator.stretches = stretches
        memory.note(record, estimator, [])
    assert looks.taken_back == [1, 5]


def test_a_log_from_the_future_is_refused_before_the_world_is_made(tmp_path: Path) -> None:
    tomorrow = time.time_ns() + 2 * SECONDS_IN_DAY * NANOSECONDS
    with pytest.raises(WorldError, match="begins 2 days ahead of this machine's clock"):
        Memory.opened(tmp_path / "w.world", corridor(), Settings(), "log", tomorrow, {})
    assert list(tmp_path.iterdir()) == []
