"""``objstate compile`` compiles the loops of grids as they are called."""

from __future__ import annotations

import numpy as np

from objstate.cli.loops import GROUPS, compile_groups
from objstate.grid import (
    AverageCells,
    BayesCells,
    CountCells,
    Grid,
    Layout,
    LogOddsCells,
    Percepts,
    circle,
    entropy,
    rasters,
    rectangle,
)


def test_after_compiling_no_grid_compiles_anything() -> None:
    loops = [each for each in vars(rasters).values() if hasattr(each, "py_func")]
    own = {loop for loop in loops if "forceinline" not in loop.targetoptions}
    groups = [group for group in GROUPS if own & set(group)]
    assert own <= {loop for group in groups for loop in group}
    compile_groups(groups)
    before = {loop.__name__: list(loop.signatures) for loop in own}
    layout = Layout(0.05, 40, 60, np.array([0.3, -0.2, 0.1]))
    ends = np.array([[1.0, 1.0], [2.0, 0.5]])
    seen = Percepts(
        np.zeros((2, 2)), ends, np.array([True, False]), np.tile(np.eye(2) * 0.01, (2, 1, 1))
    )
    for cells in (BayesCells(), LogOddsCells(), CountCells(), AverageCells()):
        grid = Grid(layout, cells)
        grid.sweep(seen, 0, reach=5.0)
        grid.draw(
            [circle(layout, ends[0], 0.2, 1.0), rectangle(layout, ends[1], (1, 1), 0, 1.0)], 5
        )
        for method in ("series", "table", "logarithms"):
            entropy(grid.values(10), method)
    assert {loop.__name__: list(loop.signatures) for loop in own} == before
