"""How fast the occupancy grid is: ``python -m benchmarks.grid``

A map of 50 m by 50 m in cells of 5 cm, in a square hall of 12 m, swept by scans of 360 beams. Beside it a
plain log-odds map as it is usually written with NumPy: every cell of every beam, in one addition. Prints
processor times, the median of many calls, taken in turns, and the memory of the cells.
"""

from __future__ import annotations

from collections.abc import Callable
from time import process_time

import numpy as np

from objstate.geometry import FloatArray
from objstate.grid import (
    AverageCells,
    BayesCells,
    CellModel,
    CountCells,
    Grid,
    Layout,
    LogOddsCells,
    Percepts,
    entropy,
    laser_percepts,
)
from objstate.records import Rays, Scan

ROUNDS, BEAMS, REACH = 60, 360, 10.0
LAYOUT = Layout(0.05, 1000, 1000, np.array([-25.0, -25.0, 0.0]))
HALF = 6.0  # m, from the middle of the hall to its walls


def scan(rng: np.random.Generator) -> Scan:
    """What a laser in the middle reads, with 2 cm of noise."""
    bearings = np.linspace(-np.pi, np.pi, BEAMS, endpoint=False)
    ranges = HALF / np.maximum(np.abs(np.cos(bearings)), np.abs(np.sin(bearings)))
    flat = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(BEAMS)])
    rays = Rays(np.zeros((BEAMS, 3)), flat)
    return Scan(0, "laser", ranges + 0.02 * rng.standard_normal(BEAMS), rays, 0.05, 20.0)


class PlainLogOdds:
    """A log-odds map without ageing, reliability, uncertainty, or an index."""

    def __init__(self) -> None:
        self.log_odds = np.zeros(LAYOUT.size, dtype=np.float32)

    def sweep(self, percepts: Percepts) -> None:
        """Add to all cells of all beams, sampled once a cell along each."""
        starts, ends = LAYOUT.to_cells(percepts.starts), LAYOUT.to_cells(percepts.ends)
        steps = np.ceil(np.abs(ends - starts).max(axis=1)).astype(int)
        beam = np.repeat(np.arange(len(steps)), steps)
        along = np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)
        cells = starts[beam] + (along / steps[beam])[:, None] * (ends - starts)[beam]
        np.add.at(self.log_odds, flat(cells), np.float32(-0.4))
        np.add.at(self.log_odds, flat(ends), np.float32(0.85))
        np.clip(self.log_odds, -4.0, 4.0, out=self.log_odds)

    def entropy(self) -> FloatArray:
        """Of all cells, by logarithms."""
        p = 1.0 - 1.0 / (1.0 + np.exp(self.log_odds))
        return -(p * np.log2(p) + (1.0 - p) * np.log2(1.0 - p))


def flat(cells: FloatArray) -> np.ndarray:
    """Indices (n,) of points (n, 2) in cells."""
    at = cells.astype(np.int64)
    return at[:, 1] * LAYOUT.columns + at[:, 0]


def main() -> None:
    """Print all tables."""
    rng = np.random.default_rng(0)
    scans = [scan(rng) for _ in range(8)]
    pose, spread = np.array([0.01, 0.01, 0.3]), np.diag([0.01, 0.01, 0.003]) ** 2
    models: list[CellModel] = [CountCells(), BayesCells(), LogOddsCells(), AverageCells()]
    grids = [Grid(LAYOUT, model) for model in models]
    plain, seen = PlainLogOdds(), [laser_percepts(each, pose, spread) for each in scans]
    turn = {"scan": 0}

    def swept(grid: Grid) -> Callable[[], object]:
        def update() -> None:
            turn["scan"] += 1
            percepts = laser_percepts(scans[turn["scan"] % 8], pose, spread)
            grid.sweep(percepts, turn["scan"] * 10**8, REACH)

        return update

    calls: dict[str, Callable[[], object]] = {
        f"a scan into {type(grid.cells).__name__}": swept(grid) for grid in grids
    }
    calls["a scan into a plain log-odds map, NumPy"] = lambda: plain.sweep(seen[0])
    now, counts = 10**9, grids[0]
    values = counts.values(now)
    calls["percepts of a scan alone"] = lambda: laser_percepts(scans[0], pose, spread)
    calls["values of all cells"] = lambda: counts.values(now)
    calls["entropy of all cells, series"] = lambda: counts.entropy(now, "series")
    calls["entropy of all cells, look-up table"] = lambda: counts.entropy(now, "table")
    calls["entropy of all cells, logarithms"] = lambda: counts.entropy(now, "logarithms")
    calls["entropies of values alone, series"] = lambda: entropy(values, "series")
    calls["entropies of values alone, look-up table"] = lambda: entropy(values, "table")
    calls["entropies of values alone, logarithms"] = lambda: entropy(values, "logarithms")
    calls["entropy of the plain log-odds map, NumPy"] = plain.entropy
    times: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(ROUNDS):
        for name, call in calls.items():
            call()
            begin = process_time()
            for _ in range(3):
                call()
            times[name].append((process_time() - begin) / 3)
    print("| what | time |\n| --- | --- |")
    for name, taken in times.items():
        print(f"| {name} | {1e3 * float(np.median(taken)):.2f} ms |")
    drawn = counts.sweep(seen[0], 2 * 10**10, REACH)
    print(
        f"\n{len(drawn.where):,} cells a scan; {counts.memory / 1e6:g} MB for {LAYOUT.size:,} cells."
    )


if __name__ == "__main__":
    main()
