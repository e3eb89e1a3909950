"""Doors of a building, of decisions and of candidates as one list, matched by their places."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from itertools import count

import numpy as np

from objstate.building.door_table import closing_distance
from objstate.editing.rows import DoorRow
from objstate.geometry import FloatArray


def merged_rows(
    doors: Sequence[DoorRow],
    decided: Sequence[DoorRow],
    candidates: Sequence[DoorRow],
    names: Collection[str] = (),
) -> list[DoorRow]:
    """Each door once: as decided, else as a candidate, else as in the building.

    Doors are the same if they close the same way, now or before a person moved them. A candidate
    in the place of a building's door takes its name. Names that clash, also with ``names`` of other
    objects, are replaced by free ones: those of candidates first.
    """
    settled = [row for row in decided if row.decision in ("accepted", "rejected")]
    found = _named_as(doors, _elsewhere(candidates, settled))
    undecided = _elsewhere([row for row in decided if row.decision == "open"], [*settled, *found])
    kept = _elsewhere(doors, [*settled, *found, *undecided])
    named = _with_free_names([*settled, *kept, *undecided, *found], names)
    places = {row.name: number for number, row in enumerate(doors)}
    named.sort(key=lambda row: places.get(row.name, len(places)))
    return [_with_place(row) for row in named]


def _elsewhere(rows: Sequence[DoorRow], others: Sequence[DoorRow]) -> list[DoorRow]:
    """The rows that are no door of the others."""
    taken = set(_matched(others, rows))
    return [row for number, row in enumerate(rows) if number not in taken]


def _named_as(doors: Sequence[DoorRow], candidates: Sequence[DoorRow]) -> list[DoorRow]:
    """The candidates, with the names of the doors in whose places they are."""
    return [
        row if number is None else row.model_copy(update={"name": doors[number].name})
        for row, number in zip(candidates, _matched(candidates, doors), strict=True)
    ]


def _matched(rows: Sequence[DoorRow], others: Sequence[DoorRow]) -> list[int | None]:
    """The number of the other that each row is the same door as, if any; no other twice.

    Of several, as where two leaves close one way, that of the same name, else the nearest.
    """
    middles = np.array([other.door.middle for other in others]).reshape(-1, 2)
    widths = np.array([other.width for other in others])
    names = np.array([other.name for other in others], dtype=object)
    is_left = np.ones(len(others), dtype=bool)
    out = list[int | None]()
    for row in rows:
        match = None
        for place in _places(row):
            apart = closing_distance(place, row.width, middles, widths)
            near = np.flatnonzero(is_left & (apart < 1.0))
            if len(near):
                match = int(near[np.argmin(np.where(names[near] == row.name, -1.0, apart[near]))])
                is_left[match] = False
                break
        out.append(match)
    return out


def _places(row: DoorRow) -> list[FloatArray]:
    """(2,) m each, middles of the closed leaf now, and where it was found."""
    return [row.door.middle, *([] if row.found_at is None else [np.array(row.found_at)])]


def _with_free_names(rows: Sequence[DoorRow], names: Collection[str]) -> list[DoorRow]:
    """The rows, each with a name that none before has."""
    taken = set(names)
    free = _names_but({row.name for row in rows} | taken)
    out = []
    for row in rows:
        name = next(free) if row.name in taken else row.name
        taken.add(name)
        out.append(row.model_copy(update={"name": name}))
    return out


def _names_but(taken: Collection[str]) -> Iterator[str]:
    names = (f"door_{number:02d}" for number in count(1))
    return (name for name in names if name not in taken)


def _with_place(row: DoorRow) -> DoorRow:
    if row.found_at is not None:
        return row
    x, y = row.door.middle.round(4).tolist()
    return row.model_copy(update={"found_at": (x, y)})
