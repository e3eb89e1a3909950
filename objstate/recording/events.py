"""When objects were moved, as a table of a result folder."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.recording.parquet import read_parquet

if TYPE_CHECKING:
    import polars as pl

EVENTS = "events.parquet"
# by how much states of doors differ that count as the same, in rad and m
SAME = {"angle": math.radians(1.0), "offset": 0.01}


@dataclass(frozen=True)
class Event:
    """An object was moved between two moments."""

    object: str
    kind: str  # moved; furniture also came, or left
    coordinate: str  # of the states
    from_ns: int
    to_ns: int
    from_state: float | None  # rad or m; None where it wasn't there
    from_std: float | None
    to_state: float | None
    to_std: float | None
    probability: float

    @property
    def stretch(self) -> tuple[int, int]:
        """(from, to) ns."""
        return self.from_ns, self.to_ns

    @property
    def has_returned(self) -> bool:
        """Whether a door ended where it stood before; it stood elsewhere in between."""
        same = SAME.get(self.coordinate)
        if same is None or self.from_state is None or self.to_state is None:
            return False
        return abs(self.to_state - self.from_state) < same


def event_schema() -> pl.Schema:
    """Names and types of the columns of ``events.parquet``."""
    import polars as pl

    text, stamp, number = pl.String(), pl.Int64(), pl.Float64()
    return pl.Schema(
        {"object": text, "kind": text, "coordinate": text, "from_ns": stamp, "to_ns": stamp}
        | dict.fromkeys(("from_state", "from_std", "to_state", "to_std", "probability"), number)
    )


def write_events(folder: str | Path, events: Sequence[Event]) -> None:
    """Write ``events.parquet`` into a result folder, in the order of ``from_ns``."""
    import polars as pl

    ordered = sorted(events, key=lambda event: (event.from_ns, event.object, event.coordinate))
    rows = [astuple(event) for event in ordered]
    pl.DataFrame(rows, schema=event_schema(), orient="row").write_parquet(Path(folder) / EVENTS)


def read_events(folder: str | Path) -> list[Event]:
    """The events of a result folder, in time order; none where it has no table of them.

    Raises ResultError for a table of another form.
    """
    path = Path(folder) / EVENTS
    if not path.is_file():
        return []
    cure = "make it with `objstate estimate`"
    return [Event(*row) for row in read_parquet(path, event_schema(), cure).rows()]
