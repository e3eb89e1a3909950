"""The outline of a mesh at laser height: what a level laser sees of it."""

from __future__ import annotations

import numpy as np

from objstate.building.model import Mesh
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, IntArray

SNAP = 1e-6  # m: vertices so near to the plane count as in it (the precision of a float32 mesh)
JOIN = 1e-6  # m: collinear segments with no wider gap become one
SAME_DIRECTION = 1e-7  # largest difference of components of unit vectors with equal directions
SAME_LINE = 1e-6  # m: largest distance of parallel lines that count as one


def outline(mesh: Mesh, height: float, transform: FloatArray | None = None) -> FloatArray:
    """Segments (k, 2, 2) m in which the plane z = ``height`` cuts a mesh, collinear ones joined.

    The mesh is first moved by ``transform`` (4, 4), if any. A vertex in the plane
    counts as above it: so a box is cut by the plane of its top but not by that of
    its bottom, and a face that lies in the plane adds nothing but its rim. The
    outline is within 0.1 mm of the exact section.
    """
    moved = mesh if transform is None else mesh.moved(transform)
    return join_collinear(_section(moved, height))


def wall_outline(walls: Mesh, height: float) -> FloatArray:
    """The same of walls. Raises BuildingError where none is so high, or so low."""
    segments = outline(walls, height)
    if not len(segments):
        raise BuildingError(f"No wall is {height:g} m above the floor; give another height.")
    return segments


def _section(mesh: Mesh, height: float) -> FloatArray:
    """One segment (k, 2, 2) for each triangle that the plane passes through."""
    tips, others, shares = crossings(mesh, height)
    start, end = mesh.vertices[tips, None, :2], mesh.vertices[others, :2]
    return np.asarray(start + shares[..., None] * (end - start))


def crossings(mesh: Mesh, height: float) -> tuple[IntArray, IntArray, FloatArray]:
    """Where the plane z = ``height`` crosses the edges of k triangles, two of each.

    The edges lead from vertices (k,) to vertices (k, 2), and are crossed at shares (k, 2) of them.
    """
    above = mesh.vertices[:, 2] - height
    above = np.where(np.abs(above) < SNAP, 0.0, above)
    first, second, third = (above >= 0.0)[mesh.faces.T]
    cut = (first != second) | (second != third)
    lone = np.where(second == third, 0, np.where(first == third, 1, 2))[cut]  # on its side alone
    faces, rows = mesh.faces[cut], np.arange(len(lone))
    tips = faces[rows, lone]
    others = np.column_stack([faces[rows, (lone + 1) % 3], faces[rows, (lone + 2) % 3]])
    return tips, others, above[tips, None] / (above[tips, None] - above[others])


def join_collinear(segments: FloatArray) -> FloatArray:
    """Segments (k, 2, 2) with those that overlap or touch on one line joined, and no empty ones."""
    along = segments[:, 1] - segments[:, 0]
    length = np.linalg.norm(along, axis=1)
    kept = length > JOIN
    if not kept.any():
        return np.zeros((0, 2, 2))
    segments = segments[kept]
    line, direction = _lines(segments, along[kept] / length[kept, None])
    places = np.einsum("kij,kj->ki", segments, direction)  # of both ends along the line
    backwards = places[:, 0] > places[:, 1]
    segments = np.where(backwards[:, None, None], segments[:, ::-1], segments)
    places.sort(axis=1)
    order = np.lexsort((places[:, 0], line))
    segments, places = segments[order], places[order]
    run = _runs(line[order], places)
    first = np.flatnonzero(np.diff(run, prepend=-1))
    reaching = np.flatnonzero(places[:, 1] == np.maximum.reduceat(places[:, 1], first)[run])
    last = reaching[np.flatnonzero(np.diff(run[reaching], append=-1))]
    return np.stack([segments[first, 0], segments[last, 1]], axis=1)


def _lines(segments: FloatArray, along: FloatArray) -> tuple[IntArray, FloatArray]:
    """For each segment the number (k,) of the line it lies on, and that line's direction (k, 2).

    Two directions that differ by half a turn are one line: the doubled angle tells
    them from others without a seam. A line's place is its foot, the point nearest
    to the middle of everything.
    """
    start = segments[:, 0] - (segments.min(axis=(0, 1)) + segments.max(axis=(0, 1))) / 2
    foot = start - np.sum(start * along, axis=1, keepdims=True) * along
    x, y = along.T
    line = np.zeros(len(segments), dtype=np.int64)
    for feature, gap in (
        (x * x - y * y, SAME_DIRECTION),
        (2 * x * y, SAME_DIRECTION),
        (foot[:, 0], SAME_LINE),
        (foot[:, 1], SAME_LINE),
    ):
        line = _split_at_gaps(line, feature, gap)
    _, member = np.unique(line, return_index=True)
    return line, along[member][line]


def _split_at_gaps(group: IntArray, values: FloatArray, gap: float) -> IntArray:
    """The groups (k,), split where sorted ``values`` (k,) differ by more than ``gap``."""
    order = np.lexsort((values, group))
    split = (np.diff(group[order]) > 0) | (np.diff(values[order]) > gap)
    out = np.empty_like(group)
    out[order] = np.concatenate([[0], np.cumsum(split)])
    return out


def _runs(line: IntArray, places: FloatArray) -> IntArray:
    """(k,) the number of the unbroken run each segment belongs to; sorted by line and start."""
    apart = 2 * (np.ptp(places) + 1.0)  # m between lines, so that none overlaps the next
    shifted = places + line[:, None] * apart
    reached = np.maximum.accumulate(shifted[:, 1])
    return np.cumsum(np.append(True, shifted[1:, 0] > reached[:-1] + JOIN)) - 1
