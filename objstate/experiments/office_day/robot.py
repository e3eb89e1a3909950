"""A robot in a simulated office: it drives, looks, and estimates with its own filters.

Scans are taken at even steps of the way and when it looks; between them the robot stands
still or drives blind. That leaves out most scans of a working day, not what they would tell.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from objstate.building.model import Mesh
from objstate.estimator import Estimator
from objstate.experiments.office_day.office import Office
from objstate.gaze.sensors import Sensor
from objstate.geometry import FloatArray, between, compose, wrap
from objstate.objects import ObjectBelief
from objstate.records import NANOSECONDS, Odometry, Scan
from objstate.simulation.crowd import Crowd
from objstate.simulation.lasers import World, reading
from objstate.simulation.scene import Laser, OdometryNoise
from objstate.simulation.states import StateHistory

SPEED = 0.7  # m/s
TURN_RATE = 0.8  # rad/s
SCAN_EVERY = 1.0  # m of way
LOOK_SCANS = 5
LOOK_PERIOD = 0.2  # s between the scans of a look
ODOMETRY = OdometryNoise(translation_scale=0.005, rotation_scale=0.005)


class Robot:
    """The true robot, its clock, and its estimator."""

    def __init__(
        self,
        place: Office,
        day: Mapping[str, StateHistory],
        sensor: Sensor,
        start: FloatArray,
        seed: int,
    ) -> None:
        self.time = 0.0  # s
        self.pose = start  # (3,) where it really is
        self.driven = 0.0  # m
        self.path = [start]  # poses (3,) on its way so far
        self.estimator = Estimator(place.building, place.settings, seed, initial_pose=start)
        self._odometry = np.zeros(3)
        self._sensor = sensor
        self._laser = Laser(
            frame=sensor.name,
            beams=sensor.beams,
            angle_min=-sensor.field_of_view / 2,
            angle_max=sensor.field_of_view / 2,
            range_min=sensor.range_min,
            range_max=sensor.range_max,
            sigma=sensor.sigma,
        )
        self._rays = sensor.rays()
        self._world = World(place.building, day, Crowd([], Mesh.empty()))
        self._rng = np.random.default_rng([seed, 7])
        self.look()

    @property
    def now_ns(self) -> int:
        return round(self.time * NANOSECONDS)

    @property
    def believed_pose(self) -> FloatArray:
        """(3,) where it thinks that it is."""
        assert self.estimator.robot is not None
        return self.estimator.robot.mean

    def beliefs(self) -> dict[str, ObjectBelief]:
        """What it believes of all objects now."""
        return {
            name: self.estimator.object_at(name, self.now_ns) for name in self.estimator.objects
        }

    def drive(self, way: FloatArray, pose: FloatArray) -> None:
        """Along a way (k, 2), then turn to the yaw of ``pose`` (3,) and look."""
        for place in _marks(way, SCAN_EVERY):
            off = place - self.pose[:2]
            if np.hypot(*off) > 1e-6:
                self._move(np.append(place, np.arctan2(off[1], off[0])))
                self._scan()
        self._move(np.append(self.pose[:2], pose[2]))
        self.look()

    def look(self) -> None:
        """Some scans from where it is."""
        for _ in range(LOOK_SCANS):
            self._scan()
            self.time += LOOK_PERIOD

    def wait(self, seconds: float) -> None:
        self.time += seconds

    def _move(self, pose: FloatArray) -> None:
        step = between(self.pose, pose)
        length, turn = float(np.hypot(*step[:2])), abs(float(wrap(step[2])))
        self.driven += length
        self.time += length / SPEED + turn / TURN_RATE
        self._odometry = compose(self._odometry, self._noisy(step, length, turn))
        self.pose = pose
        self.path.append(pose)
        self.estimator.feed(Odometry(self.now_ns, self._odometry))

    def _noisy(self, step: FloatArray, length: float, turn: float) -> FloatArray:
        """A step (3,) as the wheels measure it, in the terms of the simulated drives."""
        noise = ODOMETRY
        stretch = (
            noise.translation_scale
            + noise.translation_noise * self._rng.standard_normal() / max(np.sqrt(length), 1e-3)
        )
        std = np.sqrt(noise.rotation_noise**2 * turn + noise.drift_noise**2 * length)
        twist = noise.rotation_scale * step[2] + std * self._rng.standard_normal()
        scale = 1.0 + stretch if length > 0.0 else 1.0
        return np.array([scale * step[0], scale * step[1], step[2] + twist])

    def _scan(self) -> None:
        reach = self._sensor.range_max + 1.0
        distances = self._world.distances(self.time, self.pose, self._rays, reach)
        ranges = reading(distances, self._laser, self._rng)
        ranges = np.where(np.isneginf(ranges), np.nan, ranges)
        scan = Scan(
            self.now_ns,
            self._sensor.name,
            ranges,
            self._rays,
            self._sensor.range_min,
            self._sensor.range_max,
            self._odometry,
        )
        self.estimator.feed(scan)


def _marks(way: FloatArray, spacing: float) -> FloatArray:
    """Places (m, 2) at even steps along a way (k, 2), its end included."""
    driven = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1)))
    marks = np.append(np.arange(spacing, driven[-1], spacing), driven[-1])
    return np.column_stack([np.interp(marks, driven, column) for column in way.T])
