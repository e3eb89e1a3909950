"""What a run takes back from a world while its robot is lost and found."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from objstate.config import Settings
from objstate.estimator import Estimator
from objstate.objects import ObjectBelief
from objstate.run.memory import Memory
from objstate.world.looks import Looks
from tests.estimator.drives import corridor
from tests.rooms import fan, scan_of


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
