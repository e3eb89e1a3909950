"""The grid in a result: a ROS map, and the obstacles over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from objstate.geometry import FloatArray
from objstate.recording.parquet import read_parquet
from objstate.recording.spool import Spool

if TYPE_CHECKING:
    import polars as pl

GRID = "grid"
GRID_MAP, GRID_IMAGE = f"{GRID}.yaml", f"{GRID}.pgm"
CLUTTER = "clutter.parquet"
ROWS_IN_MEMORY = 200
OCCUPIED_THRESH, FREE_THRESH = 0.65, 0.25  # map_saver's


def write_map(
    folder: str | Path,
    values: NDArray[np.float32],
    resolution: float,
    origin: FloatArray,
    name: str = GRID,
) -> None:
    """Write probabilities (rows, columns) of being occupied as a ROS map: ``NAME.yaml``, ``NAME.pgm``.

    Rows count from the lower left corner, which lies at ``origin`` (3,). Grey values keep the
    probabilities; map_server and Nav2's static layer take them by the thresholds.
    """
    rows, columns = values.shape
    grey = np.rint(255.0 * (1.0 - values[::-1])).astype(np.uint8)
    head = f"P5\n{columns} {rows}\n255\n".encode()
    (Path(folder) / f"{name}.pgm").write_bytes(head + grey.tobytes())
    x, y, yaw = (round(float(each), 9) for each in origin)
    (Path(folder) / f"{name}.yaml").write_text(
        f"image: {name}.pgm\nmode: trinary\nresolution: {resolution:g}\n"
        f"origin: [{x}, {y}, {yaw}]\nnegate: 0\n"
        f"occupied_thresh: {OCCUPIED_THRESH}\nfree_thresh: {FREE_THRESH}\n",
        encoding="utf-8",
    )


@dataclass(frozen=True, eq=False)
class Clutter:
    """The obstacles at a moment that are not in the building."""

    stamp_ns: int
    places: FloatArray  # (n, 2) m in the building, the middles of cells
    percent: NDArray[np.uint8]  # (n,) how probably each is occupied


def clutter_schema() -> pl.Schema:
    """Names and types of the columns of ``clutter.parquet``."""
    import polars as pl

    places = pl.List(pl.Int32())
    return pl.Schema(
        {"stamp": pl.Int64(), "x": places, "y": places, "percent": pl.List(pl.UInt8())}
    )


class ClutterWriter(Spool[Clutter]):
    """Writes ``clutter.parquet`` into a result folder, a row for each moment."""

    def __init__(self, folder: str | Path) -> None:
        super().__init__(Path(folder) / CLUTTER, clutter_schema(), _columns, ROWS_IN_MEMORY)


def _columns(moments: Sequence[Clutter]) -> dict[str, list[Any]]:
    whole = [np.rint(100.0 * each.places).astype(np.int32) for each in moments]  # cm
    return {
        "stamp": [each.stamp_ns for each in moments],
        "x": [places[:, 0] for places in whole],
        "y": [places[:, 1] for places in whole],
        "percent": [each.percent for each in moments],
    }


def read_clutter(folder: str | Path) -> pl.DataFrame:
    """The moments of a result folder; none of a result that was made without ``--grid``.

    Raises ResultError for a file that is damaged.
    """
    import polars as pl

    path = Path(folder) / CLUTTER
    if not path.exists():
        return pl.DataFrame(schema=clutter_schema())
    return read_parquet(path, clutter_schema(), "make the result anew with `objstate estimate`")
