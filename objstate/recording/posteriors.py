"""``posteriors.parquet``: what was believed of every object, over time."""

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

POSTERIORS = "posteriors.parquet"
ROWS_IN_MEMORY = 4_000  # about 4 MB
WHOLE = 65_535  # what the masses of one posterior sum to, but for rounding


@dataclass(frozen=True, eq=False)
class Histogram:
    """The posterior of one coordinate of one object at one moment, in equal bins."""

    stamp_ns: int
    object: str
    coordinate: str
    lower: float  # rad or m: where the first bin begins
    upper: float  # where the last one ends
    shares: FloatArray  # (b,) of the posterior in each bin; they sum to one


def posterior_schema() -> pl.Schema:
    """Names and types of the columns of ``posteriors.parquet``."""
    import polars as pl

    return pl.Schema(
        {
            "stamp": pl.Int64(),
            "object": pl.String(),
            "coordinate": pl.String(),
            "lower": pl.Float64(),
            "upper": pl.Float64(),
            "masses": pl.List(pl.UInt16()),
        }
    )


class PosteriorWriter(Spool[Histogram]):
    """Writes ``posteriors.parquet`` into a result folder, one row for each histogram."""

    def __init__(self, folder: str | Path, rows_in_memory: int = ROWS_IN_MEMORY) -> None:
        super().__init__(Path(folder) / POSTERIORS, posterior_schema(), _columns, rows_in_memory)


def _columns(histograms: Sequence[Histogram]) -> dict[str, list[Any]]:
    """Columns of histograms, their shares rounded to 1 / ``WHOLE``."""
    return {
        "stamp": [each.stamp_ns for each in histograms],
        "object": [each.object for each in histograms],
        "coordinate": [each.coordinate for each in histograms],
        "lower": [each.lower for each in histograms],
        "upper": [each.upper for each in histograms],
        "masses": [np.rint(WHOLE * each.shares).astype(np.uint16) for each in histograms],
    }


def read_posteriors(folder: str | Path) -> pl.DataFrame:
    """The posteriors of a result folder. Raises ResultError where there are none."""
    cure = "make the result anew with `objstate estimate`"
    return read_parquet(Path(folder) / POSTERIORS, posterior_schema(), cure)
