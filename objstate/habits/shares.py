"""What a door did over a stretch of time, of which some moments were seen: sampled paths."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.habits.calendar import CELL_NS, NANOSECONDS
from objstate.habits.forecast import Forecast
from objstate.habits.looks import RegionLooks
from objstate.habits.steps import Steps, steps
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.habits import kernels
else:
    kernels = Later("objstate.habits.kernels")

SEED = 1  # of the paths, so that the same looks give the same figures


@dataclass(frozen=True, eq=False)
class Paths:
    """One path of the door for each of d draws of its habits, given the looks; cell by cell."""

    forecast: Forecast
    first: int  # cell
    keys: IntArray  # (c,) of the cells
    seen: BoolArray  # (c,) whether there are looks in cells of the same key's hour
    states: IntArray  # (d, c) at the end of each cell
    leaving: FloatArray  # (k, d, s) 1/s, rates out of a state's region

    def share(self, region: int, cells: BoolArray) -> FloatArray:
        """(d,) of the time of chosen cells (c,) that the door was in a region."""
        return np.asarray((self.states[:, cells] // 2 == region).mean(axis=1))

    def moves(self, cells: BoolArray) -> FloatArray:
        """(d,) moves a day from region to region in chosen cells (c,)."""
        draws = np.arange(len(self.states))[:, None]
        rates = self.leaving[self.keys[cells], draws, self.states[:, cells]]
        return np.asarray(rates.mean(axis=1) * 86400.0)


def paths(forecast: Forecast, looks: RegionLooks, least_s: float = 0.0) -> Paths:
    """Paths from the first look to the last, or over ``least_s`` if that is longer.

    By forward filtering and backward sampling.
    """
    begin = int(looks.stamps_ns[0])
    end = max(int(looks.stamps_ns[-1]), begin + round(least_s * NANOSECONDS))
    cut = steps(forecast.calendar, begin, looks.stamps_ns, end)
    states = _sampled(forecast, cut, looks, begin)
    first, last = begin // CELL_NS, end // CELL_NS + 1
    keys = forecast.calendar.keys(first, last)
    ends = begin + np.cumsum(np.round(cut.seconds * NANOSECONDS)).astype(np.int64)
    at = np.searchsorted(ends, np.arange(first + 1, last + 1) * CELL_NS, side="right") - 1
    hours = np.unique(keys[looks.stamps_ns // CELL_NS - first] // 4)
    leaving = np.swapaxes(forecast.leaving, 0, 1)
    return Paths(forecast, first, keys, np.isin(keys // 4, hours), states[:, at], leaving)


def _sampled(forecast: Forecast, cut: Steps, looks: RegionLooks, begin: int) -> IntArray:
    """(d, m) a path of each draw, at the ends of the steps."""
    of, start = forecast.process, forecast.marginal(begin)
    draws, states = start.shape
    likelihood = np.repeat(looks.likelihood, 2, axis=1)
    filtered = np.empty((len(cut.keys) + 1, states))
    out = np.empty((draws, len(cut.keys)), dtype=np.int64)
    for draw in range(draws):
        filtered[0] = start[draw]
        dice = np.random.default_rng([SEED, draw]).random(len(cut.keys))
        process = of.rates[draw], of.right[draw], np.ascontiguousarray(of.left[draw])
        kernels.sampled(*process, *cut, likelihood, dice, filtered, out[draw])
    return out
