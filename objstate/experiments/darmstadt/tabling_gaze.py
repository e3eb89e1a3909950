"""Tables of where the camera looked: coverage, staring, the search for a gaze, and run time."""

from __future__ import annotations

import math
from collections.abc import Sequence

from objstate.experiments.darmstadt.coverage import (
    ACTIVE,
    CELLWISE,
    EXACT,
    INHIBITED,
    LOOKING,
    SWEEP,
    TRACKING,
    Coverage,
)
from objstate.experiments.darmstadt.intervals import spread
from objstate.experiments.darmstadt.runtime import RunTime
from objstate.experiments.darmstadt.search import Search
from objstate.experiments.tables import Table

Shares = dict[str, tuple[float, float, float]]  # field, front, ball, in %

TABLE_7_6: Shares = {
    ACTIVE: (75.02, 99.64, 79.99),
    SWEEP: (87.69, 92.33, 71.98),
    TRACKING: (41.45, 75.38, 99.26),
}
TABLE_7_7: Shares = {ACTIVE: (75.31, 100.0, 79.96), LOOKING: (53.33, 45.02, 97.01)}
PAPER_MS = 3.8, 9.9  # occupancy and entropy grid map, table 7.3
PAPER_SAVED = (87 - 52) / (78 - 52)  # the CPU's load by both, without and with the table, table 7.2


def coverage_table(found: Sequence[Coverage], walking: bool) -> Table:
    """Table 7.6, or 7.7."""
    paper = TABLE_7_7 if walking else TABLE_7_6
    rows = []
    for name in dict.fromkeys(one.behaviour for one in found):
        own = [one for one in found if one.behaviour == name]
        shares = (
            [one.observed for one in own],
            [one.front for one in own],
            [one.ball for one in own],
        )
        cells = [name]
        for k, values in enumerate(shares):
            cells += [f"{paper[name][k]:.1f}" if name in paper else "-", spread(values, 1, 100.0)]
        rows.append(tuple(cells))
    title = "Coverage, walking (table 7.7)" if walking else "Coverage, standing (table 7.6)"
    columns = ("%, thesis and here", "field", "here", "front", "here", "ball", "here")
    return Table(title, columns, tuple(rows), "Means of one minute, 95 % intervals over seeds.")


def staring_table(found: Sequence[Coverage]) -> Table:
    """Section 7.5; the thesis has pictures."""
    rows = []
    for name in (SWEEP, TRACKING, LOOKING, CELLWISE, ACTIVE, INHIBITED, EXACT):
        cells = [name]
        for walking in (False, True):
            own = [one for one in found if one.behaviour == name and one.walking is walking]
            cells.append(spread((one.staring for one in own), 1, 100.0))
            cells.append(spread((math.degrees(one.travel) / 60.0 for one in own), 0))
        rows.append(tuple(cells))
    note = (
        "Staring: the share of time, %, in which the camera looks within 10 degrees of where it looked "
        "2 s before. Travel: of pan and tilt together, degrees a second."
    )
    columns = ("", "standing: stares", "travel", "walking: stares", "travel")
    return Table("Inhibition of return (section 7.5)", columns, tuple(rows), note)


def search_table(found: Sequence[Search]) -> Table:
    """What particles lose."""
    rows = tuple(
        (
            each.method,
            str(each.particles) if each.particles else "all views",
            f"{each.apart:g}" if each.particles else "-",
            spread(each.shares, 0, 100.0),
        )
        for each in found
    )
    note = "The entropy of the chosen view, eq. (6.36), in % of the largest that the neck allows."
    columns = ("search", "candidates", "apart, m", "found, %")
    return Table("Particles and the best of all views", columns, rows, note)


def runtime_table(found: RunTime) -> Table:
    """Tables 7.1 to 7.3, as ratios."""
    occupancy, entropies = PAPER_MS
    table, logarithms = found.entropy_part("table"), found.entropy_part("logarithms")
    without, saved = found.occupancy + logarithms, found.occupancy + table
    rows = (
        ("occupancy part, ms", f"{occupancy:g}", f"{found.occupancy:.2f}"),
        ("entropy part with table, ms", f"{entropies:g}", f"{table:.2f}"),
        ("entropy part : occupancy part", *(f"{x:.1f}" for x in (entropies / occupancy, table / found.occupancy))),
        ("both, without : with table", f"{PAPER_SAVED:.2f}", f"{without / saved:.2f}"),
        (
            "entropy of all cells, without : with table",
            "-",
            f"{found.entropies['logarithms'] / found.entropies['table']:.1f}",
        ),
        ("entropy of all cells by table, ms", "-", f"{found.entropies['table']:.3f}"),
        ("the same by a series, ms", "-", f"{found.entropies['series']:.3f}"),
        ("search by particles, ms", "-", f"{found.particles:.2f}"),
        ("best of all views by windows, ms", "-", f"{found.windows:.2f}"),
    )  # fmt: skip
    note = "Medians over pictures; times differ from run to run."
    return Table("Run time (section 7.1)", ("", "thesis", "here"), rows, note)
