"""p(l): a Gaussian filter while the robot's pose is known to centimetres, samples otherwise."""

from __future__ import annotations

import math
from collections.abc import Set

import numpy as np

from objstate.config import Settings
from objstate.estimator.scenery import Scenery
from objstate.estimator.sight import Near, Sight
from objstate.geometry import BoolArray, FloatArray, between, whitened, wrap
from objstate.localization import (
    NOTHING,
    Carried,
    Decorrelation,
    Learnt,
    Localizer,
    OdometryError,
    PoseBelief,
    PoseFilter,
    RangeNoise,
    Vantage,
    WallErrors,
    motion_variances,
)
from objstate.particles import Weights
from objstate.records import (
    NANOSECONDS,
    GaussianRobotBelief,
    InitialPose,
    RobotBelief,
    Scan,
)
from objstate.sensing import Sensing

# largest deviations for which scans are linear in the pose
TIGHT_M, TIGHT_RAD = 0.12, math.radians(2.5)
FOUND_STD = np.array([0.1, 0.1, np.radians(3.0)])  # m, m, rad, of a place found by a search


class Robot:
    """The belief about the robot's pose under the followed hypothesis.

    ``localizes`` is whether scans update it; otherwise it is given.
    """

    def __init__(
        self, settings: Settings, sensing: Sensing, scenery: Scenery, seed: int, *, localizes: bool
    ) -> None:
        self._settings, self._sensing, self._scenery = settings, sensing, scenery
        self._rng = np.random.default_rng([seed, 0])
        self.localizes = localizes
        self._belief: PoseBelief | None = (
            None  # None while nothing is known, or while only the filter knows
        )
        self.odometry: FloatArray | None = None  # (3,) the last reading
        self.odometry_error = OdometryError(settings.odometry_error)  # as learnt so far
        self.driven_ns: int | None = None  # until the last reading
        self._corrected_at: FloatArray | None = None  # (3,) odometry at the last correction
        self._localizer = Localizer(settings.localization)
        self._filter: PoseFilter | None = None  # while the pose is known to centimetres
        self._learnt = NOTHING  # what the last filter had learnt of robot and building
        count = settings.localization.min_particles
        self._draws = whitened(np.random.default_rng(0).standard_normal((count, 3)))
        self._decorrelation = Decorrelation(settings.building_error.robot_length_m)

    # --- what is known --------------------------------------------------------------

    @property
    def belief(self) -> PoseBelief | None:
        """Samples of the pose; None while nothing is known of it."""
        if self._belief is None and self._filter is not None:
            self._belief = self._filter.belief(self._draws)
        return self._belief

    @property
    def is_filtered(self) -> bool:
        """Whether the Gaussian filter is in use."""
        return self._filter is not None

    @property
    def is_narrow(self) -> bool:
        """Whether the position is known well enough to update objects."""
        assert self.belief is not None
        return self.belief.position_std <= self._settings.object_updates.max_position_std

    @property
    def is_tight(self) -> bool:
        """Whether the pose is known well enough for a Gaussian belief."""
        robot = self.belief
        assert robot is not None
        return robot.position_std <= TIGHT_M and math.sqrt(robot.covariance[2, 2]) <= TIGHT_RAD

    @property
    def learnt(self) -> Learnt:
        """What was learnt of lasers, their noise and walls."""
        return self._learnt if self._filter is None else self._filter.learnt

    @property
    def wall_std(self) -> float:
        """m; standard deviation of walls from the building's model."""
        if self._filter is None:
            return self._settings.building_error.wall_std_m
        return self._filter.wall_std

    def samples(self, count: int) -> PoseBelief:
        """At most so many samples of the belief."""
        assert self.belief is not None
        return self.belief.thinned(count, self._rng)

    # --- given, or found elsewhere --------------------------------------------------

    def follow(self, belief: PoseBelief) -> None:
        """Follow a belief; what was learnt of robot and building stays."""
        self.leave_filter()
        self.odometry_error.forget()
        self._belief, self._corrected_at = belief, None

    def forget(self) -> None:
        """Forget the pose."""
        self.leave_filter()
        self._belief = None

    def start(self, pose: FloatArray, covariance: FloatArray | None = None) -> None:
        """Follow a given pose (3,), with its covariance (3, 3) where there is one."""
        spread = self._localizer.start_covariance if covariance is None else covariance
        self.follow(self._localizer.start(pose, spread, self._rng))

    def take(self, record: InitialPose | GaussianRobotBelief | RobotBelief) -> None:
        """Follow a recorded belief."""
        before = self._belief
        if isinstance(record, RobotBelief):
            self.follow(PoseBelief(record.poses, Weights.of(record.weights)))
        else:
            self.start(record.mean, record.covariance)
        is_start = isinstance(record, InitialPose)
        if before is not None and self._belief is not None and not (self.localizes or is_start):
            off = self._belief.mean - before.mean
            off[2] = wrap(off[2])
            self._decorrelation.renew(off, self._belief.covariance)

    def found(self, place: FloatArray, learnt: Learnt) -> None:
        """Follow a place (3,) found by a search, with what was learnt before it was left."""
        self.start(place, np.diag(FOUND_STD**2))
        self._learnt = learnt

    # --- predict --------------------------------------------------------------------

    def drive(self, pose: FloatArray, stamp_ns: int) -> None:
        """p(l) <- integral of p(l | a, l') p(l'), for an odometry reading a, the ``pose`` (3,)."""
        if self.odometry is not None and self.driven_ns is not None:
            step = between(self.odometry, pose)
            self._decorrelation.drive(math.hypot(step[0], step[1]))
            self._predict(step, (stamp_ns - self.driven_ns) / NANOSECONDS)
        self.odometry, self.driven_ns = pose, stamp_ns

    def _predict(self, step: FloatArray, seconds: float) -> None:
        if self._filter is not None:
            variances = motion_variances(step, self._settings.localization)
            self._filter.drive(*self.odometry_error.drive(step, variances), seconds)
            self._belief = None  # samples are drawn on demand
        elif self._belief is not None and self.localizes:
            error = self.odometry_error
            self._belief = self._localizer.predict(self._belief, step, self._rng, error)
        elif self._belief is not None:
            self._belief = self._belief.moved(step)

    # --- p(l | o_k) by the filter ---------------------------------------------------

    def follows_precisely(self, is_linear: bool) -> bool:
        """Whether the filter takes a scan, which ``is_linear`` if its laser is level.

        The filter begins when the belief is tight, and ends when the position is no longer known.
        """
        assert self.belief is not None
        may = self.localizes and is_linear
        if self._filter is None and may and self.is_tight:
            s = self._settings
            slips = s.odometry_error.wheel_slips_per_hour
            self._filter = PoseFilter(
                self.belief, s.building_error, s.beam_model, slips, self._learnt
            )
        elif self._filter is not None and not self.is_narrow:
            self.leave_filter()
        return may and self._filter is not None

    def leave_filter(self) -> None:
        """Go on with samples of the pose alone."""
        if self._filter is not None:
            self._belief = self.belief
            self._learnt, self._filter = self._filter.learnt, None

    def correct(self, sight: Sight, near: Near, known: Set[str]) -> PoseBelief:
        """p(l, a, w | o_k) by the beams of a scan that meet walls.

        Of the objects ``near`` the robot, which this scan updates, those that are ``known`` are
        expected in one state, and others in states of their belief. Nothing is learnt of other
        objects, so that beams aren't used which may have met them: an error of what they were taken
        for would be the same in all scans. One that ends behind all places of an object hasn't.
        """
        pose, scan, before = self._filter, sight.scan, self.belief
        assert pose is not None
        assert before is not None
        is_near = np.isin(sight.names, near.names)
        may_meet = np.where(sight.ends_behind[~is_near], np.inf, sight.entries[~is_near])
        before_far = may_meet.min(axis=0, initial=np.inf)
        entered = sight.entries[is_near].min(axis=0, initial=np.inf)
        uncertain, certain = (
            self._sensing.scenery(self._scenery.represented(names), sight.height)
            for names in ([name for name in near.pointed_at if name not in known], known)
        )
        about = self._by_samples(sight, pose, before_far) if pose.is_wide else None
        surfaces = self._sensing.surfaces(sight.height)
        pose.correct(scan, surfaces, before_far, entered, uncertain, certain, about)
        after = self._belief = pose.belief(self._draws)
        self._corrected_at = self.odometry
        self.odometry_error.note(before, after)
        return after

    def _by_samples(self, sight: Sight, pose: PoseFilter, most: FloatArray) -> PoseBelief:
        """p(l | o_k) by the samples of p(l), with dependent errors of beams.

        By those that meet walls before ``most`` (n,) m.
        """
        robot, beams = sight.robot, sight.valid & (sight.walls < most)
        objects = self._scenery.objects(sight, beams)
        log_likelihood = sight.view(beams).pose_log_likelihood(robot.poses, pose.wall_std, objects)
        weights, _ = robot.weights.reweight(
            pose.independence(sight.scan.laser).both * log_likelihood
        )
        return PoseBelief(robot.poses, weights)

    # --- p(l | o_k) by samples ------------------------------------------------------

    def localize(self, sight: Sight, beams: BoolArray) -> PoseBelief:
        """p(l | o_k) <- alpha p(o_k | l) p(l), by some beams (n,)."""
        self.odometry_error.forget()
        robot = sight.robot
        if not self.is_narrow and not self._has_moved:
            return robot
        blur, beams = self._localizer.blur(robot), self._scenery.thinned(beams)
        log_likelihood = self._scenery.log_likelihood(sight, beams, blur)
        tempering = self._settings.localization.tempering
        corrected = self._localizer.correct(robot, tempering * log_likelihood)
        self._belief, _ = self._localizer.renew(corrected, self._rng)
        self._corrected_at = self.odometry
        return self._belief

    @property
    def _has_moved(self) -> bool:
        """Whether the robot has moved since the last correction.

        Scans from one place repeat each other's errors, and would make a wide belief converge to a
        wrong place.
        """
        if self._corrected_at is None or self.odometry is None:
            return True
        s, step = self._settings.localization, between(self._corrected_at, self.odometry)
        return bool(np.hypot(step[0], step[1]) >= s.update_min_d or abs(step[2]) >= s.update_min_a)

    # --- what objects need ----------------------------------------------------------

    def vantage(self, scan: Scan) -> Vantage:
        """The origins and directions of a scan's beams."""
        if self._filter is not None:
            return self._filter.vantage(scan)
        assert self.belief is not None
        noise = RangeNoise(self._settings.building_error.range_std_m**2, 0.0, 0.0)
        return Vantage.of(self.belief, scan, noise)

    def walls(self, height: float, pieces: int) -> WallErrors:
        """How far walls at a height m, which are that many ``pieces``, are off the model."""
        if self._filter is not None:
            return self._filter.walls(height, pieces)
        return WallErrors.unknown(pieces, self.wall_std)

    def carried(self, name: str, vantage: Vantage) -> Carried:
        """How the error carried over since an object was last observed; it is observed now."""
        if self._filter is not None:
            return self._filter.carried(name, vantage)
        return self._decorrelation.carried(name, vantage.covariance)
