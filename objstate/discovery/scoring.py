"""How probable it is that a doorway holds a leaf: explanations that compete by their evidence.

A leaf has a hinge, a bearing and a width that hold for all looks, and in each look a state, which
is summed over: the angle by which it is open, rad, or the share of its width by which it was slid
away past its hinge's end. Without one, the map is right in a look, or the doorway is open. Either
way, things may stand about that nobody drew; each costs its prior, so that an explanation that
needs them has to gain more than that.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from objstate.building.door_table import SLIDES
from objstate.discovery import kernels, surfaces
from objstate.discovery.doorway import DEEP, Doorway, beside
from objstate.discovery.lattice import FLAT, Lattice, whole
from objstate.discovery.walls import Opening
from objstate.geometry import BoolArray, FloatArray, wrap

HALF = 0.02  # m, of a leaf's thickness
DRAWN = -10.0  # nats: a map shows something as long as a leaf that ends at a jamb, and is none
# an opening without a leaf is filled within a wall's depth: nats, of a wall that parts rooms, and
# the probability of it in one around the building, which has windows
FILLED, GLAZED = -3.0, 0.8
WALL_GOES_ON = np.log(0.5)  # nats: what seems open is wall
NEARLY_CLOSED = np.radians(10.0)  # up to which what is in a leaf's place fills the opening
MISSED = -1.2  # nats: the map doesn't show a leaf that is there
MAP_STD = np.radians(4.0)  # of the turn of a leaf in a map
# m, of a leaf's place in a map, of an end beyond the leaf's, and before it, where it wasn't seen
MAP_ASIDE, MAP_END, MAP_UNSEEN = 0.03, 0.05, 0.2
OFF_STDS = np.array([MAP_STD, MAP_ASIDE, MAP_END, MAP_UNSEEN])
FAR = -2.0 * (MISSED + DRAWN)  # squared deviations from which on the map shows something else
# A leaf swings from closed to where it stands. That something which the map shows is in the way has
# a small probability: things are put behind open doors, walls aren't.
BLOCKED = np.log(0.01)  # nats
WAY = 0.12  # m about hinge, edge, and both ends of the way that jambs, the leaf and cells take
STRAYS = 2  # cells in the way that are none
SAME_PLACE = 9.0  # squared deviations up to which a leaf stands where the map has it
LAST = 0.97  # share of a leaf's cells that lie before its end
SLIT = 0.01  # m, between a leaf and the jambs
ALONG_STD, WIDTH_STD = 0.02, 0.025  # m of hinge and width about what an opening shows
NARROWEST_LEAF, WIDEST_LEAF = 0.55, 1.4  # m
USUAL_WIDTH, USUAL_WIDTH_STD = 0.85, 0.12  # m, of leaves
OPENINGS_SPREAD = 2.0  # m, over which the widths of openings are spread evenly that have no leaf
TAIL = 3.0  # degrees of freedom of these: some openings are shown wrongly
LOG_STUDENT = (
    math.lgamma((TAIL + 1.0) / 2.0) - math.lgamma(TAIL / 2.0) - 0.5 * math.log(TAIL * math.pi)
)
# A leaf lies in that face of its wall to which it opens: at the front if it opens to the robot,
# or as deep as the wall is thick. Few lie elsewhere.
FRONT, FRONT_STD = 0.01, 0.03  # m
THINNEST, THICKEST = 0.06, DEEP  # m, depths of leaves that open away
SOFT = 0.01  # m, of these
EDGE = 4.0 * SOFT  # beyond which there is none
ELSEWHERE = 0.1  # within the wall's depth
BEFORE = 0.05  # m before a wall's line within which its face may be
BEARING_STD = np.radians(2.0)  # about the wall's
TWIN_STD, TWIN_BEARING_STD = 0.01, np.radians(0.7)  # m, rad: the leaves of a double door are alike


def log_filled(opening: Opening) -> float:
    """Log-probability that an opening without a leaf is filled within its wall's depth."""
    inner = opening.p_inner
    return math.log(inner * math.exp(FILLED) + (1.0 - inner) * GLAZED)


@dataclass(frozen=True, eq=False)
class Leaf:
    """A leaf in a doorway."""

    hinge: FloatArray  # (2,) m
    bearing: float  # rad, closed, from hinge to free edge
    sense: int  # 1 opens counter-clockwise, SLIDES slides
    width: float  # m
    about: int  # number of the opening that it closes
    from_end: bool  # whether its hinge is at the opening's end
    share: float  # of the opening's width that it closes: 1, or 0.5 of two leaves
    twin: Leaf | None = None  # the other leaf of a double door, if that is known

    @property
    def slides(self) -> bool:
        """Whether it slides along itself."""
        return self.sense == SLIDES

    @property
    def lattice(self) -> Lattice:
        """All its states."""
        return whole(self.slides)

    @property
    def away(self) -> float:
        """The state from which on it lies along the wall."""
        return self.lattice.rests.away

    @property
    def kind(self) -> tuple[int, bool, float]:
        """Which way it opens, where it is hinged, and how much it closes."""
        return self.sense, self.from_end, self.share

    @property
    def vector(self) -> FloatArray:
        """(4,) hinge, bearing, width: what is refined."""
        return np.array([*self.hinge, self.bearing, self.width])

    def at(self, vector: FloatArray) -> Leaf:
        """The same with another hinge, bearing and width."""
        x, y, bearing, width = vector.tolist()
        return replace(self, hinge=np.array([x, y]), bearing=bearing, width=width)


@dataclass(frozen=True, eq=False)
class Drawn:
    """What a map shows in a doorway that may be a leaf."""

    from_end: bool | None  # where it is hinged; None: it fills the opening
    turn: float  # rad, from the closed leaf; to the left is positive
    hinge: FloatArray  # (2,) m, where it begins
    share: float  # of the opening that it would close
    points: FloatArray = field(repr=False)  # (m, 2) m, middles of its cells
    log_none: float  # log-probability that a map shows it, where it is no leaf

    def may_be(self, leaf: Leaf) -> bool:
        """Whether it hangs and opens as a leaf does."""
        is_its = self.from_end in (None, leaf.from_end) and self.share == leaf.share
        return is_its and (leaf.sense * self.turn > 0.0 or self.turn == 0.0)

    def closes(self, filling: Drawn) -> bool:
        """Whether a leaf that is drawn open would, closed, be where something fills the opening."""
        return self.share == 1.0 or filling.from_end in (None, self.from_end)

    def off(self, leaf: Leaf, angles: FloatArray) -> FloatArray:
        """(a,) squared deviations of a leaf at these angles from what is drawn.

        From ``FAR`` on all are alike.
        """
        away = self.points - leaf.hinge
        out = np.empty(len(angles))
        if self.turn == 0.0:
            aside = away @ np.array([-np.sin(leaf.bearing), np.cos(leaf.bearing)])
            turned_off = np.square(
                angles * leaf.width / MAP_END if leaf.slides else angles / MAP_STD
            )
            return np.asarray(turned_off + np.square(np.median(aside) / MAP_ASIDE))
        bearings = leaf.bearing + leaf.sense * angles
        kernels.off_drawn(away, bearings, leaf.width, OFF_STDS, LAST, FAR, out)
        return out


@dataclass(frozen=True, eq=False)
class Behind:
    """What there is without the leaf, and what the map has in its place."""

    expected: FloatArray = field(repr=False)  # (3, n) m, beside the beams
    log_likelihood: FloatArray  # (groups,)
    drawn: tuple[Drawn, ...] = ()  # what was taken out of the map
    as_is: Behind | None = field(default=None, repr=False)  # the map
    # (groups,) or (1,) whether it may be right in a look
    may_be_right: BoolArray = field(default_factory=lambda: np.ones(1, dtype=bool), repr=False)
    # (m, 2) m, middles of the map's cells that were left
    cells: FloatArray = field(default_factory=lambda: np.empty((0, 2)), repr=False)
    without_other: Behind | None = field(default=None, repr=False)  # leaf of a double door
    is_shown: bool = False  # by the map, just so

    @property
    def alone(self) -> Behind:
        """What there is without any leaf."""
        return self.without_other or self

    @property
    def as_drawn(self) -> FloatArray:
        """(groups,) what the map gains; nothing in looks in which it is wrong."""
        assert self.as_is is not None  # something was taken out of it
        gained = self.as_is.log_likelihood - self.log_likelihood
        return np.where(self.may_be_right, gained, -np.inf)

    def drawn_as(self, leaf: Leaf) -> Drawn | None:
        """What was taken out and is the leaf, if anything is."""
        angles = leaf.lattice.angles
        able = [(float(d.off(leaf, angles).min()), k) for k, d in self._able(leaf)]
        best, number = min(able, default=(np.inf, 0))
        return self.drawn[number] if best < FAR else None

    def turn_in_map(self, leaf: Leaf) -> float | None:
        """By how much a leaf is turned where the map shows it open, rad; None where it doesn't."""
        angles = leaf.lattice.angles
        angles = angles[angles < FLAT]
        drawn = [each.off(leaf, angles) for _, each in self._able(leaf) if each.turn != 0.0]
        if not drawn or min(off.min() for off in drawn) >= FAR:
            return None
        return leaf.sense * float(angles[np.argmin(np.min(drawn, axis=0))])

    def _able(self, leaf: Leaf) -> Iterator[tuple[int, Drawn]]:
        return ((k, drawn) for k, drawn in enumerate(self.drawn) if drawn.may_be(leaf))

    def map_of(self, leaf: Leaf, angles: FloatArray) -> tuple[FloatArray, BoolArray]:
        """(a,) log-likelihood ratio of the map with a leaf at these angles, to that without one.

        And (a,) whether the map has it there.
        """
        log, is_there = np.full(len(angles), MISSED), np.zeros(len(angles), dtype=bool)
        for _, drawn in self._able(leaf):
            off = drawn.off(leaf, angles)
            log = np.maximum(log, -0.5 * off - drawn.log_none)
            is_there |= off < SAME_PLACE
        return log, is_there

    def beside(self, place: Doorway, leaf: Leaf, angles: FloatArray) -> Behind:
        """What there is with a leaf that stands at angles (groups,), for another leaf.

        The map is right in those looks in which it shows this leaf, too.
        """
        expected = self.expected.copy()
        for k, own in enumerate(turned(leaf, angles)):
            if angles[k] < FLAT:
                mine = np.flatnonzero(place.group == k)
                expected[:, mine] = np.minimum(expected[:, mine], _front(place.beams[:, mine], own))
        is_right = self.map_of(leaf, angles)[1] | (angles >= leaf.away)
        return replace(
            self,
            expected=expected,
            log_likelihood=place.log_likelihood(expected),
            may_be_right=self.may_be_right & is_right,
            without_other=self.alone,
        )

    def log_way(self, leaf: Leaf, angles: FloatArray) -> FloatArray:
        """(a,) log-probability of what the map shows in the way of a leaf to these angles."""
        if leaf.slides:
            return np.zeros(len(angles))
        free = kernels.free_way(
            self.cells, leaf.hinge, leaf.bearing, leaf.sense, leaf.width, WAY, STRAYS
        )
        return np.where(angles > free, BLOCKED, 0.0)

    def gains(self, place: Doorway, leaf: Leaf, angles: FloatArray) -> FloatArray:
        """(a, groups) what a leaf at each angle adds to the log-likelihood of each look.

        Where the map has it, it may look as it is drawn, or stand in what is drawn.
        """
        return self.with_leaf(place, leaf, angles)[1]

    def with_leaf(
        self, place: Doorway, leaf: Leaf, angles: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """What the map tells of a leaf at each angle (a,), see ``map_of``, and its ``gains``."""
        log_map, is_there = self.map_of(leaf, angles)
        gain = gains(place, self, turned(leaf, angles))
        if self.as_is is not None and is_there.any():
            on_map = gains(place, self.as_is, turned(leaf, angles[is_there])).clip(min=0.0)
            gain[is_there] = np.maximum(gain[is_there], on_map + self.as_drawn)
        return log_map, gain


def with_things(place: Doorway, behind: Behind, leaves: FloatArray) -> Behind:
    """What there is with all of some leaves (k, 4) at their bearings, in all looks.

    A beam ends at the nearest one.
    """
    log_likelihood, expected = behind.log_likelihood.copy(), behind.expected
    for k in range(len(leaves)):
        there = replace(behind, expected=expected)
        log_likelihood += gains(place, there, leaves[k : k + 1])[0]
        expected = np.minimum(expected, _front(place.beams, leaves[k]))
    return replace(behind, expected=expected, log_likelihood=log_likelihood)


def _front(beams: FloatArray, leaf: FloatArray) -> FloatArray:
    """(n,) m along beams (9, n) to the front of a leaf (4,), which is ``HALF`` thick to each side."""
    way = np.array([np.cos(leaf[2]), np.sin(leaf[2])])
    met, numbers = np.empty(beams.shape[1]), np.empty(beams.shape[1], dtype=np.int64)
    ends = np.concatenate([leaf[:2], leaf[:2] + leaf[3] * way])
    surfaces.cast(np.ascontiguousarray(beams), ends[None], 0.0, met, numbers)
    cross = beams[kernels.DIRECTION_X] * way[1] - beams[kernels.DIRECTION_Y] * way[0]
    return np.asarray(met - HALF / np.maximum(np.abs(cross), kernels.LEAST_CROSS))


def gains(place: Doorway, behind: Behind, leaves: FloatArray) -> FloatArray:
    """(m, groups) what leaves (m, 4) at their bearings add to the log-likelihood of each look, tempered."""
    out = np.zeros((len(leaves), place.groups))
    kernels.leaf_gain(place.beams, behind.expected, place.group, leaves, HALF, place.model, out)
    return place.exponents * out


def turned(leaf: Leaf, angle: FloatArray) -> FloatArray:
    """(a, 4) the leaf, open by angles (a,) or shares of its width."""
    out = np.empty((len(angle), 4))
    out[:, :2], out[:, 2], out[:, 3] = leaf.hinge, leaf.bearing + leaf.sense * angle, leaf.width
    if leaf.slides:
        along = np.array([np.cos(leaf.bearing), np.sin(leaf.bearing)])
        out[:, :2] -= (angle * leaf.width)[:, None] * along
    return out


def log_prior(place: Doorway, leaf: Leaf) -> float:
    """Log density of a leaf's hinge and width about what its opening shows, and of its bearing.

    Leaves hang in walls.
    """
    opening = place.openings[leaf.about]
    start, bearing = opening.jamb(leaf.from_end)
    along, aside = beside(leaf.hinge[None], start, bearing)
    depth = -float(aside[0]) * place.side(start, bearing)
    if not -BEFORE - EDGE < depth < DEEP + EDGE or leaf.width > WIDEST_LEAF:
        return -np.inf
    turned_by = float(wrap(leaf.bearing - bearing))
    end = leaf.width + float(along[0]) - leaf.share * (opening.width - SLIT)
    log = _log_student(float(along[0]) - SLIT, ALONG_STD)
    if leaf.twin is not None:
        return log + _log_alike(leaf, leaf.twin)
    log += _log_student(end, WIDTH_STD) + _log_normal(turned_by, BEARING_STD)
    log += math.log(opening.p_doorway) + _log_width(leaf.width)
    if leaf.slides:
        return float(log + math.log(_inside(depth)))
    is_toward = leaf.sense == place.side(start, bearing)
    return float(log + _log_depth(depth, is_toward))


def _log_alike(leaf: Leaf, twin: Leaf) -> float:
    """Log density of a leaf's depth, bearing and width about those of the other one."""
    _, aside = beside(leaf.hinge[None], twin.hinge, twin.bearing)
    return (
        _log_normal(float(aside[0]), TWIN_STD)
        + _log_normal(float(wrap(leaf.bearing - twin.bearing - np.pi)), TWIN_BEARING_STD)
        + _log_normal(leaf.width - twin.width, TWIN_STD)
    )


def _log_normal(off: float, std: float) -> float:
    return -0.5 * (off / std) ** 2 - math.log(math.sqrt(2.0 * math.pi) * std)


def _log_student(off: float, std: float) -> float:
    """Log density of Student's distribution."""
    return LOG_STUDENT - math.log(std) - (TAIL + 1.0) / 2.0 * math.log1p((off / std) ** 2 / TAIL)


def _log_width(width: float) -> float:
    """Log density of a leaf's width, against that of openings that are none."""
    return _log_student(width - USUAL_WIDTH, USUAL_WIDTH_STD) + math.log(OPENINGS_SPREAD)


def _log_depth(depth: float, is_toward: bool) -> float:
    """Log density, 1/m, of how deep in its wall a leaf lies that opens toward the robot or away."""
    if is_toward:
        usual = math.exp(-0.5 * ((depth - FRONT) / FRONT_STD) ** 2) / FRONT_STD
        usual /= math.sqrt(2.0 * math.pi)
    else:
        usual = _between(depth, THINNEST, THICKEST) / (THICKEST - THINNEST)
    return math.log((1.0 - ELSEWHERE) * usual + ELSEWHERE * _inside(depth))


def _inside(depth: float) -> float:
    """Density, 1/m, of a depth anywhere in a wall, or just before it."""
    return _between(depth, -BEFORE, DEEP) / (DEEP + BEFORE)


def _between(depth: float, least: float, most: float) -> float:
    """1 between two depths, and 0 elsewhere, with soft edges."""
    return 0.5 * (math.erf((depth - least) / SOFT) - math.erf((depth - most) / SOFT))


def log_joint(place: Doorway, behind: Behind, leaf: Leaf, lattice: Lattice) -> float:
    """Log p(beams, leaf), the angles summed over."""
    prior = log_prior(place, leaf)
    if prior == -np.inf:
        return prior
    log_map, gain = behind.with_leaf(place, leaf, lattice.angles)
    log_way = behind.log_way(leaf, lattice.angles)
    total = lattice.log_evidence(log_map, log_way, gain, place.stays)
    return prior + total + float(behind.log_likelihood.sum())
