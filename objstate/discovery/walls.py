"""Lines along which walls run, and where maps and drives show openings in them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from objstate.building.occupancy import OccupancyMap
from objstate.discovery import kernels
from objstate.discovery.gathering import Beams, Readings
from objstate.discovery.nearby import Nearby
from objstate.discovery.surfaces import STEEP
from objstate.geometry import BoolArray, FloatArray, IntArray, wrap

BIN = 0.025  # m along a line
LEAST_WALL = 0.25  # m: shorter pieces make no line
SAME_WAY = np.radians(4.0)  # between pieces of one line
SAME_LINE = 0.08  # m aside, likewise
PARALLEL = np.sin(2.0 * SAME_WAY)  # sine of the angle between walls that run alike
OUTER_DOORS = 0.02  # doors among openings of a wall around the building, to those between rooms
LONGER = 2.0  # times as long as an opening: what is no leaf of it
BROKEN = 3.0  # likewise, in pieces with openings between them
BESIDE = 0.07  # m within which a reading is of the wall
NARROWEST, WIDEST = 0.45, 2.5  # m: a leaf that stands ajar hides a part of its opening
MARGIN = 0.3  # m of unknown that may part an opening from its wall
HOLE = 0.15  # m without readings in a piece of wall
KNOWN = 0.5  # share of an opening that the map has to know: elsewhere nobody mapped a door
JAMB = 0.1  # m of wall that has to show beside an opening
# Along a wall this share is shown to be wall, the rest are doorways and niches; along a line
# through pieces of other things it is the other way round. Pieces are as long as half a metre,
# stretches of wall ten times that. Of the length of all lines a fifth runs along walls.
WALL_SHARE, PIECE, STRETCH, WALLS = 0.75, 0.5, 5.0, 0.2  # 1, m, m, 1
LEAVES = BIN / STRETCH  # probability that a wall ends in a bin
# Walls of a building run in few directions, other things in others as well: the density of either
# is a mean over all lines, and even for this share of them.
TURN_STD, ANY_TURN, ROUNDS = np.radians(2.0), 0.1, 4  # rad, 1, 1
ENOUGH = 2  # beams that tell of a bin
THICKEST = 0.35  # m of a wall
HIDDEN = 0.5  # share of an opening behind another wall from which on it is none
WALL_STD = 0.02  # m, of readings about their wall
FREE, STRAY = 1.0, 0.02  # m over which beams end that pass an opening; share that end anywhere
INNER = 0.6  # share of an opening in which its beams are counted
JAMB_REACH = 0.15  # m about a jamb within which it may be
JAMB_BIAS, JAMB_STD = (
    -0.02,
    0.04,
)  # m, of jambs from where bins show them: bins and cells reach beyond
JAMB_BEAMS = 40.0  # beams about a jamb that tell something of their own
WIDTHS = 0.08, 0.05, 0.03, 0.02, 0.02  # m, of the weights with which a line is fitted, in turn
FEWEST = 30  # readings by which a line is fitted
LEAN = 0.01  # rad, prior deviation of a line's direction from the map's


@dataclass(frozen=True, eq=False)
class WallLine:
    """A line along which walls run."""

    start: FloatArray = field(repr=False)  # (2,) m
    along: FloatArray = field(repr=False)  # (2,) unit vector
    length: float  # m
    # m along it, where readings show wall, but for holes, begins and ends
    solid: tuple[tuple[float, float], ...] = ()

    @property
    def normal(self) -> FloatArray:
        """(2,) to the left."""
        return np.array([-self.along[1], self.along[0]])

    @property
    def shown(self) -> float:
        """m of it that are wall."""
        return sum(end - begin for begin, end in self.solid)

    def at(self, place: float) -> FloatArray:
        """The point (2,) so many metres along."""
        return np.asarray(self.start + place * self.along)

    def holds(self, start: FloatArray, bearing: float, length: float) -> bool:
        """Whether something straight is a piece of a wall, which goes on or is broken by openings.

        It lies where readings of the wall do. What shows there may be itself: the wall is beside it.
        """
        along = np.array([np.cos(bearing), np.sin(bearing)])
        off = start + length / 2.0 * along - self.start
        place = float(off @ self.along)
        is_on = abs(along @ self.normal) < PARALLEL and abs(off @ self.normal) < BESIDE
        if not is_on or not 0.0 < place < self.length:
            return False
        low, high = place - length / 2.0, place + length / 2.0
        solid = np.reshape(self.solid, (-1, 2))
        goes_on = solid[(solid[:, 0] < place) & (solid[:, 1] > place)]
        whole = np.clip([low - goes_on[:, 0], goes_on[:, 1] - high], 0.0, None).sum()
        beside = np.clip(solid, low - WIDEST, low), np.clip(solid, high, high + WIDEST)
        pieces = np.diff(np.concatenate(beside)).sum()
        return bool(whole >= (LONGER - 1.0) * length or pieces >= (BROKEN - 1.0) * length)


@dataclass(frozen=True, eq=False)
class Opening:
    """Where a wall's line is open, in the map or in a drive."""

    start: FloatArray  # (2,) m, one jamb
    end: FloatArray  # (2,) m, the other
    p_wall: float = 1.0  # probability that its line is a wall there
    p_inner: float = 1.0  # probability that this wall parts rooms, and isn't around all of them

    @cached_property
    def p_doorway(self) -> float:
        """Probability of a wall, and of doors in it relative to one that parts rooms."""
        return self.p_wall * (self.p_inner + OUTER_DOORS * (1.0 - self.p_inner))

    @cached_property
    def width(self) -> float:
        """m"""
        return float(np.hypot(*(self.end - self.start)))

    @property
    def middle(self) -> FloatArray:
        """(2,) m"""
        return np.asarray((self.start + self.end) / 2)

    @cached_property
    def along(self) -> FloatArray:
        """(2,) unit vector from start to end."""
        return np.asarray((self.end - self.start) / self.width)

    @cached_property
    def bearing(self) -> float:
        """rad, from start to end."""
        return float(np.arctan2(*(self.end - self.start)[::-1]))

    def jamb(self, is_end: bool) -> tuple[FloatArray, float]:
        """One of the jambs (2,), and the bearing from there to the other, rad."""
        return (self.end, self.bearing + np.pi) if is_end else (self.start, self.bearing)


def wall_lines(segments: FloatArray) -> list[WallLine]:
    """Lines through pieces of wall (k, 2, 2), the longest piece's first; each piece belongs to one."""
    way = segments[:, 1] - segments[:, 0]
    length = np.hypot(*way.T)
    left = np.ones(len(segments), dtype=bool)
    lines = []
    for first in np.argsort(-length):
        if not left[first] or length[first] < LEAST_WALL:
            continue
        along = way[first] / length[first]
        normal = np.array([-along[1], along[0]])
        offsets = segments - segments[first, 0]
        aside = np.abs(offsets @ normal).max(axis=1)
        straight = np.abs(way @ normal) <= np.sin(SAME_WAY) * length
        # a longer piece that leans has left the line at its far end
        mine = left & straight & (aside < SAME_LINE)
        left &= ~mine
        places = (offsets[mine] @ along).ravel()
        low, high = float(places.min()), float(places.max())
        lines.append(WallLine(segments[first, 0] + low * along, along, high - low))
    return lines


def fitted(lines: list[WallLine], beams: Beams) -> list[WallLine]:
    """The lines through the readings about them, the longest first; those that coincide are one.

    A map's walls are half a cell off, and lean where a recess begins.
    """
    readings = beams.readings
    lines = [_extended(line, readings) for line in _through_readings(lines, beams)]
    found = _each_once(_through_readings(_each_once(lines), beams))
    return [
        replace(line, solid=_solid(line, places))
        for line, places, _ in _of_each(found, beams, BESIDE)
    ]


def _through_readings(lines: list[WallLine], beams: Beams) -> list[WallLine]:
    """The lines through the readings about them, nearer and nearer ones."""
    for width in WIDTHS:
        lines = [
            _moved(line, places, asides, width)
            for line, places, asides in _of_each(lines, beams, 3.0 * width)
        ]
    return lines


def _of_each(
    lines: list[WallLine], beams: Beams, near: float
) -> Iterator[tuple[WallLine, FloatArray, FloatArray]]:
    """Each line, and where along and to the left of it the readings (n,) are that are its own, m."""
    index, of, aside = _on_lines(lines, beams, near)
    ends, order = beams.ends(index), np.argsort(of, kind="stable")
    parts = np.split(order, np.searchsorted(of[order], np.arange(1, len(lines))))
    for line, mine in zip(lines, parts, strict=True):
        yield line, (ends[mine] - line.start) @ line.along, aside[mine]


def _on_lines(
    lines: list[WallLine], beams: Beams, near: float, steep: float = STEEP
) -> tuple[IntArray, IntArray, FloatArray]:
    """The beams that end near lines which they meet steeply, their lines, and m to the left of these."""
    readings = beams.readings
    of, aside = _nearest(lines, readings.nearby, readings.ends, readings.directions, near, steep)
    kept = np.flatnonzero(of >= 0)
    return readings.numbers[kept], of[kept], aside[kept]


def _nearest(
    lines: list[WallLine],
    nearby: Nearby,
    ends: FloatArray,
    directions: FloatArray,
    near: float,
    steep: float,
) -> tuple[IntArray, FloatArray]:
    """(n,) the number of the nearest line within ``near`` m of ends (n, 2), -1: none.

    And (n,) how far to its left they lie, m.
    """
    of, aside = np.full(len(ends), -1), np.full(len(ends), near)
    ends, directions = np.ascontiguousarray(ends), np.ascontiguousarray(directions)
    for number, line in enumerate(lines):
        about = nearby.strip(line.start, line.at(line.length), near)
        kernels.nearest_line(ends, directions, about, _table(line), number, steep, of, aside)
    return of, aside


def _moved(line: WallLine, places: FloatArray, asides: FloatArray, width: float) -> WallLine:
    """A line by weighted least squares (Cauchy) to readings (n,) along and aside of it."""
    if len(places) < FEWEST:
        return line
    places = places - line.length / 2.0
    weights = 1.0 / (1.0 + (asides / width) ** 2)
    design = np.column_stack([np.ones(len(places)), places])
    normal = design.T @ (weights[:, None] * design) + np.diag([0.0, (width / LEAN) ** 2])
    shift, lean = np.linalg.solve(normal, design.T @ (weights * asides)).tolist()
    along = line.along + lean * line.normal
    along /= np.hypot(*along)
    middle = line.at(line.length / 2.0) + shift * line.normal
    return WallLine(middle - line.length / 2.0 * along, along, line.length)


def _extended(line: WallLine, readings: Readings) -> WallLine:
    """A line as far as readings show the same wall, across openings: maps leave walls out.

    It gets three times as long at most, as the direction of a short one isn't known well.
    """
    walls = _pieces(line, readings, line.length + MARGIN)
    low, high = 0.0, line.length
    for begin, end in walls:
        if high < end < 2.0 * line.length and begin - high < WIDEST:
            high = end
    for begin, end in reversed(walls):
        if -line.length < begin < low and low - end < WIDEST:
            low = begin
    return WallLine(line.at(low), line.along, high - low)


def _pieces(line: WallLine, readings: Readings, beyond: float) -> list[tuple[float, float]]:
    """Where along a line and up to ``beyond`` m before and behind it readings show wall, m."""
    about = readings.nearby.strip(line.at(-beyond), line.at(line.length + beyond), BESIDE)
    off = readings.ends[about] - line.start
    is_steep = np.abs(readings.directions[about] @ line.normal) > STEEP
    on_line = (np.abs(off @ line.normal) < BESIDE) & is_steep
    return _shown((off @ line.along)[on_line])


def _shown(places: FloatArray) -> list[tuple[float, float]]:
    """Pieces of wall that readings show which end at some places (k,) along a line, m."""
    bins = np.floor(places / BIN)
    known, counts = np.unique(bins, return_counts=True)
    shown = known[counts >= ENOUGH] * BIN
    pieces = np.split(shown, np.flatnonzero(np.diff(shown) > 2.5 * BIN) + 1)
    return [
        (float(piece[0]), float(piece[-1]) + BIN)
        for piece in pieces
        if len(piece) * BIN >= LEAST_WALL
    ]


def _solid(line: WallLine, places: FloatArray) -> tuple[tuple[float, float], ...]:
    """Where along a line its readings at some places (k,) show wall, but for short gaps, m."""
    found: list[tuple[float, float]] = []
    for begin, end in _shown(places):
        low, high = max(begin, 0.0), min(end, line.length)
        if found and low - found[-1][1] < HOLE:
            low = found.pop()[0]
        if high > low:
            found.append((low, high))
    return tuple(found)


def _each_once(lines: list[WallLine]) -> list[WallLine]:
    """The lines, the longest first, each as long as all that lie on it."""
    found: list[WallLine] = []
    table = np.empty((len(lines), 5))  # of those found
    for line in sorted(lines, key=lambda each: -each.length):
        known = table[: len(found)]
        ends = np.array([line.start, line.at(line.length)])[:, None] - known[:, :2]
        aside = np.abs(known[:, 2] * ends[..., 1] - known[:, 3] * ends[..., 0]).max(axis=0)
        places = known[:, 2] * ends[..., 0] + known[:, 3] * ends[..., 1]
        low, high = places.min(axis=0), places.max(axis=0)
        is_on = (aside <= SAME_LINE) & (high >= -WIDEST) & (low <= known[:, 4] + WIDEST)
        if is_on.any():
            number = int(np.argmax(is_on))
            one, begin = found[number], min(0.0, float(low[number]))
            end = max(one.length, float(high[number]))
            found[number] = WallLine(one.at(begin), one.along, end - begin)
        else:
            number = len(found)
            found.append(line)
        table[number] = _table(found[number])
    return found


def openings(lines: list[WallLine], plan: OccupancyMap, beams: Beams) -> list[Opening]:
    """Where the lines are open with wall on both sides, in the map or in some drive; each once."""
    found: list[Opening] = []
    views = _Views(lines, plan, beams, _walls_of(lines, beams), _walls_of_cells(lines, plan))
    shown = np.array([line.shown for line in lines])
    shows = [views.shows(number) for number in range(len(lines))]
    shares = wall_shares(lines, shows)
    for number, line in enumerate(lines):
        if line.length < NARROWEST + 2 * JAMB:
            continue
        crossed = views.crossed(number)
        parallel = np.array([abs(other.along @ line.normal) < PARALLEL for other in lines])
        known = _of_map(line, _bins(line), plan, plan.occupied | plan.free)
        stretches = Stretches.of(shows[number], shares[number])
        for begin, end in _gaps(shows[number]):
            if known[begin:end].mean() < KNOWN:
                continue
            p_wall = stretches.wall(begin, end)
            low, high = begin * BIN, end * BIN
            about = crossed.between(low - JAMB_REACH, high + JAMB_REACH)
            walls = parallel & (shown >= LONGER * (high - low))
            inside = about.between(low, high)
            of = views.of_beam[inside.numbers]
            if _is_behind_wall(inside, low, end - begin, (of >= 0) & walls[of]):
                continue
            low, high = _between_jambs(line, low, high, about, beams)
            found.append(Opening(line.at(low), line.at(high), p_wall))
    return found


# The bins of a line that are wall, and that are open, in the map and in each drive.
Shows = list[tuple[BoolArray, BoolArray]]


class _Views(NamedTuple):
    """What the map and each drive show along lines."""

    lines: list[WallLine]
    plan: OccupancyMap
    beams: Beams
    of_beam: IntArray  # (n,) the line at which each beam ends, -1: at none
    of_cell: IntArray  # (rows, columns) the line on which each occupied cell lies, -1: on none

    def crossed(self, number: int) -> Crossed:
        """The beams that cross a line."""
        return _crossed(self.lines[number], self.beams)

    def shows(self, number: int) -> Shows:
        """The bins of a line that the map and each drive show to be wall, and to be open.

        Where another wall crosses the line, that is shown, and no piece of this one.
        """
        line, crossed = self.lines[number], self.crossed(number)
        at, count = self.of_beam[crossed.numbers], _bins(line)
        drives = int(self.beams.drive.max()) + 1
        own = (at == number) | (at < 0) | (np.abs(crossed.beyond) > BESIDE)
        drive = self.beams.drive[crossed.numbers]
        each = [_of_drive(crossed.among(own & (drive == k)), count) for k in range(drives)]
        own_cells = self.plan.occupied & ((self.of_cell == number) | (self.of_cell < 0))
        drawn = _of_map(line, count, self.plan, own_cells)
        return [(drawn, ~drawn & _is_free(line, count, self.plan)), *each]


def _bins(line: WallLine) -> int:
    return int(np.ceil(line.length / BIN))


def wall_shares(lines: list[WallLine], shows: Sequence[Shows]) -> FloatArray:
    """(k,) of each line, the probability that it runs along a wall in some place, by its direction.

    By expectation maximization: what bins show tells which lines are walls, and lines that are tell
    in which directions walls run. A line tells nothing of its own direction.
    """
    turns = np.array([np.arctan2(*line.along[::-1]) for line in lines])
    off = wrap(4.0 * (turns[:, None] - turns)) / 4.0  # modulo a right angle
    alike = np.exp(-0.5 * np.square(off / TURN_STD)) / (np.sqrt(2.0 * np.pi) * TURN_STD)
    np.fill_diagonal(alike, 0.0)
    lengths, shares = np.array([line.length for line in lines]), np.full(len(lines), WALLS)
    for _ in range(ROUNDS):
        walls = lengths * [
            Stretches.of(each, share).share for each, share in zip(shows, shares, strict=True)
        ]
        of_walls, of_things = (_density(alike, weights) for weights in (walls, lengths - walls))
        shares = WALLS * of_walls / (WALLS * of_walls + (1.0 - WALLS) * of_things)
    return shares


def _density(alike: FloatArray, weights: FloatArray) -> FloatArray:
    """(k,) the density of each line's direction, 1/rad, by all others (k,) of some weights."""
    others = np.maximum(weights.sum() - weights, 1e-9)
    return np.asarray((1.0 - ANY_TURN) * alike @ weights / others + ANY_TURN / (np.pi / 2.0))


@dataclass(frozen=True, eq=False)
class Stretches:
    """Along a line, where it runs through wall and where through pieces of other things."""

    before: FloatArray  # (bins + 1, 2) probabilities of both at a bin, by the bins before it
    after: FloatArray  # (bins + 1, 2) likelihoods of the bins from there on
    prior: float  # probability of wall

    @staticmethod
    def of(shows: Shows, prior: float) -> Stretches:
        """By the bins of a line that some show to be wall, and that some show to be open."""
        wall = np.any([each for each, _ in shows], axis=0)
        is_open = np.any([each for _, each in shows], axis=0)
        unit = np.log(WALL_SHARE / (1.0 - WALL_SHARE)) * BIN / PIECE
        told = unit * (wall.astype(float) - (is_open & ~wall))
        before, after = np.empty((len(told) + 1, 2)), np.empty((len(told) + 1, 2))
        kernels.stretches(told, LEAVES, _begins(prior), before, after)
        return Stretches(before, after, prior)

    @property
    def share(self) -> float:
        """Of the line that runs through wall, as expected."""
        both = self.before * self.after
        return float(np.mean(both[:, 0] / both.sum(axis=1)))

    def wall(self, begin: int, end: int) -> float:
        """Probability that it is the same wall on both sides of some bins, whatever these show."""
        count = end - begin
        forgets, prior = 1.0 - (1.0 - LEAVES - _begins(self.prior)) ** count, self.prior
        steps = np.eye(2) + forgets * np.array([[prior - 1.0, 1.0 - prior], [prior, -prior]])
        both = self.before[begin][:, None] * self.after[end]
        return float(both[0, 0] * (1.0 - LEAVES) ** count / (both * steps).sum())


def _begins(prior: float) -> float:
    """Probability that a wall begins in a bin elsewhere, where the ``prior`` is that of wall."""
    return LEAVES * prior / (1.0 - prior)


def _between_jambs(
    line: WallLine, low: float, high: float, crossed: Crossed, beams: Beams
) -> tuple[float, float]:
    """Where along a line its opening begins and ends, by the beams that cross it about the jambs.

    Beside an opening beams end at the wall. Inside they pass, but for as many as end at a closed leaf.
    Those that come from inside end at the jamb's own face and don't count.
    """
    index, places, beyond = crossed
    at_wall = np.exp(-0.5 * np.square(beyond / WALL_STD)) / (np.sqrt(2.0 * np.pi) * WALL_STD)
    free = np.where(beyond > 0.0, 1.0 / FREE, STRAY / FREE)
    inside = np.abs(places - (low + high) / 2.0) < INNER * (high - low) / 2.0
    drive = beams.drive[index]
    counts, hits = (
        np.bincount(drive[chosen], minlength=int(drive.max(initial=0)) + 1)
        for chosen in (inside, inside & (np.abs(beyond) < BESIDE))
    )
    share = np.where(counts > 0, hits / np.maximum(counts, 1), 1.0)[drive]
    gain = np.log(
        (at_wall + STRAY / FREE) / (share * at_wall + (1.0 - share) * free + STRAY / FREE)
    )
    inward = beams.directions[index] @ line.along
    found = []
    for jamb, sign in ((low, 1.0), (high, -1.0)):
        off = sign * (places - jamb)
        about = np.flatnonzero((np.abs(off) < JAMB_REACH) & (sign * inward > 0.0))
        order = about[np.argsort(off[about])]
        ends = np.concatenate([[-JAMB_REACH], off[order], [JAMB_REACH]])
        edges = (ends[:-1] + ends[1:]) / 2.0
        log = np.concatenate([[0.0], np.cumsum(gain[order])])
        log *= min(JAMB_BEAMS / max(len(order), 1), 1.0)
        log -= 0.5 * np.square((edges - JAMB_BIAS) / JAMB_STD)
        found.append(jamb + sign * float(edges[np.argmax(log)]))
    return found[0], found[1]


def _walls_of(lines: list[WallLine], beams: Beams) -> IntArray:
    """(n,) the number of the line at which each beam ends, the nearest; -1: at none."""
    out = np.full(len(beams), -1)
    index, of, _ = _on_lines(lines, beams, BESIDE, 0.0)
    out[index] = of
    return out


def _walls_of_cells(lines: list[WallLine], plan: OccupancyMap) -> IntArray:
    """(rows, columns) the number of the line on which each occupied cell lies; -1: on none."""
    out = np.full(plan.occupied.shape, -1)
    middles = plan.middles
    near, anyway = BESIDE + plan.resolution / 2, np.zeros_like(middles)
    out[plan.occupied], _ = _nearest(lines, Nearby.of(middles), middles, anyway, near, -1.0)
    return out


def _table(line: WallLine) -> FloatArray:
    """(5,) as the kernels take a line."""
    return np.array([*line.start, *line.along, line.length])


def _is_behind_wall(inside: Crossed, low: float, count: int, on_wall: BoolArray) -> bool:
    """Whether an opening lies behind another wall: the far face of a wall is open everywhere.

    Then most beams that cross most of its bins, ``count`` of them from ``low`` m on, end at that
    wall, a wall's thickness before. ``on_wall`` (k,) tells which of the beams inside end at a wall.
    """
    bins = np.floor((inside.places - low) / BIN).astype(np.int64)
    before = on_wall & (inside.beyond < -BESIDE) & (inside.beyond > -THICKEST)
    hidden, past = (
        np.bincount(bins[chosen], minlength=count) for chosen in (before, inside.beyond > -BESIDE)
    )
    return bool(np.mean(hidden[:count] > past[:count]) > HIDDEN)


def _of_map(line: WallLine, count: int, plan: OccupancyMap, cells: BoolArray) -> BoolArray:
    """(count,) the bins where some of the map's cells, such as occupied ones, lie on the line."""
    reach = BESIDE + plan.resolution / 2  # of its cells' middles
    asides = np.arange(-reach, reach + 1e-9, plan.resolution / 2)
    return np.asarray(_at_bins(line, count, plan, cells, asides).any(axis=1))


def _is_free(line: WallLine, count: int, plan: OccupancyMap) -> BoolArray:
    """(count,) the bins where the map is free on both sides of the line: something passes there."""
    asides = np.arange(plan.resolution / 2, BESIDE + plan.resolution / 2, plan.resolution / 2)
    left, right = (_at_bins(line, count, plan, plan.free, side) for side in (asides, -asides))
    return np.asarray(left.any(axis=1) & right.any(axis=1))


def _at_bins(
    line: WallLine, count: int, plan: OccupancyMap, cells: BoolArray, asides: FloatArray
) -> BoolArray:
    """(count, a) whether some of the map's cells are at bins of a line, so many m to its left."""
    places: FloatArray = (np.arange(count) + np.float64(0.5)) * BIN
    return shown_beside(plan, cells, line.start, line.along, places, asides)


def shown_beside(
    plan: OccupancyMap,
    cells: BoolArray,
    start: FloatArray,
    along: FloatArray,
    places: FloatArray,
    asides: FloatArray,
) -> BoolArray:
    """(p, a) whether some of the map's cells are so far along a ray and to its left, m.

    ``along`` (2,) is a unit vector.
    """
    normal = np.array([-along[1], along[0]])
    points = start + places[:, None, None] * along + asides[:, None] * normal
    return shown_at(plan, cells, points.reshape(-1, 2)).reshape(len(places), -1)


def shown_at(plan: OccupancyMap, cells: BoolArray, points: FloatArray) -> BoolArray:
    """(n,) whether some of the map's cells are at points (n, 2); none are outside of it."""
    column, row = np.floor(plan.to_cells(points)).astype(np.int64).T
    rows, columns = cells.shape
    inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    out = np.zeros(len(points), dtype=bool)
    out[inside] = cells[row[inside], column[inside]]
    return out


def _of_drive(crossed: Crossed, count: int) -> tuple[BoolArray, BoolArray]:
    """(count,) the bins where most beams of a drive end at the line, and where most pass it."""
    bins, beyond = crossed.binned(count)
    hits = np.bincount(bins[np.abs(beyond) < BESIDE], minlength=count)
    passed = np.bincount(bins[beyond >= BESIDE], minlength=count)
    enough = hits + passed >= ENOUGH
    return np.asarray(enough & (hits > passed)), np.asarray(enough & (hits <= passed))


class Crossed(NamedTuple):
    """Beams that cross a line, or would if they got so far."""

    numbers: IntArray  # (k,) of the beams
    places: FloatArray  # (k,) m, where along the line
    beyond: FloatArray  # (k,) m, how far they get beyond it

    def among(self, chosen: BoolArray) -> Crossed:
        """Those of the chosen (k,)."""
        return Crossed(self.numbers[chosen], self.places[chosen], self.beyond[chosen])

    def between(self, low: float, high: float) -> Crossed:
        """Those between two places along the line, m."""
        return self.among((self.places > low) & (self.places < high))

    def binned(self, count: int) -> tuple[IntArray, FloatArray]:
        """Bins of those in the first ones (count,), and how far they get."""
        bins = np.floor(self.places / BIN).astype(np.int64)
        inside = (bins >= 0) & (bins < count)
        return bins[inside], self.beyond[inside]


def _crossed(line: WallLine, beams: Beams) -> Crossed:
    """The beams that cross a line steeply enough to tell of it."""
    count = kernels.crossed(
        beams.origins,
        beams.directions,
        beams.ranges,
        beams.reach,
        _table(line),
        STEEP,
        JAMB_REACH,
        numbers := np.empty(len(beams), dtype=np.int64),
        places := np.empty(len(beams)),
        beyond := np.empty(len(beams)),
    )
    return Crossed(numbers[:count].copy(), places[:count].copy(), beyond[:count].copy())


def _gaps(shows: Shows) -> Iterator[tuple[int, int]]:
    """Begin and end, in bins, of runs that are open in some of what is shown, with wall on both sides.

    The wall beside may be shown by another: the jambs stay where they are.
    """
    ever_wall = np.any([wall for wall, _ in shows], axis=0)
    told: set[tuple[int, int]] = set()
    views = [*shows, (ever_wall, np.any([is_open for _, is_open in shows], axis=0))]
    for wall, is_open in views:
        for begin, end in _runs(is_open, wall):
            width = (end - begin) * BIN
            beside = round(MARGIN / BIN), round(JAMB / BIN)
            if not NARROWEST <= width <= WIDEST or (begin, end) in told:
                continue
            before = ever_wall[max(begin - beside[0], 0) : begin].sum()
            behind = ever_wall[end : end + beside[0]].sum()
            if min(before, behind) < beside[1]:
                continue
            told.add((begin, end))
            yield begin, end


def _runs(is_open: BoolArray, wall: BoolArray) -> Iterator[tuple[int, int]]:
    """Runs that begin and end open, without more wall inside than a stray reading of two bins."""
    marks: IntArray = np.flatnonzero(is_open)
    if not len(marks):
        return
    walls = np.concatenate([[0], np.cumsum(wall)])
    begin = last = int(marks[0])
    for mark in marks[1:].tolist():
        if walls[mark] - walls[last + 1] > 2:
            yield begin, last + 1
            begin = mark
        last = mark
    yield begin, last + 1


def distinct(found: list[Opening], apart: float = 0.06) -> list[Opening]:
    """Openings, of which no two have both jambs nearer than ``apart`` m; the first is kept."""
    kept: list[Opening] = []
    for opening in found:
        same = [k for k, other in enumerate(kept) if _is_same(opening, other, apart)]
        if not same:
            kept.append(opening)
        for k in same[:1]:
            kept[k] = replace(kept[k], p_wall=max(kept[k].p_wall, opening.p_wall))
    return kept


def _is_same(one: Opening, other: Opening, apart: float) -> bool:
    straight = max(np.hypot(*(one.start - other.start)), np.hypot(*(one.end - other.end)))
    turned = max(np.hypot(*(one.start - other.end)), np.hypot(*(one.end - other.start)))
    return bool(min(straight, turned) < apart)
