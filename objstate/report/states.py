"""The table of the objects' states, which the page's script keeps at the moment that is shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from objstate.building.model import COORDINATES, Kind
from objstate.evaluation import LatestState
from objstate.evaluation.units import UNITS
from objstate.order import natural_key
from objstate.recording.tables import P_CLOSED
from objstate.report.judgement import Judged
from objstate.report.markup import Cell, Row, table, text
from objstate.report.material import Material
from objstate.report.reading import figure

if TYPE_CHECKING:
    import polars as pl

FOLLOWED = (("estimate", "median"), ("90 % interval", "interval"), ("seen at", "seen"))
LEAST_PRESENCE = 0.995  # a smaller probability of being there at all is worth a column's word


def states_table(
    material: Material,
    latest: Sequence[LatestState],
    verdicts: Sequence[Judged],
    numbers: Mapping[str, int],
) -> str:
    """Every object's last state, the worst first: by the truth where known, else by width."""
    by_state = {
        (each.state.estimate.object, each.state.estimate.coordinate): each for each in verdicts
    }
    furniture = COORDINATES[Kind.PLANAR]
    with_presence = any(
        state.estimate.coordinate in furniture and state.estimate.presence < LEAST_PRESENCE
        for state in latest
    )
    with_truth = material.truth is not None
    headings = [
        "object", "state", *(label for label, _ in FOLLOWED),
        *(("there",) if with_presence else ()), *(("truth", "error") if with_truth else ()),
    ]  # fmt: skip
    closed = _closed(material.estimates)
    rows = [
        _row(material, state, by_state, numbers, closed, with_presence, with_truth)
        for state in sorted(latest, key=lambda state: _rank(state, by_state))
    ]
    return table(headings, rows, "sortable filterable states")


def _rank(
    state: LatestState, by_state: Mapping[tuple[str, str], Judged]
) -> tuple[int, float, tuple[object, ...]]:
    """The worst first; what is right, and without truth all, by name."""
    name = natural_key(state.estimate.object)
    found = by_state.get((state.estimate.object, state.estimate.coordinate))
    if found is None or found.verdict == "right":
        return (0, 0.0, name)
    severity, badness = found.rank
    return (-severity, -badness, name)


def _row(
    material: Material,
    state: LatestState,
    by_state: Mapping[tuple[str, str], Judged],
    numbers: Mapping[str, int],
    closed: Mapping[tuple[str, int], float],
    with_presence: bool,
    with_truth: bool,
) -> Row:
    estimate = state.estimate
    kind = estimate.coordinate
    found = by_state.get((estimate.object, kind))
    seconds = (estimate.stamp_ns - material.begin_ns) / 1e9
    middle = figure(kind, estimate.value)
    share = closed.get((estimate.object, estimate.stamp_ns))
    said = middle if share is None else f"{closed_text(share)}, {middle}"
    cells: list[str | Cell] = [
        text(estimate.object),
        text(kind),
        Cell(text(said), round(estimate.value, 5), "median"),
        Cell(text(interval(state)), round(estimate.upper - estimate.lower, 6), "interval"),
        Cell(
            f"{seconds:.1f} s" if estimate.observed else "never",
            round(seconds, 1) if estimate.observed else -1,
            "seen",
        ),
    ]
    if with_presence:
        cells.append(Cell(f"{estimate.presence:.0%}", round(estimate.presence, 4)))
    if with_truth:
        error = None if found is None else round(found.badness, 4)
        cells += [
            Cell(text(figure(kind, state.truth)), state.truth, "truth"),
            Cell(text(figure(kind, state.error)), error, "error"),
        ]
    attributes = {
        "data_object": numbers[estimate.object],
        "data_coordinate": kind,
        "class_": None if found is None else found.verdict,
    }
    return Row(cells, attributes)


def interval(state: LatestState) -> str:
    """The 90 % interval, with its unit once."""
    kind = state.estimate.coordinate
    _, factor, decimals = UNITS[kind]
    return f"{factor * state.estimate.lower:z.{decimals}f} to {figure(kind, state.estimate.upper)}"


def closed_text(share: float) -> str:
    """Whether a door is closed: the more probable alternative, with its probability."""
    percent = round(100 * share)
    return f"closed {percent} %" if percent >= 50 else f"open {100 - percent} %"


def _closed(estimates: pl.DataFrame) -> dict[tuple[str, int], float]:
    """The probability that each door was closed, by name and stamp, where there is one."""
    import polars as pl

    if P_CLOSED not in estimates.columns:
        return {}
    known = estimates.filter(pl.col(P_CLOSED).is_not_null() & pl.col(P_CLOSED).is_not_nan())
    return {
        (name, stamp): share
        for name, stamp, share in known.select("object", "stamp", P_CLOSED).iter_rows()
    }
