"""Dead reckoning with the errors of wheels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.geometry import FloatArray, between, compose
from objstate.simulation.route import Motion
from objstate.simulation.scene import OdometryNoise


@dataclass(frozen=True, eq=False)
class DeadReckoning:
    """What the wheels say: poses in the odom frame, which starts at zero."""

    times: FloatArray  # (n,) s
    poses: FloatArray  # (n, 3)
    velocities: FloatArray  # (n, 3) m/s ahead, m/s to the left, rad/s, over the last period


def dead_reckoning(motion: Motion, noise: OdometryNoise, rng: np.random.Generator) -> DeadReckoning:
    """Noisy steps of the true motion, added up.

    The random errors of a way are the same in distribution at whatever rate it is
    measured: their variances grow with the way.
    """
    period = 1.0 / noise.rate
    times = np.arange(0.0, motion.duration + period, period)
    truth = motion.by_wheels(times)
    steps = between(truth[:-1], truth[1:])
    measured = _with_errors(steps, noise, rng)
    poses = [np.zeros(3)]
    for step in measured:
        poses.append(compose(poses[-1], step))
    return DeadReckoning(times, np.array(poses), np.vstack([np.zeros(3), measured / period]))


def _with_errors(steps: FloatArray, noise: OdometryNoise, rng: np.random.Generator) -> FloatArray:
    """Steps (n, 3) as the wheels measure them."""
    ways = np.hypot(steps[:, 0], steps[:, 1])
    turns = steps[:, 2]
    stretch = noise.translation_scale * ways + noise.translation_noise * np.sqrt(
        ways
    ) * rng.standard_normal(len(steps))
    turn_variance = noise.rotation_noise**2 * np.abs(turns) + noise.drift_noise**2 * ways
    twist = (
        noise.rotation_scale * turns
        + noise.drift * ways
        + np.sqrt(turn_variance) * rng.standard_normal(len(steps))
    )
    share = np.divide(stretch, ways, out=np.zeros_like(ways), where=ways > 0)
    return np.column_stack([steps[:, :2] * (1.0 + share)[:, None], turns + twist])
