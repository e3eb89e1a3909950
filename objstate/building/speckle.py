"""Specks in an occupancy map: cells that are no wall, and holes that no laser sees into."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from objstate.errors import BuildingError
from objstate.geometry import BoolArray, IntArray

PINHOLE = 0.04  # m2: no robot stands in a gap that is closed all around and smaller than this
NEIGHBOURS = np.ones((3, 3))  # cells that touch at a corner belong together


def without_specks(occupied: BoolArray, min_cells: int, tell: Callable[[str], None]) -> BoolArray:
    """The occupied cells without blobs of fewer than ``min_cells`` touching ones.

    ``tell`` receives how many were removed. Raises BuildingError if nothing is left.
    """
    blob, size = _blobs(occupied, NEIGHBOURS)
    kept = np.asarray(occupied & (size[blob] >= min_cells), dtype=bool)
    specks = int(np.count_nonzero(size[1:] < min_cells))
    lost = int(np.count_nonzero(occupied & ~kept))
    tell(f"{specks} specks of fewer than {min_cells} cells left out ({lost} cells).")
    if not kept.any():
        raise BuildingError(
            f"No blob of the map's occupied cells has {min_cells} of them, so no wall is left; "
            "lower min_cells."
        )
    return kept


def without_pinholes(occupied: BoolArray, resolution: float) -> BoolArray:
    """The occupied cells with every closed gap smaller than PINHOLE filled."""
    around = np.pad(occupied, 1)
    gap, size = _blobs(~around, None)
    filled = around | (size[gap] * resolution**2 < PINHOLE)
    return np.asarray(filled[1:-1, 1:-1], dtype=bool)


def _blobs(cells: BoolArray, neighbours: np.ndarray | None) -> tuple[IntArray, IntArray]:
    """The number of each cell's blob, 0 outside, and the size of each blob."""
    from scipy.ndimage import label

    blob, count = label(cells, neighbours)
    return blob, np.bincount(blob.ravel(), minlength=count + 1)
