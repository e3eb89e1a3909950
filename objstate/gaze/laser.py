"""What a laser would tell of an object from a place, before anybody has driven there.

Eq. (6) of Elfring et al. 2014 with the sensor simulated: readings are taken from the
expected ranges of a state that the belief holds possible, walls and other objects before
and behind it, and the same beam model as the estimator's says which states they rule out.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import NonNegative, Settings, Share, Strict
from objstate.gaze.entropy import gaussian_entropy, sample_covariance
from objstate.gaze.floor import leaf_ends
from objstate.gaze.sensors import Sensor
from objstate.geometry import FloatArray, IntArray
from objstate.objects import ObjectBelief
from objstate.records import Scan
from objstate.sensing import BeamModel, ExpectedRanges, ScanView, Sensing

FAKES = 8  # states of a door's belief, each with an equal share, at which readings are faked
TEMPLATES = 16  # states of a door, evenly spread, at which readings are simulated
KEPT = 4096  # scans of walls and of single objects
NUDGE = np.array([0.05, 0.05, 0.05])  # m, m, rad by which furniture is shifted to see what changes
FORWARD = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, 0, 1], [0, 1, 1]], dtype=float)


class LookSettings(Strict):
    """What a look from one place consists of."""

    scans: NonNegative = 5.0  # taken where the robot stops to look
    scans_on_way: NonNegative = 1.0  # taken of one object from about one place as it drives by
    beams_share: Share = 1.0  # of a scan's beams that observe objects; less with marginal inference
    robot_std: NonNegative = 0.02  # m, of the robot's position, which all its beams share
    robot_yaw_std: NonNegative = 0.01  # rad


@dataclass(frozen=True, eq=False)
class DoorLook:
    """Log-likelihoods of all a door's states, were the readings of a scan those of some state."""

    chosen: IntArray = field(repr=False)  # (k,) numbers of the states whose readings are simulated
    log_likelihood: FloatArray = field(repr=False)  # (k, s)
    smear: float = 0.0  # states by which the robot's own uncertainty shifts what it reads

    def gain(self, belief: ObjectBelief, scans: float) -> float:
        """Expected information gain of some scans, nats: the mean over what the door may be.

        A state between two simulated ones takes the readings of the nearer, shifted.
        """
        prior = belief.weights.values
        comb = (np.arange(FAKES) + 0.5) / FAKES
        fakes = np.searchsorted(np.cumsum(prior), comb).clip(max=len(prior) - 1)
        nearest = np.abs(self.chosen[None] - fakes[:, None]).argmin(axis=1)
        shift = fakes - self.chosen[nearest]
        states = (np.arange(len(prior)) - shift[:, None]).clip(0, len(prior) - 1)
        shifted = scans * self.log_likelihood[nearest[:, None], states]
        posterior = prior * self._smeared(np.exp(shifted - shifted.max(axis=1, keepdims=True)))
        posterior /= posterior.sum(axis=1, keepdims=True)
        return float(_entropies(prior[None])[0] - _entropies(posterior).mean())

    def _smeared(self, likelihood: FloatArray) -> FloatArray:
        """Likelihoods (k, s) averaged over where the robot may be."""
        if self.smear == 0.0:
            return likelihood
        from scipy.ndimage import gaussian_filter1d

        return np.asarray(gaussian_filter1d(likelihood, self.smear, axis=1, mode="nearest"))


@dataclass(frozen=True, eq=False)
class FurnitureLook:
    """The information (3, 3) that a scan of furniture at its estimated place would hold."""

    information: FloatArray
    shift: FloatArray  # (3, 3) covariance by which the robot's own uncertainty shifts it

    def gain(self, belief: ObjectBelief, scans: float) -> float:
        """Expected information gain of some scans, nats: of a Gaussian of the belief's covariance."""
        before = sample_covariance(belief.deviations, belief.standing.weights.values)
        alone = scans * self.information  # the robot's error stays the same from scan to scan
        told = np.asarray(np.linalg.solve(np.eye(3) + alone @ self.shift, alone))
        after = np.linalg.inv(np.linalg.inv(before) + (told + told.T) / 2.0)
        return float(gaussian_entropy(before) - gaussian_entropy(np.asarray(after)))


Look = DoorLook | FurnitureLook


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
        self._exponent = s.object_updates.tempering * looks.beams_share
        self._expected = ExpectedRanges(building)
        rays = sensor.rays()
        nothing = np.full(len(rays), np.inf)
        self._scan = Scan(0, sensor.name, nothing, rays, sensor.range_min, sensor.range_max)
        self._view: ScanView = Sensing(building, model).view(self._scan)
        self._walls = lru_cache(KEPT)(
            self._walls_from
        )  # objects looked at from one place share these
        self._other = lru_cache(KEPT)(self._other_from)

    def look(
        self, belief: ObjectBelief, pose: FloatArray, others: Mapping[str, FloatArray]
    ) -> Look | None:
        """What a look from ``pose`` (3,) would tell of an object; None where no beam can reach it.

        ``others`` are the states (d,) of other objects that stand before or behind it.
        """
        name, states = belief.item.name, _compared_states(belief)
        alone = self._view.object(name, states, pose[None])[0]  # (s, n)
        background = self._background(others, pose)
        touched = ((alone < background) & (alone < self.sensor.range_max)).any(axis=0)
        if not touched.any():
            return None
        expected = np.minimum(alone, background)[:, touched]
        if belief.item.kind is Kind.PLANAR:
            information = _information(self._told(expected, np.array([0]))[0])
            return FurnitureLook(information, self._shift(belief.mean, pose))
        chosen = np.unique(np.linspace(0, len(states) - 1, TEMPLATES).round().astype(np.int64))
        return DoorLook(chosen, self._told(expected, chosen), self._smear(belief, pose))

    def _shift(self, state: FloatArray, pose: FloatArray) -> FloatArray:
        """Covariance (3, 3) of where furniture at a state (3,) seems to be from an uncertain pose."""
        seems = self._seems(float(np.hypot(*(state[:2] - pose[:2]))))
        return np.diag([seems, seems, float(self._robot_std[1])]) ** 2

    def _smear(self, belief: ObjectBelief, pose: FloatArray) -> float:
        """Standard deviation, in states, of what a door's state seems to be from an uncertain pose."""
        near, far = leaf_ends(belief.item)
        seems = self._seems(float(np.hypot(*((near + far) / 2.0 - pose[:2]))))
        if belief.item.kind is Kind.HINGED:
            seems /= float(np.hypot(*(far - near))) / 2.0  # rad at the middle of the leaf
        return seems / float(belief.cell[0])

    def _seems(self, distance: float) -> float:
        """Standard deviation, m, of where something so far away seems to be."""
        position, yaw = self._robot_std
        return float(np.hypot(position, yaw * distance))

    def _background(self, others: Mapping[str, FloatArray], pose: FloatArray) -> FloatArray:
        nearest = self._walls(pose.tobytes())
        for name, state in others.items():
            nearest = np.minimum(nearest, self._other(name, state.tobytes(), pose.tobytes()))
        return nearest

    def _walls_from(self, pose: bytes) -> FloatArray:
        """What the beams (n,) read of walls alone."""
        return np.asarray(self._expected.walls(np.frombuffer(pose)[None], self._scan.rays)[0])

    def _other_from(self, name: str, state: bytes, pose: bytes) -> FloatArray:
        """What the beams (n,) read of an object alone."""
        states, poses = np.frombuffer(state)[None], np.frombuffer(pose)[None]
        return np.asarray(self._view.object(name, states, poses)[0, 0])

    def _told(self, expected: FloatArray, fakes: IntArray) -> FloatArray:
        """Tempered log-likelihood (k, s) of states with ranges (s, n), by the readings of some."""
        reach = self.sensor.range_max
        read = np.where(expected < reach, expected, np.inf)
        told = [self._model(read[k], reach)(expected).sum(axis=-1) for k in fakes]
        return self._exponent * np.array(told)


def _compared_states(belief: ObjectBelief) -> FloatArray:
    """States (s, d) told apart: all of a door's; of furniture its mean, and what lies around it."""
    if belief.item.kind is not Kind.PLANAR:
        return belief.states
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


def _entropies(weights: FloatArray) -> FloatArray:
    """Shannon entropies (k,) of rows of weights (k, s), nats."""
    logs = np.log(np.where(weights > 0.0, weights, 1.0))
    return np.asarray(-(weights * logs).sum(axis=1))
