"""The table of what is known of each object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from objstate.cli.tables import new_table, percent

if TYPE_CHECKING:
    from rich.table import Table

    from objstate.evaluation import LatestState
    from objstate.recording.events import Event
    from objstate.records import Estimate


def state_table(states: Sequence[LatestState], begin_ns: int, with_truth: bool) -> Table:
    """Each coordinate with its 90 % interval and the time at which a scan last reached it.

    ``begin_ns`` is the stamp from which "seen at" counts. Where there is furniture, also its
    presence.
    """
    from objstate.building.model import COORDINATES, Kind

    truth = ("truth", "error") if with_truth else ()
    of_furniture = COORDINATES[Kind.PLANAR]
    with_presence = any(state.estimate.coordinate in of_furniture for state in states)
    there = ("there (%)",) if with_presence else ()
    numbers = ("estimate", "90 % interval", *truth, *there, "seen at (s)")
    table = new_table("", ("object", "state"), numbers)
    for state in states:
        table.add_row(*_cells(state, begin_ns, with_truth, with_presence))
    return table


def events_table(events: Sequence[Event], begin_ns: int) -> Table:
    """When each object was moved, and from where to where; seconds count from ``begin_ns``."""
    table = new_table(
        "Moved", ("object", "state"), ("between (s)", "from", "to", "probability (%)")
    )
    for event in events:
        begin, end = ((stamp - begin_ns) / 1e9 for stamp in (event.from_ns, event.to_ns))
        table.add_row(
            event.object,
            label(event.coordinate),
            f"{begin:.1f} to {end:.1f}",
            figure(event.coordinate, event.from_state),
            figure(event.coordinate, event.to_state),
            percent(event.probability),
        )
    return table


def label(coordinate: str) -> str:
    """A coordinate with its unit as people read it."""
    from objstate.evaluation.units import UNITS

    return f"{coordinate} ({UNITS[coordinate][0]})"


def figure(coordinate: str, value: float | None) -> str:
    """A value of a coordinate (rad, m) as people read it."""
    from objstate.evaluation.units import UNITS

    _, factor, decimals = UNITS[coordinate]
    return "-" if value is None else f"{factor * value:z.{decimals}f}"


def span(estimate: Estimate) -> str:
    """The 90 % interval of an estimate as people read it."""
    lower, upper = (figure(estimate.coordinate, v) for v in (estimate.lower, estimate.upper))
    return f"{lower} to {upper}"


def _cells(state: LatestState, begin_ns: int, with_truth: bool, with_presence: bool) -> list[str]:
    estimate = state.estimate
    coordinate = estimate.coordinate
    truth = [figure(coordinate, state.truth), figure(coordinate, state.error)]
    seen = f"{(estimate.stamp_ns - begin_ns) / 1e9:.1f}" if estimate.observed else "never"
    return [
        estimate.object,
        label(coordinate),
        figure(coordinate, estimate.value),
        span(estimate),
        *(truth if with_truth else []),
        *([percent(estimate.presence)] if with_presence else []),
        seen,
    ]
