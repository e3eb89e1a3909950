"""Sections 7.4 and 7.5: how much of the field, of the ball and of the robot's front a behaviour sees."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from objstate.experiments.darmstadt import gazing
from objstate.experiments.darmstadt.behaviours import (
    BallTracking,
    Behaviour,
    LookAtBall,
    Sweep,
)
from objstate.experiments.darmstadt.robot import FRAMES_A_SECOND, Robot
from objstate.experiments.darmstadt.setting import (
    LAYOUT,
    LENGTH,
    STANDING,
    WALKING,
    WIDTH,
    Scene,
)
from objstate.geometry import FloatArray, interpolate_pose, wrap
from objstate.processes import in_order

SECONDS = 60.0
SAMPLE_FRAMES = FRAMES_A_SECOND // 2  # every 500 ms
CONE, CONE_M = math.radians(120.0), 1.0  # in front of the robot
WALK = np.array([[1.5, 1.0], [-1.5, 1.0], [-1.5, -1.0], [1.5, -1.0]])  # m, corners of the way
SPEED, TURN = 0.15, math.radians(45.0)  # m/s and rad/s
CLEAR = 0.5  # m between what is placed at random and the robot's way, and the ball
STARED, AGO_S = math.radians(10.0), 2.0  # near to where it looked so long ago, it stares

ACTIVE, SWEEP, TRACKING = "active gaze control", "localization", "ball tracking"
LOOKING = "look at ball"
CELLWISE, EXACT = "without view entropy", "best of all views"
INHIBITED = "active, inhibition of return"

BEHAVIOURS: Mapping[str, Callable[[int], Behaviour]] = {
    ACTIVE: gazing.with_views,
    SWEEP: lambda _: Sweep(),
    TRACKING: lambda _: BallTracking(),
    LOOKING: lambda _: LookAtBall(),
    INHIBITED: gazing.with_inhibition,
    CELLWISE: gazing.without_views,
    EXACT: gazing.best_of_all,
}
STANDS = (ACTIVE, SWEEP, TRACKING, INHIBITED, CELLWISE, EXACT)
WALKS = (ACTIVE, LOOKING, INHIBITED, CELLWISE, EXACT)


@dataclass(frozen=True, eq=False)
class Coverage:
    """One minute."""

    behaviour: str
    walking: bool
    seed: int
    ball: float  # shares, means over the samples
    observed: float
    front: float
    staring: float
    path: FloatArray = field(repr=False)  # (n, 2) pan and tilt, rad, each tenth of a second
    travel: float  # rad, of pan and tilt together


def cover(walking: bool, seeds: Sequence[int], processes: int) -> Iterator[Coverage]:
    """Every behaviour of table 7.6, or 7.7, and three more, one after another."""
    names = WALKS if walking else STANDS
    yield from in_order(
        _covered, [(name, walking, seed) for name in names for seed in seeds], processes
    )


def way(time: float) -> FloatArray:
    """(3,) the pose of a robot that walks along the rectangle and turns at its corners."""
    legs = np.roll(WALK, -1, axis=0) - WALK
    headings = np.arctan2(legs[:, 1], legs[:, 0])
    length = np.hypot(legs[:, 0], legs[:, 1])
    corner = (math.pi / 2.0) / TURN
    time = math.fmod(time, float(length.sum() / SPEED + 4 * corner))
    for k in range(4):
        begin = np.append(WALK[k], headings[k])
        end = np.append(WALK[(k + 1) % 4], headings[k])
        walked = length[k] / SPEED
        if time < walked:
            return interpolate_pose(begin, end, time / walked)
        time -= walked
        if time < corner:
            turned = np.append(end[:2], headings[(k + 1) % 4])
            return interpolate_pose(end, turned, time / corner)
        time -= corner
    return np.append(WALK[0], headings[0])


def _covered(task: tuple[str, bool, int]) -> Coverage:
    name, walking, seed = task
    rng = np.random.default_rng(seed)
    ball = np.zeros(2) if walking else _place(rng, [np.zeros((1, 2))])
    poses = np.array([way(each) for each in np.arange(0.0, SECONDS, 0.5)])
    taken = [ball[None], poses[:, :2] if walking else np.zeros((1, 2))]
    poles = []
    for _ in range(2 if walking else 1):
        poles.append(_place(rng, taken))
        taken.append(poles[-1][None])
    robot = Robot(Scene(np.array(poles)), WALKING if walking else STANDING, rng)
    robot.ball, robot.ball_validity = ball.copy(), 1.0
    behaviour = BEHAVIOURS[name](seed)
    aims, samples = [], []
    for frame in range(1, round(SECONDS * FRAMES_A_SECOND) + 1):
        pose = way(robot.time) if walking else np.zeros(3)
        robot.step(pose, behaviour.target(robot, pose), ball)
        aims.append((robot.head.pan, robot.head.tilt))
        if frame % SAMPLE_FRAMES == 0:
            samples.append((robot.ball_validity, *_observed(robot, pose)))
    path = np.array(aims)
    valid, observed, front = np.mean(samples, axis=0).tolist()
    travel = float(np.abs(np.diff(path, axis=0)).sum())
    tenth = FRAMES_A_SECOND // 10
    stares = staring(path)
    return Coverage(name, walking, seed, valid, observed, front, stares, path[::tenth], travel)


def staring(path: FloatArray) -> float:
    """The share of time in which the camera looks within 10 degrees of where it looked 2 s before."""
    ago = round(AGO_S * FRAMES_A_SECOND)
    now, then = _directions(path[ago:]), _directions(path[:-ago])
    return float(np.mean((now * then).sum(axis=1) >= math.cos(STARED)))


def _directions(path: FloatArray) -> FloatArray:
    """(n, 3) of pan and tilt (n, 2)."""
    pan, tilt = path[:, 0], path[:, 1]
    flat = np.cos(tilt)
    return np.column_stack([flat * np.cos(pan), flat * np.sin(pan), -np.sin(tilt)])


def _observed(robot: Robot, pose: FloatArray) -> tuple[float, float]:
    """The shares of the field, and of the cone in front of the robot, of which something is known."""
    known = robot.grid.values(robot.stamp_ns) != np.float32(0.5)
    off = LAYOUT.centres() - pose[:2]
    near = np.hypot(off[..., 0], off[..., 1]) <= CONE_M
    turn = np.abs(wrap(np.arctan2(off[..., 1], off[..., 0]) - pose[2])) <= CONE / 2.0
    return float(known.mean()), float(known[near & turn].mean())


def _place(rng: np.random.Generator, taken: Sequence[FloatArray]) -> FloatArray:
    """(2,) m on the field, not near to places (n, 2) that are taken."""
    away = np.concatenate(taken)
    while True:
        place = (rng.random(2) - 0.5) * (np.array([LENGTH, WIDTH]) - 2.0 * CLEAR)
        if np.hypot(*(away - place).T).min() > CLEAR:
            return np.asarray(place)
