"""Simultaneous object state estimation and localization: Table 1, Schulz and Burgard 2001."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal
from zlib import crc32

import numpy as np

from objstate.building.model import Building
from objstate.config import Settings
from objstate.errors import SettingsError
from objstate.estimator.backdrop import Backdrop
from objstate.estimator.schedule import Schedule, evenly_spread
from objstate.estimator.surroundings import Surroundings
from objstate.geometry import BoolArray, FloatArray, between
from objstate.localization import Localizer, PoseBelief
from objstate.objects import ObjectBelief, ScanEvidence, filter_for
from objstate.particles import Weights
from objstate.records import (
    Estimate,
    GaussianRobotBelief,
    InitialPose,
    Odometry,
    Record,
    RobotBelief,
    Scan,
)
from objstate.sensing import BeamModel, ScanView, Sensing, UncertainObject

NANOSECONDS = 1e9


class Estimator:
    """Where is the robot, and where is each object? Fed with records, one by one, in time order.

    Args:
        building: the walls and the objects.
        settings: every constant; the defaults serve.
        seed: the same seed and the same records give the same estimates, bit by bit.
        initial_pose: (3,) x m, y m, yaw rad in the building's frame, instead of the log's own.
        global_start: the robot may be anywhere in the building.
        belief: ``own`` localizes by odometry and scans; ``recorded`` takes the robot
            belief that the log holds, as in the paper's experiments.

    Raises:
        SettingsError: settings that contradict each other or an object's joint.
    """

    def __init__(
        self,
        building: Building,
        settings: Settings | None = None,
        *,
        seed: int = 0,
        initial_pose: FloatArray | None = None,
        global_start: bool = False,
        belief: Literal["own", "recorded"] = "own",
    ) -> None:
        self.building = building
        self.settings = settings or Settings()
        self.warnings: list[str] = []
        self.scans_without_pose = 0
        self._localizes_itself = belief == "own"
        self._rng = np.random.default_rng([seed, 0])
        self._object_rngs = {
            name: np.random.default_rng([seed, 1, crc32(name.encode())])
            for name in building.objects
        }
        self._localizer = Localizer(self.settings.localization)
        self._sensing = Sensing(building, BeamModel(self.settings.beam_model))
        self._schedule = Schedule(self.settings.object_updates)
        self._surroundings = Surroundings(building)
        self._filters = {
            name: filter_for(item, self.settings) for name, item in building.objects.items()
        }
        self._objects = {
            name: each.prior(self._object_rngs[name]) for name, each in self._filters.items()
        }
        for name, prior in self._objects.items():
            self._surroundings.follow(name, prior)
        self._odometry: FloatArray | None = None
        self._corrected_at: FloatArray | None = None  # odometry at the last correction
        self._start_is_told = initial_pose is not None or global_start
        self._robot = self._start(initial_pose, global_start)

    @property
    def robot(self) -> PoseBelief | None:
        """p(l), the robot belief; None while nothing is known of the robot's pose."""
        return self._robot

    @property
    def objects(self) -> dict[str, ObjectBelief]:
        """p(s) of each object, as of its last update; values that later records don't change."""
        return dict(self._objects)

    def object_at(self, name: str, stamp_ns: int) -> ObjectBelief:
        """An object's belief predicted to a moment at or after its last update."""
        return self._predicted(name, stamp_ns, np.random.default_rng([stamp_ns, 2]))

    def feed(self, record: Record) -> list[Estimate]:
        """Take one record in; what it changed in the objects' beliefs comes back."""
        match record:
            case Odometry():
                self._drive(record.pose)
            case Scan():
                return self._sense(record)
            case InitialPose() | GaussianRobotBelief() | RobotBelief():
                self._be_told(record)
        return []

    # --- the loop -------------------------------------------------------------------

    def _sense(self, scan: Scan) -> list[Estimate]:
        """The body of Table 1's loop, for new sensory input o_k."""
        if scan.odometry is not None:
            self._drive(scan.odometry)
        if self._robot is None:
            self.scans_without_pose += 1
            return []
        localizing, observing = self._schedule.share_out(scan)
        if not self._localizes_itself:
            localizing, observing = np.zeros_like(localizing), scan.valid
        if localizing.any() and self._tells_something_new(self._robot):
            self._robot = self._localize(self._robot, scan, localizing)
            self._corrected_at = self._odometry
        if not observing.any() or not self._knows_its_place(self._robot):
            return []
        near = self._surroundings.within(self._robot, self.settings.object_updates.max_distance)
        robot = self._robot.thinned(self.settings.object_updates.robot_samples, self._rng)
        return self._observe(near, scan, observing, robot)

    def _drive(self, pose: FloatArray) -> None:
        """p(l) <- integral of p(l | a, l') p(l'), for a new odometry reading a."""
        if self._robot is not None and self._odometry is not None and self._localizes_itself:
            step = between(self._odometry, pose)
            self._robot = self._localizer.predict(self._robot, step, self._rng)
        elif self._robot is not None and self._odometry is not None:
            self._robot = self._robot.moved(between(self._odometry, pose))
        self._odometry = pose

    def _localize(self, robot: PoseBelief, scan: Scan, beams: BoolArray) -> PoseBelief:
        """p(l | o_k) <- alpha p(o_k | l) p(l)."""
        beams = evenly_spread(beams, self.settings.localization.max_beams)
        view = self._sensing.view(scan, beams)
        objects = self._scenery(robot, scan, beams, view)
        return self._localizer.correct(
            robot, lambda poses, blur: view.pose_log_likelihood(poses, blur, objects), self._rng
        )

    def _observe(
        self, names: list[str], scan: Scan, beams: BoolArray, robot: PoseBelief
    ) -> list[Estimate]:
        """For each object i near the robot: predict p(s_i), then integrate o_k into it."""
        towards = self._surroundings.towards(names, robot, scan.rays) & beams
        used = np.asarray(towards.any(axis=0))
        for name in names:
            self._objects[name] = self._predicted(name, scan.stamp_ns)
        backdrop = Backdrop(self._sensing.view(scan, used), robot.poses, self._objects, names)
        rows = []
        for name, mask in zip(names, towards[:, used], strict=True):
            observed = bool(mask.any()) and self._integrate(name, backdrop, mask, robot)
            if observed:
                self._objects[name] = replace(self._objects[name], last_observed_ns=scan.stamp_ns)
                self._surroundings.follow(name, self._objects[name])
            rows += self._objects[name].estimates(observed)
        return rows

    def _integrate(
        self, name: str, backdrop: Backdrop, beams: BoolArray, robot: PoseBelief
    ) -> bool:
        """p(s_i | o_k) <- sum over l of p(o_k | s_i, l) p(s_i) p(l) / p(o_k | l); whether it told anything."""
        evidence = ScanEvidence(
            name=name,
            view=backdrop.view.take(beams),
            poses=robot.poses,
            robot_weights=robot.weights,
            background=backdrop.without(name)[:, beams],
            tempering=self.settings.object_updates.tempering,
        )
        belief = self._objects[name]
        updated = self._filters[name].update(belief, evidence, self._object_rngs[name])
        self._objects[name] = updated
        return updated is not belief

    # --- what the steps need --------------------------------------------------------

    def _predicted(
        self, name: str, stamp_ns: int, rng: np.random.Generator | None = None
    ) -> ObjectBelief:
        """p(s_i) <- integral of p(s_i | t, s_i') p(s_i'), t the time since the last update."""
        belief = self._objects[name]
        if belief.stamp_ns is not None and stamp_ns > belief.stamp_ns:
            seconds = (stamp_ns - belief.stamp_ns) / NANOSECONDS
            belief = self._filters[name].predict(belief, seconds, rng or self._object_rngs[name])
        return replace(belief, stamp_ns=stamp_ns)

    def _scenery(
        self, robot: PoseBelief, scan: Scan, beams: BoolArray, view: ScanView
    ) -> list[UncertainObject]:
        """The objects that localization must reckon with, each where it may be."""
        if not self._knows_its_place(robot):
            return []
        rays, states = scan.rays.take(beams), self.settings.localization.object_states
        near = self._surroundings.within(robot, scan.range_max)
        walls = view.walls(robot.mean[None])[0]
        seen = self._surroundings.in_sight(near, robot, rays, walls)
        return [self._objects[name].represented_by(name, states) for name in seen]

    def _tells_something_new(self, robot: PoseBelief) -> bool:
        """Whether a scan may be taken in: a robot that is lost must have moved since the last.

        Scans from one place repeat each other's errors, and would settle on a wrong one.
        """
        if self._knows_its_place(robot) or self._corrected_at is None or self._odometry is None:
            return True
        step, s = between(self._corrected_at, self._odometry), self.settings.localization
        return bool(np.hypot(*step[:2]) >= s.update_min_d or abs(step[2]) >= s.update_min_a)

    def _knows_its_place(self, robot: PoseBelief) -> bool:
        return robot.position_std <= self.settings.object_updates.max_position_std

    # --- the robot's start ----------------------------------------------------------

    def _start(self, pose: FloatArray | None, anywhere: bool) -> PoseBelief | None:
        if pose is not None and anywhere:
            raise SettingsError("--initial-pose and --global exclude each other; give one.")
        if pose is not None:
            return self._localizer.start(pose, self._localizer.told_covariance, self._rng)
        if anywhere:
            corners = self.building.walls.vertices[:, :2]
            return self._localizer.start_anywhere(
                corners.min(axis=0), corners.max(axis=0), self._rng
            )
        return None

    def _be_told(self, record: InitialPose | GaussianRobotBelief | RobotBelief) -> None:
        """Take a pose belief from outside: as the start, or as the recorded belief."""
        is_start = isinstance(record, InitialPose)
        if self._localizes_itself and not is_start:
            if self._robot is not None:
                return
            self.warnings.append(
                "The log holds no /initialpose; localization started from its first recorded "
                "robot belief."
            )
        if is_start and self._start_is_told:
            return
        if isinstance(record, RobotBelief):
            self._robot = PoseBelief(record.poses, Weights.of(record.weights))
        else:
            self._robot = self._localizer.start(record.mean, record.covariance, self._rng)
