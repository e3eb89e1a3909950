"""From occupied cells to the few straight edges that bound them.

The border between occupied and other cells is followed cell by cell, then cut
into straight stretches by split and merge (Nguyen et al. 2005, "A comparison of
line extraction algorithms using 2D laser rangefinder for indoor mobile
robotics"). Each stretch is fitted by total least squares, so that a slanted wall
becomes its true line and not a staircase.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.geometry import BoolArray, FloatArray, IntArray

CORNER = 1.0  # cells from where two stretches join within which they meet in a corner
FOLD = 1.0  # cells by which a straight part may extend backwards beyond its own ends
FACE = 6  # points, so cell sides, from which on a stretch is the face of a wall
ENOUGH = 5  # points of a stretch from which on its two ends can be spared
HEADINGS = np.array([[1, 0], [0, 1], [-1, 0], [0, -1]])  # east, north, west, south


def border_loops(occupied: BoolArray) -> list[FloatArray]:
    """Closed loops (n, 2) around the occupied cells (rows, columns), in cells: column, row.

    The points are the middles of the cell sides that face other cells; occupied cells
    lie on the left. Cells that touch at a corner count as joined, so that no beam
    slips between them.
    """
    grid = np.pad(occupied, 1)
    north_east, north_west = grid[1:, 1:], grid[1:, :-1]
    south_east, south_west = grid[:-1, 1:], grid[:-1, :-1]
    leaving = np.stack(  # by heading: a side that starts at this corner, occupied on its left only
        [
            north_east & ~south_east,
            north_west & ~north_east,
            south_west & ~north_west,
            south_east & ~south_west,
        ]
    )
    heading, y, x = np.nonzero(leaving)
    start = np.column_stack([x, y])
    points = start + HEADINGS[heading] / 2
    return [points[loop] for loop in _cycles(_following(heading, start, leaving.shape))]


def _following(heading: IntArray, start: IntArray, shape: tuple[int, ...]) -> IntArray:
    """(n,) the side after each; at a corner that two cells share, the right turn keeps them joined."""
    end = start + HEADINGS[heading]
    known = np.ravel_multi_index((heading, start[:, 1], start[:, 0]), shape)
    following = np.full(len(heading), -1)
    for turn in (1, 0, -1):  # left, straight on, right: the later goes before
        onward = np.ravel_multi_index(((heading + turn) % 4, end[:, 1], end[:, 0]), shape)
        at = np.minimum(np.searchsorted(known, onward), len(known) - 1)
        following = np.where(known[at] == onward, at, following)
    return following


def _cycles(following: IntArray) -> list[list[int]]:
    """The cycles of a permutation (n,)."""
    after = following.tolist()
    seen = [False] * len(after)
    cycles = []
    for first in range(len(after)):
        cycle, here = [], first
        while not seen[here]:
            seen[here] = True
            cycle.append(here)
            here = after[here]
        if cycle:
            cycles.append(cycle)
    return cycles


def straighten(loop: FloatArray, tolerance: float, inset: float) -> FloatArray:
    """The corners (m, 2) of a closed polygon of few edges within ``tolerance`` of a loop (n, 2).

    Stretches of some length, the faces of walls, are moved inward by ``inset``; short
    ones, the ends of walls and small things, stay where they are, lest gaps widen. All
    in cells. A wall as thick as twice ``inset`` comes out as an edge there and back.
    """
    loop = _from_far_corner(loop)
    stretches = _merge(_split(loop, tolerance), tolerance)
    stretches = _merge(_settle(stretches, tolerance), tolerance)
    lines = [
        Line.through(stretch).moved_left(inset if len(stretch) >= FACE else 0.0)
        for stretch in stretches
    ]
    corners: list[FloatArray] = []
    for index, line in enumerate(lines):
        after = (index + 1) % len(lines)
        end, start = stretches[index][-1], stretches[after][0]
        corners += _joint(end, line, lines[after], start, CORNER + inset)
    return np.array(corners)


@dataclass(frozen=True, eq=False)
class Line:
    """A straight line fitted to points by total least squares."""

    middle: FloatArray = field(repr=False)  # (2,)
    along: FloatArray = field(repr=False)  # (2,) unit vector, the way the points go

    @staticmethod
    def through(stretch: FloatArray) -> Line:
        """The line of a stretch of border; its ends, which cut a corner, don't count."""
        points = _without_ends(stretch)
        middle = points.mean(axis=0)
        x, y = (points - middle).T
        angle = np.arctan2(2 * (x @ y), x @ x - y @ y) / 2
        along = np.array([np.cos(angle), np.sin(angle)])
        backwards = along @ (points[-1] - points[0]) < 0
        return Line(middle, -along if backwards else along)

    def moved_left(self, distance: float) -> Line:
        """The parallel line, seen along it to the left."""
        left = np.array([-self.along[1], self.along[0]])
        return Line(self.middle + distance * left, self.along)

    def project(self, point: FloatArray) -> FloatArray:
        """The nearest point (2,) on the line."""
        return np.asarray(self.middle + self.along * (self.along @ (point - self.middle)))

    def crossing(self, other: Line) -> FloatArray | None:
        """Where two lines cross, or None if they are parallel."""
        cross = float(self.along[0] * other.along[1] - self.along[1] * other.along[0])
        if abs(cross) < np.finfo(float).eps:
            return None
        gap = other.middle - self.middle
        reach = (gap[0] * other.along[1] - gap[1] * other.along[0]) / cross
        return np.asarray(self.middle + reach * self.along)


def _joint(
    end: FloatArray, line: Line, after: Line, start: FloatArray, near: float
) -> list[FloatArray]:
    """The corner of two lines that follow one another, or a short edge if it isn't ``near``."""
    crossing = line.crossing(after)
    if crossing is not None and np.linalg.norm(crossing - (end + start) / 2) <= near:
        return [crossing]
    return [line.project(end), after.project(start)]


def _from_far_corner(loop: FloatArray) -> FloatArray:
    """The same loop, begun at a point that lies farthest out."""
    from_middle = np.linalg.norm(loop - loop.mean(axis=0), axis=1)
    return np.roll(loop, -int(from_middle.argmax()), axis=0)


def _split(loop: FloatArray, tolerance: float) -> list[FloatArray]:
    """Stretches of a loop, in order, each within tolerance of a line."""
    opposite = int(np.linalg.norm(loop - loop[0], axis=1).argmax())
    pending = [loop[max(opposite, 1) :], loop[: max(opposite, 1)]]
    straight = []
    while pending:
        stretch = pending.pop()
        if _is_straight(stretch, tolerance):
            straight.append(stretch)
            continue
        cut = int(np.clip(_distance_to_chord(stretch).argmax(), 1, len(stretch) - 1))
        pending += [stretch[cut:], stretch[:cut]]
    return straight


def _merge(stretches: list[FloatArray], tolerance: float) -> list[FloatArray]:
    """Neighbouring stretches joined while together they are still straight."""
    merged: list[FloatArray] = []
    for stretch in stretches:
        last = stretch
        while merged and _is_straight(both := np.concatenate([merged[-1], last]), tolerance):
            merged.pop()
            last = both
        merged.append(last)
    if len(merged) > 2 and _is_straight(seam := np.concatenate([merged[-1], merged[0]]), tolerance):
        merged = [seam, *merged[1:-1]]
    return merged


def _settle(stretches: list[FloatArray], tolerance: float) -> list[FloatArray]:
    """The same points with each joint moved to where two lines fit its two neighbours best."""
    settled = [stretches[0]]
    for stretch in stretches[1:]:
        both = np.concatenate([settled[-1], stretch])
        cut = _best_cut(both)
        halves = [both[:cut], both[cut:]]
        if all(_is_straight(half, tolerance) for half in halves):
            settled[-1:] = halves
        else:
            settled.append(stretch)
    return settled


def _best_cut(points: FloatArray) -> int:
    """Where to cut points (n, 2) in two so that two lines leave the least squared distance."""
    centred = points - points.mean(axis=0)
    x, y = centred.T
    sums = np.cumsum(np.column_stack([np.ones(len(x)), x, y, x * x, y * y, x * y]), axis=0)
    before, after = sums[:-1], sums[-1] - sums[:-1]
    return int(np.argmin(_squares_off_line(before) + _squares_off_line(after))) + 1


def _squares_off_line(sums: FloatArray) -> FloatArray:
    """(n,) squared distances from the best line, from sums (n, 6) of 1, x, y, xx, yy, xy."""
    count, x, y, xx, yy, xy = sums.T
    xx, yy, xy = xx - x * x / count, yy - y * y / count, xy - x * y / count
    return np.asarray((xx + yy - np.hypot(xx - yy, 2 * xy)) / 2)  # the lesser eigenvalue


def _is_straight(stretch: FloatArray, tolerance: float) -> bool:
    """Whether points (n, 2) lie within tolerance of one line and don't turn back along it."""
    if len(stretch) <= 2:
        return True
    line = Line.through(stretch)
    off = stretch - line.middle
    ahead = off @ line.along
    folds = max(ahead[0] - ahead.min(), ahead.max() - ahead[-1]) > FOLD
    aside = np.abs(off[:, 0] * line.along[1] - off[:, 1] * line.along[0])
    strays = max(aside[0], aside[-1]) > CORNER or _without_ends(aside).max() > tolerance
    return not (folds or strays)


def _without_ends(stretch: FloatArray) -> FloatArray:
    return stretch[1:-1] if len(stretch) >= ENOUGH else stretch


def _distance_to_chord(stretch: FloatArray) -> FloatArray:
    """(n,) distance of each point from the segment between the first and the last."""
    chord, off = stretch[-1] - stretch[0], stretch - stretch[0]
    length = float(chord @ chord)
    share = np.clip(off @ chord / length, 0.0, 1.0) if length > 0 else np.zeros(len(off))
    return np.asarray(np.linalg.norm(off - share[:, None] * chord, axis=1))
