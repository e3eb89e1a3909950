"""What finding doors leaves out: what accepted doors explain."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.discovery.doorway import unexplained
from objstate.discovery.gathering import Beams
from objstate.discovery.walls import Opening


def test_what_ended_on_a_leaf_is_no_wall_beside_an_opening() -> None:
    west, east = np.linspace(-0.45, -0.05, 41), np.linspace(0.95, 1.35, 41)
    x = np.concatenate([west, east])
    count = len(x)
    whole = np.zeros(count, dtype=np.int64)
    beams = Beams(
        origins=np.column_stack([x, np.full(count, -2.0)]),
        directions=np.tile([0.0, 1.0], (count, 1)),
        ranges=np.full(count, 2.0),
        reach=np.full(count, 10.0),
        scan=whole,
        drive=whole,
        seconds=np.zeros(count),
    )
    opening = Opening(np.zeros(2), np.array([0.9, 0.0]), p_wall=0.8)
    left = np.ones(count, dtype=bool)
    assert unexplained(opening, beams, left).p_wall == pytest.approx(0.8)
    left[:10] = False
    assert unexplained(opening, beams, left).p_wall == pytest.approx(0.8 * 31 / 41)
    left[: len(west)] = False
    assert unexplained(opening, beams, left).p_wall == 0.0
