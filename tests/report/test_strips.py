"""Strips: the posterior over time as a picture."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
import polars as pl
import pytest
from PIL import Image

from objstate.evaluation.states import TrueCourse
from objstate.recording.posteriors import WHOLE, posterior_schema
from objstate.records import Estimate
from objstate.report.strips import MOST_COLUMNS, Axis, heat_map, picture, strip, time_axis
from tests.report.pages import as_table

SECOND = 10**9


def posteriors(rows: list[tuple[float, float, list[float]]]) -> pl.DataFrame:
    """Rows of seconds, lower bound and shares in bins of 0.1."""
    return pl.DataFrame(
        [
            (int(t * SECOND), "d", "angle", low, low + 0.1 * len(shares),
             [round(WHOLE * share) for share in shares])
            for t, low, shares in rows
        ],
        schema=posterior_schema(), orient="row",
    )  # fmt: skip


def estimates(rows: list[tuple[float, float, bool]]) -> pl.DataFrame:
    return as_table(
        [
            Estimate(int(t * SECOND), "d", "angle", mean, 0.1, mean - 0.1, mean + 0.1, observed)
            for t, mean, observed in rows
        ]
    )


def test_a_column_shows_its_last_posterior_and_holds_it() -> None:
    rows = posteriors([(1.2, 0.0, [1, 0]), (1.8, 0.0, [0, 1]), (3.5, 0.0, [0.5, 0.5])])
    heat = heat_map(rows, Axis(0, 5.0))
    assert heat.shares == pytest.approx(
        np.array([[0, 0, 0, 0.5, 0.5], [0, 1, 1, 0.5, 0.5]]), abs=1e-4
    )
    assert heat.known.tolist() == [False, True, True, True, True]
    assert heat.fresh.tolist() == [False, True, False, True, False]


def test_bins_that_move_along_share_one_lattice() -> None:
    heat = heat_map(posteriors([(0.0, 0.3, [1, 0]), (1.0, 0.1, [1, 0])]), Axis(0, 2.0))
    assert (heat.lower, heat.upper) == (pytest.approx(0.1), pytest.approx(0.5))
    assert heat.shares == pytest.approx(np.array([[0, 1], [0, 0], [1, 0], [0, 0]]))


def test_the_picture_is_opaque_where_the_state_is_probable() -> None:
    uri = picture(heat_map(posteriors([(0.5, 0.0, [0.125, 0.875, 0.0])]), Axis(0, 2.0)))
    image = Image.open(io.BytesIO(base64.b64decode(uri.partition(",")[2]))).convert("RGBA")
    opacity = np.asarray(image)[:, :, 3] / 255
    fresh, held = opacity.T
    assert fresh == pytest.approx([0.0, 0.875 ** (1 / 3), 0.5], abs=0.01)  # highest bin on top
    assert (held[1:] < fresh[1:]).all()


def test_marks_stand_where_something_was_observed() -> None:
    rows = estimates([(0.5, 0.1, True), (1.5, 0.1, True), (2.5, 0.1, False), (4.5, 0.1, True)])
    drawn = strip("angle", posteriors([(0.5, 0.0, [1, 0])]), rows, None, Axis(0, 5.0))
    seen = re.search(r'<title>when.*?<path d="([^"]*)"', drawn)
    assert seen
    assert seen[1] == "M0,0H2V1H0ZM4,0H5V1H4Z"


def test_lines_have_gaps_where_the_object_was_not_near() -> None:
    rows = estimates([(0.5, 0.2, True), (1.5, 0.0, True), (3.5, 0.1, False)])
    course = TrueCourse(np.array([2 * SECOND]), np.array([0.1]))
    drawn = strip("angle", posteriors([(0.5, 0.0, [1, 0])]), rows, course, Axis(0, 5.0))
    assert 'd="M0.5,0.0h.01L1.5,100.0M3.5,50.0h.01"' in drawn
    assert 'd="M2.5,50.0h.01L4.5,50.0" class="truth"' in drawn


def test_an_object_without_posteriors_was_never_near() -> None:
    assert "never in view" in strip("angle", posteriors([]), estimates([]), None, Axis(0, 1.0))


@pytest.mark.parametrize("duration", [0.0, 0.5, 59.0, 3600.0, 10**6])
def test_time_axes_suit_any_duration(duration: float) -> None:
    axis = Axis(0, duration)
    assert 1 <= axis.columns <= MOST_COLUMNS
    assert axis.column(np.array([0, int(duration * SECOND)])).tolist() == [0, axis.columns - 1]
    marks = re.findall(r"left:([\d.]+)%", time_axis(axis))
    assert 1 <= len(marks) <= 60
    assert all(0 <= float(mark) <= 100 for mark in marks)


def test_moments_at_which_the_robot_was_lost_are_hatched() -> None:
    axis, rows = Axis(0, 10.0), posteriors([(0.5, 0.0, [1, 0])])
    lost = [(2 * SECOND, 5 * SECOND), (8 * SECOND, 8 * SECOND + 1)]
    drawn = strip("angle", rows, estimates([(0.5, 0.1, True)]), None, axis, lost=lost)
    assert re.findall(r"left:([\d.]+)%;width:([\d.]+)%", drawn) == [
        ("20.00", "30.00"), ("80.00", "0.30"),
    ]  # fmt: skip


def test_the_interval_has_two_edges_that_hold_until_the_next_look() -> None:
    rows = estimates([(0.5, 0.1, True), (3.5, 0.0, True)])
    drawn = strip("angle", posteriors([(0.5, 0.0, [1, 0])]), rows, None, Axis(0, 6.0))
    assert re.findall(r'd="([^"]*)" class="edge"', drawn) == [
        "M0.5,100.0h.01L5.5,100.0", "M0.5,0.0h.01L2.5,0.0L3.5,50.0L5.5,50.0",
    ]  # fmt: skip


def test_when_the_object_was_moved_is_bracketed() -> None:
    rows = posteriors([(0.5, 0.0, [1, 0])])
    drawn = strip(
        "angle", rows, estimates([]), None, Axis(0, 10.0), moved=[(2 * SECOND, 4 * SECOND)]
    )
    assert re.search(r'class="moved" title="[^"]*" style="left:20.00%;width:20.00%"', drawn)
