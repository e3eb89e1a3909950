"""What is to be seen along rays over a grid, and where the head has looked; compiled.

Planes (rows, columns) of a grid are given flat, as arrays (n,) of float32. Rays leave one place in
cells at equal steps of one cell; bearings (k,) are given by their directions in the grid's axes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from objstate.compiling import called_with, inner, njit
from objstate.geometry import FloatArray

Plane = NDArray[np.float32]

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "nsz"})


@called_with("i i f f f2 f g1 g1 g1 g1 f f f f i b g2 g2")
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
    watched: Plane,  # bits that come back within ``back`` s of a look
    looked: Plane,  # s, when each cell was last looked at
    now: float,
    fade: float,  # s
    back: float,  # s
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
                since = now - looked[cell]
                shown = bits[cell] * (1.0 - held_back * max(0.0, 1.0 - since / fade))
                shown += watched[cell] * min(1.0, since / back)
                seen[k, j] = shown * reliable * away * wide
            if occlusion:
                through *= 1.0 - opaque[cell]


@called_with("i i f f f2 i i f g1")
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


@called_with("i i g1 f2 f2 f2 f1")
@_compile
def mean_views(
    columns: int,
    rows: int,
    bits: Plane,
    centres: FloatArray,  # (k, 2) column, row
    directions: FloatArray,  # (k, 2) in the grid, away from the robot
    semiaxes: FloatArray,  # (k, 2) cells, away from the robot and across
    means: FloatArray,  # (k,) out
) -> None:
    """Mean bits of the cells in an ellipse, each by 1 less its Mahalanobis distance, eq. (6.36)."""
    for k in range(centres.shape[0]):
        a, b = max(0.5, semiaxes[k, 0]), max(0.5, semiaxes[k, 1])
        cos, sin = directions[k, 0], directions[k, 1]
        wide, high = np.hypot(a * cos, b * sin), np.hypot(a * sin, b * cos)
        x, y = centres[k, 0], centres[k, 1]
        total, count = 0.0, 0
        for row in range(max(0, int(y - high)), min(rows, int(y + high) + 1)):
            for column in range(max(0, int(x - wide)), min(columns, int(x + wide) + 1)):
                dx, dy = column + 0.5 - x, row + 0.5 - y
                u, v = (cos * dx + sin * dy) / a, (cos * dy - sin * dx) / b
                away = u * u + v * v
                if away <= 1.0:
                    total += (1.0 - np.sqrt(away)) * bits[row * columns + column]
                    count += 1
        means[k] = total / max(1, count)


@inner(nogil=True, error_model="numpy")
def _better(
    value: float, bits: float, weight: float, other_bits: float, other_weight: float
) -> Any:
    """The order of eqs. (6.34), which has priority, and (6.35)."""
    other = other_bits * other_weight
    if value != other:
        return value > other
    better = bits > other_bits or weight > other_weight
    return better and bits >= other_bits and weight >= other_weight


@called_with("i g1 f1 j1 f j1")
@_compile
def follow_maxima(
    columns: int,
    bits: Plane,
    weights: FloatArray,  # (n,)
    where: NDArray[np.int32],  # (m,) cells in the order in which they are updated
    apart: float,  # cells
    particles: NDArray[np.int32],  # (p,) cells, the best first; changed in place
) -> None:
    """Let particles move to cells that are better than the worst of them, eqs. (6.34) and (6.35).

    A cell near to particles may only take the place of the one of those with the least weight.
    """
    count = particles.shape[0]
    for j in range(where.shape[0]):
        cell = where[j]
        value, weight = bits[cell] * weights[cell], weights[cell]
        last = particles[count - 1]
        if not _better(value, bits[cell], weight, bits[last], weights[last]):
            continue
        x, y, worst, near = cell % columns, cell // columns, -1, np.inf
        for p in range(count):
            dx, dy = particles[p] % columns - x, particles[p] // columns - y
            if dx * dx + dy * dy < apart * apart and weights[particles[p]] < near:
                worst, near = p, weights[particles[p]]
        if worst < 0:
            worst = count - 1
        else:
            other = particles[worst]
            if not _better(value, bits[cell], weight, bits[other], weights[other]):
                continue
        while worst < count - 1:  # close the gap
            particles[worst] = particles[worst + 1]
            worst += 1
        at = count - 1
        while at > 0:
            other = particles[at - 1]
            if not _better(value, bits[cell], weight, bits[other], weights[other]):
                break
            particles[at] = other
            at -= 1
        particles[at] = cell


@called_with("i i g1 f f f2 f1 f1 f2 f2")
@_compile
def panorama(
    columns: int,
    rows: int,
    bits: Plane,
    column: float,
    row: float,
    directions: FloatArray,  # (k, 2) in the grid, one for each pan
    distances: FloatArray,  # (j,) cells, where the camera looks with each tilt
    areas: FloatArray,  # (j,) cells of the floor that a pixel shows
    seen: FloatArray,  # (k, j) out: bits
    shown: FloatArray,  # (k, j) out: cells of the grid
) -> None:
    """The grid as a camera that turns all round sees it, pixel by pixel."""
    for k in range(directions.shape[0]):
        for j in range(distances.shape[0]):
            x = column + distances[j] * directions[k, 0]
            y = row + distances[j] * directions[k, 1]
            seen[k, j], shown[k, j] = 0.0, 0.0
            if 0.0 <= x < columns and 0.0 <= y < rows:
                shown[k, j] = areas[j]
                seen[k, j] = areas[j] * bits[int(y) * columns + int(x)]
