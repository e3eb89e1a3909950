"""What is to be seen along rays over a grid, and where the head has looked; compiled.

Planes (rows, columns) of a grid are given flat, as arrays (n,) of float32. Rays leave one place in cells
at equal steps of one cell; bearings (k,) are given by their directions in the grid's axes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from objstate.compiling import njit
from objstate.geometry import FloatArray

Plane = NDArray[np.float32]

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})


@_compile
def along_rays(
    columns: int,
    rows: int,
    column: float,
    row: float,
    directions: FloatArray,  # (k, 2) column, row
    wide: float,  # rad between two rays
    bits: Plane,
    opaque: Plane,  # P(a cell stops a ray)
    looked: Plane,  # s, when each cell was last looked at
    now: float,
    fade: float,  # s
    held_back: float,  # the share of bits that don't count where one has just looked
    least: int,  # cells from the place where the view begins
    occlusion: bool,
    sight: Plane,  # (k, j) out: the probability that a ray gets there, times the reliability there
    seen: Plane,  # (k, j) out: bits that are to be seen in each step of each ray
) -> None:
    """Bits in polar cells: those of the grid's cells times the area, what hides them, and eq. (6.9)."""
    reach = sight.shape[1]
    for k in range(sight.shape[0]):
        through = 1.0
        for j in range(reach):
            sight[k, j], seen[k, j] = 0.0, 0.0
            away = j + 0.5
            x, y = column + away * directions[k, 0], row + away * directions[k, 1]
            if x < 0.0 or y < 0.0 or x >= columns or y >= rows or through < 1e-3:
                through = 0.0
                continue
            cell = int(y) * columns + int(x)
            if j >= least:
                reliable = through * (1.0 - away / reach)
                sight[k, j] = reliable
                recent = max(0.0, 1.0 - (now - looked[cell]) / fade)
                seen[k, j] = bits[cell] * reliable * away * wide * (1.0 - held_back * recent)
            if occlusion:
                through *= 1.0 - opaque[cell]


@_compile
def mark_looked(
    columns: int,
    rows: int,
    column: float,
    row: float,
    directions: FloatArray,  # (k, 2) column, row
    least: int,
    reach: int,
    now: float,
    looked: Plane,
) -> None:
    """Note the time in all cells of a view, hidden ones too: looking again shows no more of those."""
    for k in range(directions.shape[0]):
        for j in range(least, reach):
            away = j + 0.5
            x, y = column + away * directions[k, 0], row + away * directions[k, 1]
            if x < 0.0 or y < 0.0 or x >= columns or y >= rows:
                break
            looked[int(y) * columns + int(x)] = now
