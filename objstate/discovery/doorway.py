"""A place where a wall opens: the openings found there, and the beams that tell of it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from objstate.building.contours import border_loops, straighten
from objstate.building.occupancy import OccupancyMap
from objstate.config import BeamModelSettings
from objstate.discovery import kernels, surfaces
from objstate.discovery.gathering import Beams
from objstate.discovery.walls import BESIDE, Opening, WallLine
from objstate.geometry import BoolArray, FloatArray, IntArray, wrap
from objstate.sensing.beam_model import BeamModel

TOGETHER = 0.5  # m between the middles of openings of one doorway
PARALLEL = np.radians(20.0)
NEAR = 6.0  # m from the laser: farther beams lie too far apart
REST_S = 20.0  # s without a look after which the door may have been moved
MOST_SCANS = 20  # of one look
# beams of a look that tell something of their own: all share the robot's and the map's error
TOLD = 150.0
ROUGH, FINE = 250, 800  # beams of a look for a first search, and for all else
MOST_LOOKS = 16  # of one doorway, evenly over all of them
# probability that a door stands as before: in the same drive, in the next
STAYS, UNMOVED = 0.9, 0.5
MARGIN = 0.3  # m about all places of a leaf that count
TOLERANCE, INSET = 0.75, 0.5  # cells, as `building from-map` straightens walls
DEEP = 0.27  # m from the wall's line, within which a closed leaf may lie
FILLED_SHARE = 0.7  # of an opening's width that something covers which closes it
ON_LEAF = 0.08  # m from a leaf within which a reading is of it
JAMB = 0.03  # m of a jamb that stays when a doorway is cleared
JAMB_SHOWN = 0.5  # m of wall beside an opening, whose readings are wall or what doors explain
JAMB_WALL = 0.2  # m of wall beside an opening, by which it is one without what stands there


@dataclass(frozen=True, eq=False)
class Doorway:
    """Openings in one place, and what was seen of it."""

    openings: list[Opening]
    walls: list[WallLine] = field(repr=False)  # all of the building's
    middle: FloatArray = field(repr=False)  # (2,) m
    radius: float  # m, of the disc in which a leaf may be
    robot: FloatArray  # (2,) m, from where it was seen, mostly
    beams: FloatArray = field(repr=False)  # (9, n) as the kernels take them
    group: IntArray = field(repr=False)  # (n,) number of the look
    groups: int
    drive: IntArray  # (groups,) number of the drive of each look
    seconds: FloatArray  # (groups, 2) s, when each look began and ended
    exponents: FloatArray  # (groups,) on the likelihood of each look
    # (groups,) probability that nothing was moved since the look before, or since the map
    stays: FloatArray
    model: FloatArray = field(repr=False)  # (5,) beam model

    def is_near(self, other: Doorway) -> bool:
        """Whether leaves of both may be in one place."""
        return bool(np.hypot(*(self.middle - other.middle)) < self.radius + other.radius)

    def side(self, start: FloatArray, bearing: float) -> int:
        """On which side of a line the robot was: 1 is the left."""
        _, aside = beside(self.robot[None], start, bearing)
        return 1 if aside[0] > 0.0 else -1

    def inward(self, start: FloatArray, bearing: float) -> FloatArray:
        """(2,) unit vector across a line, away from where the robot was."""
        return -self.side(start, bearing) * np.array([-np.sin(bearing), np.cos(bearing)])

    def is_wall(self, leaf: FloatArray) -> bool:
        """Whether a leaf (4,), with its hinge, bearing and width, is a piece of one of the walls."""
        bearing, width = leaf[2:].tolist()
        return any(wall.holds(leaf[:2], bearing, width) for wall in self.walls)

    def log_likelihood(self, expected: FloatArray) -> FloatArray:
        """(groups,) of the looks, tempered, for expected distances (3, n) m beside the beams."""
        out = np.zeros(self.groups)
        kernels.background_log_likelihood(self.beams, expected, self.group, self.model, out)
        return np.asarray(self.exponents * out)

    def moved(self, offsets: FloatArray) -> Doorway:
        """The same where the robot stood elsewhere in each look, by offsets (groups, 2) m."""
        beams = self.beams.copy()
        beams[[kernels.ORIGIN_X, kernels.ORIGIN_Y]] += offsets[self.group].T
        return replace(self, beams=beams)

    @property
    def rough(self) -> Doorway:
        """The same with fewer beams."""
        kept = thinned(self.group, ROUGH)
        beams = np.ascontiguousarray(self.beams[:, kept])
        return replace(
            self, beams=beams, group=self.group[kept], exponents=exponents(self.group[kept])
        )


def ended_on(place: Doorway, beams: Beams, leaves: FloatArray) -> IntArray:
    """The beams that ended on a leaf with its hinge, bearing and width (groups, 4) in each look."""
    out = []
    for k, leaf in enumerate(leaves):
        hinge, bearing, width = leaf[:2], float(leaf[2]), leaf[3]
        along = np.array([np.cos(bearing), np.sin(bearing)])
        readings = beams.readings
        about = readings.nearby.strip(hinge, hinge + width * along, 2.0 * ON_LEAF)
        index = readings.numbers[about]
        begin, end = place.seconds[k] + np.array([-REST_S, REST_S]) / 2.0
        seconds = beams.seconds[index]
        meant = (beams.drive[index] == place.drive[k]) & (seconds > begin) & (seconds < end)
        far, aside = beside(readings.ends[about], hinge, bearing)
        is_on = (np.abs(aside) < ON_LEAF) & (far > -ON_LEAF) & (far < width + ON_LEAF)
        out.append(index[is_on & meant])
    return np.unique(np.concatenate(out))


def unexplained(opening: Opening, beams: Beams, left: BoolArray) -> Opening:
    """An opening beside which only some readings are ``left`` (n,) of all that show its wall.

    What ended on a leaf of an accepted door is no wall.
    """
    readings, shares = beams.readings, [1.0]
    for is_end in (False, True):
        jamb, bearing = opening.jamb(is_end)
        far = jamb - JAMB_SHOWN * np.array([np.cos(bearing), np.sin(bearing)])
        about = readings.nearby.strip(jamb, far, BESIDE)
        along, aside = beside(readings.ends[about], jamb, bearing)
        on = about[(np.abs(aside) < BESIDE) & (along < 0.0) & (along > -JAMB_SHOWN)]
        if len(on):
            shares.append(float(left[readings.numbers[on]].mean()))
    return replace(opening, p_wall=opening.p_wall * min(shares))


def exponents(group: IntArray) -> FloatArray:
    """On the likelihood of each look, so that its beams (n,) count as at most ``TOLD``."""
    return np.asarray(np.minimum(TOLD / np.maximum(np.bincount(group), 1), 1.0))


def thinned(group: IntArray, most: int) -> IntArray:
    """Numbers of beams (n,), about evenly as many as ``most`` of each group; groups in a row."""
    every = np.maximum(np.bincount(group) // most, 1)[group]
    rank = np.arange(len(group)) - np.searchsorted(group, group)
    return np.flatnonzero(rank % every == 0)


def together(found: list[Opening]) -> list[list[Opening]]:
    """Openings by the place where they are."""
    places: list[list[Opening]] = []
    for opening in found:
        for place in places:
            turn = abs(float(wrap(2 * (opening.bearing - place[0].bearing)))) / 2
            if turn < PARALLEL and np.hypot(*(opening.middle - place[0].middle)) < TOGETHER:
                place.append(opening)
                break
        else:
            places.append([opening])
    return places


def doorway(
    found: list[Opening],
    walls: list[WallLine],
    plan: OccupancyMap,
    beams: Beams,
    settings: BeamModelSettings,
    left: BoolArray | None = None,
) -> Doorway:
    """What drives saw of openings that are together, by the beams that are ``left`` (n,) of all."""
    widest = max(opening.width for opening in found)
    leaf = widest if widest < 1.4 else widest / 2
    middle = np.mean([opening.middle for opening in found], axis=0)
    radius = widest / 2 + leaf + MARGIN
    inside, past = _through(beams, middle, radius)
    if left is not None:
        inside, past = inside[left[inside]], past[left[inside]]
    group, stays = _looks(beams, inside)
    chosen = np.flatnonzero(group >= 0)
    chosen = chosen[thinned(group[chosen], FINE)]
    index = inside[chosen]
    first = np.unique(group[chosen], return_index=True)[1]
    last = np.append(first[1:], len(index))[: len(first)] - 1
    model = BeamModel(settings)
    peak, per_sigma, random, missing, hit = model.parameters(1.0)[:5]
    ranges = beams.ranges[index]
    rows = np.stack(
        [
            *beams.origins[index].T,
            *beams.directions[index].T,
            ranges,
            past[chosen],
            beams.reach[index],
            model.short(np.where(np.isfinite(ranges), ranges, 1e3)),
            np.empty(len(index)),
        ]
    )
    known = plan.occupied | plan.free
    cells = 1.0 / plan.resolution
    kernels.enter_unknown(rows, known, plan.origin, cells, rows[kernels.UNKNOWN])
    return Doorway(
        openings=found,
        walls=walls,
        middle=middle,
        radius=radius,
        robot=np.median(beams.origins[index], axis=0) if len(index) else middle,
        beams=np.ascontiguousarray(rows),
        group=group[chosen],
        groups=int(group.max(initial=-1)) + 1,
        drive=beams.drive[index[first]],
        seconds=np.column_stack([beams.seconds[index[first]], beams.seconds[index[last]]]),
        exponents=exponents(group[chosen]),
        stays=stays,
        model=np.array([hit, per_sigma, peak, random, missing]),
    )


def _through(beams: Beams, middle: FloatArray, radius: float) -> tuple[IntArray, FloatArray]:
    """Beams that reach a disc, and how far along they leave it (n,) m."""
    scans = beams.scans
    chosen = np.flatnonzero(np.hypot(*(beams.origins[scans[:-1]] - middle).T) < NEAR)
    most = int((scans[chosen + 1] - scans[chosen]).sum())
    index, past = np.empty(most, dtype=np.int64), np.empty(most)
    rays = beams.origins, beams.directions, beams.ranges
    count = kernels.through(*rays, scans, chosen, middle, radius, index, past)
    return index[:count], past[:count]


def _looks(beams: Beams, index: IntArray) -> tuple[IntArray, FloatArray]:
    """(n,) the number of each beam's look, a stretch without a pause in which a door may be moved.

    Beams that are left out have -1. And for each look the probability that nothing was moved since
    the one before, or since the map.
    """
    out = np.full(len(index), -1)
    scans, place = np.unique(beams.scan[index], return_inverse=True)
    if not len(scans):
        return out, np.empty(0)
    first = index[np.unique(place, return_index=True)[1]]
    is_next = np.diff(beams.drive[first], prepend=-1) > 0
    pause = np.diff(beams.seconds[first], prepend=beams.seconds[first[0]]) > REST_S
    begins = np.flatnonzero(pause | is_next)
    stays = np.where(is_next[begins], UNMOVED, STAYS)
    look = np.searchsorted(begins, np.arange(len(scans)), side="right") - 1
    looks = _evenly(len(begins), MOST_LOOKS)
    for number, each in enumerate(looks.tolist()):
        mine = np.flatnonzero(look == each)
        out[np.isin(place, mine[_evenly(len(mine), MOST_SCANS)])] = number
    since = np.concatenate([[0], looks[:-1] + 1])
    return out, np.multiply.reduceat(stays, since)


def _evenly(count: int, most: int) -> IntArray:
    """Some of so many numbers."""
    return np.linspace(0, count - 1, min(most, count)).round().astype(np.int64)


@dataclass(frozen=True, eq=False)
class Cells:
    """The occupied cells of a map about a doorway."""

    plan: OccupancyMap
    corner: IntArray  # (2,) row and column of the first cell
    occupied: BoolArray = field(repr=False)  # (rows, columns)
    middles: FloatArray = field(repr=False)  # (k, 2) m of the occupied ones
    places: tuple[IntArray, IntArray] = field(repr=False)  # their rows and columns
    rings: dict[bytes, FloatArray] = field(default_factory=dict, repr=False)  # straightened loops

    @staticmethod
    def about(plan: OccupancyMap, middle: FloatArray, radius: float) -> Cells:
        """Those within a square about a place."""
        size = plan.occupied.shape
        corners = np.array([[0, 0], [size[1], 0], [0, size[0]], [size[1], size[0]]], dtype=float)
        origin, right, up = plan.to_building(corners)[:3]
        per_column, per_row = (right - origin) / size[1], (up - origin) / size[0]
        away = middle - origin
        column = away @ per_column / plan.resolution**2
        row = away @ per_row / plan.resolution**2
        reach = int(np.ceil(radius / plan.resolution)) + 4
        low = np.maximum([int(row) - reach, int(column) - reach], 0)
        high = np.maximum([int(row) + reach, int(column) + reach], 0)
        occupied = plan.occupied[low[0] : high[0], low[1] : high[1]]
        rows, columns = np.nonzero(occupied)
        middles = plan.to_building(np.column_stack([columns + low[1], rows + low[0]]) + 0.5)
        return Cells(plan, low, occupied, middles, (rows, columns))

    def segments(self, cleared: BoolArray | None = None) -> FloatArray:
        """Walls (k, 4) m as `building from-map` makes them, without the cleared ones (n,) of the cells."""
        occupied = self.occupied
        if cleared is not None and cleared.any():
            occupied = occupied.copy()
            occupied[self.places[0][cleared], self.places[1][cleared]] = False
        pieces = []
        for loop in border_loops(occupied):
            key = loop.tobytes()  # most stay as they are when others are cleared
            if key not in self.rings:
                self.rings[key] = straighten(loop, TOLERANCE, INSET)
            ring = self.plan.to_building(self.rings[key] + self.corner[::-1])
            pieces.append(np.hstack([ring, np.roll(ring, -1, axis=0)]))
        return np.concatenate(pieces) if pieces else np.zeros((0, 4))

    def in_doorway(self, opening: Opening) -> BoolArray:
        """(n,) the cells between its jambs."""
        along, aside = beside(self.middles, opening.start, opening.bearing)
        return (along > JAMB) & (along < opening.width - JAMB) & (np.abs(aside) < DEEP)

    def behind(self, opening: Opening, depth: float) -> BoolArray:
        """(n,) the cells between its jambs' lines, farther than a wall's depth on either side."""
        along, aside = beside(self.middles, opening.start, opening.bearing)
        aside = np.abs(aside)
        return (along > JAMB) & (along < opening.width - JAMB) & (aside > DEEP) & (aside < depth)

    def fill(self, some: BoolArray, opening: Opening, share: float) -> bool:
        """Whether some of the cells (n,) close a share of an opening."""
        along, _ = beside(self.middles[some], opening.start, opening.bearing)
        return self._covered(along) > FILLED_SHARE * share * (opening.width - 2 * JAMB)

    def has_jamb(self, some: BoolArray, opening: Opening, from_end: bool) -> bool:
        """Whether some of the cells (n,) show wall beside an opening, at its end or its start."""
        start, bearing = opening.jamb(from_end)
        along, aside = beside(self.middles[some], start, bearing)
        near = (along < JAMB) & (along > -JAMB_WALL) & (np.abs(aside) < DEEP)
        return self._covered(along[near]) > FILLED_SHARE * JAMB_WALL

    def _covered(self, along: FloatArray) -> float:
        """How much of a line cells cover that lie so far along it (n,), m."""
        return len(np.unique(np.floor(along / self.plan.resolution))) * self.plan.resolution

    def on_leaf(self, hinge: FloatArray, bearing: float, width: float) -> BoolArray:
        """(n,) the cells about a leaf; those at its hinge are the jamb."""
        along, aside = beside(self.middles, hinge, bearing)
        smear = 2.0 * self.plan.resolution
        return (along > smear) & (along < width + smear) & (np.abs(aside) < smear)


def beside(points: FloatArray, start: FloatArray, bearing: float) -> tuple[FloatArray, FloatArray]:
    """Where points (n, 2) lie along a ray and to its left, m."""
    offset = points - start
    cos, sin = np.cos(bearing), np.sin(bearing)
    return offset @ np.array([cos, sin]), offset @ np.array([-sin, cos])


def background(
    place: Doorway, segments: FloatArray, *, is_fitted: bool = True
) -> tuple[FloatArray, FloatArray]:
    """Expected distances (3, n) beside the beams, and their log-likelihood by look (groups,), tempered.

    Surfaces lie where readings show them, near to where the map has them.
    """
    shape, segments = (len(kernels.ASIDE), place.beams.shape[1]), np.ascontiguousarray(segments)
    expected, met = np.empty(shape), np.empty(shape, dtype=np.int64)
    for k, aside in enumerate(kernels.ASIDE):
        surfaces.cast(place.beams, segments, aside, expected[k], met[k])
    if is_fitted:
        off, weights = np.empty((len(segments), 2)), place.exponents[place.group]
        surfaces.offsets(place.beams, segments, expected[0], met[0], weights, place.model, off)
        for k, aside in enumerate(kernels.ASIDE):
            surfaces.displace(place.beams, segments, aside, met[k], off, expected[k])
    return expected, place.log_likelihood(expected)
