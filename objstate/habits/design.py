"""What a habit is described by: smooth functions of the time of day, and a few constants.

The parameters of one habit are a vector ``theta`` (p,). In each cell of the week they give local
parameters ``u`` (LOCAL + regions - 2,), linear in ``theta``: the logarithm of the rate at which a
settled door is moved, the log odds of coming to rest elsewhere than in the first region, and
constants. Functions of the time have values at even distances, between which they are linear.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.habits.calendar import FREE, PER_DAY, WARM, kinds
from objstate.lazy import lazy

# Local parameters: log of moves an hour of a settled door, log odds of resting off the first
# region, log of moves an hour after a brief rest, log odds that a rest is brief in the first
# region, and in others; then log odds of the third region and further ones against the second.
SETTLED, AWAY, BRIEF, BRIEF_FIRST, BRIEF_OTHER, LOCAL = range(6)
CONSTANTS = {  # of these: prior mean and deviation
    BRIEF: (np.log(60.0), 1.3),
    BRIEF_FIRST: (-0.7, 3.5),
    BRIEF_OTHER: (-0.7, 3.5),
}
MEANS = {SETTLED: np.log(0.7), AWAY: -0.7}
SLOW_H, QUICK_H = 4.0, 0.5  # over which functions of the time of day stay similar
LEAST_STD = 0.03  # of a single value
# Of what is added while a building is empty, at night and on free days: prior mean and deviation.
EMPTY = {SETTLED: (-1.5, 1.5), AWAY: (-7.0, 5.0)}
WAKES, FILLED, LEAVES, EMPTIED = 7.0, 8.0, 18.0, 19.0  # h, between which it fills, and empties
REGION_STD = 1.0  # of the log odds among the further regions


class Block(NamedTuple):
    """A function of the time of day that is added to a local parameter on some kinds of days."""

    local: int
    on: int  # FREE, WARM; 0: on all days
    knots: int  # values, at even distances
    level: float  # deviation of its constant
    slow: float  # deviation of what changes over SLOW_H
    quick: float  # deviation of what changes over QUICK_H


ALL = 0
BLOCKS = (
    Block(SETTLED, ALL, 48, 1.5, 1.5, 0.7),
    Block(SETTLED, FREE, 12, 0.7, 0.7, 0.0),
    Block(AWAY, ALL, 96, 1.5, 2.0, 1.0),
    Block(AWAY, FREE, 12, 1.5, 1.0, 0.0),
)
# Of the warm season. A door that is open a twentieth of the time in the one may be shut as seldom in
# the other: log odds that differ by 6, within two deviations.
SEASONAL = (Block(SETTLED, WARM, 12, 0.7, 0.7, 0.0), Block(AWAY, WARM, 12, 3.0, 2.0, 0.0))


@dataclass(frozen=True)
class Design:
    """How parameters become local ones, for doors of so many regions."""

    regions: int
    seasons: bool = False  # whether the warm season has blocks of its own

    @lazy
    def placed(self) -> tuple[tuple[int, Block], ...]:
        """The blocks, each after its first parameter."""
        blocks = BLOCKS + SEASONAL if self.seasons else BLOCKS
        firsts = itertools.accumulate((block.knots for block in blocks), initial=0)
        return tuple(zip(firsts, blocks, strict=False))

    @property
    def locals(self) -> int:
        """How many local parameters a cell has."""
        return LOCAL + self.regions - 2

    @property
    def states(self) -> int:
        """Regions, each settled or brief: state ``2 * region + phase``."""
        return 2 * self.regions

    @lazy
    def parameters(self) -> int:
        """Length of ``theta``."""
        return self._constants + self.locals - 2

    @lazy
    def _empty(self) -> int:
        """Where what is added while a building is empty begins."""
        return sum(block.knots for _, block in self.placed)

    @property
    def _constants(self) -> int:
        """Where the constants begin."""
        return self._empty + len(EMPTY)

    @lazy
    def active(self) -> tuple[IntArray, IntArray, FloatArray]:
        """For each key of a cell (k, a): which parameters matter, for which local one, by how much."""
        keys: list[list[tuple[int, int, float]]] = []
        for kind in range(kinds(self.seasons)):
            for cell in range(PER_DAY):
                rows = [(self._constants + k, AWAY + 1 + k, 1.0) for k in range(self.locals - 2)]
                empty = _empty(kind, 24.0 * (cell + 0.5) / PER_DAY)
                rows += [(self._empty + k, local, empty) for k, local in enumerate(EMPTY)]
                for first, block in self.placed:
                    if kind & block.on == block.on:
                        at = (cell + 0.5) * block.knots / PER_DAY - 0.5
                        low, share = int(np.floor(at)), at - np.floor(at)
                        rows.append((first + low % block.knots, block.local, 1.0 - share))
                        rows.append((first + (low + 1) % block.knots, block.local, share))
                keys.append(rows)
        most = max(len(rows) for rows in keys)
        filled = np.array([rows + [(0, 0, 0.0)] * (most - len(rows)) for rows in keys])
        return (
            filled[..., 0].astype(np.int64),
            filled[..., 1].astype(np.int64),
            filled[..., 2].copy(),
        )

    @lazy
    def matrix(self) -> FloatArray:
        """(k, u, p) from parameters to local ones."""
        which, to, by = self.active
        out = np.zeros((len(which), self.locals, self.parameters))
        np.add.at(out, (np.arange(len(which))[:, None], to, which), by)
        return out

    @lazy
    def level(self) -> FloatArray:
        """(p,) from parameters to the mean logarithm over a day of a settled door's moves an hour."""
        out = np.zeros(self.parameters)
        (first, block), *_ = self.placed  # of SETTLED, on all days
        out[first : first + block.knots] = 1.0 / block.knots
        return out

    @lazy
    def mean(self) -> FloatArray:
        """(p,) prior mean."""
        out = np.zeros(self.parameters)
        for first, block in self.placed:
            if block.on == ALL:
                out[first : first + block.knots] = MEANS[block.local]
        means = [mean for mean, _ in (*EMPTY.values(), *CONSTANTS.values())]
        out[self._empty : self._empty + len(means)] = means
        return out

    @lazy
    def covariance(self) -> FloatArray:
        """(p, p) prior covariance."""
        out = np.zeros((self.parameters, self.parameters))
        for first, block in self.placed:
            at = slice(first, first + block.knots)
            out[at, at] = similarity(block)
        stds = [std for _, std in (*EMPTY.values(), *CONSTANTS.values())]
        stds += [REGION_STD] * (self.regions - 2)
        for k, std in enumerate(stds, start=self._empty):
            out[k, k] = std**2
        return out


def _empty(kind: int, hour: float) -> float:
    """How empty a building is, 0 to 1."""
    return (
        1.0
        if kind & FREE
        else float(np.interp(hour, [WAKES, FILLED, LEAVES, EMPTIED], [1.0, 0.0, 0.0, 1.0]))
    )


def similarity(block: Block) -> FloatArray:
    """(n, n) covariance of a function's values, by the time of day between them."""
    hours = np.arange(block.knots) * 24.0 / block.knots
    apart = np.sin(np.pi * (hours[:, None] - hours) / 24.0) * 24.0 / np.pi
    out = block.level**2 + LEAST_STD**2 * np.eye(block.knots)
    for std, length in ((block.slow, SLOW_H), (block.quick, QUICK_H)):
        out += std**2 * np.exp(-0.5 * (apart / length) ** 2)
    return np.asarray(out)
