"""What the plan moves by."""

from __future__ import annotations

import numpy as np
import polars as pl

from objstate.records import Estimate
from objstate.records import Path as RobotPath
from objstate.report import timeline
from objstate.report.timeline import object_moments, robot_moments, step_for
from tests.report.pages import as_table

SECOND = 10**9


def table(rows: list[tuple[float, str, str, float, bool]]) -> pl.DataFrame:
    return as_table(
        [
            Estimate(int(t * SECOND), name, kind, mean, 0.0, mean, mean, seen)
            for t, name, kind, mean, seen in rows
        ]
    )


def test_each_step_keeps_its_last_observed_moment() -> None:
    rows = [(0.1, "d", "angle", 0.1, True), (0.5, "d", "angle", 0.2, True),
            (0.9, "d", "angle", 0.3, False), (1.5, "d", "angle", 0.4, False)]  # fmt: skip
    found = object_moments(table(rows), 0, "d", ("angle",), 1.0)
    assert found["t"] == [5, 15]
    assert found["seen"] == [1, 0]
    assert found["mean"] == [[115, 229]]


def test_coordinates_of_one_object_share_their_moments() -> None:
    rows = [(t, "f", kind, value + t, True) for t in (0.2, 0.7, 3.2)
            for kind, value in (("x", 1.0), ("y", 2.0), ("yaw", 0.0))]  # fmt: skip
    found = object_moments(table(rows), 0, "f", ("x", "y", "yaw"), 1.0)
    assert found["t"] == [7, 32]
    assert found["mean"] == [[1700, 4200], [2700, 5200], [401, 1833]]


def test_steps_grow_until_all_moments_fit(monkeypatch) -> None:
    rows = table([(float(t), name, "angle", 0.0, True) for t in range(100) for name in "ab"])
    assert step_for(rows) == timeline.STEP
    monkeypatch.setattr(timeline, "MOST_MOMENTS", 60)
    assert step_for(rows) == 4.0


def test_a_long_path_is_thinned(monkeypatch) -> None:
    monkeypatch.setattr(timeline, "MOST_POSES", 10)
    path = RobotPath(np.arange(95) * SECOND, np.tile([1.234, -2.0, 4.0], (95, 1)))
    found = robot_moments(path, 0)
    assert len(found["t"]) <= 10
    assert found["t"][:2] == [0, 100]
    assert (found["x"][0], found["y"][0], found["yaw"][0]) == (123, -200, -131)
