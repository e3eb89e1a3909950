"""``candidates.json``: obstacles of a run that may be objects."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from objstate.errors import ResultError

CANDIDATES = "candidates.json"


@dataclass(frozen=True)
class Found:
    """A candidate of a run."""

    name: str
    probability: float  # of being real: that it stays
    looks: int
    x: float  # m in the building, of the middle of the least box about it
    y: float
    yaw: float  # rad, of its longer side
    length: float  # m
    width: float  # m
    first_ns: int
    last_ns: int  # of the last observation
    outline: tuple[tuple[float, float], ...]  # m, its convex hull


def write_candidates(folder: str | Path, found: Sequence[Found]) -> None:
    """Write ``candidates.json`` into a result folder."""
    text = json.dumps([asdict(each) for each in found], indent=2)
    (Path(folder) / CANDIDATES).write_text(text + "\n", encoding="utf-8")


def read_candidates(folder: str | Path) -> list[Found]:
    """The candidates of a result; none of one that mapped nothing. Raises ResultError."""
    file = Path(folder) / CANDIDATES
    if not file.is_file():
        return []
    try:
        rows: list[dict[str, Any]] = json.loads(file.read_text(encoding="utf-8"))
        return [Found(**row | {"outline": tuple(map(tuple, row["outline"]))}) for row in rows]
    except (ValueError, TypeError, KeyError) as error:
        raise ResultError(f"{file} is damaged: {error}; estimate the log again.") from error
