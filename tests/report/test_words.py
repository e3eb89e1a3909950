"""Warnings in plain words."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from objstate.evaluation import LatestState
from objstate.recording.events import Event
from objstate.records import Estimate
from objstate.report.events import events_table
from objstate.report.material import Material, read_material
from objstate.report.reading import figure, span
from objstate.report.words import warnings
from tests.report.pages import as_table

SURE = Estimate(0, "office_door", "angle", 0.5, 0.01, 0.48, 0.52, True, fit=0.95)


@pytest.fixture(scope="module")
def material(result: Path) -> Material:
    return read_material(result)


def told(material: Material, estimate: Estimate, error: float | None = None) -> list[str]:
    """What is said of a state, beside what is said of the run."""
    truth = None if error is None else estimate.mean - error
    of_run = warnings(material, [])
    return warnings(material, [LatestState(estimate, truth, error)])[len(of_run) :]


def test_of_a_sure_right_state_nothing_is_said(material: Material) -> None:
    assert told(material, SURE, 0.01) == []


@pytest.mark.parametrize(
    ("estimate", "error", "word"),
    [
        (replace(SURE, observed=False), None, "No beam reached office_door"),
        (replace(SURE, lower=0.1, upper=0.9), None, "left it open how office_door stood"),
        (
            replace(SURE, coordinate="x", presence=0.2),
            None,
            "not there at all any more: office_door",
        ),
        (SURE, 0.1, "last state of office_door is wrong"),
        (SURE, 0.03, "true state of office_door lies outside"),
    ],
)
def test_what_is_wrong_is_said_once(
    material: Material, estimate: Estimate, error: float | None, word: str
) -> None:
    (said,) = told(material, estimate, error)
    assert word in said


def test_an_object_that_no_state_explains_is_named(material: Material) -> None:
    rows = [replace(SURE, stamp_ns=k, fit=0.9 if k < 50 else 0.2) for k in range(80)]
    once = [replace(SURE, stamp_ns=k, fit=0.9 if k < 79 else 0.0) for k in range(80)]
    told = [warnings(replace(material, estimates=as_table(table)), []) for table in (rows, once)]
    found = ["best state of office_door explains" in " ".join(each) for each in told]
    assert found == [True, False]


@pytest.mark.parametrize(
    ("before", "after", "expected"),
    [(0.5, 0.505, True), (0.5, 0.6, False), (None, 0.5, False), (0.5, None, False)],
)
def test_a_door_that_ends_where_it_began_is_back(
    before: float | None, after: float | None, expected: bool
) -> None:
    std = 0.01
    event = Event("door", "moved", "angle", 0, 1, before, std, after, std, 1.0)
    assert ("moved and back" in events_table([event], 0)) == expected
    assert "and back" not in events_table(
        [replace(event, coordinate="x")], 0
    )  # furniture has two more


@pytest.mark.parametrize(("seconds", "text"), [(9.6, "10 s"), (119.7, "2 min 0 s"), (7260, "2 h 1 min")])  # fmt: skip
def test_durations_read_well(seconds: float, text: str) -> None:
    assert span(seconds) == text


def test_figures_are_in_the_units_that_people_read() -> None:
    assert [figure("angle", 0.5), figure("x", 1.2345), figure("yaw", None)] == [
        "28.6°", "1.234 m", "–",
    ]  # fmt: skip
