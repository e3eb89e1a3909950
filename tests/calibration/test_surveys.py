"""Surveys of several drives, put together."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.shapes import Box
from objstate.building.warping import Columns
from objstate.calibration import Survey, Surveys
from objstate.config import BuildingErrorSettings
from objstate.geometry import FloatArray

COLUMNS = Columns.of(Box((9.0, 5.0, 2.0)).mesh())
COUNT = len(COLUMNS.places)
SURVEYS = Surveys(COLUMNS, BuildingErrorSettings())
STD = 0.003  # m, of a column by one drive


def survey(seed: int, truth: FloatArray, noise: float = STD) -> Survey:
    """A drive that saw all columns, at ``truth`` (c, 2) and errors of its own, with one laser."""
    rng = np.random.default_rng(seed)
    information = np.diag([1e4, 1e4, 1e5, 1e4, *np.full(2 * COUNT, noise**-2.0)])
    found = np.concatenate([[0.0, 0.0, 0.01, 0.0], truth.ravel()])
    found[4:] += noise * rng.standard_normal(2 * COUNT)
    exact = Survey(("laser",), np.arange(COUNT), information, information @ found, 0.01, 0.3)
    return Survey.read(json.loads(json.dumps(exact.words())))


def walls(seed: int) -> FloatArray:
    return 0.02 * np.random.default_rng(seed).standard_normal((COUNT, 2))


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000))
def test_walls_are_where_all_drives_find_them(seed: int) -> None:
    truth = walls(seed)
    found = SURVEYS.together([survey(seed + k, truth) for k in range(1, 5)])
    off = found.walls - truth
    assert np.sqrt(np.mean(off**2)) < STD
    squares = np.einsum("ci,cij,cj->c", off, np.linalg.inv(found.covariances), off)
    assert np.mean(squares < 4.605) > 0.6  # 90 % of two degrees of freedom, of few columns
    assert found.mountings[0, 2] == pytest.approx(0.01, abs=0.002)
    assert found.remaining_std < found.wall_std
    assert np.nanmedian(found.after) < np.nanmedian(found.before)


def test_the_order_of_drives_changes_nothing() -> None:
    drives = [survey(k, walls(0)) for k in range(4)]
    one, other = SURVEYS.together(drives), SURVEYS.together(drives[::-1])
    np.testing.assert_allclose(one.walls, other.walls, atol=1e-9)


def test_something_before_a_wall_on_one_day_is_no_wall() -> None:
    truth, before = walls(1), walls(1)
    before[3] += 0.1
    drives = [survey(k, truth) for k in range(4)]
    hidden = SURVEYS.together([*drives, survey(9, before)])
    assert hidden.hidden == 1
    assert np.abs(hidden.walls[3] - truth[3]).max() < 3.0 * STD
    assert SURVEYS.contradicting([*drives, survey(9, before)]) is None


def test_a_drive_of_another_building_is_named() -> None:
    drives = [survey(k, walls(2)) for k in range(4)]
    assert SURVEYS.contradicting(drives) is None
    other = survey(9, walls(3))
    assert SURVEYS.contradicting([*drives[:2], other, *drives[2:]]) == 2
    assert SURVEYS.contradicting([drives[0], other]) is None  # nobody knows which of two


def test_what_is_left_out_is_integrated_out() -> None:
    rng = np.random.default_rng(5)
    whole = survey(0, walls(4))
    root = rng.standard_normal((len(whole.pull), len(whole.pull)))
    whole = replace(whole, information=root @ root.T + 10.0 * np.eye(len(root)))
    part = whole.without(np.array([0, 2]))
    assert part.columns.tolist() == [k for k in range(COUNT) if k not in (0, 2)]
    kept = np.setdiff1d(np.arange(len(root)), [4, 5, 8, 9])
    # those left out have a deviation of a metre
    damped = whole.information + np.diag(np.isin(np.arange(len(root)), [4, 5, 8, 9]).astype(float))
    exact = np.linalg.inv(np.linalg.inv(damped)[np.ix_(kept, kept)])
    np.testing.assert_allclose(part.information, exact, rtol=1e-6, atol=1e-6)


def test_words_of_another_form_are_refused() -> None:
    words = survey(0, walls(0)).words()
    with pytest.raises(ValueError, match="another form"):
        Survey.read(words | {"columns": [0]})
