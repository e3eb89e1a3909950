"""The movements of objects in a result."""

from __future__ import annotations

from collections.abc import Sequence

from objstate.order import natural_key
from objstate.recording.events import Event
from objstate.report.markup import Cell, table, text
from objstate.report.reading import figure

HEADINGS = ("object", "state", "event", "between (s)", "from", "to", "probability")


def events_table(events: Sequence[Event], begin_ns: int) -> str:
    """A row for each coordinate of each event, sortable."""
    ordered = sorted(events, key=lambda event: (natural_key(event.object), event.from_ns))
    return table(HEADINGS, [_row(each, begin_ns) for each in ordered], "sortable")


def _row(event: Event, begin_ns: int) -> list[str | Cell]:
    begin, end = ((stamp - begin_ns) / 1e9 for stamp in (event.from_ns, event.to_ns))
    return [
        text(event.object),
        text(event.coordinate),
        text(f"{event.kind} and back" if event.has_returned else event.kind),
        Cell(f"{begin:.1f} to {end:.1f}", begin),
        text(figure(event.coordinate, event.from_state)),
        text(figure(event.coordinate, event.to_state)),
        f"{event.probability:.0%}",
    ]
