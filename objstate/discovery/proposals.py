"""Leaves that are tried, and what of the map is taken away where they may have been drawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from objstate.building.door_table import SLIDES
from objstate.building.occupancy import OccupancyMap
from objstate.discovery import kernels
from objstate.discovery.doorway import (
    DEEP,
    FILLED_SHARE,
    MARGIN,
    ON_LEAF,
    Cells,
    Doorway,
    background,
    beside,
)
from objstate.discovery.scoring import (
    BEFORE,
    DRAWN,
    MAP_ASIDE,
    NARROWEST_LEAF,
    WALL_GOES_ON,
    WIDEST_LEAF,
    Behind,
    Drawn,
    Leaf,
    log_filled,
)
from objstate.discovery.walls import Opening
from objstate.geometry import BoolArray, FloatArray, IntArray, wrap

# m, across a wall and along it, of the map
SHIFTS = np.stack(
    np.meshgrid(np.arange(-0.06, 0.061, 0.015), np.arange(-0.06, 0.061, 0.03)), axis=-1
).reshape(-1, 2)
SHIFT_STD, LOOK_STD = 0.03, 0.015  # m, of the map, and of a look
TURNS = np.radians(np.arange(-155.0, 156.0, 5.0))  # of a leaf in the map that are tried
LEAST_TURN = np.radians(19.0)  # what stands nearer to the wall's line may be the wall
LEAST_FITTED = np.radians(15.0)  # likewise, by the cells about it
ALONG = 0.1  # m along the wall within which a hinge lies about a jamb
DEPTHS = np.arange(0.0, DEEP, DEEP / 5.0)  # m in the wall, of leaves that are tried
ON_WALL = 0.04  # m before it, of leaves that slide along its face
DRAWN_SHARE = 0.7  # of a leaf's length that the map shows
SAME_LEAF = np.radians(20.0)  # between turns of what may be one
ABOUT_AS_WELL, MOST_FITTED = (
    0.1,
    16,
)  # of how well a map shows leaves, of which the straightest counts
GAP_BEHIND = 2.5  # cells without any, behind which there is something else
END_WEIGHT = 0.25  # of how far a leaf's end is off, against its cells
MOST_DRAWN = 2  # leaves in a map, about one jamb
LONGER = 8  # cells beyond a leaf's end that have to be free
STRAIGHT = 0.6  # cells by which the nearest of a leaf's cells lies beside it
LEAST_COLUMNS = 4  # cells along a leaf from which on they tell whether it is straight
CORNER, CORNER_ASIDE = 3, 2.5  # cells from a leaf's end on that are a corner, and beside it


def proposals(place: Doorway) -> list[Leaf]:
    """Leaves on either side of each opening, in some places about its jambs."""
    found = []
    for about, opening in enumerate(place.openings):
        for from_end in (False, True):
            start, bearing = opening.jamb(from_end)
            inward = place.inward(start, bearing)
            for share, width in _widths(opening).items():
                places = [(depth, sense) for depth in DEPTHS for sense in (1, -1, SLIDES)]
                for depth, sense in [*places, (-ON_WALL, SLIDES)]:
                    hinge = start + depth * inward
                    found.append(Leaf(hinge, bearing, sense, width, about, from_end, share))
    return found


@dataclass(frozen=True, eq=False)
class Shown:
    """What a map shows about a doorway, by opening."""

    cells: Cells
    between: list[BoolArray]  # the cells in the opening
    filling: list[list[tuple[Drawn, BoolArray]]]  # what fills it, or a half, and its cells
    leaves: list[list[tuple[Drawn, BoolArray]]]  # what may be its leaves, and their cells

    def both(self, about: int) -> list[tuple[int, int]]:
        """Numbers of what may be the two leaves of a double door, which open the same way."""
        halves = [(k, d) for k, (d, _) in enumerate(self.leaves[about]) if d.share < 1.0]
        return [
            (k, other)
            for (k, one), (other, two) in product(halves, halves)
            if not one.from_end and two.from_end and one.turn * two.turn < 0.0
        ]

    def proposed(self, place: Doorway) -> list[tuple[int, Leaf]]:
        """The leaves that it may show, with the numbers of the backgrounds without them."""
        found = []
        for about, (opening, leaves) in enumerate(zip(place.openings, self.leaves, strict=True)):
            both = [leaves[first] for first, _ in self.both(about)]
            for number, (drawn, _) in enumerate([*leaves, *both], start=1):
                from_end, width = bool(drawn.from_end), drawn.share * opening.width
                _, bearing = opening.jamb(from_end)
                sense = 1 if drawn.turn > 0.0 else -1
                leaf = Leaf(drawn.hinge, bearing, sense, width, about, from_end, drawn.share)
                found.append((number, leaf))
        return found

    @staticmethod
    def about(place: Doorway, plan: OccupancyMap) -> Shown:
        """What it shows about one."""
        cells, openings = Cells.about(plan, place.middle, place.radius + MARGIN), place.openings
        between = [cells.in_doorway(opening) for opening in openings]
        filling = [_filling(cells, opening, place) for opening in openings]
        leaves = [_leaves(cells, opening, place) for opening in openings]
        return Shown(cells, between, filling, leaves)


def settled(place: Doorway, plan: OccupancyMap) -> tuple[Doorway, FloatArray]:
    """A doorway whose looks fit the map best, and the shift (2,) m of the map there that does.

    Where the robot was in each look is off by some more.
    """
    bearing = place.openings[0].bearing
    along = np.array([np.cos(bearing), np.sin(bearing)])
    segments = Cells.about(plan, place.middle, place.radius + MARGIN).segments()
    shifts = SHIFTS @ np.array([[-along[1], along[0]], along])
    moved = (segments + np.tile(shift, 2) for shift in shifts)
    fits = np.array([background(place, each, is_fitted=False)[1] for each in moved])
    best = int(np.argmax(fits.sum(axis=1) - 0.5 * np.square(SHIFTS / SHIFT_STD).sum(axis=1)))
    own = np.square((SHIFTS - SHIFTS[best]) / LOOK_STD).sum(axis=1)
    each = np.argmax(fits - 0.5 * own[:, None], axis=0)
    return place.moved(shifts[best] - shifts[each]), shifts[best]


@dataclass(frozen=True, eq=False)
class Backgrounds:
    """The map about a doorway as it is, and without what may be leaves."""

    place: Doorway
    shown: Shown
    as_is: Behind
    # by opening, without what the map shows in the doorway, and without leaves there too
    cleared: dict[int, list[Behind]]

    @staticmethod
    def of(place: Doorway, shown: Shown) -> Backgrounds:
        """Those of one."""
        as_is = Behind(*background(place, shown.cells.segments()), is_shown=True)
        found = Backgrounds(place, shown, as_is, {})
        for about, leaves in enumerate(shown.leaves):
            both = [[leaves[one], leaves[other]] for one, other in shown.both(about)]
            variants = [[], *([leaf] for leaf in leaves), *both]
            found.cleared[about] = [found.without(about, some) for some in variants]
        return found

    def without(self, about: int, leaves: Sequence[tuple[Drawn, BoolArray]]) -> Behind:
        """Without what fills an opening, and some leaves with their cells.

        What fills it beside an open leaf, where that would close it, is left: it is no leaf.
        """
        cells, opening = self.shown.cells, self.place.openings[about]
        taken, drawn = self.shown.between[about].copy(), [each for each, _ in leaves]
        on_leaf = np.zeros_like(taken)
        for _, its in leaves:
            on_leaf |= its
        for filling, its in self.shown.filling[about]:
            is_beside = any(leaf.closes(filling) for leaf, _ in leaves)
            if is_beside and cells.fill(its & ~on_leaf, opening, filling.share):
                taken &= ~its
            else:
                drawn.append(filling)
        taken |= on_leaf
        expected, log_likelihood = background(self.place, cells.segments(taken))
        left = cells.middles[~taken]
        return Behind(expected, log_likelihood, tuple(drawn), self.as_is, cells=left)

    def redrawn(self, leaves: Sequence[Leaf], behind: Behind) -> Behind | None:
        """Without what lies on leaves, where the map shows them; None where it shows none of them."""
        shown = []
        for leaf in leaves:
            turn = behind.turn_in_map(leaf)
            if turn is None or self.place.is_wall(
                np.array([*leaf.hinge, leaf.bearing + turn, leaf.width])
            ):
                continue
            opening = self.place.openings[leaf.about]
            bearing = opening.jamb(leaf.from_end)[1]
            hung = leaf.hinge, turn + float(wrap(leaf.bearing - bearing)), leaf.width
            shown.append(_as_drawn(self.shown.cells, opening, leaf.from_end, leaf.share, hung))
        return self.without(leaves[0].about, shown) if shown else None


def _filling(cells: Cells, opening: Opening, place: Doorway) -> list[tuple[Drawn, BoolArray]]:
    """What the map shows that fills an opening, as one leaf that is closed, or either of two.

    It may be a piece of the opening's wall, or of another one.
    """
    normal = np.array([-np.sin(opening.bearing), np.cos(opening.bearing)])
    between = cells.in_doorway(opening)
    along, aside = beside(cells.middles, opening.start, opening.bearing)
    first = along < opening.width / 2.0
    found = []
    for from_end, share, half in ((None, 1.0, between), (False, 0.5, first), (True, 0.5, ~first)):
        closing = between & half
        if cells.fill(closing, opening, share):
            start, bearing = opening.jamb(bool(from_end))
            off, goes_on = float(np.median(aside[closing])), WALL_GOES_ON
            piece = np.array([*(start + off * normal), bearing, share * opening.width])
            if not place.is_wall(piece):
                goes_on -= 0.5 * (off / MAP_ASIDE) ** 2
            log_none = share * min(float(np.logaddexp(log_filled(opening), goes_on)), 0.0)
            filling = Drawn(from_end, 0.0, start, share, cells.middles[closing], log_none)
            found.append((filling, closing))
    return found


def _leaves(cells: Cells, opening: Opening, place: Doorway) -> list[tuple[Drawn, BoolArray]]:
    """Leaves of an opening that the map shows: the end of the hinge and the turn, and their cells."""
    found: list[tuple[Drawn, BoolArray]] = []
    for from_end, (share, width) in product((False, True), _widths(opening).items()):
        start, bearing = opening.jamb(from_end)
        for hinge, turn in _drawn(cells, start, bearing, place.inward(start, bearing), width):
            if place.is_wall(np.array([*hinge, bearing + turn, width])):
                continue
            drawn, leaf = _as_drawn(cells, opening, from_end, share, (hinge, turn, width))
            is_closed_behind = cells.fill(~leaf & cells.behind(opening, width), opening, 1.0)
            if is_closed_behind or _turns_in(cells, leaf, hinge, bearing + turn, bearing):
                continue  # it is the side of a recess
            found.append((drawn, leaf))
    return found


def _turns_in(
    cells: Cells, leaf: BoolArray, hinge: FloatArray, bearing: float, inwards: float
) -> bool:
    """Whether what the map shows in a leaf's cells (n,) turns a corner at the free end.

    That is along the opening, with the bearing ``inwards`` to the other jamb, as the wall does about
    a door at the back of a recess, before which nothing is. A map that shows a leaf at two angles
    has it there, too.
    """
    size = cells.plan.resolution
    along, _ = beside(cells.middles, hinge, bearing)
    length = along[leaf].max(initial=0.0)

    def across(way: float) -> IntArray:
        """Numbers of the cells along the opening, from a way along the leaf on."""
        start = hinge + way * np.array([np.cos(bearing), np.sin(bearing)])
        along, aside = beside(cells.middles, start, inwards)
        return np.round(along[np.abs(aside) < CORNER_ASIDE * size] / size).astype(np.int64)

    is_corner = np.isin(np.arange(1, CORNER + 1), across(length)).all()
    return bool(is_corner and not np.isin(across(length / 2.0), (CORNER - 1, CORNER)).any())


def _as_drawn(
    cells: Cells,
    opening: Opening,
    from_end: bool,
    share: float,
    leaf: tuple[FloatArray, float, float],
) -> tuple[Drawn, BoolArray]:
    """What a map shows in the place of a leaf, by its hinge, turn and width, and its cells."""
    hinge, turn, width = leaf
    bearing = opening.jamb(from_end)[1] + turn
    on = cells.on_leaf(hinge, bearing, width)
    fills = np.cos(turn) > 0.0 and FILLED_SHARE * width * abs(np.tan(turn)) < DEEP
    is_at_jamb = cells.has_jamb(~on, opening, from_end)
    points, log_none = cells.middles[on], share * log_filled(opening)
    if is_at_jamb and not fills:
        log_straight = _log_straight(points, hinge, bearing, cells.plan.resolution)
        log_none = min(DRAWN - log_straight, 0.0)
    return Drawn(from_end, turn, hinge, share, points, log_none), on


def _log_straight(points: FloatArray, hinge: FloatArray, bearing: float, size: float) -> float:
    """Log-likelihood ratio of cells (n, 2), of a size in m, on a leaf, to what isn't straight.

    That lies evenly about the leaf, as the steps of a recess do along its diagonal. What the map
    shows besides doesn't count. 0 at most.
    """
    along, aside = beside(points, hinge, bearing)
    _, column = np.unique(np.floor(along / size), return_inverse=True)
    counts = np.bincount(column)
    if len(counts) < LEAST_COLUMNS:
        return 0.0
    off = aside[np.lexsort((np.abs(aside), column))][np.cumsum(counts) - counts]  # the nearest
    std = STRAIGHT * size
    each = math.log(2.0 * ON_LEAF / (math.sqrt(2.0 * math.pi) * std))
    return min(float(np.sum(each - 0.5 * np.square(off / std))), 0.0)


def _widths(opening: Opening) -> dict[float, float]:
    """The widths, m, that leaves of an opening may have, by the share of it that they close."""
    widths = {share: share * opening.width for share in (1.0, 0.5)}
    return {k: width for k, width in widths.items() if NARROWEST_LEAF <= width <= WIDEST_LEAF}


def _drawn(
    cells: Cells, jamb: FloatArray, bearing: float, inward: FloatArray, width: float
) -> list[tuple[FloatArray, float]]:
    """Hinges about a jamb, and turns from the closed leaf, at which the map shows a leaf.

    That is something as long as a leaf, and no longer. What is nearly parallel to the opening fills
    it, or is the back of a recess.
    """
    size, turns = cells.plan.resolution, TURNS[np.abs(TURNS) > LEAST_TURN]
    near = np.hypot(*(cells.middles - jamb).T) < width + LONGER * size + np.hypot(ALONG, DEEP)
    points = cells.middles[near]
    reach, before, deep = (round(way / size) for way in (ALONG, BEFORE, DEEP))
    unit = np.array([np.cos(bearing), np.sin(bearing)])
    along = np.arange(-reach, reach + 1)[:, None] * size * unit
    depth = np.arange(-before, deep + 1)[:, None] * size * inward
    hinges = (jamb + along[:, None] + depth).reshape(-1, 2)
    last, beyond = int(width / size), int(width / size) + LONGER
    shown = np.zeros((len(hinges), len(turns), beyond + 1), dtype=bool)
    kernels.shown_along(points, hinges, bearing + turns, size, shown)
    shown[..., 1:-1] |= shown[..., :-2] & shown[..., 2:]  # scans miss single cells
    shares = shown[..., 2:last].mean(axis=-1)
    able = (shares > DRAWN_SHARE) & (shown[..., last + 2 :].sum(axis=-1) <= 2)
    # a jamb may go on as the leaf does: the leaf's end tells where it begins
    ends = beyond - np.argmax(shown[..., ::-1], axis=-1)
    fits = shares - np.abs((ends + 1) * size - width) / width
    found = [(float(fits[h, k]), hinges[h], float(turns[k])) for h, k in np.argwhere(able)]
    found.sort(key=lambda each: -each[0])
    kept: list[tuple[FloatArray, float]] = []
    while found and len(kept) < MOST_DRAWN:
        best, _, turn = found[0]
        same = [each for each in found if abs(each[2] - turn) <= SAME_LEAF]
        found = [each for each in found if abs(each[2] - turn) > SAME_LEAF]
        alike = [each for each in same if each[0] > best - ABOUT_AS_WELL][:MOST_FITTED]
        fitted = [_fitted(points, start, bearing + way, width, size) for _, start, way in alike]
        _, hinge, along = min(fitted, key=lambda each: each[0])
        turn = along - bearing
        is_leaf = LEAST_FITTED < abs(turn) < np.pi - LEAST_TURN
        if is_leaf and all(abs(turn - other) > SAME_LEAF / 2.0 for _, other in kept):
            kept.append((hinge, turn))
    return kept


def _fitted(
    points: FloatArray, hinge: FloatArray, bearing: float, width: float, size: float
) -> tuple[float, FloatArray, float]:
    """A leaf's hinge and bearing by the cells (n, 2) about it, whose middles lie on it on average.

    And how far they lie from it, and its end from theirs, m.
    """
    off, near = size, width + LONGER * size
    for reach in (1.5, 1.5, 1.0):
        along, aside = beside(points, hinge, bearing)
        on = (np.abs(aside) < reach * size) & (along > 2.0 * size) & (along < width + 2.0 * size)
        if on.sum() < 4:
            break
        lean, shift = np.polyfit(along[on], aside[on], 1).tolist()
        hinge = hinge + shift * np.array([-np.sin(bearing), np.cos(bearing)])
        bearing = bearing + float(np.arctan(lean))
        along, aside = beside(points, hinge, bearing)
        on = (np.abs(aside) < size) & (along > 0.0) & (along < near)
        ordered = np.sort(along[on])
        gaps = np.flatnonzero(np.diff(ordered) > GAP_BEHIND * size)
        end = float(ordered[gaps[0] if len(gaps) else -1]) + size / 2.0 - width
        off = float(np.hypot(np.sqrt(np.mean(np.square(aside[on]))), END_WEIGHT * end))
    return off, hinge, bearing
