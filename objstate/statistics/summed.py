"""Looks at a door, summed by the minute, so that years of them are stored in few numbers.

The statistics of a door need only sums: the numbers of looks in a minute and of those that saw it
open, and the numbers of pairs of neighbouring looks by gap and states. Only the first and the last
look of a minute have neighbours outside it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray

MINUTE_NS = 60 * 10**9
GAP_STEP = 0.05  # in the logarithm: gaps between looks that differ by less count as equal


@dataclass(frozen=True, eq=False)
class Summed:
    """The looks at one door, by the minute; minutes may occur twice, where two robots looked."""

    minutes: IntArray  # (m,) since 1970
    counts: IntArray  # (m,) looks
    open: IntArray  # (m,) of them saw it open
    seconds: FloatArray  # (m,) s, sum of the looks' times after the minute's begin
    first_ns: IntArray  # (m,) stamp of the first look, ascending
    last_ns: IntArray  # (m,) and of the last
    first_open: BoolArray  # (m,) what they saw
    last_open: BoolArray  # (m,)
    steps: (
        IntArray  # (g,) gaps between neighbours of one minute, in GAP_STEP of their logarithm in s
    )
    pairs: IntArray  # (g, 4) how often such neighbours saw 0-0, 0-1, 1-0 and 1-1

    @staticmethod
    def of(stamps_ns: IntArray, open_: BoolArray) -> Summed:
        """The sums of looks (n,) in order of time."""
        minutes = stamps_ns // MINUTE_NS
        begins = np.flatnonzero(np.diff(minutes, prepend=-1))
        ends = np.append(begins[1:], len(minutes)) - 1 if len(begins) else begins
        cell = np.repeat(np.arange(len(begins)), ends - begins + 1)
        inner = np.flatnonzero(np.diff(cell) == 0)
        steps, pairs = _counted(
            stamps_ns[inner + 1] - stamps_ns[inner], open_[inner], open_[inner + 1]
        )
        return Summed(
            minutes=minutes[begins],
            counts=ends - begins + 1,
            open=_total(cell, open_, len(begins)).astype(np.int64),
            seconds=_total(cell, (stamps_ns % MINUTE_NS) / 1e9, len(begins)),
            first_ns=stamps_ns[begins],
            last_ns=stamps_ns[ends],
            first_open=open_[begins],
            last_open=open_[ends],
            steps=steps,
            pairs=pairs,
        )

    @staticmethod
    def joined(parts: Iterable[Summed]) -> Summed:
        """The looks of several logs together, at least one; of one minute, log after log."""
        known = list(parts)
        order = np.argsort(np.concatenate([part.first_ns for part in known]), kind="stable")
        cells = {
            name: np.concatenate([getattr(part, name) for part in known])[order] for name in CELLS
        }
        steps, pairs = _added(
            np.concatenate([part.steps for part in known]),
            np.concatenate([part.pairs for part in known]),
        )
        return Summed(**cells, steps=steps, pairs=pairs)

    def __len__(self) -> int:
        return int(self.counts.sum())

    @property
    def moves_seen(self) -> int:
        """Neighbouring looks of which one saw it open and one closed."""
        return int(self.neighbours()[1][:, 1:3].sum())

    def neighbours(self) -> tuple[FloatArray, IntArray]:
        """Gaps (g,) in s, and numbers (g, 4) of looks that saw 0-0, 0-1, 1-0 and 1-1."""
        steps, pairs = _counted(
            self.first_ns[1:] - self.last_ns[:-1], self.last_open[:-1], self.first_open[1:]
        )
        steps, pairs = _added(
            np.concatenate([self.steps, steps]), np.concatenate([self.pairs, pairs])
        )
        return np.exp(steps * GAP_STEP), pairs

    def chosen(self, which: BoolArray) -> Summed:
        """The looks of some minutes; their neighbours are those of all."""
        cells = {name: getattr(self, name)[which] for name in CELLS}
        return Summed(**cells, steps=self.steps, pairs=self.pairs)


CELLS = (
    "minutes", "counts", "open", "seconds", "first_ns", "last_ns", "first_open", "last_open",
)  # fmt: skip


def _counted(gaps_ns: IntArray, before: BoolArray, after: BoolArray) -> tuple[IntArray, IntArray]:
    """Steps of gaps (g,), and the numbers (g, 4) of each pair of states."""
    steps = np.round(np.log(np.maximum(gaps_ns, 1) / 1e9) / GAP_STEP).astype(np.int64)
    kinds = 2 * before.astype(np.int64) + after
    pairs = np.zeros((len(steps), 4), dtype=np.int64)
    pairs[np.arange(len(steps)), kinds] = 1
    return _added(steps, pairs)


def _added(steps: IntArray, pairs: IntArray) -> tuple[IntArray, IntArray]:
    """Equal steps as one."""
    known, place = np.unique(steps, return_inverse=True)
    total = np.zeros((len(known), 4), dtype=np.int64)
    np.add.at(total, place, pairs)
    return known, total


def _total(cell: IntArray, values: FloatArray | BoolArray, count: int) -> FloatArray:
    return np.bincount(cell, weights=values, minlength=count).astype(float)
