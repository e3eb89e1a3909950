"""The robot's true motion: from waypoints to a pose at any time.

The route becomes pieces (straight lines, arcs, turns on the spot, pauses), every
piece a fine row of poses; between standing still, a run of pieces is driven as fast
as speed limits and accelerations allow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from objstate.geometry import FloatArray, between, compose, wrap
from objstate.simulation.scene import PlanarState, Route

STEP = 0.005  # m or rad between the poses of a piece; what lies between is interpolated
SHARPEST = math.radians(135.0)  # of a rounded corner: beyond, its arc stays far from the waypoint
STRAIGHT = 1e-6  # rad; a corner that turns by less is none
JUMP = 1e-6  # s that it takes to carry the robot elsewhere; so soon no scan is taken


@dataclass(frozen=True, eq=False)
class Motion:
    """Poses over time, interpolated linearly; the yaw is not wrapped."""

    times: FloatArray  # (n,) s, never decreasing
    track: FloatArray  # (n, 3) x, y, yaw
    rolled: FloatArray | None = (
        None  # (n, 3) as exact wheels feel it, where kidnapping breaks the track
    )

    @property
    def duration(self) -> float:
        return float(self.times[-1])

    def at(self, times: ArrayLike) -> FloatArray:
        """Poses (..., 3) at times (...) s; before and after the motion it stands still."""
        return self._interpolated(times, self.track)

    def by_wheels(self, times: ArrayLike) -> FloatArray:
        """Poses (..., 3) at times (...) s by exact dead reckoning from the start."""
        return self._interpolated(times, self.track if self.rolled is None else self.rolled)

    def _interpolated(self, times: ArrayLike, track: FloatArray) -> FloatArray:
        columns = [np.interp(np.asarray(times), self.times, column) for column in track.T]
        columns[2] = wrap(columns[2])
        return np.stack(columns, axis=-1)


@dataclass(frozen=True, eq=False)
class _Piece:
    """A row of poses at fixed distances, with the speed limit at each."""

    track: FloatArray  # (n, 3)
    ways: FloatArray  # (n,) m or rad from the first pose
    limits: FloatArray  # (n,) m/s or rad/s


def drive(route: Route) -> Motion:
    """The motion along a route. Starts at time 0 at the first waypoint."""
    first = route.waypoints[0]
    legs = _legs(route)
    yaw = route.start_yaw if route.start_yaw is not None else legs[0].yaw if legs else 0.0
    start = np.array([first.x, first.y, yaw])
    rows = [_pause(start, first.pause)]
    run: list[_Piece] = []  # what is driven without standing between
    cut = 0.0  # m by which a rounded corner shortens the leg after it
    for leg, next_leg in zip(legs, [*legs[1:], None], strict=False):
        if not run:
            rows.append(_turn(rows[-1].end, leg.yaw, route))
        corner = _corner(leg, next_leg, route)
        run.append(leg.straight(cut, corner.cut if corner else 0.0))
        if corner:
            run += corner.arc(leg)
            cut = corner.cut
            continue
        rows.append(_driven(run, rows[-1].end[2], route))
        rows.append(_pause(rows[-1].end, leg.pause))
        if leg.kidnapped_to is not None:
            rows.append(_kidnapped(leg.kidnapped_to))
        run, cut = [], 0.0
    return _joined(rows)


@dataclass(frozen=True, eq=False)
class _Row:
    """Poses over time, from time 0 on."""

    times: FloatArray  # (n,) s
    track: FloatArray  # (n, 3)
    is_elsewhere: bool = False  # the robot didn't drive here from the end of the row before

    @property
    def end(self) -> FloatArray:
        return np.asarray(self.track[-1])


@dataclass(frozen=True, eq=False)
class _Leg:
    """The straight way between two waypoints."""

    start: FloatArray  # (2,)
    end: FloatArray  # (2,)
    speed: float  # m/s
    pause: float  # s at its end
    kidnapped_to: PlanarState | None = None  # from its end

    @property
    def length(self) -> float:
        return float(np.hypot(*(self.end - self.start)))

    @property
    def yaw(self) -> float:
        dx, dy = self.end - self.start
        return float(np.arctan2(dy, dx))

    def straight(self, cut_start: float, cut_end: float) -> _Piece:
        """The way without what rounded corners take from both ends."""
        ways = _ways(self.length - cut_start - cut_end)
        ahead = (self.end - self.start) / self.length
        places = self.start + (cut_start + ways)[:, None] * ahead
        track = np.column_stack([places, np.full(len(ways), self.yaw)])
        return _Piece(track, ways, np.full(len(ways), self.speed))


@dataclass(frozen=True)
class _Corner:
    """A corner that is driven through."""

    turn: float  # rad, to the left
    radius: float  # m
    cut: float  # m of both legs that the arc replaces
    speed: float  # m/s

    def arc(self, leg: _Leg) -> list[_Piece]:
        """The arc after ``leg``; none where the route goes straight on."""
        if self.turn == 0.0:
            return []
        ways = _ways(abs(self.turn) * self.radius, STEP * min(1.0, self.radius))
        bow = (ways / self.radius)[:, None]
        ahead = np.array([np.cos(leg.yaw), np.sin(leg.yaw)])
        inward = np.array([-ahead[1], ahead[0]]) * np.sign(self.turn)
        start = leg.end - self.cut * ahead
        places = start + self.radius * (np.sin(bow) * ahead + (1.0 - np.cos(bow)) * inward)
        yaws = leg.yaw + np.sign(self.turn) * bow[:, 0]
        return [_Piece(np.column_stack([places, yaws]), ways, np.full(len(ways), self.speed))]


def _legs(route: Route) -> list[_Leg]:
    return [
        _Leg(
            np.array(start.left_from),
            np.array([end.x, end.y]),
            end.speed or route.speed,
            end.pause,
            end.kidnapped_to,
        )
        for start, end in pairwise(route.waypoints)
    ]


def _corner(leg: _Leg, next_leg: _Leg | None, route: Route) -> _Corner | None:
    """How the end of a leg is driven through; None where the robot stops there."""
    if next_leg is None or leg.pause > 0.0 or leg.kidnapped_to is not None:
        return None
    turn = float(wrap(next_leg.yaw - leg.yaw))
    speed = min(leg.speed, next_leg.speed)
    if abs(turn) > SHARPEST:
        return None
    if abs(turn) < STRAIGHT:
        return _Corner(0.0, 0.0, 0.0, speed)
    tangent = float(np.tan(abs(turn) / 2))
    room = min(leg.length, next_leg.length) / 2
    radius = min(route.corner_radius, room / tangent)
    if radius < STEP:
        return None
    return _Corner(turn, radius, radius * tangent, min(speed, route.turn_rate * radius))


def _ways(length: float, step: float = STEP) -> FloatArray:
    """Marks from 0 to ``length``, at most a step apart."""
    return np.linspace(0.0, length, max(2, int(np.ceil(length / step)) + 1))


def _pause(pose: FloatArray, seconds: float) -> _Row:
    return _Row(np.array([0.0, seconds]), np.stack([pose, pose]))


def _kidnapped(to: PlanarState) -> _Row:
    """Standing, all at once, in another place."""
    pose = np.array([to.x, to.y, to.yaw])
    return _Row(np.array([JUMP, 2.0 * JUMP]), np.stack([pose, pose]), is_elsewhere=True)


def _turn(pose: FloatArray, yaw: float, route: Route) -> _Row:
    """Turning on the spot, the short way round."""
    angle = float(wrap(yaw - pose[2]))
    ways = _ways(abs(angle))
    track = np.repeat(pose[None], len(ways), axis=0)
    track[:, 2] += np.sign(angle) * ways
    return _Row(_times(ways, np.full(len(ways), route.turn_rate), route.turn_acceleration), track)


def _driven(run: list[_Piece], yaw: float, route: Route) -> _Row:
    """Several pieces without standing between them; the yaw goes on from ``yaw``."""
    starts = np.cumsum([0.0, *(piece.ways[-1] for piece in run[:-1])])
    ways = np.concatenate([piece.ways + s for piece, s in zip(run, starts, strict=True)])
    limits = np.concatenate([piece.limits for piece in run])
    track = np.concatenate([piece.track for piece in run])
    track[:, 2] = np.unwrap([yaw, *track[:, 2]])[1:]
    return _Row(_times(ways, limits, route.acceleration), track)


def _times(ways: FloatArray, limits: FloatArray, acceleration: float) -> FloatArray:
    """When each mark is passed, starting and ending at rest, as fast as the limits allow."""
    steps = np.diff(ways)
    ahead = _reachable(steps, [0.0, *limits[1:-1], 0.0], acceleration)
    speeds = np.array(_reachable(steps[::-1], ahead[::-1], acceleration)[::-1])
    sums = speeds[1:] + speeds[:-1]
    between_rests = 2 * np.sqrt(steps / acceleration)  # half the way faster, half slower
    taken = np.divide(2 * steps, sums, out=between_rests, where=sums > 0)
    return np.concatenate([[0.0], np.cumsum(taken)])


def _reachable(steps: FloatArray, limits: list[float], acceleration: float) -> list[float]:
    """Speeds at the marks that are within the limits and within reach of the mark before."""
    speeds = [limits[0]]
    for step, limit in zip(steps.tolist(), limits[1:], strict=True):
        speeds.append(min(limit, (speeds[-1] ** 2 + 2 * acceleration * step) ** 0.5))
    return speeds


def _joined(rows: list[_Row]) -> Motion:
    """Rows one after the other; of marks passed at the same time only the first."""
    starts = np.cumsum([0.0, *(row.times[-1] for row in rows[:-1])])
    times = np.concatenate([row.times + s for row, s in zip(rows, starts, strict=True)])
    track = np.concatenate([row.track for row in rows])
    rolled = np.concatenate(_without_kidnapping(rows))
    keep = np.concatenate([[True], np.diff(times) > 0])
    return Motion(times[keep], track[keep], rolled[keep])


def _without_kidnapping(rows: list[_Row]) -> list[FloatArray]:
    """The rows' tracks, each put where the one before ended."""
    tracks = [rows[0].track]
    for before, row in pairwise(rows):
        if not (row.is_elsewhere or tracks[-1] is not before.track):
            tracks.append(row.track)
            continue
        start = row.track[0] if row.is_elsewhere else before.end
        moved = compose(tracks[-1][-1], between(start, row.track))
        moved[:, 2] = tracks[-1][-1, 2] + row.track[:, 2] - start[2]
        tracks.append(moved)
    return tracks
