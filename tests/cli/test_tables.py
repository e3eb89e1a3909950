"""Tables that stay readable on a narrow terminal."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
from rich.console import Console

from objstate.cli.console import print_table
from objstate.cli.error_tables import errors_table, robot_table
from objstate.cli.json_values import json_values
from objstate.cli.learnt_tables import describe_found
from objstate.cli.log_tables import describe_log
from objstate.cli.state_table import events_table, state_table
from objstate.cli.tables import new_table
from objstate.discovery import Learnt
from objstate.evaluation import CoordinateErrors, Distances, LatestState, RobotErrors, StateErrors
from objstate.logs import LaserSummary, LogSummary, TopicSummary
from objstate.recording.events import Event
from objstate.records import Estimate

LONG_NAME = "building_4/floor_2/west_wing/door_to_the_meeting_room"
STAMP = 1_600_000_000_000_000_000


def at_80_columns(*parts: object) -> str:
    console = Console(width=80, highlight=False)
    with console.capture() as capture:
        console.print(*parts, sep="\n")
    return capture.get()


def state(coordinate: str, value: float, observed: bool = True) -> LatestState:
    estimate = Estimate(
        STAMP, LONG_NAME, coordinate, value, 0.1, value - 0.125, value + 0.125, observed
    )
    return LatestState(estimate, value - 0.01, 0.01)


def test_no_figure_of_an_estimate_is_cut_off() -> None:
    begin = STAMP - 12345_600_000_000
    table = state_table([state("angle", math.pi), state("x", 1234.5)], begin, with_truth=True)
    shown = at_80_columns(table)
    for figure in ("180.0", "172.8 to 187.2", "1234.500", "1234.375 to 1234.625", "12345.6"):
        assert figure in shown
    assert "…" not in shown


def test_on_a_terminal_that_is_too_narrow_a_table_is_as_wide_as_its_words(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    monkeypatch.setenv("COLUMNS", "30")
    table = new_table("Doors", ("door",), ("hinge (m)", "bearing (deg)"))
    table.add_row("door_01", "-14.34, 3.41 ± 0.10", "-145.6 ± 1.6")
    print_table(table)
    shown = capsys.readouterr().out
    for word in ("door_01", "-14.34, 3.41 ± 0.10", "-145.6 ± 1.6", "bearing (deg)"):
        assert word in shown


def test_degrees_and_metres_have_their_own_decimals() -> None:
    shown = at_80_columns(state_table([state("yaw", -1e-9), state("y", 0.0004)], STAMP, False))
    assert " 0.0 " in shown
    assert " 0.000 " in shown
    assert "-0.0 " not in shown


def test_what_was_never_observed_says_so() -> None:
    assert "never" in at_80_columns(state_table([state("angle", 0.0, False)], STAMP, False))


def test_furniture_that_is_gone_says_so_and_doors_have_no_column_for_it() -> None:
    gone, door = state("x", 1.0), state("angle", 1.0)
    gone = replace(gone, estimate=replace(gone.estimate, presence=0.04))
    shown = at_80_columns(state_table([door, gone], STAMP, False))
    assert "(%)" in shown
    assert "  4 " in shown
    assert "(%)" not in at_80_columns(state_table([door], STAMP, False))


@pytest.mark.parametrize(("unit", "figure"), [("rad", "57.3"), ("m", "100.0")])
def test_no_figure_of_an_evaluation_is_cut_off(unit: str, figure: str) -> None:
    errors = StateErrors(123456, -1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    entry = CoordinateErrors(LONG_NAME, "offset", unit, errors, None)
    shown = at_80_columns(errors_table("Final", [(entry, errors), (entry, None)]))
    assert shown.count(figure) == 4
    assert "123456" in shown
    assert "…" not in shown


def test_the_robots_table_turns_radians_into_degrees() -> None:
    ones = Distances(1.0, 1.0, 1.0, 1.0, 1.0)
    shown = at_80_columns(robot_table(RobotErrors(7, ones, ones)))
    assert shown.count("1.000") == 5
    assert shown.count("57.30") == 5


def test_no_figure_of_a_log_is_cut_off() -> None:
    laser = LaserSummary(
        frame=LONG_NAME,
        topics=("/scan",),
        xyz=(-0.1234, 0.0, 12.5),
        rpy_deg=(-180.0, 0.04, 179.96),
        beams=(180, 1081),
        angle_min_deg=-135.0,
        angle_max_deg=135.0,
        range_min=0.02,
        range_max=81.83,
        returns=0.975,
        no_returns=0.02,
        discarded=0.005,
    )
    nowhere = LaserSummary(**{**vars(laser), "frame": "lost", "xyz": None, "rpy_deg": None})
    topic = TopicSummary("/" + LONG_NAME, "geometry_msgs/msg/PoseWithCovarianceStamped", 10**7, 5.0)
    summary = LogSummary(
        ("a.mcap",), 0, 10**9, (topic,), ("base",), "/odom", (laser, nowhere), {"Scan": 3}, ()
    )
    shown = at_80_columns(*describe_log(summary))
    for figure in ("-0.123", "-180.0", "180 to 1081", "-135 to 135", "0.02 to 81.83", "10000000"):
        assert figure in shown
    assert shown.count("?") == 6
    assert "…" not in shown


def test_numbers_that_json_has_no_word_for_become_null() -> None:
    shown = json_values({"range": math.inf, "of": Distances(math.nan, 0.5, 1.0, 2.0, 3.0)})
    assert shown == {
        "range": None,
        "of": {"rms": None, "mean": 0.5, "median": 1.0, "p90": 2.0, "end": 3.0},
    }


def test_movements_are_listed_by_seconds_of_the_log() -> None:
    second = 10**9
    times = STAMP + 10 * second, STAMP + 12 * second
    angles = math.radians(31.0), 0.01, math.radians(88.0), 0.01
    table = events_table([Event(LONG_NAME, "moved", "angle", *times, *angles, 0.984)], STAMP)
    for shown in ("angle (deg)", "10.0 to 12.0", "31.0", "88.0", "98"):
        assert shown in at_80_columns(table)


def test_openings_that_were_not_weighed_are_counted() -> None:
    learnt = Learnt(Path("building.urdf"), [], openings=12, passed_over=3)
    assert list(describe_found(learnt)) == [
        "No doors found.",
        "3 of 12 openings weren't weighed as doors: each lies in a line that is a wall with less than "
        "5 % probability (learn.json lists them).",
    ]
    assert list(describe_found(replace(learnt, passed_over=0))) == ["No doors found."]
