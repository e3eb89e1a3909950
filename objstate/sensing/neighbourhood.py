"""The walls that a laser may see from somewhere near: those in reach, and once it is worth it, in sight."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import BoolArray, FloatArray
from objstate.records import Rays
from objstate.sensing import kernels, projection
from objstate.sensing.level import Sweep

Rectangle = tuple[float, float, float, float]  # m: left, bottom, right, top

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
        return Neighbourhood(self.rectangle, self.reach, segments, self.asked + 1, is_worth_it)


def _seen(walls: FloatArray, lower: FloatArray, upper: FloatArray) -> BoolArray:
    """Which wall segments (k,) are seen from somewhere in a rectangle.

    From each place of a grid, beams all round find what is large; then points on
    each segment that isn't found yet are looked at from the rectangle's middle and
    corners, so that nothing small is missed.
    """
    grid = _grid(lower, upper)
    places = np.empty((len(grid), 4))
    kernels.stand(grid, places)
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
    if len(segments) == 0:
        return np.zeros(0, dtype=bool)
    start, along = segments[:, None, :2], segments[:, None, 2:] - segments[:, None, :2]
    off = (start + GLIMPSES[:, None] * along - place).reshape(-1, 2)
    distance = np.hypot(off[:, 0], off[:, 1]).clip(min=TOUCHING)
    sweep = _sweep_towards(off / distance[:, None])
    nearest, nothing = np.empty((1, len(off), 1)), np.zeros(len(off))
    projection.cast(
        np.array([[*place, 1.0, 0.0]]),
        np.array([[0.0, 0.0, 1.0, 0.0]]),
        screens,
        0,
        np.ones(len(off), dtype=bool),
        sweep.order,
        sweep.rows,
        sweep.index,
        nothing,
        nothing,
        sweep.centre,
        nearest,
    )
    visible = distance <= nearest[0, :, 0] + TOUCHING
    return np.asarray(visible.reshape(len(segments), -1).any(axis=1))


def _sweep_towards(directions: FloatArray) -> Sweep:
    """A sweep of beams from one place in directions (n, 2)."""
    level = np.column_stack([directions, np.zeros(len(directions))])
    sweep = Sweep.of(Rays(np.zeros_like(level), level))
    assert sweep is not None
    return sweep


def widened(rectangle: Rectangle, by: float) -> Rectangle:
    left, bottom, right, top = rectangle
    return left - by, bottom - by, right + by, top + by
