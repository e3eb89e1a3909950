"""Cells: their rules of update and ageing, eqs. (2.10) to (2.18) and (6.1) to (6.8)."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.errors import GridError
from objstate.grid import AverageCells, BayesCells, CellModel, CountCells, LogOddsCells
from objstate.grid.cells import AGELESS_S, Fields

MODELS: tuple[CellModel, ...] = (BayesCells(), LogOddsCells(), CountCells(), AverageCells())
ALL = pytest.mark.parametrize("model", MODELS, ids=lambda model: type(model).__name__)
evidences = st.lists(
    st.floats(0.0, 1.0, width=32).filter(lambda each: each == 0.5 or abs(each - 0.5) > 1e-3),
    min_size=1,
    max_size=12,
)


def updated(model: CellModel, evidence: list[float], step_s: float = 0.0) -> Fields:
    """One cell after evidence that comes every so many seconds."""
    fields = model.empty(1)
    for number, each in enumerate(evidence):
        where = np.zeros(1, dtype=np.int32)
        model.update(fields, where, np.array([each], dtype=np.float32), number * step_s)
    return fields


def value(model: CellModel, evidence: list[float], at: float = 0.0) -> float:
    return float(model.values(updated(model, evidence), at)[0])


@ALL
def test_an_untouched_cell_is_even(model: CellModel) -> None:
    assert model.values(model.empty(3), 1e4).tolist() == [0.5] * 3


@ALL
@settings(max_examples=60, deadline=None)
@given(evidence=evidences)
def test_values_are_probabilities(model: CellModel, evidence: list[float]) -> None:
    assert 0.0 <= value(model, evidence) <= 1.0


@ALL
@settings(max_examples=60, deadline=None)
@given(evidence=evidences)
def test_free_and_occupied_mirror_each_other(model: CellModel, evidence: list[float]) -> None:
    mirrored = [float(np.float32(1.0) - np.float32(each)) for each in evidence]
    assert value(model, mirrored) == pytest.approx(1.0 - value(model, evidence), abs=2e-5)


@ALL
@settings(max_examples=60, deadline=None)
@given(evidence=evidences)
def test_what_says_nothing_changes_nothing(model: CellModel, evidence: list[float]) -> None:
    assert value(model, [*evidence, 0.5]) == value(model, evidence)


@ALL
def test_a_cell_follows_what_is_seen(model: CellModel) -> None:
    assert value(model, [1.0] * 5) > 0.9
    assert value(model, [1.0] * 5 + [0.0] * 12) < 0.1


@settings(max_examples=60, deadline=None)
@given(evidence=evidences)
def test_bayes_and_log_odds_agree(evidence: list[float]) -> None:
    assert value(LogOddsCells(), evidence) == pytest.approx(value(BayesCells(), evidence), abs=1e-4)


def test_bayes_is_equation_2_10() -> None:
    model = BayesCells(trust=0.6, most=0.999)
    p, belief = (0.5 + 0.6 * (0.9 - 0.5)), 0.5
    for _ in range(3):
        belief = 1.0 - 1.0 / (1.0 + p / (1.0 - p) * belief / (1.0 - belief))
    assert value(model, [0.9] * 3) == pytest.approx(belief, abs=1e-6)


def test_counts_are_capped_and_lower_their_contrary() -> None:
    model = CountCells(max_count=3.0)
    free, occupied, _ = updated(model, [1.0] * 5)
    assert (free[0], occupied[0]) == (0.0, 3.0)  # eq. (6.5)
    free, occupied, _ = updated(model, [1.0] * 5 + [0.0])
    assert (free[0], occupied[0]) == (1.0, 1.5)  # eq. (6.6)
    free, occupied, _ = updated(model, [0.0, 0.0, 0.75])
    assert (free[0], occupied[0]) == (1.5, 0.5)  # eq. (6.7)


def test_counts_are_read_by_their_reliability() -> None:
    model = CountCells(max_age_s=100.0)
    evidence = [1.0, 1.0, 0.0]  # counts of 1 free and 1 occupied: 2 was halved
    assert value(model, evidence) == pytest.approx(0.5)
    for age in (0.0, 25.0, 75.0, 100.0, 1e6):
        reliability = max(0.0, 1.0 - age / 100.0)  # eq. (6.2)
        assert value(model, [1.0], age) == pytest.approx(0.5 + reliability / 2, abs=1e-6)  # (6.4)


def test_counts_outlive_the_age_of_their_reliability() -> None:
    model, where = CountCells(max_age_s=10.0), np.zeros(1, dtype=np.int32)
    fields = updated(model, [1.0] * 4)
    model.update(fields, where, np.ones(1, dtype=np.float32), 9.99)
    assert fields[1][0] == 5.0
    model.update(fields, where, np.ones(1, dtype=np.float32), 19.99 + 1e-3)
    assert fields[1][0] == 1.0  # reset, as the reliability was zero


def test_faint_evidence_makes_a_cell_less_reliable_than_sure_evidence() -> None:
    model = CountCells()
    faint = value(model, [0.55])
    assert 0.5 < faint < 0.6
    assert value(model, [0.55] * 5) > 0.7
    assert value(model, [0.55] * 20) == pytest.approx(1.0)


def test_averages_are_equation_6_8() -> None:
    model = AverageCells(alpha=0.25)
    free, occupied, _ = updated(model, [1.0, 1.0, 0.25])
    assert occupied[0] == pytest.approx((0.25 + 0.75 * 0.25) * 0.75)
    assert free[0] == pytest.approx(0.25 * 0.5)


@ALL
def test_assigned_values_are_read_back(model: CellModel) -> None:
    fields, values = model.empty(3), np.array([0.1, 0.5, 0.9], dtype=np.float32)
    model.assign(fields, np.arange(3, dtype=np.int32), values, 7.0)
    assert model.values(fields, 7.0) == pytest.approx(values, abs=1e-6)


@pytest.mark.parametrize("age", [0.0, -1.0, math.nan, math.inf, 2 * AGELESS_S])
def test_ages_that_cant_be_are_refused(age: float) -> None:
    for kind in (BayesCells, CountCells, AverageCells):
        with pytest.raises(GridError, match="max_age_s"):
            kind(max_age_s=age)


def test_settings_of_cells_are_checked() -> None:
    with pytest.raises(GridError, match="trust"):
        BayesCells(trust=0.0)
    with pytest.raises(GridError, match="below 1"):
        BayesCells(trust=1.0)
    with pytest.raises(GridError, match="count to"):
        CountCells(max_count=math.nan)
    with pytest.raises(GridError, match="alpha"):
        AverageCells(alpha=1.5)
