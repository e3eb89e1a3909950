"""The information of one scan's readings about the robot's pose and the objects' states.

The Fisher information of a beam is that of its range about the true distance, times the outer
product of the slopes of that distance: how it changes with the robot's pose and with the state of
the object that the beam touches.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from objstate.errors import SettingsError
from objstate.geometry import BoolArray, FloatArray
from objstate.sensing.expected import ExpectedRanges
from objstate.simulation.lasers import Exposure
from objstate.simulation.scene import Laser

STEP = 1e-3  # m or rad to both sides, over which slopes are taken
# m. A distance that bends by more over two steps has come to another surface: the beam lies
# on an edge, where it has no slope.
JUMP = 0.005
POSE = 3  # x, y, yaw
WIDEST = 8.0  # standard deviations over which the density of a reading is integrated
NODES = 1601  # at which it is


@dataclass(frozen=True, eq=False)
class ScanInformation:
    """Fisher information about the robot's pose and the objects that a scan touches."""

    objects: tuple[str, ...]
    matrix: FloatArray  # (3 + d, 3 + d) of the pose, then of each object's state


def range_information(laser: Laser) -> float:
    """Fisher information, 1/m^2, of one reading about the distance that the beam should measure.

    A reading is the distance with Gaussian noise, or a missing return, or a random value between
    the limits of the range, by the laser's shares; random readings also lower the information of
    the others. Rounding counts as noise of its own variance. Raises SettingsError for a laser
    without noise, which has no bound.
    """
    variance = laser.sigma**2 + laser.quantization**2 / 12
    if variance == 0.0:
        raise SettingsError(
            f"Laser '{laser.frame}' of the scene has no noise, so that nothing bounds what can be "
            "learnt from it; give it a sigma above 0."
        )
    off = np.linspace(-WIDEST, WIDEST, NODES)  # standard deviations
    normal = np.exp(-(off**2) / 2) / np.sqrt(2 * np.pi)
    hit = (1 - laser.false_share) * (1 - laser.no_return_share)
    true = hit * normal / np.sqrt(variance)
    false = laser.false_share / (laser.range_max - laser.range_min)
    told = np.divide(true, true + false, out=np.zeros_like(true), where=true > 0)
    return float(hit / variance * np.trapezoid(off**2 * normal * told, off))


def scan_information(expected: ExpectedRanges, exposure: Exposure) -> ScanInformation:
    """The information of all beams of a scan, at the true pose and states.

    ``expected`` are the ranges in the building as it stands. Beams on people and boxes, on edges,
    and out of the laser's limits carry none.
    """
    names = tuple(exposure.states)
    nearest, surface = _nearest(expected, exposure, names)
    laser = exposure.laser
    in_range = (nearest >= laser.range_min) & (nearest <= laser.range_max)
    useful = in_range & (nearest < exposure.unmodelled)
    touched = tuple(n for number, n in enumerate(names) if (useful & (surface == number)).any())
    blocks = [_pose_slopes(expected, exposure, names, surface)]
    for name in touched:
        own = surface == names.index(name)
        blocks.append(np.where(own[:, None], _state_slopes(expected, exposure, name), 0.0))
    slopes = np.concatenate(blocks, axis=1)
    kept = slopes[useful & np.isfinite(slopes).all(axis=1)]
    return ScanInformation(touched, range_information(laser) * kept.T @ kept)


def _nearest(
    expected: ExpectedRanges, exposure: Exposure, names: Sequence[str]
) -> tuple[FloatArray, FloatArray]:
    """Distances (n,) m, and which object each beam touches (n,): -1 for a wall."""
    robot, rays = exposure.robot[None], exposure.rays
    nearest = expected.walls(robot, rays)[0]
    surface = np.full(len(rays), -1)
    for number, name in enumerate(names):
        alone = expected.object(name, exposure.states[name][None], robot, rays)[0, 0]
        surface = np.where(alone < nearest, number, surface)
        nearest = np.minimum(alone, nearest)
    return nearest, surface


def _pose_slopes(
    expected: ExpectedRanges, exposure: Exposure, names: Sequence[str], surface: FloatArray
) -> FloatArray:
    """(n, 3) how the distance of each beam changes with the pose; nan on an edge."""
    poses = _around(exposure.robot)
    ranges = expected.walls(poses, exposure.rays)
    for number in np.unique(surface[surface >= 0]):
        state = exposure.states[names[number]][None]
        alone = expected.object(names[number], state, poses, exposure.rays)[:, 0]
        ranges = np.where(surface == number, alone, ranges)
    return _slopes(ranges)


def _state_slopes(expected: ExpectedRanges, exposure: Exposure, name: str) -> FloatArray:
    """(n, d) how the distance of each beam to an object changes with its state; nan on an edge."""
    states = _around(exposure.states[name])
    return _slopes(expected.object(name, states, exposure.robot[None], exposure.rays)[0])


def _around(point: FloatArray) -> FloatArray:
    """(1 + 2 d, d) a point, then a step back along each axis, then a step ahead."""
    steps = STEP * np.eye(len(point))
    return np.concatenate([point[None], point - steps, point + steps])


def _slopes(ranges: FloatArray) -> FloatArray:
    """(n, d) central differences of ranges (1 + 2 d, n) around a point; nan where they jump."""
    here, back, ahead = ranges[0], *np.split(ranges[1:], 2)
    with np.errstate(invalid="ignore"):
        slopes = (ahead - back) / (2 * STEP)
        smooth: BoolArray = np.abs(ahead + back - 2 * here) <= JUMP
    return np.where(smooth, slopes, np.nan).T
