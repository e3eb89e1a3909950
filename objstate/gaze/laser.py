"""The expected evidence of a laser about an object from a place, by simulation.

Eq. (6) of Elfring et al. 2014: readings are simulated from the expected ranges of possible states,
with walls and other objects before and behind the object, and evaluated by the estimator's beam
model.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache, lru_cache
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import NonNegative, NonNegativeAngle, Positive, Settings, Share, Strict
from objstate.gaze.floor import leaf_ends
from objstate.gaze.sensors import Sensor
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import Later
from objstate.objects import ObjectBelief
from objstate.records import Scan
from objstate.sensing import BeamModel, ExpectedRanges, ScanView, Sensing

if TYPE_CHECKING:
    from objstate.gaze import kernels
else:
    kernels = Later("objstate.gaze.kernels")

COMPARED = 60  # number of a door's states, evenly spread, for which a look is evaluated
TEMPLATES = 16  # of these, evenly spread, at which readings are faked
KEPT = 10_000  # number of looks, and of scans of walls and of single objects, that are cached
NUDGE = np.array([0.05, 0.05, 0.05])  # m, m, rad by which furniture is shifted to see what changes
TINY = 1e-300
FORWARD = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1]], dtype=float)

K = TypeVar("K")
V = TypeVar("V")


class LookSettings(Strict):
    """The parameters of a look from one place."""

    scans: NonNegative = 5.0  # taken where the robot stops to look
    scans_on_way: NonNegative = 1.0  # taken of one object from about one place as it drives by
    beams_share: Share = 1.0  # of a scan's beams that observe objects; less with marginal inference
    robot_std: NonNegative = 0.02  # m, of the robot's position, which all its beams share
    robot_yaw_std: NonNegativeAngle = 0.01  # rad
    variance_factor: Positive = 1.0  # that an estimator learns for its beliefs' variances on a log


class LaserLooks:
    """Simulates looks of one laser in one building."""

    def __init__(
        self,
        building: Building,
        sensor: Sensor,
        settings: Settings | None = None,
        looks: LookSettings | None = None,
    ) -> None:
        s, looks = settings or Settings(), looks or LookSettings()
        model = BeamModel(s.beam_model)
        self.sensor = sensor
        self._model = model
        self._robot_std = np.array([looks.robot_std, looks.robot_yaw_std])
        updates = s.object_updates
        exponent = 1.0 if updates.inference == "joint" else updates.tempering
        self._exponent = exponent * looks.beams_share / looks.variance_factor
        self._expected = ExpectedRanges(building)
        rays = sensor.rays()
        self._bearings = np.arctan2(rays.directions[:, 1], rays.directions[:, 0]) - sensor.yaw
        nothing = np.full(len(rays), np.inf)
        self._scan = Scan(0, sensor.name, nothing, rays, sensor.range_min, sensor.range_max)
        self._view: ScanView = Sensing(building, model).view(self._scan)
        # computes its outline now, as later calls are timed
        for name, item in building.objects.items():
            self._view.object(name, item.home[None], np.zeros((1, 3)))
        self._seen_of_walls: dict[bytes, FloatArray] = {}  # (n,) by pose
        self._other = lru_cache(KEPT)(self._other_from)

    def look(
        self,
        belief: ObjectBelief,
        pose: FloatArray,
        others: Mapping[str, FloatArray],
        scans: float,
    ) -> FloatArray | None:
        """The evidence of some scans from ``pose`` (3,) about an object; None if unreachable.

        For a door it is the log-likelihoods (k, c) of the states that ``compared`` names, for the
        readings of its ``TEMPLATES``; for furniture the information (3, 3) of readings at its mean.
        Evidence from several places adds up. ``others`` are the states (d,) of other objects that
        stand before or behind it.
        """
        states = _compared_states(belief)
        alone = self._view.object(belief.item.name, states, pose[None])[0]  # (s, n)
        background = self._background(others, pose)
        touched = alone.min(axis=0) < np.minimum(background, self.sensor.range_max)
        if not touched.any():
            return None
        expected = np.minimum(alone[:, touched], background[touched])
        if belief.item.kind is Kind.PLANAR:
            information = scans * _information(self._told(expected, np.array([0]))[0])
            return _shared(information, self._shift(belief.mean, pose))
        told = scans * self._told(expected, evenly(len(states), TEMPLATES))
        between = float(states[1, 0] - states[0, 0])
        return _smeared(told, self._smear(belief, pose) / between)

    def walls(self, poses: FloatArray) -> FloatArray:
        """What the beams read (k, n) of walls alone from poses (k, 3), m; cast once from each."""
        known, keys = self._seen_of_walls, [pose.tobytes() for pose in poses]
        new = {key: k for k, key in enumerate(keys) if key not in known}
        if new:
            ranges = self._expected.walls(poses[list(new.values())], self._scan.rays)
            known = known | dict(zip(new, ranges, strict=True))
        for key in new:
            keep(self._seen_of_walls, key, known[key])
        return np.array([known[key] for key in keys]).reshape(len(keys), len(self._bearings))

    def in_sight(
        self, poses: FloatArray, circles: FloatArray, reach: FloatArray, through_walls: bool
    ) -> BoolArray:
        """(k, o) which circles (o, 3) of x, y and radius some beam enters from poses (k, 3).

        Their middles are no farther than ``reach`` (o,) m.
        """
        ranges = np.full((len(poses), len(self._bearings)), self.sensor.range_max)
        if not through_walls:
            ranges = np.minimum(ranges, self.walls(poses))
        out = np.empty((len(poses), len(circles)), dtype=bool)
        lasers = self.sensor.poses(poses)
        kernels.in_sight(lasers, self._bearings, ranges, circles, reach, out)
        return out

    def _shift(self, state: FloatArray, pose: FloatArray) -> FloatArray:
        """Covariance (3, 3) of where furniture at a state (3,) seems to be from an uncertain pose."""
        seems = self._seems(float(np.hypot(*(state[:2] - pose[:2]))))
        return np.diag([seems, seems, float(self._robot_std[1])]) ** 2

    def _smear(self, belief: ObjectBelief, pose: FloatArray) -> float:
        """Standard deviation, rad or m, of what a door's state seems to be from an uncertain pose."""
        near, far = leaf_ends(belief.item)
        seems = self._seems(float(np.hypot(*((near + far) / 2.0 - pose[:2]))))
        if belief.item.kind is Kind.HINGED:
            seems /= float(np.hypot(*(far - near))) / 2.0  # at the middle of the leaf
        return seems

    def _seems(self, distance: float) -> float:
        """Standard deviation, m, of where something so far away seems to be."""
        position, yaw = self._robot_std
        return float(np.hypot(position, yaw * distance))

    def _background(self, others: Mapping[str, FloatArray], pose: FloatArray) -> FloatArray:
        alone = [
            self._other(name, state.tobytes(), pose.tobytes()) for name, state in others.items()
        ]
        return np.asarray(np.min([self.walls(pose[None])[0], *alone], axis=0))

    def _other_from(self, name: str, state: bytes, pose: bytes) -> FloatArray:
        """What the beams (n,) read of an object alone."""
        states, poses = np.frombuffer(state)[None], np.frombuffer(pose)[None]
        return np.asarray(self._view.object(name, states, poses)[0, 0])

    def _told(self, expected: FloatArray, fakes: IntArray) -> FloatArray:
        """Tempered log-likelihood (k, s) of states with ranges (s, n), by the readings of some."""
        reach = self.sensor.range_max
        read = np.where(expected < reach, expected, np.inf)
        return self._exponent * self._model.totals(read[fakes], expected, reach)


def compared(states: int) -> IntArray:
    """Indices (c,) of the states, of some number of a door's, for which a look is evaluated."""
    return evenly(states, COMPARED)


@cache
def evenly(count: int, chosen: int) -> IntArray:
    """Numbers (k,) of no more than ``chosen`` of ``count`` things, evenly spread, both ends included."""
    return np.unique(np.linspace(0, count - 1, chosen).round().astype(np.int64))


def keep(known: dict[K, V], key: K, value: V) -> None:
    """Add to what is known; of too much, the oldest is forgotten."""
    known[key] = value
    if len(known) > KEPT:
        del known[next(iter(known))]


def _compared_states(belief: ObjectBelief) -> FloatArray:
    """States (s, d) to evaluate: many of a door; of furniture its mean and those around it."""
    if belief.item.kind is not Kind.PLANAR:
        return belief.states[compared(len(belief.states))]
    steps = np.concatenate([np.zeros((1, 3)), FORWARD, -FORWARD])
    return np.asarray(belief.mean + NUDGE * steps)


def _information(told: FloatArray) -> FloatArray:
    """Curvature (3, 3) of a log-likelihood (13,) at the states that ``_compared_states`` makes."""
    count = len(FORWARD)
    bend = 2.0 * told[0] - told[1 : 1 + count] - told[1 + count :]  # h' J h of each step h
    curvature = np.diag(bend[:3])
    for (i, j), both in zip(((0, 1), (0, 2), (1, 2)), bend[3:], strict=True):
        curvature[i, j] = curvature[j, i] = (both - bend[i] - bend[j]) / 2.0
    values, vectors = np.linalg.eigh(curvature / np.outer(NUDGE, NUDGE))
    return np.asarray((vectors * values.clip(min=0.0)) @ vectors.T)


def _shared(information: FloatArray, shift: FloatArray) -> FloatArray:
    """What information (3, 3) is left of, when an error of covariance ``shift`` (3, 3) is in all of it.

    Scans from one place share the robot's error: no number of them makes up for it.
    """
    told = np.linalg.solve(np.eye(3) + information @ shift, information)
    return np.asarray((told + told.T) / 2.0)


def _smeared(log_likelihood: FloatArray, smear: float) -> FloatArray:
    """Log-likelihoods (k, c), their likelihoods averaged over the robot's error.

    ``smear`` is the standard deviation, in states, of the shift by that error.
    """
    if smear == 0.0:
        return log_likelihood
    from scipy.ndimage import gaussian_filter1d

    top = log_likelihood.max(axis=1, keepdims=True)
    likelihood = gaussian_filter1d(np.exp(log_likelihood - top), smear, axis=1, mode="nearest")
    return np.asarray(np.log(likelihood + TINY))
