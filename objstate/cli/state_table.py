"""The table of what is known of each object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from objstate.cli.tables import new_table

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.evaluation import LatestState


def state_table(states: Sequence[LatestState], begin_ns: int, with_truth: bool) -> Table:
    """Each coordinate with its 90 % interval and when a scan last bore on it.

    ``begin_ns`` is the stamp from which "last seen" counts.
    """
    truth = ("truth", "error") if with_truth else ()
    numbers = ("estimate", "90 % interval", *truth, "last seen (s)")
    table = new_table("", ("object", "state"), numbers)
    for state in states:
        table.add_row(*_cells(state, begin_ns, with_truth))
    return table


def _cells(state: LatestState, begin_ns: int, with_truth: bool) -> list[str]:
    estimate = state.estimate
    from objstate.evaluation.units import UNITS

    unit, factor, decimals = UNITS[estimate.coordinate]

    def figure(value: float | None) -> str:
        return "-" if value is None else f"{factor * value:z.{decimals}f}"

    seen = f"{(estimate.stamp_ns - begin_ns) / 1e9:.1f}" if estimate.observed else "never"
    return [
        estimate.object,
        f"{estimate.coordinate} ({unit})",
        figure(estimate.mean),
        f"{figure(estimate.lower)} to {figure(estimate.upper)}",
        *([figure(state.truth), figure(state.error)] if with_truth else []),
        seen,
    ]
