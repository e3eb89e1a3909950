"""``scans.parquet``: a thin selection of the scans, small enough to keep with every result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from objstate.geometry import FloatArray
from objstate.recording.parquet import read_parquet
from objstate.recording.spool import Spool

if TYPE_CHECKING:
    import polars as pl

SCANS = "scans.parquet"
ROWS_IN_MEMORY = 4_000  # about 3 MB
UNITS_IN_METRE = 100  # ends are kept to the centimetre, below the noise of a laser
FARTHEST = np.iinfo(np.int16).max / UNITS_IN_METRE  # m; about 330, beyond any indoor laser


@dataclass(frozen=True, eq=False)
class ThinScan:
    """Where some of the beams of one scan ended."""

    stamp_ns: int
    laser: str
    ends: FloatArray  # (n, 2) m in base_link, seen from above


def scan_schema() -> pl.Schema:
    """Names and types of the columns of ``scans.parquet``."""
    import polars as pl

    ends = pl.List(pl.Int16())
    return pl.Schema({"stamp": pl.Int64(), "laser": pl.String(), "x": ends, "y": ends})


class ScanWriter(Spool[ThinScan]):
    """Writes ``scans.parquet`` into a result folder, one row for each scan."""

    def __init__(self, folder: str | Path, rows_in_memory: int = ROWS_IN_MEMORY) -> None:
        super().__init__(Path(folder) / SCANS, scan_schema(), _columns, rows_in_memory)


def _columns(scans: Sequence[ThinScan]) -> dict[str, list[Any]]:
    whole = [
        np.rint(UNITS_IN_METRE * scan.ends.clip(-FARTHEST, FARTHEST)).astype(np.int16)
        for scan in scans
    ]
    return {
        "stamp": [scan.stamp_ns for scan in scans],
        "laser": [scan.laser for scan in scans],
        "x": [ends[:, 0] for ends in whole],
        "y": [ends[:, 1] for ends in whole],
    }


def read_scans(folder: str | Path) -> pl.DataFrame:
    """The scans of a result folder; none of a result that was made before they were kept.

    Raises ResultError for a file that is damaged.
    """
    import polars as pl

    path = Path(folder) / SCANS
    if not path.exists():
        return pl.DataFrame(schema=scan_schema())
    return read_parquet(path, scan_schema(), "make the result anew with `objstate estimate`")
