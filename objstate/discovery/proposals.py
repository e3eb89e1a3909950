"""Leaves that are tried, and what of the map is taken away where they may have been drawn."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery import kernels
from objstate.discovery.doorway import DEEP, Cells, Doorway, background, beside
from objstate.discovery.scoring import (
    BEFORE,
    DRAWN,
    FILLED,
    MAP_ASIDE,
    NEARLY_CLOSED,
    WALL_GOES_ON,
    Behind,
    Drawn,
    Leaf,
)
from objstate.discovery.walls import Opening
from objstate.geometry import BoolArray, FloatArray

SHIFTS = np.arange(-0.06, 0.061, 0.015)  # m, of the map across a wall
SHIFT_STD = 0.03  # m
TURNS = np.radians(np.arange(-155.0, 156.0, 5.0))  # of a leaf in the map that are tried
LEAST_TURN = np.radians(19.0)  # what stands nearer to the wall's line may be the wall
NARROWEST_LEAF, WIDEST_LEAF = 0.55, 1.4  # m
ALONG = 0.1  # m along the wall within which a hinge lies about a jamb
APART = DEEP / 5.0  # m, across the wall, of leaves that are tried
DRAWN_SHARE = 0.7  # of a leaf's length that the map shows
LONGER = 8  # cells beyond a leaf's end that have to be free


def proposals(place: Doorway) -> list[Leaf]:
    """Leaves on either side of each opening, in some places about its jambs."""
    found = []
    for about, opening in enumerate(place.openings):
        for from_end in (False, True):
            start, bearing = opening.jamb(from_end)
            inward = place.inward(start, bearing)
            for share, width in _widths(opening).items():
                for depth in np.arange(0.0, DEEP, APART):
                    hinge = start + depth * inward
                    for sense in (1, -1):
                        found.append(Leaf(hinge, bearing, sense, width, about, from_end, share))
    return found


@dataclass(frozen=True, eq=False)
class Shown:
    """What a map shows about a doorway, by opening."""

    cells: Cells
    between: list[BoolArray]  # the cells in the opening
    filling: list[list[Drawn]]  # what fills it, or a half
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
        cells, openings = Cells.about(plan, place.middle, place.radius + 0.3), place.openings
        between = [cells.in_doorway(opening) for opening in openings]
        filling = [_filling(cells, opening) for opening in openings]
        leaves = [_leaves(cells, opening, place) for opening in openings]
        return Shown(cells, between, filling, leaves)


def backgrounds(place: Doorway, shown: Shown) -> tuple[Behind, dict[int, list[Behind]]]:
    """The map as it is, and by opening without what it shows in the doorway, and without leaves there.

    The map is shifted across the wall so that it fits the readings best.
    """
    cells, bearing = shown.cells, place.openings[0].bearing
    across = np.tile([-np.sin(bearing), np.cos(bearing)], 2)
    segments = cells.segments()
    shifts = [shift * across for shift in SHIFTS]
    fits = [
        background(place, segments + shift)[1].sum()
        - 0.5 * (float(np.hypot(*shift[:2])) / SHIFT_STD) ** 2
        for shift in shifts
    ]
    shift = shifts[int(np.argmax(fits))]
    as_is = Behind(*background(place, segments + shift))
    cleared = {}
    for about, between in enumerate(shown.between):
        leaves, filling = shown.leaves[about], shown.filling[about]
        variants = [(filling, between)]
        variants += [([*filling, drawn], between | leaf) for drawn, leaf in leaves]
        for (first, its), (other, others) in ((leaves[a], leaves[b]) for a, b in shown.both(about)):
            variants.append(([*filling, first, other], between | its | others))
        cleared[about] = [
            replace(
                _without(place, cells.segments(taken) + shift, as_is, drawn),
                cells=cells.middles[~taken],
            )
            for drawn, taken in variants
        ]
    return as_is, cleared


def _filling(cells: Cells, opening: Opening) -> list[Drawn]:
    """What the map shows that fills an opening, as one leaf that is closed, or either of two."""
    between = cells.in_doorway(opening)
    along, aside = beside(cells.middles, opening.start, opening.bearing)
    first = along < opening.width / 2.0
    found = []
    for from_end, share, half in ((None, 1.0, between), (False, 0.5, first), (True, 0.5, ~first)):
        closing = between & half
        if cells.fill(closing, opening, share):
            start = opening.jamb(bool(from_end))[0]
            off = float(np.median(aside[closing])) / MAP_ASIDE
            log_none = share * float(np.logaddexp(FILLED, WALL_GOES_ON - 0.5 * off**2))
            found.append(Drawn(from_end, 0.0, start, share, cells.middles[closing], log_none))
    return found


def _leaves(cells: Cells, opening: Opening, place: Doorway) -> list[tuple[Drawn, BoolArray]]:
    """Leaves of an opening that the map shows: the end of the hinge and the turn, and their cells."""
    found: list[tuple[Drawn, BoolArray]] = []
    for from_end, (share, width) in product((False, True), _widths(opening).items()):
        start, bearing = opening.jamb(from_end)
        for hinge, turn in _drawn(cells, start, bearing, place.inward(start, bearing), width):
            if any(wall.holds(hinge, bearing + turn, width) for wall in place.walls):
                continue
            leaf = cells.on_leaf(hinge, bearing + turn, width)
            if cells.fill(~leaf & cells.behind(opening, width), opening, 1.0):
                continue  # the side of a recess
            fills = cells.fill(leaf & cells.in_doorway(opening), opening, share)
            log_none = share * FILLED if fills else DRAWN
            found.append((Drawn(from_end, turn, hinge, share, cells.middles[leaf], log_none), leaf))
    return found


def _widths(opening: Opening) -> dict[float, float]:
    """The widths, m, that leaves of an opening may have, by the share of it that they close."""
    widths = {share: share * opening.width for share in (1.0, 0.5)}
    return {k: width for k, width in widths.items() if NARROWEST_LEAF <= width <= WIDEST_LEAF}


def _without(place: Doorway, segments: FloatArray, as_is: Behind, drawn: list[Drawn]) -> Behind:
    """A map from which things were taken out."""
    expected, log_likelihood = background(place, segments)
    return Behind(expected, log_likelihood, tuple(drawn), as_is.log_likelihood - log_likelihood)


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
    for _, start, turn in found:
        if all(abs(turn - other) > np.radians(20.0) for _, other in kept):
            hinge, along = _fitted(points, start, bearing + turn, width, size)
            kept.append((hinge, along - bearing))
    return [each for each in kept[:2] if NEARLY_CLOSED < abs(each[1]) < np.pi - LEAST_TURN]


def _fitted(
    points: FloatArray, hinge: FloatArray, bearing: float, width: float, size: float
) -> tuple[FloatArray, float]:
    """A leaf's hinge and bearing by the cells (n, 2) about it, whose middles lie on it on average."""
    for reach in (1.5, 1.5, 1.0):
        along, aside = beside(points, hinge, bearing)
        on = (np.abs(aside) < reach * size) & (along > 2.0 * size) & (along < width + 2.0 * size)
        if on.sum() < 4:
            break
        lean, shift = np.polyfit(along[on], aside[on], 1).tolist()
        hinge = hinge + shift * np.array([-np.sin(bearing), np.cos(bearing)])
        bearing = bearing + float(np.arctan(lean))
    return hinge, bearing
