"""A stretch of time with looks in it, cut at the borders of cells and at the looks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.habits.calendar import CELL_NS, CELL_S, NANOSECONDS, PER_DAY, Calendar


class Steps(NamedTuple):
    """Step i lets time pass within one cell; then a look may be taken."""

    keys: IntArray  # (m,) of the cells; of whole days, see ``by_days``, past those of all cells
    seconds: FloatArray  # (m,)
    looks: IntArray  # (m,) which look follows; -1: none


def steps(
    calendar: Calendar, begin_ns: int, stamps_ns: IntArray, end_ns: int | None = None
) -> Steps:
    """From ``begin_ns`` over looks at ``stamps_ns`` (n,), ascending, to the last or to ``end_ns``."""
    last = int(end_ns if end_ns is not None else stamps_ns[-1])
    first_cell, last_cell = begin_ns // CELL_NS, last // CELL_NS
    borders = np.arange(first_cell + 1, last_cell + 1, dtype=np.int64) * CELL_NS
    ends = [borders, stamps_ns] if end_ns is None else [borders, stamps_ns, np.array([last])]
    moments = np.concatenate(ends)
    which = np.full(len(moments), -1)
    which[len(borders) : len(borders) + len(stamps_ns)] = np.arange(len(stamps_ns))
    order = np.argsort(moments, kind="stable")
    moments, which = moments[order], which[order]
    since = np.concatenate([[begin_ns], moments[:-1]])
    keys = calendar.keys(first_cell, last_cell + 1)[since // CELL_NS - first_cell]
    return Steps(keys, (moments - since) / NANOSECONDS, which)


def by_days(of: Steps, kinds: int, least: int) -> Steps:
    """The steps with one in place of those of each whole day without a look.

    There are so many ``kinds`` of days. A day of kind k has the key ``kinds * PER_DAY + k``. Of
    kinds that come fewer than ``least`` times the cells stay.
    """
    is_whole = (of.seconds == CELL_S) & (of.looks < 0)
    before = np.concatenate([[0], np.cumsum(is_whole)])
    begins = np.flatnonzero(of.keys[: max(len(of.keys) - PER_DAY + 1, 0)] % PER_DAY == 0)
    ends, last = begins + PER_DAY, begins + PER_DAY - 1
    is_day = (before[ends] - before[begins] == PER_DAY) & (
        of.keys[last] - of.keys[begins] == PER_DAY - 1
    )
    begins, of_kind = begins[is_day], of.keys[begins[is_day]] // PER_DAY
    begins = begins[np.bincount(of_kind, minlength=kinds)[of_kind] >= least]
    keys, seconds, stays = of.keys.copy(), of.seconds.copy(), np.ones(len(of.keys), dtype=bool)
    stays[(begins[:, None] + np.arange(1, PER_DAY)).ravel()] = False
    keys[begins] = kinds * PER_DAY + keys[begins] // PER_DAY
    seconds[begins] = PER_DAY * CELL_S
    return Steps(keys[stays], seconds[stays], of.looks[stays])
