"""Errors by condition, calibration and paired differences, on estimates whose errors are known."""

import numpy as np
import polars as pl
import pytest

from objstate.errors import ResultError
from objstate.evaluation.breakdown import BINS, groups, parts_of
from objstate.evaluation.calibration import calibrations
from objstate.evaluation.conditions import conditions
from objstate.evaluation.judged import judge
from objstate.evaluation.paired import differences
from objstate.evaluation.states import TrueCourse
from objstate.evaluation.sums import Totals, sums_of
from objstate.records import Path as RobotPath
from tests.rooms import building, door, enclosure, table

SECOND = 10**9


def estimates(rows: list[tuple[int, str, str, float, float, bool]]) -> pl.DataFrame:
    """Rows of stamp (s), object, coordinate, median, std, observed; with 90 % intervals."""
    names = ["stamp", "object", "coordinate", "median", "std", "observed"]
    frame = pl.DataFrame(rows, schema=names, orient="row")
    half = 1.645 * pl.col("std")
    return frame.with_columns(
        stamp=(pl.col("stamp") * SECOND).cast(pl.Int64),
        lower=pl.col("median") - half,
        upper=pl.col("median") + half,
    )


def course(*steps: tuple[int, float]) -> TrueCourse:
    return TrueCourse(np.array([s * SECOND for s, _ in steps]), np.array([v for _, v in steps]))


def judged(
    count: int, off: float, std: float, rng: np.random.Generator, logs: int = 20
) -> pl.DataFrame:
    """Final estimates of ``count`` doors in each log that err by ``off`` times a normal deviate."""
    tables = []
    for log in range(logs):
        rows = [
            (1, f"door_{n}", "angle", 1.0 + off * rng.standard_normal(), std, True)
            for n in range(count)
        ]
        courses = {(f"door_{n}", "angle"): course((0, 1.0)) for n in range(count)}
        tables.append(judge(estimates(rows), courses).with_columns(log=pl.lit(f"log_{log}")))
    return pl.concat(tables)


def test_estimates_are_judged_by_the_value_that_held() -> None:
    rows = [
        (0, "door", "angle", 0.2, 0.1, True),
        (1, "door", "angle", 0.2, 0.1, False),
        (4, "door", "angle", 0.9, 0.1, True),
        (7, "door", "angle", 0.9, 0.1, False),
        (9, "other", "angle", 0.9, 0.1, True),
    ]
    table_ = judge(estimates(rows), {("door", "angle"): course((0, 0.3), (3, 1.2))})
    assert table_["error"].to_list() == pytest.approx([-0.1, -0.1, -0.3, -0.3])
    assert table_["inside"].to_list() == [True, True, False, False]
    assert table_["final"].to_list() == [True, False, True, False]
    assert table_["since_seen"].to_list() == [0.0, 1.0, 0.0, 3.0]


def test_what_was_estimated_while_lost_is_not_final() -> None:
    rows = [(1, "door", "angle", 0.2, 0.1, True), (2, "door", "angle", 0.9, 0.1, True)]
    lost = [(2 * SECOND, 3 * SECOND)]
    table_ = judge(estimates(rows), {("door", "angle"): course((0, 0.2))}, lost)
    assert table_["final"].to_list() == [True, False]


def test_a_long_log_is_thinned_but_keeps_its_final_estimates() -> None:
    rows = [(n, "door", "angle", 0.2, 0.1, True) for n in range(5001)]
    table_ = judge(estimates(rows), {("door", "angle"): course((0, 0.2), (1234, 0.3))})
    assert len(table_) <= 502
    assert table_.filter("final")["stamp"].to_list() == [1233 * SECOND, 5000 * SECOND]


def test_distance_incidence_and_beams_are_those_of_the_geometry() -> None:
    leaf = door("door", 2.0, -0.45, bearing=np.pi / 2)  # across the way of the robot, 2 m ahead
    desk = table("desk", -1.0, 1.5)
    room = building(enclosure(8.0, 6.0), leaf, desk)
    poses = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    path = RobotPath(np.array([0, SECOND]), poses)
    rows = [
        (0, "door", "angle", 0.0, 0.1, True),
        (1, "door", "angle", 0.0, 0.1, True),
        *(
            (1, "desk", name, value, 0.1, True)
            for name, value in zip("xy", (-1.0, 1.5), strict=True)
        ),
        (1, "desk", "yaw", 0.0, 0.1, True),
    ]
    found = conditions(estimates(rows), room, path, None).sort("object", "stamp")
    assert found["class"].to_list() == ["furniture", "door", "door"]
    assert found["distance"].to_list() == pytest.approx([2.5, 2.0, 1.0], abs=0.05)
    assert found["incidence"].to_list()[1:] == pytest.approx([0.0, 0.0], abs=0.02)
    assert found["incidence"][0] is None
    assert found["beams"].null_count() == 3
    turned = [(1, "door", "angle", np.pi / 2, 0.1, True)]
    edge_on = conditions(estimates(turned), room, path, None)
    assert edge_on["incidence"][0] > np.radians(45)


def test_every_judged_estimate_falls_into_one_stretch() -> None:
    rng = np.random.default_rng(0)
    table_ = judged(5, 0.1, 0.1, rng).with_columns(
        pl.Series("distance", rng.uniform(0, 9, 100)),
        pl.Series("beams", rng.integers(0, 90, 100)),
    )
    by = dict.fromkeys(("object", "distance (m)", "beams", "last seen before (s)"), 0)
    totals = Totals()
    totals.add("", sums_of(parts_of(table_), table_, ()))
    for group in groups(totals):
        by[group.condition] += group.errors.count
    assert set(by.values()) == {100}
    assert all(len(bins.labels()) == len(bins.edges) for bins in BINS)


@pytest.mark.parametrize(("claimed", "sure"), [(0.1, "right"), (0.05, "too"), (0.3, "little")])
def test_calibration_tells_who_is_too_sure(claimed: float, sure: str) -> None:
    (found,) = calibrations(judged(40, 0.1, claimed, np.random.default_rng(0)))
    nominal, held = (
        [getattr(level, name) for level in found.levels] for name in ("level", "share")
    )
    gap = np.array(held) - np.array(nominal)
    middle = slice(3, 8)
    if sure == "right":
        assert np.abs(gap).max() < 0.05
        assert found.recorded.lower <= 0.9 <= found.recorded.upper
    else:
        assert (gap[middle] < -0.1 if sure == "too" else gap[middle] > 0.1).all()
    assert [width.rms for width in found.widths] == pytest.approx([0.1] * 10, rel=0.3)


def test_a_difference_is_found_where_there_is_one_and_only_there() -> None:
    good, equal = (judged(10, 0.1, 0.1, np.random.default_rng(seed)) for seed in (1, 2))
    bad = judged(10, 0.2, 0.1, np.random.default_rng(3))
    error, coverage, width = differences(bad, good)
    assert error.lower > 0
    assert error.difference == pytest.approx(0.08, abs=0.02)  # of the mean absolute errors
    assert coverage.upper < 0
    assert width.difference == pytest.approx(0.0, abs=1e-12)
    assert (error.units, error.pairs) == (20, 200)
    same = differences(equal, good)[0]
    assert same.lower < 0 < same.upper


def test_swapped_results_differ_by_the_same_the_other_way() -> None:
    one, other = (judged(4, off, 0.1, np.random.default_rng(5)) for off in (0.1, 0.3))
    for there, back in zip(differences(one, other), differences(other, one), strict=True):
        assert there.difference == pytest.approx(-back.difference)
        assert (there.lower, there.upper) == pytest.approx((-back.upper, -back.lower))


def test_results_of_different_logs_cannot_be_compared() -> None:
    one = judged(2, 0.1, 0.1, np.random.default_rng(0))
    with pytest.raises(ResultError, match="in common"):
        differences(one, one.with_columns(log=pl.lit("elsewhere")))
