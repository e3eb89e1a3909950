"""Tables with the thesis' figures beside what came out."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from objstate.experiments.darmstadt.accuracy import PLACES, Accuracy, Validity
from objstate.experiments.darmstadt.intervals import spread
from objstate.experiments.tables import Table

SECTOR_MODEL, OCCUPIED, FREE = "sector model", "occupied state", "free state"
TABLE_7_5 = {
    SECTOR_MODEL: (227.92, 227.2, 383.0),
    OCCUPIED: (33.0, 50.69, 192.55),
    FREE: (40.22, 44.69, 43.9),
}  # mm
THREE_PLUS_ONE = "Three poles and a box (section 7.2)"


def accuracy_table(found: Sequence[Accuracy]) -> Table:
    """Table 7.5."""
    picked: dict[str, Callable[[Accuracy], float]] = {
        SECTOR_MODEL: lambda one: one.sector,
        OCCUPIED: lambda one: one.occupied,
        FREE: lambda one: one.free,
    }
    rows = []
    for name, pick in picked.items():
        for place, (x, y) in enumerate(PLACES):
            values = [pick(one) for one in found if one.place == place]
            paper = f"{TABLE_7_5[name][place]:.0f}"
            rows.append((name, f"{x:g} m, {y:g} m", paper, spread(values, 0, 1000.0)))
    note = (
        "Deviations about no error, mm, with 95 % intervals of the mean over seeds. Errors of occupied "
        "cells, of free cells that the pole touches, and of the sectors' points, from the pole's outline."
    )
    return Table("Accuracy (table 7.5)", ("σ of", "pole at", "thesis", "here"), tuple(rows), note)


def validity_table(found: Sequence[Validity]) -> Table:
    """Figure 7.2 in numbers; the thesis gives none."""
    rows = (
        (
            "obstacles found, of 4",
            "4",
            spread((4 * one.found_by_grid for one in found), 2),
            "4",
            spread((4 * one.found_by_sectors for one in found), 2),
        ),
        (
            "phantoms at a time",
            "0",
            f"{spread((one.phantom_cells for one in found), 2)} cells",
            "2",
            f"{spread((one.phantom_sectors for one in found), 2)} sectors",
        ),
    )
    columns = ("", "grid, fig. 7.2c", "grid, here", "sectors, fig. 7.2b", "sectors, here")
    note = "Phantoms are occupied though no obstacle is within 25 cm."
    return Table(THREE_PLUS_ONE, columns, rows, note)
