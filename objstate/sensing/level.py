"""Level lasers: a horizontal cut of a rigid thing is always the same outline.

That holds for walls, for objects that turn about a vertical axis, and for those
that move in the floor plane. What a level sweep sees of them are segments.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import accumulate
from typing import NamedTuple, TypeVar

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.building.outline import outline
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import lazy
from objstate.records import Rays
from objstate.sensing.blocks import Blocks

T = TypeVar("T", bound=np.generic)
Rectangle = tuple[float, float, float, float]  # m: left, bottom, right, top

ABREAST = 200  # poses from which ranges are cast side by side, at most
LEVEL = 1e-6  # rad or relative: a laser or an axis tilted by less counts as level or upright
SAME_HEIGHT = 1e-6  # m
INDEX_STEPS = 2  # of a sweep's index, for each beam
TOUCHING = 1e-6  # m within which ends of segments are one corner
STRIDE = 0.5  # m the robot moves before the walls in its sight are looked up again
WIDEST_LOOK = 4.0  # m, sides of a rectangle from which sight is tried
LOOK_AFTER = (
    4000  # segments that a place has been asked for: a robot that drives on leaves it first
)
LOOK_SPACING = 0.5  # m between the places from which it is tried
LOOKS = 360  # beams all round
GLIMPSES = np.array([0.02, 0.5, 0.98])  # shares of a segment's length at which it is looked at


@dataclass(frozen=True, eq=False)
class Sweep:
    """The beams of a level scan, sorted by bearing in the robot's frame."""

    height: float  # m above the floor
    order: IntArray  # (n,) the scan's beams by bearing
    rows: FloatArray  # (5, n) pseudo-angle, direction, origin relative to the centre; sorted
    centre: FloatArray  # (3,) x, y in the robot's frame, m; largest distance of an origin

    @staticmethod
    def of(rays: Rays) -> Sweep | None:
        """The sweep of some rays, or None where they are not level."""
        if len(rays) == 0 or np.abs(rays.directions[:, 2]).max() > LEVEL:
            return None
        if np.ptp(rays.origins[:, 2]) > SAME_HEIGHT:
            return None
        bearing = pseudo_angles(rays.directions)
        order = np.argsort(bearing, kind="stable")
        bearing, origin = bearing[order], rays.origins[order, :2]
        centre = (origin.min(axis=0) + origin.max(axis=0)) / 2
        offset = origin - centre
        return Sweep(
            height=float(rays.origins[0, 2]),
            order=order,
            rows=np.vstack([bearing, rays.directions[order, :2].T, offset.T]),
            centre=np.array([*centre, np.hypot(*offset.T).max()]),
        )

    @lazy
    def around(self) -> float:
        """m by which beams begin aside of the robot, at most."""
        x, y, spread = self.centre.tolist()
        return math.hypot(x, y) + float(spread)

    @lazy
    def index(self) -> IntArray:
        """(m + 1,) first beam at or after each of some even steps of the pseudo-angle."""
        count = max(INDEX_STEPS * len(self.order), 1)
        steps = np.arange(count + 1) * (4.0 / count) - 2.0
        return np.searchsorted(self.rows[0], steps)

    @lazy
    def mute(self) -> FloatArray:
        """(7, n) the sorted beams as the kernels take them, where nothing is read."""
        return np.vstack([self.rows, np.zeros((2, len(self.order)))])


def pseudo_angles(directions: FloatArray) -> FloatArray:
    """Numbers (n,) in [-2, 2] that grow with the bearings of directions (n, 2 or 3)."""
    x, y = directions[:, 0], directions[:, 1]
    quarter = np.abs(y) / (np.abs(x) + np.abs(y))
    half = np.where(x < 0.0, 2.0 - quarter, quarter)
    return np.asarray(np.where(y < 0.0, -half, half))


@dataclass(frozen=True, eq=False)
class Stand:
    """Robot poses as the kernels take them, in parts that see about the same."""

    poses: FloatArray  # (p, 4) x, y, cosine and sine of the yaw
    parts: Sequence[slice | IntArray]  # of poses that look in about the same direction

    @lazy
    def rectangle(self) -> Rectangle:
        """In which the robot stands."""
        from objstate.sensing import kernels

        left, bottom, right, top = kernels.rectangle(self.poses)
        return left, bottom, right, top

    @staticmethod
    def of(poses: FloatArray) -> Stand:
        """Of poses (p, 3)."""
        from objstate.sensing import kernels

        count = -(-len(poses) // ABREAST)
        parts: Sequence[slice | IntArray] = [slice(None)]
        if count > 1:
            parts = np.array_split(np.argsort(poses[:, 2], kind="stable"), count)
        return Stand(kernels.with_trigonometry(poses, 0.0), parts)

    def each(self, of: Callable[..., FloatArray], *also: FloatArray) -> FloatArray:
        """What ``of`` gives (p, ...) for the poses, and for ``also`` (p, ...), part by part."""
        if len(self.parts) == 1:
            return of(self.poses, *also)
        found = [of(self.poses[part], *(each[part] for each in also)) for part in self.parts]
        out = np.empty((len(self.poses), *found[0].shape[1:]))
        for part, each in zip(self.parts, found, strict=True):
            out[part] = each
        return out


@dataclass(frozen=True, eq=False)
class Neighbourhood:
    """The wall segments that matter to a laser inside a rectangle."""

    rectangle: Rectangle
    reach: float  # m
    segments: FloatArray  # (k, 4)
    asked: int = 1  # how often it has served
    is_seen: bool = False  # whether it has been looked at which of them can be seen

    def serves(self, rectangle: Rectangle, reach: float) -> bool:
        """Whether it holds for places in a rectangle, and isn't far too large for it."""
        left, bottom, right, top = rectangle
        known_left, known_bottom, known_right, known_top = self.rectangle
        holds = known_left <= left and right <= known_right
        holds = holds and known_bottom <= bottom and top <= known_top and reach <= self.reach
        most = 4.0 * STRIDE
        wide = (known_right - known_left) - (right - left) > most
        return holds and not wide and (known_top - known_bottom) - (top - bottom) <= most

    def asked_again(self) -> Neighbourhood:
        """The same; once it is worth it, with only those segments that are seen from inside."""
        if self.is_seen:
            return self
        segments, (left, bottom, right, top) = self.segments, self.rectangle
        is_worth_it = self.asked * len(segments) >= LOOK_AFTER
        if is_worth_it and max(right - left, top - bottom) <= WIDEST_LOOK:
            segments = segments[_seen(segments, np.array([left, bottom]), np.array([right, top]))]
        return replace(self, segments=segments, asked=self.asked + 1, is_seen=is_worth_it)


@dataclass(frozen=True, eq=False)
class UncertainObject:
    """Where an object may be, as far as a scan's other readers need to know."""

    name: str
    states: FloatArray  # (k, d)
    shares: FloatArray  # (k,) sum to the probability that it is there at all


@dataclass(frozen=True, eq=False)
class ObjectOutline:
    """What a level sweep sees of an object."""

    segments: FloatArray  # (k, 4)
    rim: int = 0  # the first are closed loops, clockwise, outside of which nothing else is seen


class Scenery(NamedTuple):
    """Objects that may stand in several places each, as the kernels take them."""

    outlines: FloatArray  # (k, 4) segments of one object after the other
    outline_ends: IntArray  # (j,) where each object's segments end
    rims: IntArray  # (j,) how many of each object's segments are its rim
    placements: FloatArray  # (s, 4) of one object after the other
    placement_ends: IntArray  # (j,) where each object's placements end
    shares: FloatArray  # (s,) their weights


class LevelOutlines:
    """Outlines of a building's walls and objects at the heights of its level lasers."""

    def __init__(self, building: Building) -> None:
        self._building = building
        self.hold = all(moves_in_plane(item) for item in building.objects.values())
        self._walls = cache(lambda height: Blocks(flat(outline(building.walls, height))))
        self._neighbourhoods: dict[float, Neighbourhood] = {}
        self._stand: tuple[FloatArray, Stand] | None = None  # the last, with its poses (p, 3)

    def with_object(self, item: MovableObject) -> LevelOutlines:
        """The same building but for one object, which now stands elsewhere."""
        other = copy(self)
        other._building = self._building.with_object(item)
        return other

    def stand(self, poses: FloatArray) -> Stand:
        """Robot poses (p, 3) as the kernels take them; a scan asks for the same often."""
        if len(poses) == 1:
            return Stand.of(poses)
        if self._stand is None or self._stand[0] is not poses:
            self._stand = poses, Stand.of(poses)
        return self._stand[1]

    def walls_in_sight(self, sweep: Sweep, stand: Stand, reach: float) -> FloatArray:
        """Wall segments (k, 4) that a sweep may see within ``reach`` m from robot poses.

        Where it is asked about again, sight is tried from a grid of places; for beliefs wider
        than ``WIDEST_LOOK``, all segments in reach are given.
        """
        known = self._neighbourhoods.get(sweep.height)
        rectangle = _widened(stand.rectangle, sweep.around)
        if known is None or not known.serves(rectangle, reach):
            known = self._neighbourhood(sweep.height, _widened(rectangle, STRIDE), reach)
        else:
            known = known.asked_again()
        self._neighbourhoods[sweep.height] = known
        return known.segments

    def _neighbourhood(self, height: float, rectangle: Rectangle, reach: float) -> Neighbourhood:
        left, bottom, right, top = rectangle
        radius = reach + math.hypot(right - left, top - bottom) / 2
        middle = np.array([left + right, bottom + top]) / 2
        return Neighbourhood(rectangle, reach, self._walls(height).within(middle, radius))

    @cache  # noqa: B019 - lives as long as the outlines it belongs to
    def of_object(self, name: str, height: float) -> ObjectOutline:
        """Outline of an object at a height, about its origin in its home state."""
        item = self._building[name]
        home = item.transforms(item.home[None])[0]
        return _rimmed(outline(item.mesh.moved(home), height) - home[:2, 3])

    @lru_cache(maxsize=64)  # noqa: B019 - lives as long as the outlines it belongs to
    def scenery(self, objects: tuple[UncertainObject, ...], height: float) -> Scenery:
        """Objects that localization reckons with, in a laser's plane."""
        outlines = [self.of_object(each.name, height) for each in objects]
        places = [self.placements(each.name, each.states) for each in objects]
        none = np.empty((0, 4))
        return Scenery(
            np.concatenate([none, *(each.segments for each in outlines)]),
            _ends([each.segments for each in outlines]),
            np.array([each.rim for each in outlines], dtype=np.int64),
            np.concatenate([none, *places]),
            _ends(places),
            np.concatenate([none[:, 0], *(each.shares for each in objects)]),
        )

    def placements(self, name: str, states: FloatArray) -> FloatArray:
        """An object's outline in states (s, d), against its home state, as the kernels take it (s, 4)."""
        return _placements(self._building[name], states)


def _ends(parts: Sequence[FloatArray]) -> IntArray:
    """(j,) where each of some arrays ends when they stand one after the other."""
    return np.array(list(accumulate(map(len, parts))), dtype=np.int64)


def _seen(walls: FloatArray, lower: FloatArray, upper: FloatArray) -> BoolArray:
    """Which wall segments (k,) are seen from somewhere in a rectangle.

    From each place of a grid, beams all round find what is large; then points on
    each segment that isn't found yet are looked at from the rectangle's middle and
    corners, so that nothing small is missed.
    """
    from objstate.sensing import kernels, projection

    places = kernels.with_trigonometry(_grid(lower, upper), 0.0)
    bearings = np.linspace(-np.pi, np.pi, LOOKS, endpoint=False)
    round_about = _sweep_towards(np.column_stack([np.cos(bearings), np.sin(bearings)]))
    seen = np.zeros(len(walls), dtype=bool)
    projection.mark_seen(
        places,
        walls,
        0,
        round_about.mute,
        round_about.index,
        round_about.centre,
        seen,
    )
    corners = np.array([lower, upper, [lower[0], upper[1]], [upper[0], lower[1]]])
    for place in np.vstack([(lower + upper) / 2, corners]):
        unseen = np.flatnonzero(~seen)
        seen[unseen] = _glimpsed(walls[unseen], walls[seen], place)
    return seen


def _grid(lower: FloatArray, upper: FloatArray) -> FloatArray:
    """Poses (m, 3) that look east, all over a rectangle, its corners included."""
    sides = [
        np.linspace(low, high, int(np.ceil((high - low) / LOOK_SPACING)) + 1)
        for low, high in zip(lower, upper, strict=True)
    ]
    x, y = (grid.ravel() for grid in np.meshgrid(*sides))
    return np.column_stack([x, y, np.zeros(len(x))])


def _glimpsed(segments: FloatArray, screens: FloatArray, place: FloatArray) -> BoolArray:
    """Which segments (k, 4) show some of their points past screens (m, 4), from a place (2,)."""
    from objstate.sensing import projection

    if len(segments) == 0:
        return np.zeros(0, dtype=bool)
    start, along = segments[:, None, :2], segments[:, None, 2:] - segments[:, None, :2]
    off = (start + GLIMPSES[:, None] * along - place).reshape(-1, 2)
    distance = np.hypot(off[:, 0], off[:, 1]).clip(min=TOUCHING)
    sweep = _sweep_towards(off / distance[:, None])
    nearest = np.empty((1, 1, len(off)))
    projection.cast(
        np.array([[*place, 1.0, 0.0]]),
        np.array([[0.0, 0.0, 1.0, 0.0]]),
        screens,
        0,
        sweep.order,
        sweep.mute,
        sweep.index,
        sweep.centre,
        nearest,
    )
    visible = distance <= nearest[0, 0] + TOUCHING
    return np.asarray(visible.reshape(len(segments), -1).any(axis=1))


def _sweep_towards(directions: FloatArray) -> Sweep:
    """A sweep of beams from one place in directions (n, 2)."""
    level = np.column_stack([directions, np.zeros(len(directions))])
    sweep = Sweep.of(Rays(np.zeros_like(level), level))
    assert sweep is not None
    return sweep


def _widened(rectangle: Rectangle, by: float) -> Rectangle:
    left, bottom, right, top = rectangle
    return left - by, bottom - by, right + by, top + by


def moves_in_plane(item: MovableObject) -> bool:
    """Whether an object only turns about vertical axes and moves horizontally."""
    if item.kind is Kind.PLANAR:
        return True
    x, y, z = item.direction
    if item.kind is Kind.HINGED:
        return bool(np.hypot(x, y) < LEVEL)
    return bool(abs(z) < LEVEL)


def _placements(item: MovableObject, states: FloatArray) -> FloatArray:
    """Positions, and cosines and sines of turns (s, 4), of the link's frame against the home state."""
    from objstate.sensing import kernels

    if item.kind is Kind.PLANAR:
        return np.asarray(kernels.with_trigonometry(states, item.home[2]))
    x, y = item.origin[:2, 3].tolist()
    if item.kind is Kind.HINGED:
        direction = math.copysign(1.0, item.direction[2])
        return np.asarray(kernels.hinged(x, y, direction, item.home[0], states))
    along = states * item.direction[:2]
    return np.column_stack(
        [x + along[:, 0], y + along[:, 1], np.ones(len(states)), np.zeros(len(states))]
    )


def _rimmed(segments: FloatArray) -> ObjectOutline:
    """The outline that segments (k, 2, 2) make, its rim first; some may hang loose, then it has none."""
    import shapely

    lines = shapely.unary_union(shapely.linestrings(segments), grid_size=TOUCHING)
    filled = shapely.unary_union(shapely.polygonize([lines]))
    if filled.is_empty or not shapely.difference(lines, filled).is_empty:
        return ObjectOutline(flat(segments))
    solids = shapely.get_parts(shapely.simplify(filled, TOUCHING))
    loops = [shapely.get_coordinates(shapely.get_exterior_ring(solid)) for solid in solids]
    clockwise = [
        loop[::-1] if shapely.is_ccw(shapely.linearrings(loop)) else loop for loop in loops
    ]
    rim = np.concatenate([np.stack([loop[:-1], loop[1:]], axis=1) for loop in clockwise])
    within = shapely.get_parts(shapely.difference(lines, shapely.boundary(filled)))
    rest = [
        np.stack([line[:-1], line[1:]], axis=1) for line in map(shapely.get_coordinates, within)
    ]
    return ObjectOutline(flat(np.concatenate([rim, *rest])), len(rim))


def flat(segments: FloatArray) -> FloatArray:
    """Segments (k, 2, 2) as the kernels take them (k, 4)."""
    return np.ascontiguousarray(segments.reshape(-1, 4))
