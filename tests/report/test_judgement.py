"""Which last states are called wrong, and what all come to."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.evaluation import LatestState
from objstate.records import Estimate
from objstate.report.judgement import headline, judged, tallied, verdict


def state(name: str, error_deg: float, half_deg: float, coordinate: str = "angle") -> LatestState:
    mean, half, error = 0.9, np.radians(half_deg), np.radians(error_deg)
    row = Estimate(0, name, coordinate, mean, 0.01, mean - half, mean + half, True)
    return LatestState(row, mean - error, error)


@pytest.mark.parametrize(
    ("error", "inside", "told"),
    [(1.0, True, "right"), (1.0, False, "outside"), (7.0, True, "right"), (7.0, False, "wrong"),
     (25.0, True, "unsure"), (25.0, False, "wrong")],
)  # fmt: skip
def test_verdicts_by_error_and_interval(error: float, inside: bool, told: str) -> None:
    assert verdict("angle", np.radians(error), inside) == told


def test_states_that_were_not_observed_or_have_no_truth_are_not_judged() -> None:
    row = Estimate(0, "d", "angle", 0.9, 0.01, 0.8, 1.0, observed=False)
    assert judged([LatestState(row, 0.9, 0.0), LatestState(row, None, None)]) == []


def test_equal_headings_count_as_one() -> None:
    half_turn = LatestState(
        Estimate(0, "desk", "yaw", 0.1, 0.01, 0.05, 0.15, True), 0.1 + np.pi, 0.0
    )
    assert [each.inside for each in judged([half_turn], {"desk": 2})] == [True]
    assert [each.inside for each in judged([half_turn])] == [False]


def test_the_headline_names_the_worst_and_the_share_in_intervals() -> None:
    states = judged([state(f"door_{k}", 0.1, 1.0) for k in range(13)] + [state("bad", 25.0, 1.0)])
    said = " ".join(headline(tallied((each.state.estimate.object, each) for each in states)))
    assert '<div class="wrong"><b>25.0°</b>angle off at worst, bad; median 0.1°; 1 wrong' in said
    assert "<b>93%</b>of 14 true states in 90 % intervals" in said


def test_without_truth_there_is_no_headline() -> None:
    assert headline({}) == []
