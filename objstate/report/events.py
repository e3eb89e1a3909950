"""When objects were moved, as far as a result tells it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from objstate.building.model import Building
from objstate.order import natural_key
from objstate.report.markup import Cell, table, text
from objstate.report.reading import figure

EVENTS = "events.parquet"
COLUMNS = ("object", "from_ns", "to_ns", "from_state", "to_state", "probability")
HEADINGS = ("object", "between (s)", "from", "to", "probability")


@dataclass(frozen=True)
class Event:
    """An object was moved between two moments."""

    object: str
    from_ns: int
    to_ns: int
    from_state: float | str | None
    to_state: float | str | None
    probability: float


def read_events(folder: str | Path, doubts: list[str]) -> tuple[Event, ...]:
    """The events of a result folder, in time order; none where it has none, a doubt where unreadable."""
    import polars as pl

    path = Path(folder) / EVENTS
    if not path.is_file():
        return ()
    try:
        rows = pl.read_parquet(path).select(COLUMNS).sort("from_ns", "object").rows()
        return tuple(
            Event(str(name), int(begin), int(end), _state(before), _state(after), float(share))
            for name, begin, end, before, after, share in rows
        )
    except (OSError, TypeError, ValueError, pl.exceptions.PolarsError) as error:
        doubts.append(f"{path} can't be read ({error}); the report leaves it out.")
        return ()


def _state(value: object) -> float | str | None:
    if value is None or isinstance(value, str):
        return value
    return float(value) if isinstance(value, int | float) else str(value)


def shown(state: float | str | None, coordinate: str) -> str:
    """A state of an event: its name, or its value with a unit."""
    return state if isinstance(state, str) else figure(coordinate, state)


def events_table(events: Sequence[Event], building: Building, begin_ns: int) -> str:
    """A row for each event, sortable."""
    ordered = sorted(events, key=lambda event: (natural_key(event.object), event.from_ns))
    return table(HEADINGS, [_row(each, building, begin_ns) for each in ordered], "sortable")


def _row(event: Event, building: Building, begin_ns: int) -> list[str | Cell]:
    begin, end = seconds(event, begin_ns)
    coordinate = coordinate_of(event, building)
    return [
        text(event.object),
        Cell(f"{begin:.1f} to {end:.1f}", begin),
        text(shown(event.from_state, coordinate)),
        text(shown(event.to_state, coordinate)),
        f"{event.probability:.0%}",
    ]


def coordinate_of(event: Event, building: Building) -> str:
    """Of which coordinate an event's states are values."""
    objects: Mapping[str, object] = building.objects
    return building[event.object].coordinates[0] if event.object in objects else "angle"


def seconds(event: Event, begin_ns: int) -> tuple[float, float]:
    """From when to when, from the log's start."""
    return (event.from_ns - begin_ns) / 1e9, (event.to_ns - begin_ns) / 1e9


def said(event: Event, building: Building, begin_ns: int) -> str:
    """An event as a sentence."""
    begin, end = seconds(event, begin_ns)
    coordinate = coordinate_of(event, building)
    before, after = shown(event.from_state, coordinate), shown(event.to_state, coordinate)
    return (
        f"moved between {begin:.1f} s and {end:.1f} s, from {before} to {after}, "
        f"probability {event.probability:.0%}"
    )
