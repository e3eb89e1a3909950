"""What a batch saw of its doors: at which moments each was seen open, or closed."""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from objstate.errors import ResultError
from objstate.evaluation import read_lost, within
from objstate.order import natural_key
from objstate.packing import pack, unpack
from objstate.recording.batches import read_logs, result_of
from objstate.recording.index import open_index, settled
from objstate.recording.parts import Part, parts, states_state
from objstate.recording.tables import read_states
from objstate.statistics.summed import CELLS, Summed
from objstate.statistics.two_state import Looks

if TYPE_CHECKING:
    import polars as pl

FORM = 1  # version of the stored looks
PAIRS = ("steps", "pairs")
CELL_OWNER, PAIR_OWNER = "cell owner", "pair owner"  # numbers of doors
JOINED = 1000  # logs after which their columns become one

# from where on a door counts as open
OPEN_ABOVE_RAD, OPEN_ABOVE_M = math.radians(10.0), 0.1


@dataclass(frozen=True, eq=False)
class DoorLooks:
    """The looks at one door."""

    door: str
    looks: Summed  # the decided ones
    undecided: int  # number of looks whose interval held both open and closed
    logs: int  # logs with looks at the door


@dataclass(frozen=True)
class OpenAbove:
    """From which state on a door counts as open."""

    angle: float = OPEN_ABOVE_RAD  # rad
    offset: float = OPEN_ABOVE_M  # m


def door_looks(folder: str | Path, above: OpenAbove, *, filtered: bool = False) -> list[DoorLooks]:
    """The looks at every door that a batch's scans reached, by name.

    A look decides where the 90 % interval lies on one side of ``above``. Estimates from while the
    robot was lost don't count. Raises ResultError.
    """
    logs = read_logs(folder)
    found = Found()
    with open_index(folder) as index:
        entries = settled(index, Path(folder), logs)
        results = {
            n: result_of(folder, n) for n, e in entries.items() if e.outcome.status == "done"
        }
        if not results:
            raise ResultError(
                f"{folder} holds no estimates; run `objstate batch` until a log is done."
            )
        wanted = {n: Part(n, each, stamp_of(each, filtered)) for n, each in results.items()}

        def made(name: str) -> bytes:
            return looks_of(results[name], above, filtered=filtered)

        for name, content in parts(index, kind_of(above, filtered), wanted, made):
            found.add(content, f"What is kept of {name}")
    return found.doors()


def kind_of(above: OpenAbove, filtered: bool) -> str:
    """The key of the looks of a log."""
    return f"looks {above.angle!r} {above.offset!r}{', filtered' if filtered else ''}"


def stamp_of(result: Path, filtered: bool) -> str:
    """Changes whenever the looks of a result do."""
    return json.dumps([FORM, states_state(result, filtered)])


def looks_of(result: Path, above: OpenAbove, *, filtered: bool = False) -> bytes:
    """The looks of one log, summed, as bytes. Raises ResultError."""
    bounds = {"angle": above.angle, "offset": above.offset}
    seen = read_states(result, filtered=filtered).filter("observed")
    kept = seen.filter(~within(seen["stamp"].to_numpy(), read_lost(result)))
    parts_ = kept.partition_by("object", "coordinate", as_dict=True)
    doors, sums = [], []
    for (door, coordinate), part in sorted(parts_.items()):
        if coordinate in bounds:
            looks, undecided = _looks(part.sort("stamp"), bounds[coordinate])
            doors.append([door, coordinate, undecided, len(looks.minutes), len(looks.steps)])
            sums.append(looks)
    if not sums:
        return pack({"doors": []}, {})
    return pack(
        {"doors": doors},
        {name: np.concatenate([getattr(each, name) for each in sums]) for name in (*CELLS, *PAIRS)},
    )


class Found:
    """The looks of many logs, by door: columns of all logs, and the door of each row."""

    def __init__(self) -> None:
        self._doors: dict[tuple[str, str], int] = {}
        self._undecided: Counter[int] = Counter()
        self._logs: Counter[int] = Counter()
        self._columns: dict[str, list[np.ndarray]] = {}
        self._count = 0

    def add(self, content: bytes, what: str) -> None:
        """Add those of a log. Raises WorldError for damage."""
        words, arrays = unpack(content, what)
        if not words["doors"]:
            return
        numbers, cells, pairs = [], [], []
        for door, coordinate, undecided, own_cells, own_pairs in words["doors"]:
            number = self._doors.setdefault((door, coordinate), len(self._doors))
            self._undecided[number] += undecided
            self._logs[number] += 1
            numbers.append(number)
            cells.append(own_cells)
            pairs.append(own_pairs)
        owners = {CELL_OWNER: np.repeat(numbers, cells), PAIR_OWNER: np.repeat(numbers, pairs)}
        for name, values in (owners | arrays).items():
            self._columns.setdefault(name, []).append(values)
        self._count += 1
        if self._count % JOINED == 0:  # thousands of small arrays take more than what they hold
            self._join()

    def doors(self) -> list[DoorLooks]:
        """The looks at each door, by name."""
        self._join()
        columns = {name: whole for name, (whole,) in self._columns.items()}
        found = []
        for key, number in sorted(self._doors.items(), key=lambda each: natural_key(each[0][0])):
            cells, pairs = (columns[each] == number for each in (CELL_OWNER, PAIR_OWNER))
            own = {name: columns[name][cells] for name in CELLS}
            own |= {name: columns[name][pairs] for name in PAIRS}
            looks = Summed.joined([Summed(**own)])
            found.append(DoorLooks(key[0], looks, self._undecided[number], self._logs[number]))
        return found

    def _join(self) -> None:
        self._columns = {name: [np.concatenate(own)] for name, own in self._columns.items()}


def _looks(rows: pl.DataFrame, bound: float) -> tuple[Summed, int]:
    """The decided looks, and the number of others."""
    lower, upper = rows["lower"].to_numpy(), rows["upper"].to_numpy()
    decided = (lower > bound) | (upper <= bound)
    stamps = rows["stamp"].to_numpy().astype(np.int64)
    looks = Looks(stamps[decided], lower[decided] > bound)
    return looks.summed(), int((~decided).sum())
