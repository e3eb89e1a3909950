"""Sweeps, merging and entropy of whole grids."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.errors import GridError
from objstate.geometry import FloatArray
from objstate.grid import (
    BayesCells,
    CellModel,
    CountCells,
    Grid,
    Layout,
    LogOddsCells,
    Percepts,
    add,
    bayes,
    beam,
    circle,
    either,
    entropy,
    maximum,
    merged,
    overwrite,
    resampled,
)
from objstate.grid import grid as grid_module

LAYOUT = Layout(0.05, 120, 160, np.array([-4.0, -3.0, 0.0]))
SECOND = 10**9
ROBOT = np.array([0.025, 0.025])


def percepts(ends: FloatArray, obstacle: bool = True, std: float = 1e-4) -> Percepts:
    count = len(ends)
    spread = np.tile(std**2 * np.eye(2), (count, 1, 1))
    return Percepts(np.tile(ROBOT, (count, 1)), ends, np.full(count, obstacle), spread)


def beside(distance: float) -> FloatArray:
    return ROBOT + np.array([distance, 0.0])


def round_about(count: int, distance: float) -> FloatArray:
    bearings = np.linspace(-np.pi, np.pi, count, endpoint=False)
    return ROBOT + distance * np.column_stack([np.cos(bearings), np.sin(bearings)])


def value_at(grid: Grid, x: float, y: float, stamp_ns: int = 0) -> float:
    column, row = grid.layout.to_cells(np.array([x, y])).astype(int)
    return float(grid.values(stamp_ns)[row, column])


@settings(max_examples=40, deadline=None)
@given(st.floats(-3.9, 3.9), st.floats(-2.9, 2.9), st.booleans())
def test_one_beam_is_the_drawing_of_a_beam(x: float, y: float, obstacle: bool) -> None:
    grid, end = Grid(LAYOUT), np.array([x, y])
    if math.dist(ROBOT, end) < 0.1:
        return
    swept = grid.sweep(percepts(end[None], obstacle), 0, reach=6.0).plane()
    drawn = beam(LAYOUT, ROBOT, end, 6.0, obstacle).plane()
    assert swept == pytest.approx(drawn, abs=0.01)


def test_a_sweep_touches_a_cell_once() -> None:
    grid = Grid(LAYOUT)
    for scan in range(5):
        drawn = grid.sweep(percepts(round_about(720, 2.0)), scan, reach=6.0)
        assert len(np.unique(drawn.where)) == len(drawn.where)
    free, _, _ = grid._fields
    assert free.max() <= 5.0


def test_beams_stop_at_what_the_sweep_found() -> None:
    far, near = beside(3.0), beside(1.0)
    together = Percepts(
        np.tile(ROBOT, (2, 1)),
        np.stack([far, near]),
        np.array([False, True]),
        np.tile(1e-8 * np.eye(2), (2, 1, 1)),
    )
    grid = Grid(LAYOUT)
    grid.sweep(together, 0, reach=6.0)
    assert value_at(grid, *near) > 0.5
    assert value_at(grid, *beside(0.5)) < 0.5
    assert value_at(grid, *beside(2.0)) == 0.5


def test_an_unsure_end_is_wide_and_highest_in_the_middle() -> None:
    grid, end = Grid(LAYOUT), beside(2.0)
    drawn = grid.sweep(percepts(end[None], std=0.15), 0, reach=20.0)
    occupied = drawn.values > 0.5
    area = math.pi * 0.15**2 * -2 * math.log(0.1)
    assert occupied.sum() * 0.05**2 == pytest.approx(area, rel=0.1)
    column, row = LAYOUT.to_cells(end).astype(int)
    assert drawn.where[drawn.values.argmax()] == row * LAYOUT.columns + column


@settings(max_examples=25, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(0.0, 0.2))
def test_a_turned_grid_sees_the_same(yaw: float, std: float) -> None:
    """But for cells that are cut otherwise: how much is occupied, and how surely, is alike."""
    turned = Layout(0.05, 200, 200, np.array([5 * math.cos(yaw + 3.926991), 0.0, yaw]))
    centre = turned.to_frame(np.array([100.0, 100.0]))
    plain = Layout(0.05, 200, 200, np.array([*(centre - 5.0), 0.0]))
    spread = np.array([[0.16, 0.05], [0.05, 0.04]]) * (0.1 + std)
    seen = Percepts(centre[None], centre[None] + [2.0, 1.0], np.ones(1, bool), spread[None])
    drawn = [Grid(each).sweep(seen, 0, reach=30.0).values for each in (plain, turned)]
    areas = [np.maximum(values - 0.5, 0.0).sum() for values in drawn]
    assert areas[0] == pytest.approx(areas[1], rel=0.1)


def test_more_cells_than_there_is_room_for_are_all_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = Grid(LAYOUT).sweep(percepts(round_about(360, 2.5), std=0.03), 0, reach=6.0)
    monkeypatch.setattr(grid_module, "ROOM", 16)
    small = Grid(LAYOUT).sweep(percepts(round_about(360, 2.5), std=0.03), 0, reach=6.0)
    assert (small.where == whole.where).all()
    assert (small.values == whole.values).all()


def test_update_indices_begin_anew_before_they_overflow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grid_module, "LAST_INDEX", LAYOUT.size + 3000)
    grid, usual = Grid(LAYOUT), Grid(LAYOUT)
    for scan in range(6):
        seen = percepts(round_about(90, 1.0 + 0.3 * scan))
        drawn = grid.sweep(seen, scan, reach=6.0)
        monkeypatch.undo()
        assert (drawn.where == usual.sweep(seen, scan, reach=6.0).where).all()
        monkeypatch.setattr(grid_module, "LAST_INDEX", LAYOUT.size + 3000)
    assert grid._next <= LAYOUT.size + 3000


def test_scaled_evidence_counts_less_and_none_nothing() -> None:
    seen = percepts(round_about(90, 1.5))
    values = []
    for scale in (0.0, 0.3, 1.0):
        grid = Grid(LAYOUT, BayesCells())
        grid.sweep(seen, 0, reach=6.0, scale=scale)
        values.append(value_at(grid, *beside(1.5)))
    assert values[0] == 0.5 < values[1] < values[2]


def test_what_leaves_is_forgotten_and_what_stands_stays() -> None:
    grid = Grid(LAYOUT, CountCells(max_age_s=30.0))
    for scan in range(5):
        grid.sweep(percepts(round_about(360, 1.5)), scan * SECOND, reach=6.0)
    spot = beside(1.5)
    assert value_at(grid, *spot, 4 * SECOND) > 0.9
    assert 0.5 < value_at(grid, *spot, 25 * SECOND) < 0.8
    assert value_at(grid, *spot, 60 * SECOND) == 0.5
    assert grid.ages(4 * SECOND).min() == pytest.approx(0.0, abs=0.01)
    for scan in range(5, 12):
        grid.sweep(percepts(round_about(360, 2.5)), scan * SECOND, reach=6.0)
    assert value_at(grid, *spot, 11 * SECOND) < 0.3


def test_the_first_of_several_drawings_counts() -> None:
    grid = Grid(LAYOUT)
    grid.draw([circle(LAYOUT, ROBOT, 0.3, 1.0), circle(LAYOUT, ROBOT, 0.6, 0.0)], 0)
    assert value_at(grid, *ROBOT) == 1.0
    assert value_at(grid, *beside(0.45)) == 0.0


def test_drawings_merge_by_any_function_and_skip_the_ignored_value() -> None:
    grid = Grid(LAYOUT, BayesCells(most=0.99))
    grid.draw(circle(LAYOUT, ROBOT, 0.3, 0.8), 0, overwrite)
    assert value_at(grid, *ROBOT) == pytest.approx(0.8)
    grid.draw(circle(LAYOUT, ROBOT, 0.3, 0.6), 0, maximum)
    assert value_at(grid, *ROBOT) == pytest.approx(0.8)
    grid.draw(circle(LAYOUT, ROBOT, 0.3, 0.6), 0, overwrite, ignored=0.6)
    assert value_at(grid, *ROBOT) == pytest.approx(0.8)
    grid.draw(circle(LAYOUT, ROBOT, 0.3, 0.6), 0, bayes)
    assert value_at(grid, *ROBOT) == pytest.approx(0.48 / (0.48 + 0.08))


values_of_maps = st.lists(st.floats(0.0625, 0.9375, width=32), min_size=4, max_size=4)


@given(values_of_maps, values_of_maps)
def test_laws_of_merging(a: list[float], b: list[float]) -> None:
    one, other = (np.array(each, dtype=np.float32).reshape(2, 2) for each in (a, b))
    even = np.full((2, 2), 0.5, dtype=np.float32)
    assert merged(one, even, bayes) == pytest.approx(one, abs=1e-5)
    for merge in (bayes, either, maximum, add):
        assert merged(one, other, merge) == pytest.approx(merged(other, one, merge), abs=1e-5)
    assert (merged(one, other, either) >= merged(one, other, maximum) - 1e-6).all()
    assert (merged(one, other, overwrite) == other).all()


def test_an_ignored_value_leaves_the_map_and_none_ignores_nothing() -> None:
    one = np.array([[0.9, 0.2]], dtype=np.float32)
    other = np.array([[0.5, 0.7]], dtype=np.float32)
    assert merged(one, other, overwrite, 0.5).tolist() == [[one[0, 0], other[0, 1]]]
    assert merged(one, other, overwrite).tolist() == other.tolist()


def test_maps_that_dont_fit_are_refused() -> None:
    with pytest.raises(GridError, match=r"2 by 2 cells.*3 by 2 cells"):
        merged(np.zeros((3, 2), np.float32), np.zeros((2, 2), np.float32), bayes)
    bad = np.zeros((2, 2), np.float32)
    bad[1, 0] = np.nan
    with pytest.raises(GridError, match="nan in row 1, column 0"):
        merged(np.zeros((2, 2), np.float32), bad, bayes)
    with pytest.raises(GridError, match="layout of 120 by 160"):
        resampled(np.zeros((2, 2), np.float32), LAYOUT, LAYOUT)
    with pytest.raises(GridError, match="'odom'"):
        resampled(np.zeros(LAYOUT.shape, np.float32), LAYOUT, Layout(0.1, 3, 3, frame="odom"))


@settings(max_examples=25, deadline=None)
@given(
    st.floats(-1.0, 1.0),
    st.floats(-1.0, 1.0),
    st.floats(-3.0, 3.0),
    st.sampled_from([0.025, 0.1, 0.2]),
)
def test_no_obstacle_is_lost_in_other_cells(
    x: float, y: float, yaw: float, resolution: float
) -> None:
    values = np.full(LAYOUT.shape, 0.1, dtype=np.float32)
    at = LAYOUT.to_cells(np.array([x, y])).astype(int)
    values[at[1] - 1 : at[1] + 2, at[0] - 1 : at[0] + 2] = 0.9
    onto = Layout(resolution, 60, 60, np.array([x, y, yaw]))
    onto = Layout(
        resolution, 60, 60, np.append(2 * onto.origin[:2] - onto.to_frame(np.full(2, 30.0)), yaw)
    )
    result = resampled(values, LAYOUT, onto)
    assert (result[28:32, 28:32] == np.float32(0.9)).any()
    assert result.min() >= np.float32(0.1)


def test_the_same_layout_gives_the_same_map() -> None:
    values = np.random.default_rng(0).random(LAYOUT.shape, dtype=np.float32)
    assert (resampled(values, LAYOUT, LAYOUT) == values).all()
    doubled = Layout(0.025, 240, 320, LAYOUT.origin)
    finer = resampled(values, LAYOUT, doubled)
    assert (finer == np.repeat(np.repeat(values, 2, axis=0), 2, axis=1)).all()
    assert (resampled(finer, doubled, LAYOUT) == values).all()


def test_outside_of_a_map_nothing_is_known() -> None:
    moved = Layout(0.05, 120, 160, LAYOUT.origin + np.array([100.0, 0.0, 0.0]))
    values = np.zeros(LAYOUT.shape, np.float32)
    assert (resampled(values, LAYOUT, moved) == 0.5).all()


@pytest.mark.parametrize("cells", [CountCells(), BayesCells(), LogOddsCells()])
def test_grids_of_other_cells_merge(cells: CellModel) -> None:
    grid, other = Grid(LAYOUT, CountCells()), Grid(Layout(0.1, 20, 20), cells)
    other.draw(circle(other.layout, np.array([1.0, 1.0]), 0.4, 1.0), 0)
    grid.merge(other, 0, bayes)
    assert value_at(grid, 1.0, 1.0) == pytest.approx(value_at(other, 1.0, 1.0), abs=0.03)
    assert value_at(grid, -1.0, -1.0) == 0.5


def test_entropy_is_shannons() -> None:
    p = np.linspace(0.0, 1.0, 10001, dtype=np.float32)
    with np.errstate(divide="ignore", invalid="ignore"):
        exact = np.nan_to_num(-(p * np.log2(p) + (1 - p) * np.log2(1 - p)))
    assert entropy(p, "logarithms") == pytest.approx(exact, abs=1e-5)
    assert entropy(p, "table") == pytest.approx(exact, abs=1.1e-3)
    assert entropy(p, "series") == pytest.approx(exact, abs=1.1e-3)
    assert entropy(np.array([0.0, 1.0], np.float32)).tolist() == [0.0, 0.0]
    assert Grid(LAYOUT).entropy(0) == pytest.approx(np.ones(LAYOUT.shape), abs=1e-3)


def test_a_map_of_a_million_cells_takes_16_mb() -> None:
    assert Grid(Layout(0.05, 1000, 1000)).memory == 16_000_000


def test_sweeps_that_cant_be_are_refused() -> None:
    grid, seen = Grid(LAYOUT), percepts(round_about(8, 1.0))
    with pytest.raises(GridError, match="reach"):
        grid.sweep(seen, 0, reach=math.nan)
    with pytest.raises(GridError, match=r"scaled by 1.5"):
        grid.sweep(seen, 0, reach=1.0, scale=1.5)
    elsewhere = Percepts(seen.starts, seen.ends, seen.obstacle, seen.covariances, "odom")
    with pytest.raises(GridError, match=r"'map'.*'odom'"):
        grid.sweep(elsewhere, 0, reach=1.0)
    with pytest.raises(GridError, match="another layout"):
        grid.draw(circle(Layout(0.05, 5, 5), np.zeros(2), 0.1, 1.0), 0)
    with pytest.raises(GridError, match="ends that are not finite"):
        percepts(np.full((1, 2), np.nan))
    with pytest.raises(GridError, match=r"obstacle of shape \(2,\)"):
        Percepts(np.zeros((1, 2)), np.zeros((1, 2)), np.ones(2, bool), np.zeros((1, 2, 2)))
    assert (grid.values(0) == 0.5).all()
