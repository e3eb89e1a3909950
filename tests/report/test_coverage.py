"""Coverage: claimed shares against held ones."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.records import Estimate, TrueState
from objstate.report.coverage import Coverage, coverages
from tests.report.pages import as_table

COUNT = 4000
Z90 = 1.6448536


def calibrated(width: float, lost: tuple[tuple[int, int], ...] = ()) -> Coverage:
    """Of Gaussian errors of deviation 0.01 about intervals ``width`` times as wide as they should be."""
    means = 0.5 + 0.01 * np.random.default_rng(3).standard_normal(COUNT)
    half = width * Z90 * 0.01
    rows = [
        Estimate(k, "d", "angle", m, half / Z90, m - half, m + half, True)
        for k, m in enumerate(means)
    ]
    frame = as_table(rows)
    (found,) = coverages(frame, [TrueState(0, "d", "angle", 0.5)], lost)
    return found


def test_intervals_of_the_right_width_lie_on_the_diagonal() -> None:
    found = calibrated(1.0)
    assert (found.kind, found.count) == ("angles", COUNT)
    assert found.held == pytest.approx(found.claimed, abs=0.03)


def test_narrow_intervals_lie_below_it_and_wide_ones_above() -> None:
    middle = slice(4, -4)
    assert (calibrated(0.5).held < calibrated(1.0).claimed)[middle].all()
    assert (calibrated(2.0).held > calibrated(1.0).claimed)[middle].all()


def test_at_ninety_percent_it_is_the_coverage_of_the_recorded_intervals() -> None:
    found = calibrated(0.7)
    at_90 = int(np.argmin(np.abs(found.claimed - 0.9)))
    inside = np.abs(found.errors) <= 0.7 * Z90 * 0.01
    assert found.held[at_90] == pytest.approx(inside.mean(), abs=2 / COUNT)


def test_what_was_taken_back_does_not_count() -> None:
    assert calibrated(1.0, lost=((100, 600),)).count == COUNT - 500


def test_an_interval_of_no_width_that_holds_the_truth_is_no_nan() -> None:
    rows = [
        Estimate(0, "d", "x", 1.0, 0.0, 1.0, 1.0, True),
        Estimate(1, "d", "x", 1.1, 0.0, 1.1, 1.1, True),
    ]
    frame = as_table(rows)
    (found,) = coverages(frame, [TrueState(0, "d", "x", 1.0)], ())
    assert found.kind == "lengths"
    assert found.held == pytest.approx(np.full(len(found.claimed), 0.5))
