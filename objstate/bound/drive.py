"""The Cramér-Rao bound of every object's state along a simulated drive.

The robot's pose at the moment and the states of all objects are unknown together.
What is known of them at best is carried along as one covariance, by the recursion of
Tichavský, Muravchik and Nehorai (1998) for the posterior bound, evaluated on the true
path: odometry widens it, each scan narrows it by its Fisher information, and an object
whose state changes is as unknown as before.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

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
        """The bound (n,) of a coordinate after the scans with these stamps (n,)."""
        scan = np.searchsorted(self.stamps_ns, stamps_ns, side="right") - 1
        return np.asarray(self.deviations[coordinate][scan.clip(min=0)])


def bounds_of(simulation: Simulation) -> Bounds:
    """The bounds after every scan of a simulated drive.

    The noise, the building as it stands, and the steady errors of the odometry count
    as known. Raises SettingsError for a laser without noise.
    """
    expected = ExpectedRanges(simulation.building)
    knowledge = Knowledge.at_first(simulation.building, simulation.scene.initial_pose)
    stamps, deviations, before = [], [], simulation.motion.at(0.0)
    states = {name: history.at(0.0) for name, history in simulation.history.items()}
    for stamp, exposure in simulation.exposures():
        knowledge = knowledge.driven(before, exposure.robot, simulation.scene.odometry)
        before = exposure.robot
        for name, history in simulation.history.items():
            state = history.at(exposure.time)
            if not np.array_equal(state, states[name]):
                knowledge = knowledge.without(name)
            states[name] = state
        knowledge = knowledge.after(scan_information(expected, exposure))
        stamps.append(stamp)
        deviations.append(knowledge.deviations)
    table = np.array(deviations).reshape(len(stamps), -1)
    return Bounds(
        stamps_ns=np.array(stamps, dtype=np.int64),
        deviations={key: table[:, place] for key, place in knowledge.layout.places.items()},
        robot=table[:, :POSE],
    )


@dataclass(frozen=True, eq=False)
class Layout:
    """Where each object's state stands in a vector that begins with the robot's pose."""

    rows: Mapping[str, IntArray]  # of each object's state
    places: Mapping[tuple[str, str], int]  # of each object's coordinates

    @staticmethod
    def of(building: Building) -> Layout:
        rows: dict[str, IntArray] = {}
        places: dict[tuple[str, str], int] = {}
        size = POSE
        for name, item in building.objects.items():
            rows[name] = np.arange(size, size + len(item.coordinates))
            places |= {(name, c): size + i for i, c in enumerate(item.coordinates)}
            size += len(item.coordinates)
        return Layout(rows, places)


@dataclass(frozen=True, eq=False)
class Knowledge:
    """The least covariance of the robot's pose and all objects' states together."""

    layout: Layout
    prior: FloatArray  # (n,) standard deviations before any scan
    covariance: FloatArray  # (n, n)

    @staticmethod
    def at_first(building: Building, start: InitialPose | None) -> Knowledge:
        """What is known before the first scan."""
        states = [_widest(item) for item in building.objects.values()]
        prior = np.concatenate([_start(start), *states])
        return Knowledge(Layout.of(building), prior, np.diag(prior**2))

    @property
    def deviations(self) -> FloatArray:
        """(n,) standard deviations of the pose, then of the states."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))

    def driven(self, start: FloatArray, end: FloatArray, noise: OdometryNoise) -> Knowledge:
        """After the robot has moved between two poses (3,), by an odometry with such noise."""
        step, way = end - start, float(np.hypot(*(end - start)[:2]))
        moved = np.eye(len(self.prior))
        moved[:2, 2] = -step[1], step[0]
        wider = moved @ self.covariance @ moved.T
        turned = abs(float(between(start, end)[2]))
        if way > 0.0:  # noise^2 times the way, along the way
            along = step[:2] / way
            wider[:2, :2] += noise.translation_noise**2 * way * np.outer(along, along)
        wider[2, 2] += noise.rotation_noise**2 * turned + noise.drift_noise**2 * way
        return replace(self, covariance=wider)

    def without(self, name: str) -> Knowledge:
        """The information after an object changed its state, about which nothing is known."""
        rows, wider = self.layout.rows[name], self.covariance.copy()
        wider[rows, :] = 0.0
        wider[:, rows] = 0.0
        wider[rows, rows] = self.prior[rows] ** 2
        return replace(self, covariance=wider)

    def after(self, scan: ScanInformation) -> Knowledge:
        """After a scan: the inverse covariance grows by its information."""
        rows = np.concatenate([np.arange(POSE), *(self.layout.rows[n] for n in scan.objects)])
        seen, across = self.covariance[np.ix_(rows, rows)], self.covariance[:, rows]
        # of which J involves only some rows
        gain = scan.matrix @ np.linalg.inv(np.eye(len(rows)) + seen @ scan.matrix)
        narrower = self.covariance - across @ gain @ across.T
        return replace(self, covariance=(narrower + narrower.T) / 2)


def _start(deviations: InitialPose | None) -> FloatArray:
    """(3,) prior knowledge of the pose."""
    if deviations is None:
        return np.array([ANY_PLACE, ANY_PLACE, ANY_YAW])
    return np.array([deviations.sigma_xy, deviations.sigma_xy, deviations.sigma_yaw])


def _widest(item: MovableObject) -> FloatArray:
    """(d,) standard deviations of the state of an object that was never seen."""
    if item.kind is Kind.PLANAR:
        return np.array([ANY_PLACE, ANY_PLACE, ANY_YAW])
    return np.array([(item.upper - item.lower) / np.sqrt(12.0)])
