"""What a door did over a stretch of time, of which some moments were seen: sampled paths."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.habits.calendar import NANOSECONDS
from objstate.habits.chain import Chain
from objstate.habits.forecast import Forecast
from objstate.habits.looks import RegionLooks
from objstate.habits.steps import CELL_NS, Steps, steps

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
    of = forecast.process
    filtered = _filtered(forecast, of, cut, looks, begin)
    states = _sampled(forecast, cut, filtered)
    first, last = begin // CELL_NS, end // CELL_NS + 1
    keys = forecast.calendar.keys(first, last)
    ends = begin + np.cumsum(np.round(cut.seconds * NANOSECONDS)).astype(np.int64)
    at = np.searchsorted(ends, np.arange(first + 1, last + 1) * CELL_NS, side="right") - 1
    hours = np.unique(keys[looks.stamps_ns // CELL_NS - first] // 4)
    leaving = np.swapaxes(forecast.leaving, 0, 1)
    return Paths(forecast, first, keys, np.isin(keys // 4, hours), states[:, at], leaving)


def _transition(forecast: Forecast, of: Chain, cut: Steps, i: int) -> FloatArray:
    """(d, s, s) of a step."""
    key, seconds = int(cut.keys[i]), float(cut.seconds[i])
    if seconds == CELL_NS / NANOSECONDS:
        return forecast.over_cell(key)
    kept = np.exp(of.rates[:, key] * seconds)
    return np.asarray(np.clip((of.right[:, key] * kept[:, None, :]) @ of.left[:, key], 0.0, None))


def _filtered(
    forecast: Forecast, of: Chain, cut: Steps, looks: RegionLooks, begin: int
) -> FloatArray:
    """(m, d, s) after each step and its look."""
    state = forecast.marginal(begin)
    out = np.empty((len(cut.keys), *state.shape))
    for i, look in enumerate(cut.looks):
        if cut.seconds[i] > 0.0:
            state = (state[:, None, :] @ _transition(forecast, of, cut, i))[:, 0]
        if look >= 0:
            state = forecast.given(state, looks.likelihood[look])
        out[i] = state
    return out


def _sampled(forecast: Forecast, cut: Steps, filtered: FloatArray) -> IntArray:
    """(d, m) a path of each draw, at the ends of the steps."""
    rng, of = np.random.default_rng(SEED), forecast.process
    count, draws, _ = filtered.shape
    out, every = np.empty((draws, count), dtype=np.int64), np.arange(draws)
    stays = np.broadcast_to(np.eye(filtered.shape[2]), (draws, *filtered.shape[2:] * 2))
    chance = filtered[-1]
    for i in range(count - 1, -1, -1):
        heights = np.asarray(chance.cumsum(axis=1))
        dice = rng.random((draws, 1)) * heights[:, -1:]
        out[:, i] = (dice >= heights).sum(axis=1).clip(max=chance.shape[1] - 1)
        if i:
            moves = cut.seconds[i] > 0.0
            passes = _transition(forecast, of, cut, i) if moves else stays
            chance = filtered[i - 1] * passes[every, :, out[:, i]]
    return out
