"""The Cramér-Rao bound of every object's state along a simulated drive.

The robot's pose at the moment and the states of all objects are unknown together.
What is known of them at best is carried along as one covariance, by the recursion of
Tichavský, Muravchik and Nehorai (1998) for the posterior bound, evaluated on the true
path: odometry widens it, each scan narrows it by its Fisher information, and an object
whose state changes is as unknown as before.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from objstate.bound.readings import POSE, ScanInformation, scan_information
from objstate.building.model import Building, Kind, MovableObject
from objstate.geometry import FloatArray, IntArray, between
from objstate.sensing.expected import ExpectedRanges
from objstate.simulation.drive import Simulation
from objstate.simulation.scene import InitialPose, OdometryNoise

# What nothing but the place of the building tells: deviations of uniform distributions
# over a turn, and over some metres.
ANY_YAW = np.pi / np.sqrt(3)  # rad
ANY_PLACE = 10.0 / np.sqrt(3)  # m


@dataclass(frozen=True, eq=False)
class Bounds:
    """The least standard deviations that estimates from all readings so far can have."""

    stamps_ns: IntArray  # (t,) of the scans, ascending
    deviations: Mapping[tuple[str, str], FloatArray]  # (t,) rad or m, by object and coordinate
    robot: FloatArray  # (t, 3) of x, y (m) and yaw (rad)

    def at(self, coordinate: tuple[str, str], stamps_ns: IntArray) -> FloatArray:
        """The bound (n,) of a coordinate when the scans with these stamps (n,) were taken in."""
        scan = np.searchsorted(self.stamps_ns, stamps_ns, side="right") - 1
        return np.asarray(self.deviations[coordinate][scan.clip(min=0)])


def bounds_of(simulation: Simulation) -> Bounds:
    """The bounds after every scan of a simulated drive.

    The noise, the building as it stands, and the steady errors of the odometry count
    as known. Raises SettingsError for a laser without noise.
    """
    building, expected = simulation.building, ExpectedRanges(simulation.building)
    knowledge = Knowledge(building, simulation.scene.initial_pose)
    stamps, deviations, before = [], [], simulation.motion.at(0.0)
    states = {name: history.at(0.0) for name, history in simulation.history.items()}
    for stamp, exposure in simulation.exposures():
        knowledge.drive(before, exposure.robot, simulation.scene.odometry)
        before = exposure.robot
        for name, history in simulation.history.items():
            state = history.at(exposure.time)
            if not np.array_equal(state, states[name]):
                knowledge.forget(name)
            states[name] = state
        knowledge.learn(scan_information(expected, exposure))
        stamps.append(stamp)
        deviations.append(knowledge.deviations)
    table = np.array(deviations).reshape(len(stamps), -1)
    return Bounds(
        stamps_ns=np.array(stamps, dtype=np.int64),
        deviations={key: table[:, place] for key, place in knowledge.places.items()},
        robot=table[:, :POSE],
    )


class Knowledge:
    """The joint covariance of the robot's pose and all objects' states, as small as it can be."""

    def __init__(self, building: Building, start: InitialPose | None) -> None:
        self._rows: dict[str, IntArray] = {}  # of each object's state in the covariance
        self.places: dict[tuple[str, str], int] = {}  # of each object's coordinates
        size = POSE
        for name, item in building.objects.items():
            self._rows[name] = np.arange(size, size + len(item.coordinates))
            self.places |= {(name, c): size + i for i, c in enumerate(item.coordinates)}
            size += len(item.coordinates)
        self._prior = np.concatenate(
            [_start(start), *(_widest(item) for item in building.objects.values())]
        )
        self._covariance = np.diag(self._prior**2)

    @property
    def deviations(self) -> FloatArray:
        """(3 + d,) standard deviations of the pose, then of the states."""
        return np.asarray(np.sqrt(np.diag(self._covariance)))

    def drive(self, start: FloatArray, end: FloatArray, noise: OdometryNoise) -> None:
        """The robot moves between two poses (3,), with what odometry gets wrong on the way."""
        step, way = end - start, float(np.hypot(*(end - start)[:2]))
        moved = np.eye(len(self._prior))
        moved[:2, 2] = -step[1], step[0]
        self._covariance = moved @ self._covariance @ moved.T
        turned = abs(float(between(start, end)[2]))
        if way > 0.0:  # the noise is along the way: (way * noise^2) times its direction squared
            self._covariance[:2, :2] += noise.translation_noise**2 * np.outer(*[step[:2]] * 2) / way
        self._covariance[2, 2] += noise.rotation_noise**2 * turned + noise.drift_noise**2 * way

    def forget(self, name: str) -> None:
        """An object is in another state, of which nothing is known yet."""
        rows = self._rows[name]
        self._covariance[rows, :] = 0.0
        self._covariance[:, rows] = 0.0
        self._covariance[rows, rows] = self._prior[rows] ** 2

    def learn(self, scan: ScanInformation) -> None:
        """Take in the information of a scan: the inverse covariance grows by it."""
        rows = np.concatenate([np.arange(POSE), *(self._rows[name] for name in scan.objects)])
        seen = self._covariance[np.ix_(rows, rows)]
        # (C^-1 + J)^-1 = C - C J (I + C J)^-1 C, of which J touches only some rows
        gain = scan.matrix @ np.linalg.inv(np.eye(len(rows)) + seen @ scan.matrix)
        across = self._covariance[:, rows]
        shrunk = self._covariance - across @ gain @ across.T
        self._covariance = (shrunk + shrunk.T) / 2


def _start(deviations: InitialPose | None) -> FloatArray:
    """(3,) what is known of the pose at first."""
    if deviations is None:
        return np.array([ANY_PLACE, ANY_PLACE, ANY_YAW])
    return np.array([deviations.sigma_xy, deviations.sigma_xy, deviations.sigma_yaw])


def _widest(item: MovableObject) -> FloatArray:
    """(d,) standard deviations of the state of an object that was never seen."""
    if item.kind is Kind.PLANAR:
        return np.array([ANY_PLACE, ANY_PLACE, ANY_YAW])
    return np.array([(item.upper - item.lower) / np.sqrt(12.0)])
