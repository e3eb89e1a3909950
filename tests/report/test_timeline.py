"""What the plan moves by."""

from __future__ import annotations

import base64

import numpy as np
import polars as pl

from objstate.recording.grids import clutter_schema
from objstate.recording.scans import scan_schema
from objstate.records import Estimate
from objstate.records import Path as RobotPath
from objstate.report import timeline
from objstate.report.timeline import (
    clutter_moments,
    object_moments,
    robot_moments,
    scan_moments,
    step_for,
)
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
    assert found["median"] == [[115, 229]]


def test_coordinates_of_one_object_share_their_moments() -> None:
    rows = [(t, "f", kind, value + t, True) for t in (0.2, 0.7, 3.2)
            for kind, value in (("x", 1.0), ("y", 2.0), ("yaw", 0.0))]  # fmt: skip
    found = object_moments(table(rows), 0, "f", ("x", "y", "yaw"), 1.0)
    assert found["t"] == [7, 32]
    assert found["median"] == [[1700, 4200], [2700, 5200], [401, 1833]]


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


def test_how_probably_a_door_is_closed_is_told_where_the_estimates_tell_it() -> None:
    rows = table([(float(t), "d", "angle", 0.0, True) for t in range(3)])
    assert "closed" not in object_moments(rows, 0, "d", ("angle",), 1.0)
    told = rows.with_columns(p_closed=pl.Series([0.984, None, float("nan")]))
    assert object_moments(told, 0, "d", ("angle",), 1.0)["closed"] == [98, None, None]


def scans(rows: list[tuple[float, str, list[int]]]) -> pl.DataFrame:
    return pl.DataFrame(
        [(int(t * SECOND), laser, x, [-each for each in x]) for t, laser, x in rows],
        schema=scan_schema(), orient="row",
    )  # fmt: skip


def test_scans_come_with_the_pose_at_which_they_were_taken() -> None:
    path = RobotPath(np.array([1, 2]) * SECOND, np.array([[1.0, 2.0, 0.1], [3.0, 4.0, -0.2]]))
    table = scans([(0.5, "a", [1]), (1.0, "a", [100, -7]), (2.5, "b", []), (2.6, "b", [5])])
    found = scan_moments(table, path, 0)
    assert (found["t"], found["laser"], found["count"]) == ([10, 25, 26], [0, 1, 1], [2, 0, 1])
    assert found["pose"] == [[100, 300, 300], [200, 400, 400], [57, -115, -115]]
    ends = np.frombuffer(base64.b64decode(found["ends"]), dtype="<i2").reshape(-1, 2)
    assert ends.tolist() == [[100, -100], [-7, 7], [5, -5]]


def test_the_scans_of_a_long_log_are_thinned_for_each_laser(monkeypatch) -> None:
    monkeypatch.setattr(timeline, "MOST_SCANS", 10)
    path = RobotPath(np.arange(60) * SECOND, np.zeros((60, 3)))
    table = scans([(float(t), laser, [1]) for t in range(30) for laser in "ab"])
    found = scan_moments(table, path, 0)
    assert [found["laser"].count(k) for k in (0, 1)] == [5, 5]
    assert found["step"] == 60


def test_what_stands_about_is_thinned_to_fit(monkeypatch) -> None:
    rows = pl.DataFrame(
        [(k * SECOND, [k, 7], [-k, 8], [90, 60]) for k in range(10)],
        schema=clutter_schema(), orient="row",
    )  # fmt: skip
    assert clutter_moments(rows[:1], 0) == {"t": [0], "places": [[0, 0, 7, 8]]}
    monkeypatch.setattr(timeline, "MOST_CLUTTER", 5)
    found = clutter_moments(rows, 0)
    assert found == {"t": [0, 40, 80], "places": [[k, -k, 7, 8] for k in (0, 4, 8)]}


def test_a_result_without_scans_or_poses_shows_none() -> None:
    nowhere = RobotPath(np.zeros(0, dtype=np.int64), np.zeros((0, 3)))
    assert scan_moments(scans([(1.0, "a", [1])]), nowhere, 0)["t"] == []
