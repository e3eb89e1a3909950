"""A stretch of time with looks in it, cut at the borders of cells and at the looks."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from objstate.geometry import FloatArray, IntArray
from objstate.habits.calendar import CELL_NS, NANOSECONDS, Calendar


class Steps(NamedTuple):
    """Step i lets time pass within one cell; then a look may be taken."""

    keys: IntArray  # (m,) of the cells
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
