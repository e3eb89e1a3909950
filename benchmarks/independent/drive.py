"""How the robot drives, and what its wheels say of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.independent.shapes import Floats
from benchmarks.independent.world import Course, dimensions

STEP = 0.01  # s
MARGIN = 1.2  # m that the robot stays away from the corridor's ends
TURN_RATE = 0.8  # rad/s, turning on the spot
LOOK_AHEAD = 0.8  # m
GAIN = 1.5  # 1/s, of steering
START_PAUSE = 1.0  # s
ODOMETRY_RATE = 20.0  # Hz


@dataclass(frozen=True)
class Drive:
    """The robot's true way."""

    times: Floats  # (n,) s
    poses: Floats  # (n, 3) x, y, yaw; yaw unwrapped

    @property
    def duration(self) -> float:
        """Its length in s."""
        return float(self.times[-1])

    @property
    def along(self) -> Course:
        """How far along the corridor the robot is."""
        return Course(self.times, self.poses[:, 0])

    def at(self, times: Floats) -> Floats:
        """Poses (n, 3) at times; constant outside the drive."""
        columns = [np.interp(times, self.times, self.poses[:, axis]) for axis in range(3)]
        return np.column_stack(columns)


@dataclass(frozen=True)
class OdometryErrors:
    """How wrong the wheels are."""

    scale: float = 0.01  # standard deviation of the factor on distances, per drive
    turn_scale: float = 0.015
    noise: float = 0.01  # m per square root of a metre
    turn_noise: float = 0.01  # rad per square root of a rad
    drift: float = 0.003  # rad/m, standard deviation per drive
    bursts: int = 0  # of slip
    slip: float = 0.4  # standard deviation of the factor on distances within a burst
    burst_turn: float = 0.08  # rad, standard deviation of what a burst turns


@dataclass(frozen=True)
class Route:
    """How the robot drives through a corridor."""

    returns: bool = True  # whether it drives back as well
    speeds: tuple[float, float] = (0.4, 0.6)  # m/s, from, to


def corridor_drive(seed: int, route: Route = Route(), length: float | None = None) -> Drive:
    """Up and down the corridor, weaving, with a pause each way; its ``length`` in m may be given."""
    rng = np.random.default_rng([seed, 21])
    length, half = dimensions(seed, length)
    sway, wave, phase = rng.uniform(0.05, 0.2), rng.uniform(3.0, 6.0), rng.uniform(0.0, 6.3)
    sway = min(sway, half - 1.0)
    pose, poses = [MARGIN, 0.0, 0.0], []
    wait(poses, pose, START_PAUSE)
    legs = ((True, length - MARGIN), (False, MARGIN))
    for forth, target in legs if route.returns else legs[:1]:
        way = 1 if forth else -1
        speed, paused = rng.uniform(*route.speeds), False
        pause_at = rng.uniform(0.3, 0.7) * length
        turn(poses, pose, 0.0 if forth else np.pi)
        while way * (target - pose[0]) > 0.0:
            if not paused and way * (pose[0] - pause_at) > 0.0:
                paused = True
                wait(poses, pose, rng.uniform(1.0, 2.0))
            ahead = pose[0] + way * LOOK_AHEAD
            aim = sway * np.sin(2 * np.pi * ahead / wave + phase)
            bearing = np.arctan2(aim - pose[1], way * LOOK_AHEAD)
            off = (bearing - pose[2] + np.pi) % (2 * np.pi) - np.pi
            pose[0] += speed * np.cos(pose[2]) * STEP
            pose[1] += speed * np.sin(pose[2]) * STEP
            pose[2] += GAIN * off * STEP
            poses.append(tuple(pose))
    wait(poses, pose, 0.5)
    return Drive(np.arange(len(poses)) * STEP, np.array(poses))


def wait(poses: list[tuple[float, ...]], pose: list[float], seconds: float) -> None:
    """Stand still."""
    poses += [tuple(pose)] * round(seconds / STEP)


def turn(poses: list[tuple[float, ...]], pose: list[float], bearing: float) -> None:
    """Turn on the spot."""
    off = (bearing - pose[2] + np.pi) % (2 * np.pi) - np.pi
    start, count = pose[2], round(abs(off) / TURN_RATE / STEP)
    for number in range(count):
        share = (number + 1) / count
        pose[2] = start + off * (3 - 2 * share) * share**2
        poses.append(tuple(pose))


def odometry(seed: int, drive: Drive, errors: OdometryErrors) -> tuple[Floats, Floats]:
    """Times (n,) and poses (n, 3) by the wheels, from (0, 0, 0) on."""
    rng = np.random.default_rng([seed, 22])
    scale, turn_scale = 1 + rng.normal(0.0, [errors.scale, errors.turn_scale])
    drift = rng.normal(0.0, errors.drift)
    times = np.arange(0.0, drive.duration, 1 / ODOMETRY_RATE)
    true = drive.at(times)
    step, turn = np.diff(true[:, :2], axis=0), np.diff(true[:, 2])
    middle = true[:-1, 2] + turn / 2
    ahead = step[:, 0] * np.cos(middle) + step[:, 1] * np.sin(middle)
    aside = -step[:, 0] * np.sin(middle) + step[:, 1] * np.cos(middle)
    way = np.hypot(ahead, aside)
    ahead = scale * ahead + errors.noise * np.sqrt(way) * rng.standard_normal(len(way))
    turn = turn_scale * turn + drift * way
    turn += errors.turn_noise * np.sqrt(np.abs(turn) + 0.1 * way) * rng.standard_normal(len(way))
    factor, extra = _slipped(np.random.default_rng([seed, 23]), times[:-1], errors)
    ahead, turn = ahead * factor, turn + np.where(way > 0.0, extra, 0.0)
    yaw = np.concatenate([[0.0], np.cumsum(turn)])
    heading = yaw[:-1] + turn / 2
    moved = np.column_stack(
        [
            ahead * np.cos(heading) - aside * np.sin(heading),
            ahead * np.sin(heading) + aside * np.cos(heading),
        ]
    )
    return times, np.column_stack([np.vstack([np.zeros(2), np.cumsum(moved, axis=0)]), yaw])


def _slipped(
    rng: np.random.Generator, times: Floats, errors: OdometryErrors
) -> tuple[Floats, Floats]:
    """Factors on distances and extra turns, by bursts of slip of 0.3 to 1 s."""
    factor, extra = np.ones(len(times)), np.zeros(len(times))
    for _ in range(errors.bursts):
        begin, length = rng.uniform(5.0, times[-1] - 5.0), rng.uniform(0.3, 1.0)
        slip, turn = errors.slip * rng.normal(), errors.burst_turn * rng.normal()
        within = (times >= begin) & (times < begin + length)
        factor[within] = max(1 + slip, 0.0)
        extra[within] += turn / max(within.sum(), 1)
    return factor, extra
