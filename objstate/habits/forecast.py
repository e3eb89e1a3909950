"""A door's state ahead in time, averaged over what isn't known of its habits."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.habits.calendar import CELL_NS, NANOSECONDS, PER_DAY, Calendar
from objstate.habits.chain import Chain, chain
from objstate.habits.design import Design
from objstate.habits.model import Distribution
from objstate.lazy import lazy

DRAWS = 16  # of the parameters
FORGOTTEN_CELLS = 28 * PER_DAY  # after which the state is taken to depend on the hour alone
LEAST = 1e-12  # probability
MOST_KEPT = 10_000  # marginals of cells that are remembered


@dataclass(frozen=True, eq=False)
class Forecast:
    """The process for several draws of its parameters; d draws, s states."""

    design: Design
    calendar: Calendar
    habits: Distribution
    draws: int = DRAWS  # 1: the mode alone
    _spans: dict[tuple[int, int], FloatArray] = field(default_factory=dict, init=False, repr=False)

    _marginals: dict[int, FloatArray] = field(default_factory=dict, init=False, repr=False)

    @lazy
    def thetas(self) -> FloatArray:
        """(d, p) draws."""
        return self.habits.draws(self.draws)

    @lazy
    def process(self) -> Chain:
        """Leading axes (d, k)."""
        return chain(np.einsum("kup,dp->dku", self.design.matrix, self.thetas))

    @lazy
    def _cells(self) -> FloatArray:
        """(d, k, s, s) transition probabilities over a whole cell."""
        return self.process.over(CELL_NS / NANOSECONDS)

    def marginal(self, stamp_ns: int) -> FloatArray:
        """(d, s) at a moment, nobody having looked."""
        cell = stamp_ns // CELL_NS
        start = self._marginals.get(cell)
        if start is None:
            before = self._marginals.get(cell - 1)
            since = cell - (1 if before is not None else FORGOTTEN_CELLS)
            if before is None:
                before = self.process.settled[:, self.calendar.key(since)]
            start = self.later(before, since * CELL_NS, cell * CELL_NS)
            if len(self._marginals) >= MOST_KEPT:
                self._marginals.clear()
            self._marginals[cell] = start
        return self.later(start, cell * CELL_NS, stamp_ns)

    def given(self, state: FloatArray, likelihood: FloatArray) -> FloatArray:
        """(d, s) after a look with a likelihood (r,) of the regions."""
        out = state * np.repeat(likelihood, 2)
        total = out.sum(axis=-1, keepdims=True)
        return np.asarray(np.where(total > 0.0, out / np.where(total > 0.0, total, 1.0), state))

    def with_shares(self, state: FloatArray, shares: FloatArray) -> FloatArray:
        """(d, s) with probabilities (r,) of the regions, settled or brief in each as in ``state``."""
        known = state[:, 0::2] + state[:, 1::2]
        settled = state[:, 0::2] / np.maximum(known, LEAST)
        out = np.stack([shares * settled, shares * (1.0 - settled)], axis=-1)
        return np.asarray(out.reshape(state.shape))

    def kept(self, begin_ns: int, end_ns: int) -> FloatArray:
        """(d, s) probability that a door doesn't leave its region from one moment to another."""
        of_key = self.calendar.seconds_by_key(begin_ns, end_ns)
        return np.asarray(np.exp(-np.einsum("dks,k->ds", self.leaving, of_key)))

    @lazy
    def leaving(self) -> FloatArray:
        """(d, k, s) 1/s, rates out of a state's region."""
        region = np.arange(self.design.states) // 2
        apart = (region[:, None] != region).astype(float)
        return np.asarray(self.process.leaves * (self.process.arrives @ apart))

    def later(self, state: FloatArray, begin_ns: int, end_ns: int) -> FloatArray:
        """(d, s) at ``end_ns``, of a state (d, s) at ``begin_ns``."""
        first, last = begin_ns // CELL_NS, end_ns // CELL_NS
        if first == last:
            return self._within(state, first, (end_ns - begin_ns) / NANOSECONDS)
        state = self._within(state, first, ((first + 1) * CELL_NS - begin_ns) / NANOSECONDS)
        for low, high in _runs(self.calendar.keys(first + 1, last)):
            state = (state[:, None, :] @ self._over(low, high))[:, 0]
        return self._within(state, last, (end_ns - last * CELL_NS) / NANOSECONDS)

    def regions(self, state: FloatArray) -> FloatArray:
        """(r,) probabilities of the regions, averaged over the draws."""
        return np.asarray((state[:, 0::2] + state[:, 1::2]).mean(axis=0))

    def _within(self, state: FloatArray, cell: int, seconds: float) -> FloatArray:
        if seconds <= 0.0:
            return state
        of, key = self.process, self.calendar.key(cell)
        kept = np.exp(of.rates[:, key] * seconds)[:, None]
        out = (state[:, None, :] @ of.right[:, key] * kept) @ of.left[:, key]
        out = np.clip(out[:, 0], 0.0, None)
        return np.asarray(out / out.sum(axis=1, keepdims=True))

    def _over(self, low: int, high: int) -> FloatArray:
        """(d, s, s) over the cells of one day from the key ``low`` up to ``high``, which is included."""
        known = self._spans.get((low, high))
        if known is None:
            cells = self._cells
            known = cells[:, low] if low == high else self._over(low, high - 1) @ cells[:, high]
            self._spans[low, high] = known
        return known


def _runs(keys: IntArray) -> list[tuple[int, int]]:
    """First and last key of stretches in which keys follow each other within a day."""
    if not len(keys):
        return []
    breaks = np.flatnonzero((np.diff(keys) != 1) | (keys[1:] % PER_DAY == 0)) + 1
    first, last = np.append(0, breaks), np.append(breaks, len(keys)) - 1
    return list(zip(keys[first].tolist(), keys[last].tolist(), strict=True))
