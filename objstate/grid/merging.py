"""Maps and drawings merged cell by cell (Darmstadt, section 6.1.3, algorithms 1 and 2).

A merge takes the values a map has and those of an update, (n,) either, and returns the new ones.

Line 2 of algorithm 1 keeps the map's cell when no ignored value is given; the text says the
opposite, that all updates are made then. Here the text is followed: an update that equals the
ignored value is skipped.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from objstate.errors import GridError
from objstate.grid.layout import Layout

Values = NDArray[np.float32]
Merge = Callable[[Values, Values], Values]

CERTAIN = 1e-6  # probabilities closer to 0 or 1 count as these


def bayes(values: Values, update: Values) -> Values:
    """Bayes' rule with an even prior, eq. (2.10); contradictory certainties give 0.5."""
    a, b = (np.clip(each.astype(float), CERTAIN, 1.0 - CERTAIN) for each in (values, update))
    occupied = a * b
    return np.asarray(occupied / (occupied + (1.0 - a) * (1.0 - b)), dtype=np.float32)


def either(values: Values, update: Values) -> Values:
    """The probability that a cell is occupied by the one or the other of two independent things."""
    return np.asarray(values + update - values * update, dtype=np.float32)


def maximum(values: Values, update: Values) -> Values:
    """The larger value."""
    return np.maximum(values, update)


def overwrite(values: Values, update: Values) -> Values:
    """The value of the update."""
    return np.asarray(update, dtype=np.float32)


def add(values: Values, update: Values) -> Values:
    """The sum, as of entropies."""
    return values + update


MERGES: dict[str, Merge] = {
    "bayes": bayes,
    "either": either,
    "maximum": maximum,
    "overwrite": overwrite,
    "add": add,
}


def merged(values: Values, update: Values, merge: Merge, ignored: float | None = None) -> Values:
    """A map (rows, columns) with another of the same cells merged into it.

    Where the update has the value ``ignored``, the map stays as it is. Raises GridError for maps of
    different sizes and for values that are not finite.
    """
    if values.shape != update.shape:
        raise GridError(
            f"A map of {shape(update)} can't be merged into one of {shape(values)}; resample it to "
            "the other's layout first."
        )
    for each in (values, update):
        if not np.isfinite(each).all():
            row, column = np.argwhere(~np.isfinite(each))[0]
            raise GridError(
                f"A map that is merged holds {each[row, column]} in row {row}, column {column}; "
                "give 0.5 where nothing is known."
            )
    result = merge(values, update)
    return result if ignored is None else np.where(update == np.float32(ignored), values, result)


def shape(values: Values) -> str:
    """Its size in words."""
    return " by ".join(map(str, values.shape)) + " cells"


def resampled(values: Values, layout: Layout, onto: Layout, outside: float = 0.5) -> Values:
    """A map (rows, columns) in the cells of another layout, of any origin, heading and resolution.

    A cell takes the largest value of those that it covers, so that no obstacle is lost in larger
    cells, and ``outside`` where the map doesn't reach. Raises GridError where the frames differ.
    """
    onto.require_frame(layout.frame)
    if values.shape != layout.shape:
        raise GridError(
            f"A map of {shape(values)} doesn't fit a layout of {layout.rows} by {layout.columns} "
            "cells."
        )
    if layout.same_cells(onto):
        return values.copy()
    count = max(1, int(np.ceil(onto.resolution / layout.resolution - 1e-9)))
    result = np.full(onto.shape, -np.inf, dtype=np.float32)
    offsets = (np.arange(count) + 0.5) / count - 0.5
    row, column = np.arange(onto.rows) + 0.5, np.arange(onto.columns) + 0.5
    for up in offsets:
        for right in offsets:
            cells = np.stack(np.meshgrid(column + right, row + up), axis=-1)
            at = layout.to_cells(onto.to_frame(cells))
            inside = layout.within(at)
            sampled = np.full(onto.shape, outside, dtype=np.float32)
            low = at[inside].astype(np.int64)
            sampled[inside] = values[low[:, 1], low[:, 0]]
            np.maximum(result, sampled, out=result)
    return result
