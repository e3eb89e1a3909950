"""Section 8.1 of Elfring et al. 2014: a cat that runs to and fro, watched by one camera with depth.

The camera stands still and has the cat in view all the time. In each frame the coordinator
weighs what an update would gain, eq. (6), and updates where that is above the threshold.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from objstate.gaze.entropy import gaussian_entropy
from objstate.geometry import BoolArray, FloatArray

FRAMES_PER_SECOND = 30.0  # of the paper's Kinect
DEPTH = (
    1.425e-3  # 1/m: sigma of a depth z of that sensor is DEPTH z^2 (Khoshelham and Elberink 2012)
)
BLOB = 0.01  # m, sigma of the middle of a cat's blob in any direction: it changes its shape
ACCELERATION = 6.0  # m/s^2, sigma of the process noise: a cat turns within half a second
REGION = 11.345  # chi-squared of 3 coordinates, 99 %; the paper's region holds 95 % of each


@dataclass(frozen=True)
class CatSetup:
    """One video."""

    gain_threshold: float = 2.0  # nats; the paper doesn't say
    duration: float = 30.0  # s
    nearest: float = 1.0  # m from the camera, between which it runs
    farthest: float = 3.5
    period: float = 7.0  # s, to and fro


@dataclass(frozen=True, eq=False)
class CatCourse:
    """What came of a video."""

    updated: BoolArray = field(repr=False)  # (t,) in which frames
    entropies: FloatArray = field(repr=False)  # (t,) nats, of the position, after each frame
    distances: FloatArray = field(repr=False)  # (t,) m, of the cat from the camera
    errors: FloatArray = field(repr=False)  # (t,) m
    inside: FloatArray = field(repr=False)  # (u,) whether a reading lay in the region of interest

    @property
    def rates(self) -> FloatArray:
        """(s,) updates a second, second by second."""
        frames = round(FRAMES_PER_SECOND)
        whole = len(self.updated) // frames * frames
        return np.asarray(self.updated[:whole].reshape(-1, frames).sum(axis=1, dtype=float))


def follow(setup: CatSetup, seed: int, every_frame: bool = False) -> CatCourse:
    """One video, with updates where they gain enough, or in ``every_frame``."""
    rng = np.random.default_rng(seed)
    truth = _run(setup, rng)
    transition, process = _constant_velocity(1.0 / FRAMES_PER_SECOND)
    noise = rng.standard_normal((len(truth), 3))
    mean = np.concatenate([truth[0], np.zeros(3)])
    covariance = np.diag([BLOB**2] * 3 + [1.0] * 3)
    updated, entropies, errors, inside = [], [], [], []
    for position, unit in zip(truth, noise, strict=True):
        mean, covariance = transition @ mean, transition @ covariance @ transition.T + process
        spread = _reading_covariance(mean[:3])
        seen = covariance[:3, :3]
        gain = float(gaussian_entropy(seen) - gaussian_entropy(_after(seen, spread)))
        chosen = every_frame or gain > setup.gain_threshold
        if chosen:
            reading = position + np.sqrt(np.diag(_reading_covariance(position))) * unit
            off = reading - mean[:3]
            inside.append(float(off @ np.linalg.solve(seen + spread, off) <= REGION))
            weight = np.linalg.solve(seen + spread, covariance[:3]).T
            mean, covariance = mean + weight @ off, covariance - weight @ covariance[:3]
        updated.append(chosen)
        entropies.append(float(gaussian_entropy(covariance[:3, :3])))
        errors.append(float(np.linalg.norm(mean[:3] - position)))
    return CatCourse(
        np.array(updated),
        np.array(entropies),
        np.linalg.norm(truth, axis=1),
        np.array(errors),
        np.array(inside),
    )


def _run(setup: CatSetup, rng: np.random.Generator) -> FloatArray:
    """(t, 3) m, in the camera's frame, depth last: to and fro, with a jump now and then."""
    times = np.arange(round(setup.duration * FRAMES_PER_SECOND)) / FRAMES_PER_SECOND
    middle, reach = (setup.farthest + setup.nearest) / 2.0, (setup.farthest - setup.nearest) / 2.0
    phase = 2.0 * np.pi * times / setup.period + rng.uniform(0.0, 2.0 * np.pi)
    across = 0.6 * np.sin(2.3 * phase + rng.uniform(0.0, 2.0 * np.pi))
    jump = 0.4 * np.clip(1.0 - ((times - setup.duration / 2.0) / 0.35) ** 2, 0.0, None)
    return np.column_stack([across, jump, middle + reach * np.sin(phase)])


def _constant_velocity(step: float) -> tuple[FloatArray, FloatArray]:
    """Transition (6, 6) of position and velocity, and the noise's constant, diagonal covariance."""
    transition = np.eye(6)
    transition[:3, 3:] = step * np.eye(3)
    process = np.diag([(0.5 * ACCELERATION * step**2) ** 2] * 3 + [(ACCELERATION * step) ** 2] * 3)
    return transition, process


def _reading_covariance(position: FloatArray) -> FloatArray:
    """(3, 3) m^2: depth is read the worse the farther away."""
    depth = DEPTH * float(position[2]) ** 2
    return np.diag([BLOB**2, BLOB**2, BLOB**2 + depth**2])


def _after(covariance: FloatArray, noise: FloatArray) -> FloatArray:
    """(3, 3) that a reading leaves."""
    return np.asarray(covariance - covariance @ np.linalg.solve(covariance + noise, covariance))
