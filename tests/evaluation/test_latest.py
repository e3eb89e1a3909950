"""What a run knows of each object in the end."""

import numpy as np
import polars as pl
import pytest

from objstate.evaluation import latest_states
from objstate.recording.tables import COLUMNS
from objstate.records import Estimate, TrueState


def frame(*estimates: Estimate) -> pl.DataFrame:
    rows = [tuple(vars(estimate).values()) for estimate in estimates]
    return pl.DataFrame(rows, schema=list(COLUMNS), orient="row")


def angle(stamp: int, name: str, mean: float, observed: bool) -> Estimate:
    return Estimate(stamp, name, "angle", mean, 0.1, mean - 0.2, mean + 0.2, observed, fit=0.5)


def test_the_last_observed_estimate_counts_not_what_spread_after_it() -> None:
    (door,) = latest_states(frame(angle(1, "a", 0.1, True), angle(2, "a", 0.9, False)))
    assert door.estimate == angle(1, "a", 0.1, True)
    assert (door.truth, door.error) == (None, None)


def test_an_object_never_observed_shows_its_last_estimate() -> None:
    (door,) = latest_states(frame(angle(1, "a", 0.5, False), angle(2, "a", 0.6, False)))
    assert door.estimate.stamp_ns == 2


def test_what_was_taken_back_because_the_robot_was_lost_does_not_count() -> None:
    rows = frame(*(angle(stamp, "a", stamp / 10, True) for stamp in (1, 2, 3, 4)))
    (door,) = latest_states(rows, lost=[(3, 4), (4, 9)])
    assert door.estimate.stamp_ns == 2
    (door,) = latest_states(rows, lost=[(1, 4)])
    assert door.estimate.stamp_ns == 4
    assert latest_states(rows, lost=[(0, 9)]) == []


def test_truth_is_that_of_the_stamp_and_the_error_wraps() -> None:
    truth = [TrueState(0, "a", "angle", -3.1), TrueState(5, "a", "angle", 1.0)]
    (door,) = latest_states(frame(angle(3, "a", 3.1, True)), truth)
    assert door.truth == -3.1
    assert door.error == pytest.approx(6.2 - 2 * np.pi)


def test_truth_that_begins_later_is_unknown_yet() -> None:
    (door,) = latest_states(frame(angle(3, "a", 0.0, True)), [TrueState(5, "a", "angle", 1.0)])
    assert door.truth is None


def test_coordinates_of_an_object_stay_together_in_their_order() -> None:
    rows = [
        Estimate(stamp, name, part, 0.0, 0.1, 0.0, 0.0, True)
        for stamp in (1, 2)
        for name in ("desk_b", "desk_a")
        for part in ("x", "y", "yaw")
    ]
    latest = latest_states(frame(*rows))
    keys = [(state.estimate.object, state.estimate.coordinate) for state in latest]
    assert keys == [(name, part) for name in ("desk_a", "desk_b") for part in ("x", "y", "yaw")]
