"""Estimates beside truth: laws of errors, intervals and final states."""

import numpy as np
import polars as pl
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.errors import ResultError, TruthError
from objstate.evaluation import evaluate_states
from objstate.evaluation.states import Posteriors, TrueCourse, compare
from objstate.records import TrueState

SECOND = 1_000_000_000
angles = st.floats(-3.1, 3.1)


def rows(*updates: tuple[float, str, str, float, float, bool]) -> pl.DataFrame:
    """Estimates from (second, object, coordinate, median, half interval, observed)."""
    return pl.DataFrame(
        [
            (int(t * SECOND), name, part, middle, half / 2, middle - half, middle + half, seen)
            for t, name, part, middle, half, seen in updates
        ],
        schema=["stamp", "object", "coordinate", "median", "std", "lower", "upper", "observed"],
        orient="row",
    )


def truth(*states: tuple[float, str, str, float]) -> list[TrueState]:
    return [TrueState(int(t * SECOND), name, part, value) for t, name, part, value in states]


def one(mean: float, lower: float, upper: float) -> Posteriors:
    return Posteriors(np.array([1]), np.array([mean]), np.array([lower]), np.array([upper]))


@given(true=angles, error=st.floats(-1.5, 1.5), turns=st.integers(-1, 1))
def test_a_rotation_error_is_the_short_way_round(true: float, error: float, turns: int) -> None:
    mean = true + error + 2 * np.pi * turns
    course = TrueCourse(np.array([0]), np.array([true]))
    compared = compare("yaw", one(mean, mean, mean), course)
    assert compared.errors[0] == pytest.approx(error, abs=1e-9)


@given(true=angles, middle=angles, half=st.floats(0.01, 3.0))
def test_an_interval_on_the_circle_holds_what_is_within_its_half_width(
    true: float, middle: float, half: float
) -> None:
    apart = abs((true - middle + np.pi) % (2 * np.pi) - np.pi)
    if abs(apart - half) < 1e-9:
        return
    course = TrueCourse(np.array([0]), np.array([true]))
    compared = compare("angle", one(middle, middle - half, middle + half), course)
    assert compared.inside[0] == (apart < half)


def test_an_interval_whose_upper_bound_was_wrapped_goes_on_round() -> None:
    course = TrueCourse(np.array([0]), np.array([-3.1]))
    assert compare("yaw", one(3.1, 3.0, -3.05), course).inside[0]
    assert not compare("yaw", one(3.1, 3.0, -3.12), course).inside[0]


def test_a_length_does_not_wrap() -> None:
    course = TrueCourse(np.array([0]), np.array([0.0]))
    compared = compare("x", one(2 * np.pi, 6.0, 6.5), course)
    assert compared.errors[0] == pytest.approx(2 * np.pi)
    assert not compared.inside[0]


def test_a_closed_door_lies_inside_an_interval_that_begins_at_closed() -> None:
    course = TrueCourse(np.array([0]), np.array([0.0]))
    assert compare("angle", one(0.01, 0.0, 0.05), course).inside[0]


def test_summary_of_a_hand_computed_door() -> None:
    degrees = np.radians([1.0, -3.0, 7.0, 20.0])
    estimates = rows(
        *((i + 1, "door", "angle", e, np.radians(5), True) for i, e in enumerate(degrees))
    )
    (door,) = evaluate_states(estimates, truth((0, "door", "angle", 0.0))).objects
    assert door.updates is not None
    assert door.updates.count == 4
    assert np.degrees(door.updates.bias) == pytest.approx(6.25)
    assert np.degrees(door.updates.mean) == pytest.approx(7.75)
    assert np.degrees(door.updates.rms) == pytest.approx(np.sqrt((1 + 9 + 49 + 400) / 4))
    assert np.degrees(door.updates.median) == pytest.approx(5.0)
    assert np.degrees(door.updates.p90) == pytest.approx(16.1)
    assert (door.updates.within_near, door.updates.within_far) == (0.5, 0.75)
    assert door.updates.coverage == 0.5
    assert door.final is not None
    assert door.final.count == 1
    assert np.degrees(door.final.mean) == pytest.approx(20.0)


def test_lengths_are_judged_in_centimetres() -> None:
    estimates = rows(*((1, "desk", "x", e, 0.01, True) for e in (0.04, 0.08, 0.3)))
    (desk,) = evaluate_states(estimates, truth((0, "desk", "x", 0.0))).overall
    assert desk.unit == "m"
    assert desk.updates is not None
    assert (desk.updates.within_near, desk.updates.within_far) == (1 / 3, 2 / 3)


def test_updates_that_observed_nothing_or_precede_the_truth_are_left_out() -> None:
    estimates = rows(
        (1, "door", "angle", 1.0, 0.1, True),
        (3, "door", "angle", 0.2, 0.1, True),
        (4, "door", "angle", 1.5, 0.1, False),
    )
    (door,) = evaluate_states(estimates, truth((2, "door", "angle", 0.2))).objects
    assert door.updates is not None
    assert door.updates.count == 1
    assert door.updates.mean == pytest.approx(0.0)


def test_final_is_the_last_observed_before_each_change_and_not_amid_a_swing() -> None:
    swing = [(10 + 0.05 * k, "door", "angle", 0.1 * k) for k in range(11)]
    changes = truth((0, "door", "angle", 0.0), *swing)
    estimates = rows(
        (1, "door", "angle", 0.5, 0.1, True),
        (9, "door", "angle", 0.01, 0.1, True),
        (9.5, "door", "angle", 0.3, 0.1, False),
        (10.21, "door", "angle", 0.0, 0.1, True),
        (20, "door", "angle", 0.7, 0.1, True),
        (30, "door", "angle", 0.98, 0.1, True),
    )
    (door,) = evaluate_states(estimates, changes).objects
    assert door.final is not None
    assert door.final.count == 2
    assert door.final.mean == pytest.approx(0.015)
    assert door.updates is not None
    assert door.updates.count == 5


def test_a_repeated_true_value_is_no_change() -> None:
    estimates = rows((1, "door", "angle", 0.0, 0.1, True), (9, "door", "angle", 0.0, 0.1, True))
    repeated = truth((0, "door", "angle", 0.0), (5, "door", "angle", 0.0))
    (door,) = evaluate_states(estimates, repeated).objects
    assert door.final is not None
    assert door.final.count == 1


def test_objects_that_cannot_be_compared_are_named() -> None:
    estimates = rows(
        (1, "a", "angle", 0.0, 0.1, True),
        (1, "b", "angle", 0.0, 0.1, True),
        (1, "c", "angle", 0.0, 0.1, False),
    )
    known = truth((0, "a", "angle", 0.0), (0, "c", "angle", 0.0), (0, "d", "angle", 0.0))
    evaluation = evaluate_states(estimates, known)
    assert evaluation.without_truth == ("b",)
    assert evaluation.never_observed == ("c",)
    assert evaluation.never_estimated == ("d",)
    assert [entry.object for entry in evaluation.objects] == ["a"]


def test_what_was_observed_only_before_its_truth_begins_is_named() -> None:
    estimates = rows((1, "a", "angle", 0.1, 0.2, True), (1, "b", "angle", 0.1, 0.2, True))
    known = truth((0, "a", "angle", 0.0), (2, "b", "angle", 0.0))
    evaluation = evaluate_states(estimates, known)
    assert evaluation.before_truth == ("b",)
    assert evaluation.never_observed == ()


def test_a_result_without_estimates_is_refused() -> None:
    with pytest.raises(ResultError, match="holds no estimates"):
        evaluate_states(rows(), truth((0, "door", "angle", 0.0)))


def test_a_truth_of_other_coordinates_is_refused_with_both() -> None:
    estimates = rows((1, "door", "angle", 0.0, 0.1, True))
    with pytest.raises(TruthError, match=r"has door \(x\), the result has door \(angle\)"):
        evaluate_states(estimates, truth((0, "door", "x", 0.0)))


def test_overall_joins_all_objects_of_a_kind() -> None:
    estimates = rows((1, "a", "angle", 0.1, 0.2, True), (1, "b", "angle", 0.3, 0.2, True))
    known = truth((0, "a", "angle", 0.0), (0, "b", "angle", 0.0))
    (angle,) = evaluate_states(estimates, known).overall
    assert angle.updates is not None
    assert angle.updates.mean == pytest.approx(0.2)
    assert angle.updates.coverage == 0.5


def test_a_truth_of_another_building_is_refused() -> None:
    estimates = rows((1, "door", "angle", 0.0, 0.1, True))
    with pytest.raises(TruthError, match=r"has gate \(angle\), the result has door \(angle\)"):
        evaluate_states(estimates, truth((0, "gate", "angle", 0.0)))
