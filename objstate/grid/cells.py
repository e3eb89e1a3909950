"""Models of cells: content, update and ageing (Darmstadt, sections 2.4.1 and 6.1.2).

A model serves all cells of a grid. Its fields are arrays, so that reading a map of a million cells
is one pass over memory. Evidence lies between 0 (free) and 1 (occupied); 0.5 says nothing.

All models age alike: a cell is as good as new for a reading of full weight, and its reliability
falls to zero within ``max_age_s``, eq. (6.2). Aged cells are read nearer to 0.5, eq. (6.4), and
lose what they hold only when the reliability is zero. Stored is the time at which that will be, so
that ageing costs nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from objstate.errors import GridError
from objstate.lazy import Later

if TYPE_CHECKING:
    from objstate.grid import rasters
else:
    rasters = Later("objstate.grid.rasters")

Plane = NDArray[np.float32]  # (n,) one number per cell
Flat = NDArray[np.int32]  # (m,) indices of cells, row by row
Fields = tuple[Plane, ...]  # what all cells hold; the last field is when their reliability ends, s

AGELESS_S = 1e9  # s; cells keep what they hold for 30 years
NEVER = -np.inf  # when the reliability of a cell ended that was never touched


class CellModel(Protocol):
    """What a grid asks of its cells (Darmstadt, appendix 9.1)."""

    @property
    def max_age_s(self) -> float:
        """s without evidence after which a cell is as if it had never been touched."""

    def empty(self, size: int) -> Fields:
        """The fields of cells (n,) that were never touched."""

    def update(self, fields: Fields, where: Flat, evidence: Plane, at: float) -> None:
        """Take evidence (m,) on cells ``where`` (m,), each at most once, in at a time, s."""

    def assign(self, fields: Fields, where: Flat, values: Plane, at: float) -> None:
        """Let cells ``where`` (m,) have values (m,) at a time, s, with full reliability."""

    def values(self, fields: Fields, at: float) -> Plane:
        """Probabilities (n,) at a time, s, that cells are occupied."""


def _check(model: CellModel, **shares: float) -> None:
    if not 0.0 < model.max_age_s <= AGELESS_S:
        raise GridError(
            f"Cells can't age within {model.max_age_s:g} s; give max_age_s above 0 and up to "
            f"{AGELESS_S:g} s."
        )
    for name, share in shares.items():
        if not 0.0 < share <= 1.0:
            raise GridError(f"Cells can't have {name} {share:g}; give a number above 0, up to 1.")


def _empty(size: int, *first: float) -> Fields:
    return tuple(np.full(size, value, dtype=np.float32) for value in (*first, NEVER))


@dataclass(frozen=True)
class BayesCells:
    """Each cell holds its probability, updated by Bayes' rule, eq. (2.10)."""

    trust: float = 0.8  # evidence of 1 is a sensor that is right with 0.5 + trust / 2
    most: float = 0.97  # beliefs stay below, and above 1 - most, so that a cell can change
    max_age_s: float = AGELESS_S

    def __post_init__(self) -> None:
        _check(self, trust=self.trust, most=self.most)
        if self.trust == 1.0 or not 0.5 < self.most < 1.0:
            raise GridError("trust has to be below 1, and most between 0.5 and 1.")

    def empty(self, size: int) -> Fields:
        """As the protocol has it."""
        return _empty(size, rasters.UNKNOWN)

    def update(self, fields: Fields, where: Flat, evidence: Plane, at: float) -> None:
        """As the protocol has it."""
        belief, expires = fields
        rasters.update_bayes(
            belief, expires, where, evidence, at, self.max_age_s, self.trust, self.most
        )

    def assign(self, fields: Fields, where: Flat, values: Plane, at: float) -> None:
        """As the protocol has it."""
        fields[0][where] = np.clip(values, 1.0 - self.most, self.most)
        fields[-1][where] = at + self.max_age_s

    def values(self, fields: Fields, at: float) -> Plane:
        """As the protocol has it."""
        belief, expires = fields
        values = np.empty_like(belief)
        rasters.read_beliefs(belief, expires, at, self.max_age_s, values)
        return values


@dataclass(frozen=True)
class LogOddsCells(BayesCells):
    """The same by sums of log odds, eqs. (2.12) and (2.14)."""

    def empty(self, size: int) -> Fields:
        """As the protocol has it."""
        return _empty(size, 0.0)

    def update(self, fields: Fields, where: Flat, evidence: Plane, at: float) -> None:
        """As the protocol has it."""
        log_odds, expires = fields
        rasters.update_log_odds(
            log_odds, expires, where, evidence, at, self.max_age_s, self.trust, self.most
        )

    def assign(self, fields: Fields, where: Flat, values: Plane, at: float) -> None:
        """As the protocol has it."""
        bounded = np.clip(values, 1.0 - self.most, self.most)
        fields[0][where] = np.log(bounded / (1.0 - bounded))
        fields[-1][where] = at + self.max_age_s

    def values(self, fields: Fields, at: float) -> Plane:
        """As the protocol has it."""
        log_odds, expires = fields
        one, values = np.float32(1.0), np.empty_like(log_odds)
        rasters.read_beliefs(
            one - one / (one + np.exp(log_odds)), expires, at, self.max_age_s, values
        )
        return values


@dataclass(frozen=True)
class CountCells:
    """Each cell counts how often it was seen free and occupied, eqs. (6.1) to (6.7).

    Evidence of weight w (1 when certain) renews the reliability by w; the thesis leaves this open.
    So a cell seen once from far away has little reliability, although all its counts agree.
    """

    max_age_s: float = 60.0
    max_count: float = 10.0  # c_max of eq. (6.5)

    def __post_init__(self) -> None:
        _check(self)
        if not 1.0 <= self.max_count <= 1e6:
            raise GridError(f"Cells can't count to {self.max_count:g}; give 1 or more, up to 1e6.")

    def empty(self, size: int) -> Fields:
        """As the protocol has it."""
        return _empty(size, 0.0, 0.0)

    def update(self, fields: Fields, where: Flat, evidence: Plane, at: float) -> None:
        """As the protocol has it."""
        free, occupied, expires = fields
        rasters.update_counts(
            free, occupied, expires, where, evidence, at, self.max_age_s, self.max_count
        )

    def assign(self, fields: Fields, where: Flat, values: Plane, at: float) -> None:
        """As the protocol has it."""
        fields[0][where], fields[1][where] = 1.0 - values, values
        fields[-1][where] = at + self.max_age_s

    def values(self, fields: Fields, at: float) -> Plane:
        """As the protocol has it."""
        free, occupied, expires = fields
        values = np.empty_like(free)
        rasters.read_counts(free, occupied, expires, at, self.max_age_s, values)
        return values


@dataclass(frozen=True)
class AverageCells:
    """Counts that are exponential moving averages, eq. (6.8)."""

    alpha: float = 0.3  # weight of the latest reading
    max_age_s: float = 60.0

    def __post_init__(self) -> None:
        _check(self, alpha=self.alpha)

    def empty(self, size: int) -> Fields:
        """As the protocol has it."""
        return _empty(size, 0.0, 0.0)

    def update(self, fields: Fields, where: Flat, evidence: Plane, at: float) -> None:
        """As the protocol has it."""
        free, occupied, expires = fields
        rasters.update_averages(
            free, occupied, expires, where, evidence, at, self.max_age_s, self.alpha
        )

    def assign(self, fields: Fields, where: Flat, values: Plane, at: float) -> None:
        """As the protocol has it."""
        fields[0][where], fields[1][where] = 1.0 - values, values
        fields[-1][where] = at + self.max_age_s

    def values(self, fields: Fields, at: float) -> Plane:
        """As the protocol has it."""
        free, occupied, expires = fields
        values = np.empty_like(free)
        rasters.read_counts(free, occupied, expires, at, self.max_age_s, values)
        return values
