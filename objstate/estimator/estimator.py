"""Simultaneous object state estimation and localization: Table 1, Schulz and Burgard 2001."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal
from zlib import crc32

import numpy as np

from objstate.building.model import Building
from objstate.config import Settings
from objstate.errors import LogError, SettingsError
from objstate.estimator.backdrop import Backdrop
from objstate.estimator.map_error import MapError
from objstate.estimator.schedule import Schedule, evenly_spread
from objstate.estimator.surroundings import Surroundings
from objstate.estimator.tracking import (
    NANOSECONDS,
    Patience,
    Track,
    Trusted,
    share_through_walls,
)
from objstate.geometry import BoolArray, FloatArray, between, transform_from_pose
from objstate.localization import Localizer, PoseBelief
from objstate.objects import ConditionalBelief, ObjectBelief, ScanEvidence, filter_for
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
from objstate.sensing import BeamModel, Sensing, UncertainObject, cast_from


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
        seed: int = 0,
        *,
        initial_pose: FloatArray | None = None,
        global_start: bool = False,
        belief: Literal["own", "recorded"] = "own",
    ) -> None:
        self.building = building
        self.settings = settings or Settings()
        self.warnings: list[str] = []
        self.scans_without_pose = 0
        self.corrections = 0  # scans that localized the robot
        self.lost: list[tuple[int, int]] = []  # ns, stretches in which the robot was lost
        self._localizes_itself = belief == "own"
        self._rng = np.random.default_rng([seed, 0])
        self._search_rng = np.random.default_rng([seed, 2])
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
        self._map_error = MapError(self.settings.map_error)
        self._in_view: dict[str, ConditionalBelief] = {}
        self._odometry: FloatArray | None = None
        self._now_ns = 0
        self._start_is_told = initial_pose is not None or global_start
        start = self._start(initial_pose, global_start)
        self._track = None if start is None else Track(start)
        self._search: Track | None = None
        self._trusted = Trusted(0, self.objects)
        self._patience = Patience(0, self.settings.localization.lost_after)

    @property
    def robot(self) -> PoseBelief | None:
        """p(l), the robot belief; None while nothing is known of the robot's pose."""
        return None if self._track is None else self._track.belief

    @property
    def objects(self) -> dict[str, ObjectBelief]:
        """p(s) of each object, as of its last update; values that later records don't change."""
        return dict(self._objects)

    def object_at(self, name: str, stamp_ns: int) -> ObjectBelief:
        """An object's belief predicted to a moment at or after its last update.

        Raises ValueError for an earlier moment.
        """
        known = self._objects[name].stamp_ns
        if known is not None and stamp_ns < known:
            raise ValueError(f"object '{name}' was updated after {stamp_ns} ns, at {known} ns")
        return self._predicted(name, stamp_ns, np.random.default_rng(stamp_ns))

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
        if scan.stamp_ns < self._now_ns:
            raise LogError(
                f"A scan of {scan.stamp_ns} ns came after one of {self._now_ns} ns; feed records "
                "in time order, as open_log gives them."
            )
        self._now_ns = scan.stamp_ns
        if scan.odometry is not None:
            self._drive(scan.odometry)
        if self._track is None:
            self.scans_without_pose += 1
            return []
        if self._infers_jointly(self._track.belief):
            return self._sense_jointly(self._track, scan)
        self._in_view.clear()
        localizing, observing = self._schedule.share_out(scan)
        if not self._localizes_itself:
            localizing, observing = np.zeros_like(localizing), scan.valid
        if localizing.any():
            self._track = self._localize(self._track, scan, localizing, self._rng)
            self.corrections += 1
            self._doubt(self._track, scan, localizing)
        robot = self._track.belief
        if not observing.any() or not self._is_narrow(robot):
            return []
        near = self._surroundings.within(robot, self.settings.object_updates.max_distance)
        samples = robot.thinned(self.settings.object_updates.robot_samples, self._rng)
        return self._observe(near, scan, observing, samples)

    def _drive(self, pose: FloatArray) -> None:
        """p(l) <- integral of p(l | a, l') p(l'), for a new odometry reading a."""
        if self._odometry is not None:
            step = between(self._odometry, pose)
            self._track = self._driven(self._track, step, self._rng)
            self._search = self._driven(self._search, step, self._search_rng)
        self._odometry = pose

    def _driven(
        self, track: Track | None, step: FloatArray, rng: np.random.Generator
    ) -> Track | None:
        if track is None:
            return None
        if not self._localizes_itself:
            return replace(track, belief=track.belief.moved(step))
        return replace(track, belief=self._localizer.predict(track.belief, step, rng))

    def _localize(
        self, track: Track, scan: Scan, beams: BoolArray, rng: np.random.Generator
    ) -> Track:
        """p(l | o_k) <- alpha p(o_k | l) p(l)."""
        s, robot, objects = self.settings.localization, track.belief, []
        beams = evenly_spread(beams, s.max_beams)
        view = self._sensing.view(scan, beams)
        if self._is_narrow(robot):
            walls = view.walls(robot.mean[None])[0]
            through = share_through_walls(scan.ranges[beams], walls, s.lost_margin)
            track = track.judged(through, scan.stamp_ns, s)
            objects = self._scenery(robot, scan, beams, walls)
        elif not track.moved_enough(self._odometry, s):
            return track
        log_likelihood = s.tempering * view.pose_log_likelihood(
            robot.poses, self._localizer.blur(robot), objects
        )
        corrected, _ = self._localizer.renew(self._localizer.correct(robot, log_likelihood), rng)
        return track.corrected(corrected, scan.stamp_ns, self._odometry)

    def _infers_jointly(self, robot: PoseBelief) -> bool:
        s = self.settings.object_updates
        return (
            self._localizes_itself
            and s.inference == "joint"
            and len(robot.weights) <= s.joint_samples
            and self._is_narrow(robot)
        )

    def _sense_jointly(self, track: Track, scan: Scan) -> list[Estimate]:
        """p(l, s | o_k): all beams serve both, and each robot sample has its own p(s_i | l)."""
        s, u, robot = self.settings.localization, self.settings.object_updates, track.belief
        spread = evenly_spread(scan.valid, s.max_beams)
        walls = self._sensing.view(scan, spread).walls(robot.mean[None])[0]
        through = share_through_walls(scan.ranges[spread], walls, s.lost_margin)
        track = track.judged(through, scan.stamp_ns, s)
        if self._map_error.is_due(scan.stamp_ns):
            self._note_map_error(scan, robot)
        near = self._surroundings.within(robot, u.max_distance)
        towards = self._surroundings.towards(near, robot, scan.rays) & scan.valid
        used = np.asarray(towards.any(axis=0))
        aside = evenly_spread(scan.valid & ~used, s.max_beams)
        far = [each for each in self._scenery(robot, scan, spread, walls) if each.name not in near]
        evidence = s.tempering * self._sensing.view(scan, aside).pose_log_likelihood(
            robot.poses, self._localizer.blur(robot), far
        )
        believed = {
            name: self._filters[name].predict_each(
                self._in_view.get(name)
                or ConditionalBelief.independent(self._objects[name], len(robot.weights)),
                self._since(name, scan.stamp_ns),
                self._object_rngs[name],
            )
            for name in near
        }
        backdrop = Backdrop(
            self._sensing.view(scan, used),
            robot.poses,
            {name: each.belief for name, each in believed.items()},
            near,
        )
        base = backdrop.view.log_likelihood(backdrop.whole)
        evidence += u.tempering * base
        seen = {}
        for name, mask in zip(near, towards[:, used], strict=True):
            without = backdrop.without(name)
            updated = mask.any() and self._filters[name].update(
                believed[name],
                ScanEvidence(
                    name=name,
                    view=backdrop.view,
                    poses=robot.poses,
                    robot_weights=robot.weights,
                    background=without,
                    tempering=u.tempering,
                    shift_std=self._map_error.std,
                ),
                self._object_rngs[name],
            )
            if not updated:
                continue
            seen[name] = updated
            evidence += updated.log_evidence
            evidence += u.tempering * (backdrop.view.log_likelihood(without) - base)
        corrected = self._localizer.correct(robot, evidence)
        rows = []
        self._in_view = {}
        for name in near:
            each = seen[name].conditional if name in seen else believed[name]
            each = each.averaged(each.given, corrected.weights.values)
            belief = replace(
                each.belief,
                stamp_ns=scan.stamp_ns,
                last_observed_ns=scan.stamp_ns if name in seen else each.belief.last_observed_ns,
            )
            self._objects[name] = belief
            self._in_view[name] = replace(each, belief=belief)
            if name in seen:
                self._surroundings.follow(name, belief)
            rows += self._filters[name].widened(belief, self._map_error.std).estimates(name in seen)
        renewed, ancestors = self._localizer.renew(corrected, self._rng)
        if ancestors is not None:
            self._in_view = {n: each.resampled(ancestors) for n, each in self._in_view.items()}
        self._track = track.corrected(renewed, scan.stamp_ns, self._odometry)
        self.corrections += 1
        self._doubt(self._track, scan, scan.valid)
        return rows

    def _note_map_error(self, scan: Scan, robot: PoseBelief) -> None:
        near = self._surroundings.within(robot, scan.range_max)
        bare = np.isfinite(scan.ranges)
        bare &= ~self._surroundings.towards(near, robot, scan.rays).any(axis=0)
        walls = self._sensing.view(scan, bare).walls(robot.mean[None])[0]
        origins, directions = cast_from(transform_from_pose(robot.mean), scan.rays.take(bare))
        known = np.isfinite(walls)
        places = origins[known, :2] + directions[known, :2] * walls[known, None]
        self._map_error.note(scan.stamp_ns, places, scan.ranges[bare][known] - walls[known])

    def _since(self, name: str, stamp_ns: int) -> float:
        known = self._objects[name].stamp_ns
        return 0.0 if known is None else (stamp_ns - known) / NANOSECONDS

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
            shift_std=self._map_error.std,
        )
        belief = self._objects[name]
        updated = self._filters[name].update(
            ConditionalBelief.independent(belief, len(robot.weights)),
            evidence,
            self._object_rngs[name],
        )
        if updated is None:
            return False
        self._objects[name] = updated.conditional.belief
        return True

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
        self, robot: PoseBelief, scan: Scan, beams: BoolArray, walls: FloatArray
    ) -> list[UncertainObject]:
        """The objects that localization must reckon with, each where it may be."""
        near = self._surroundings.within(robot, scan.range_max)
        seen = self._surroundings.in_sight(near, robot, scan.rays.take(beams), walls)
        states = self.settings.localization.object_states
        return [self._objects[name].represented_by(name, states) for name in seen]

    def _is_narrow(self, robot: PoseBelief) -> bool:
        return robot.position_std <= self.settings.object_updates.max_position_std

    # --- lost, and found again ------------------------------------------------------

    def _doubt(self, track: Track, scan: Scan, beams: BoolArray) -> None:
        """Search anew, beside the track, while too many beams pass through walls.

        The track is given up only for one that fits twice as well; what objects were
        believed to be since it last fitted is given up with it.
        """
        s, now = self.settings.localization, scan.stamp_ns
        if track.misfit <= s.lost_above / 2.0:
            self._trusted, self._search = Trusted(now, self.objects), None
            self._patience = Patience(0, s.lost_after)
        elif track.misfit <= s.lost_above:
            return
        elif self._search is None:
            if self._patience.is_over(now):
                self._search = Track(self._anywhere(self._search_rng))
        else:
            found = self._localize(self._search, scan, beams, self._search_rng)
            known, self._search = found.known_for(now), found
            if known > s.lost_after and found.misfit < track.misfit / 2.0:
                self._recover(found, now)
            elif known > 2.0 * s.lost_after:  # no better than the track
                self._search, self._patience = None, self._patience.doubled(now)

    def _recover(self, found: Track, stamp_ns: int) -> None:
        self.lost.append((self._trusted.stamp_ns, stamp_ns))
        self._objects = dict(self._trusted.objects)
        for name, belief in self._objects.items():
            self._surroundings.follow(name, belief)
        self._track, self._search = found, None
        self._in_view = {}

    # --- the robot's start ----------------------------------------------------------

    def _start(self, pose: FloatArray | None, anywhere: bool) -> PoseBelief | None:
        if pose is not None and anywhere:
            raise SettingsError("--initial-pose and --global exclude each other; give one.")
        if pose is not None:
            return self._localizer.start(pose, self._localizer.told_covariance, self._rng)
        return self._anywhere(self._rng) if anywhere else None

    def _anywhere(self, rng: np.random.Generator) -> PoseBelief:
        corners = self.building.walls.vertices[:, :2]
        return self._localizer.start_anywhere(corners.min(axis=0), corners.max(axis=0), rng)

    def _be_told(self, record: InitialPose | GaussianRobotBelief | RobotBelief) -> None:
        """Take a pose belief from outside: as the start, or as the recorded belief."""
        is_start = isinstance(record, InitialPose)
        if self._localizes_itself and not is_start:
            if self._track is not None:
                return
            self.warnings.append(
                "The log holds no /initialpose; localization started from its first recorded "
                "robot belief."
            )
        if is_start and self._start_is_told:
            return
        if isinstance(record, RobotBelief):
            belief = PoseBelief(record.poses, Weights.of(record.weights))
        else:
            belief = self._localizer.start(record.mean, record.covariance, self._rng)
        self._track, self._search = Track(belief), None
