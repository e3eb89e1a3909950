"""Cells that are updated, read, and swept by beams; compiled.

Fields of cells are given one by one, as arrays (n,) of float32. The update index (n,) of cells says
in which sweep a cell was touched, and where it stands in the list of that sweep.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from objstate.compiling import called_with, inner, njit
from objstate.geometry import BoolArray, FloatArray

Field = NDArray[np.float32]  # (n,)
Indices = NDArray[np.int32]  # (m,) flat, row by row

UNKNOWN = 0.5  # the value of an unknown cell

_compile = njit(nogil=True, error_model="numpy", fastmath={"contract"})
_inner = inner(nogil=True, error_model="numpy", fastmath={"contract"})


@called_with("g1 g1 j1 g1 f f f f")
@_compile
def update_bayes(
    belief: Field,
    expires: Field,
    where: Indices,
    evidence: Field,
    at: float,
    life: float,
    trust: float,
    most: float,
) -> None:
    """Bayes' rule with an even prior, eq. (2.10), limited to ``1 - most`` to ``most``."""
    for j in range(where.shape[0]):
        if evidence[j] != UNKNOWN:  # which would have no effect, eqs. (2.15) to (2.18)
            k = where[j]
            p = UNKNOWN + trust * (evidence[j] - UNKNOWN)
            before = belief[k] if expires[k] > at else UNKNOWN
            odds = p / (1.0 - p) * before / (1.0 - before)
            belief[k] = min(most, max(1.0 - most, 1.0 - 1.0 / (1.0 + odds)))
            expires[k] = at + life


@called_with("g1 g1 j1 g1 f f f f")
@_compile
def update_log_odds(
    log_odds: Field,
    expires: Field,
    where: Indices,
    evidence: Field,
    at: float,
    life: float,
    trust: float,
    most: float,
) -> None:
    """The same by a sum, eq. (2.14)."""
    limit = np.log(most / (1.0 - most))
    for j in range(where.shape[0]):
        if evidence[j] != UNKNOWN:
            k = where[j]
            p = UNKNOWN + trust * (evidence[j] - UNKNOWN)
            before = log_odds[k] if expires[k] > at else 0.0
            log_odds[k] = min(limit, max(-limit, before + np.log(p / (1.0 - p))))
            expires[k] = at + life


@called_with("g1 g1 g1 j1 g1 f f f")
@_compile
def update_counts(
    free: Field,
    occupied: Field,
    expires: Field,
    where: Indices,
    evidence: Field,
    at: float,
    life: float,
    most: float,
) -> None:
    """Counts that are capped, eq. (6.5), and lower the contrary count, eqs. (6.6) and (6.7)."""
    for j in range(where.shape[0]):
        k, count = where[j], 2.0 * evidence[j] - 1.0
        left = expires[k] - at
        if left <= 0.0:  # the reliability is zero, and the cell begins anew
            left, free[k], occupied[k] = 0.0, 0.0, 0.0
        if count > 0.0:
            occupied[k] = min(most, occupied[k] + count)
            free[k] = max(0.0, free[k] - count * free[k] / 2.0)
        else:
            free[k] = min(most, free[k] - count)
            occupied[k] = max(0.0, occupied[k] + count * occupied[k] / 2.0)
        expires[k] = at + min(life, left + abs(count) * life)


@called_with("g1 g1 g1 j1 g1 f f f")
@_compile
def update_averages(
    free: Field,
    occupied: Field,
    expires: Field,
    where: Indices,
    evidence: Field,
    at: float,
    life: float,
    alpha: float,
) -> None:
    """Exponential moving averages of both counts, eq. (6.8)."""
    for j in range(where.shape[0]):
        k, count = where[j], 2.0 * evidence[j] - 1.0
        left = expires[k] - at
        if left <= 0.0:
            left, free[k], occupied[k] = 0.0, 0.0, 0.0
        if count != 0.0:
            free[k] = alpha * max(0.0, -count) + (1.0 - alpha) * free[k]
            occupied[k] = alpha * max(0.0, count) + (1.0 - alpha) * occupied[k]
            expires[k] = at + min(life, left + abs(count) * life)


@called_with("g1 g1 g1 f f g1")
@_compile
def read_counts(
    free: Field, occupied: Field, expires: Field, at: float, life: float, values: Field
) -> None:
    """Values (n,) of cells by both counts and the reliability, eqs. (6.2) to (6.4)."""
    half, one, none = np.float32(0.5), np.float32(1.0), np.float32(0.0)
    now, rate, least = np.float32(at), np.float32(1.0 / life), np.float32(1e-30)
    for k in range(values.shape[0]):
        reliability = min(one, max(none, (expires[k] - now) * rate))
        share = occupied[k] / max(least, free[k] + occupied[k])
        values[k] = half + reliability * (share - half)


@called_with("g1 g1 f f g1")
@_compile
def read_beliefs(belief: Field, expires: Field, at: float, life: float, values: Field) -> None:
    """Values (n,) of cells that hold a probability, by their reliability."""
    half, one, none = np.float32(0.5), np.float32(1.0), np.float32(0.0)
    now, rate = np.float32(at), np.float32(1.0 / life)
    for k in range(values.shape[0]):
        reliability = min(one, max(none, (expires[k] - now) * rate))
        values[k] = half + reliability * (belief[k] - half)


@called_with("g1 g1")
@_compile
def entropies(values: Field, out: Field) -> None:
    """Entropies (n,) bits of cells that are occupied with probabilities (n,), eq. (2.20)."""
    for k in range(values.shape[0]):
        p = np.float64(values[k])
        if p <= 0.0 or p >= 1.0:
            out[k] = 0.0
        else:
            out[k] = -(p * np.log2(p) + (1.0 - p) * np.log2(1.0 - p))


@called_with("g1 g1 g1 g1")
@_compile
def entropies_from_table(values: Field, table: Field, slopes: Field, out: Field) -> None:
    """The same by linear interpolation in a table (m,) over [0, 1] with differences (m,)."""
    scale = np.float32(table.shape[0] - 1)
    for k in range(values.shape[0]):
        at = values[k] * scale
        low = np.int32(at)
        out[k] = table[low] + (at - np.float32(low)) * slopes[low]


@called_with("g1 g1 g1")
@_compile
def entropies_by_series(values: Field, terms: Field, out: Field) -> None:
    """The same by a polynomial (6,) without a constant in ``w = 2 sqrt(p (1 - p))``."""
    one, two = np.float32(1.0), np.float32(2.0)
    a, b, c, d, e, f = terms[0], terms[1], terms[2], terms[3], terms[4], terms[5]
    for k in range(values.shape[0]):
        w = two * np.sqrt(values[k] * (one - values[k]))
        out[k] = w * (a + w * (b + w * (c + w * (d + w * (e + w * f)))))


@called_with("j1 i i i f2 f2 b1 f1 f2 f f f j1 g1")
@_compile
def draw_obstacles(
    index: Indices,
    base: int,
    columns: int,
    rows: int,
    starts: FloatArray,
    ends: FloatArray,
    obstacle: BoolArray,
    weights: FloatArray,
    spreads: FloatArray,
    quantile: float,
    reach: float,
    scale: float,
    where: Indices,
    evidence: Field,
) -> Any:
    """Draw ends of beams from ``starts`` to ``ends`` (n, 2), column and row; count cells.

    The end of an ``obstacle`` (n,) is a Gaussian with covariance ``spreads`` (n, 3: xx, xy, yy)
    cells^2 up to a squared Mahalanobis distance ``quantile``, eq. (2.25). It counts less with the
    distance, eq. (6.9), up to ``reach`` cells, times its weight (n,) and ``scale``. The list
    ``where`` and ``evidence`` (m,; 0 free, 1 occupied) of the sweep is filled. Where it is too
    short the number is -1.
    """
    count = 0
    for j in range(ends.shape[0]):
        if not obstacle[j]:
            continue
        away = np.hypot(ends[j, 0] - starts[j, 0], ends[j, 1] - starts[j, 1])
        peak = 0.5 * scale * weights[j] * (1.0 - min(1.0, away / reach))
        if peak <= 0.0:
            continue
        column, row = int(np.floor(ends[j, 0])), int(np.floor(ends[j, 1]))
        xx, xy, yy = spreads[j, 0], spreads[j, 1], spreads[j, 2]
        wide, high = int(np.sqrt(quantile * xx)), int(np.sqrt(quantile * yy))
        determinant = xx * yy - xy * xy
        for y in range(max(0, row - high), min(rows, row + high + 1)):
            for x in range(max(0, column - wide), min(columns, column + wide + 1)):
                dx, dy = x - column, y - row
                squared = 0.0
                if dx != 0 or dy != 0:
                    squared = (yy * dx * dx - 2.0 * xy * dx * dy + xx * dy * dy) / determinant
                if not squared <= quantile:
                    continue
                value = np.float32(UNKNOWN + peak * np.exp(-squared / 2.0))
                k = y * columns + x
                slot = index[k] - base
                if slot >= 0:
                    evidence[slot] = max(evidence[slot], value)
                    continue
                if count == where.shape[0]:
                    return -1
                index[k], where[count], evidence[count] = base + count, k, value
                count += 1
    return count


@called_with("j1 i i i f2 f2 i f f j1 g1")
@_compile
def draw_beams(
    index: Indices,
    base: int,
    columns: int,
    rows: int,
    starts: FloatArray,
    ends: FloatArray,
    occupied: int,
    reach: float,
    scale: float,
    where: Indices,
    evidence: Field,
) -> Any:
    """Draw free beams from ``starts`` to ``ends`` (n, 2), column and row; count cells.

    Cells are those of algorithm 4, from the robot on, up to the first that this sweep found
    occupied: those are the first ``occupied`` of its list. They count less with the distance, as
    obstacles do.
    """
    count = occupied
    for j in range(ends.shape[0]):
        length = np.hypot(ends[j, 0] - starts[j, 0], ends[j, 1] - starts[j, 1])
        part = min(1.0, reach / length) if length > 0.0 else 1.0
        x, y = int(np.floor(starts[j, 0])), int(np.floor(starts[j, 1]))
        to_x = int(np.floor(starts[j, 0] + part * (ends[j, 0] - starts[j, 0])))
        to_y = int(np.floor(starts[j, 1] + part * (ends[j, 1] - starts[j, 1])))
        along_x, along_y = (1 if to_x > x else -1), (1 if to_y > y else -1)
        far_x, far_y = abs(to_x - x), abs(to_y - y)
        steep = far_y > far_x
        steps, minor = max(far_x, far_y), min(far_x, far_y)
        if where.shape[0] - count <= steps:
            return -1
        inside = min(x, to_x, y, to_y) >= 0
        inside = inside and max(x, to_x) < columns and max(y, to_y) < rows
        fall = scale * 0.5 * part * length / (reach * max(1, steps))
        value, error = UNKNOWN - scale * 0.5, steps
        for _ in range(steps + 1):
            if inside or (0 <= x < columns and 0 <= y < rows):
                k = y * columns + x
                slot = index[k] - base
                if slot < 0:
                    index[k], where[count], evidence[count] = base + count, k, value
                    count += 1
                elif slot < occupied:
                    break
            value += fall
            error += 2 * minor
            turn = error >= 2 * steps
            if turn:
                error -= 2 * steps
            if turn or not steep:
                x += along_x
            if turn or steep:
                y += along_y
    return count


@_inner
def _ascend(values: FloatArray, count: int) -> None:
    """Sort the first ``count`` values, which are few; ``sort`` takes longer to compile."""
    for i in range(1, count):
        value, k = values[i], i
        while k > 0 and values[k - 1] > value:
            values[k] = values[k - 1]
            k -= 1
        values[k] = value


@called_with("j1 f2 f2 j1 f1")
@_compile
def cover(
    mark: Indices, plane: FloatArray, outlines: FloatArray, corners: Indices, weights: FloatArray
) -> None:
    """Add the weight of each polygon to the cells (rows, columns) that it touches.

    The polygons' ``outlines`` (n, 2), column and row, are concatenated, with ``corners`` (k,) each.
    ``mark`` (rows * columns,) holds -1.
    """
    rows, columns = plane.shape
    begin = 0
    for polygon in range(corners.shape[0]):
        count = corners[polygon]
        outline = outlines[begin : begin + count]
        begin += count
        crossings = np.empty(count)
        first = max(0, int(np.floor(outline[:, 1].min())))
        last = min(rows - 1, int(np.floor(outline[:, 1].max())))
        for y in range(first, last + 1):
            met = 0
            for i in range(count + 1):
                j = (i + 1) % count
                if i < count:  # the cells of this row that an edge passes
                    ax, ay, bx, by = outline[i, 0], outline[i, 1], outline[j, 0], outline[j, 1]
                    if max(ay, by) < y or min(ay, by) >= y + 1:
                        continue
                    if (ay > y + 0.5) != (by > y + 0.5):
                        crossings[met] = ax + (y + 0.5 - ay) / (by - ay) * (bx - ax)
                        met += 1
                    low, high = 0.0, 1.0
                    if ay != by:
                        s, t = (y - ay) / (by - ay), (y + 1 - ay) / (by - ay)
                        low, high = max(0.0, min(s, t)), min(1.0, max(s, t))
                    left, right = ax + low * (bx - ax), ax + high * (bx - ax)
                    spans = 1
                else:  # those that lie within
                    _ascend(crossings, met)
                    spans = met // 2
                for span in range(spans):
                    if i == count:
                        left, right = crossings[2 * span], crossings[2 * span + 1]
                    from_x = max(0, int(np.floor(min(left, right))))
                    to_x = min(columns - 1, int(np.floor(max(left, right))))
                    for x in range(from_x, to_x + 1):
                        if mark[y * columns + x] != polygon:
                            mark[y * columns + x] = polygon
                            plane[y, x] += weights[polygon]
