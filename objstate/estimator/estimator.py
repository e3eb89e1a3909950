"""Simultaneous object state estimation and localization: Table 1, Schulz and Burgard 2001."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import lru_cache, partial
from typing import Literal

import numpy as np

from objstate.building.model import Building
from objstate.config import Settings
from objstate.errors import LogError, SettingsError
from objstate.estimator.believed import Believed
from objstate.estimator.consistency import Consistency
from objstate.estimator.doors import Doors
from objstate.estimator.doubt import Doubt, Verdict
from objstate.estimator.kernels import evenly_spread, share_through_walls
from objstate.estimator.observation import Observation, observe
from objstate.estimator.schedule import Schedule
from objstate.estimator.sight import Near, Sight
from objstate.estimator.thinning import Thinning
from objstate.estimator.tracking import Track
from objstate.geometry import BoolArray, FloatArray, IntArray, between
from objstate.lazy import altered
from objstate.localization import (
    LEVER,
    NOTHING,
    Hypotheses,
    Localizer,
    LogLikelihood,
    OdometryError,
    PoseBelief,
    PoseFilter,
    Search,
    Vantage,
    motion_variances,
)
from objstate.objects import Descent, ObjectBelief
from objstate.particles import Weights
from objstate.records import (
    NANOSECONDS,
    Estimate,
    GaussianRobotBelief,
    InitialPose,
    Odometry,
    Record,
    RobotBelief,
    Scan,
)
from objstate.sensing import BeamModel, Sensing, UncertainObject

SLIDE = 2.0  # m by which a pose may slide to a place that looks alike
FIT_BLUR = 0.1  # m; walls that are off by less fit
ROUGH = 0.01  # m by which walls behind objects are rough
BEFORE_OBJECTS = 0.1  # m before a known object, up to which a beam tells of walls alone
TIGHT_M, TIGHT_RAD = 0.12, math.radians(2.5)  # deviations with which scans are linear in a pose
FOUND_STD = np.array([0.1, 0.1, np.radians(3.0)])  # m, m, rad, of a place that was searched for


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
        beliefs: of objects known from before, by name, instead of their priors; on the
            samples that these settings give, as ``World.at`` returns them.

    Raises:
        SettingsError: settings that contradict each other, an object's joint, or the samples of
            its belief.
        BuildingError: beliefs of an object that the building doesn't have.
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
        beliefs: Mapping[str, ObjectBelief] | None = None,
    ) -> None:
        self.building = building
        self.settings = (settings or Settings()).in_building(building.error)
        self.warnings: list[str] = []
        self.scans_without_pose = 0
        self.corrections = 0  # scans that localized the robot
        self._localizes_itself = belief == "own"
        self._rng = np.random.default_rng([seed, 0])
        self._search_rng = np.random.default_rng([seed, 2])
        self._localizer = Localizer(self.settings.localization)
        self.odometry_error = OdometryError(self.settings.odometry_error)  # as learnt by now
        self._sensing = Sensing(building, BeamModel(self.settings.beam_model))
        self._search = Search(self._sensing, self.settings)
        self._thinned = Thinning(self.settings.scans)
        self._schedule = Schedule(self.settings.object_updates)
        self._believed = Believed(building, self.settings, seed, beliefs or {})
        self._consistency = Consistency(self.settings.consistency)
        self._doors = Doors(building, self.settings)
        self._pose: PoseFilter | None = None  # while the robot's pose is known to centimetres
        self._learnt = NOTHING  # what such a filter knew of robot and building when it was left
        self._draws = _whitened(self.settings.localization.min_particles_by_furniture)
        self._represented = lru_cache(maxsize=1024)(ObjectBelief.represented_by)  # few change
        self._widened = lru_cache(maxsize=64)(partial(_widened, self._believed))  # asked for again
        self._odometry: FloatArray | None = None
        self._driven_m = 0.0
        self._now_ns = 0
        self._start_is_told = initial_pose is not None or global_start
        self._is_anywhere = global_start  # and no place is more likely than others as yet
        start = self._start(initial_pose)
        self._track = None if start is None else Track(start)
        self._doubt = Doubt(self.settings)
        self._fits_from_ns: int | None = None  # since when the track has explained scans

    @property
    def robot(self) -> PoseBelief | None:
        """p(l), the robot belief; None while nothing is known of the robot's pose."""
        return None if self._track is None else self._track.belief

    @property
    def objects(self) -> dict[str, ObjectBelief]:
        """p(s) of each object, as of its last update; values that later records don't change."""
        return {
            name: self._published(name, each) for name, each in self._believed.marginals.items()
        }

    def object_at(self, name: str, stamp_ns: int) -> ObjectBelief:
        """An object's belief predicted to a moment at or after its last update.

        Raises ValueError for an earlier moment.
        """
        belief = self._believed.marginals[name]
        known = belief.stamp_ns
        if known is not None and stamp_ns < known:
            raise ValueError(f"object '{name}' was updated after {stamp_ns} ns, at {known} ns")
        if stamp_ns != known:
            belief = self._believed.at(name, stamp_ns, np.random.default_rng(stamp_ns))
        return self._published(name, belief)

    @property
    def lost(self) -> tuple[tuple[int, int], ...]:
        """Stretches (from, to) in ns in which the robot was not where it thought."""
        return self._doubt.stretches(self._now_ns)

    @property
    def is_lost(self) -> bool:
        """Whether the robot is not where it thinks, so that what it reads tells nothing of objects."""
        return self._doubt.is_lost

    @property
    def map_error(self) -> float:
        """m by which pieces of wall are off the building's model, as the log tells."""
        if self._pose is None:
            return self.settings.building_error.wall_std_m
        return self._pose.wall_std

    @property
    def hung_elsewhere(self) -> dict[str, FloatArray]:
        """Doors that surely don't hang where the model has them, by how much (2,) m."""
        off = {
            name: self._doors.elsewhere(belief)
            for name, belief in self._believed.marginals.items()
            if name in self._doors
        }
        return {name: each for name, each in off.items() if each is not None}

    def feed(self, record: Record) -> list[Estimate]:
        """Take one record in; what it changed in the objects' beliefs comes back."""
        match record:
            case Odometry():
                self._drive(record.pose)
            case Scan():
                return self._read(record)
            case InitialPose() | GaussianRobotBelief() | RobotBelief():
                self._be_told(record)
        return []

    # --- the loop -------------------------------------------------------------------

    def _read(self, scan: Scan) -> list[Estimate]:
        """Take a scan in, or as much of it as tells something new."""
        if scan.stamp_ns < self._now_ns:
            raise LogError(
                f"A scan of {scan.stamp_ns} ns came after one of {self._now_ns} ns; feed records "
                "in time order, as open_log gives them."
            )
        self._now_ns = scan.stamp_ns
        if scan.odometry is not None:
            self._drive(scan.odometry)
        if not np.count_nonzero(scan.valid):
            return []
        thinned = self._thinned(scan)
        return [] if thinned is None else self._sense(thinned)

    def _sense(self, scan: Scan) -> list[Estimate]:
        """The body of Table 1's loop, for new sensory input o_k."""
        if self._is_anywhere:
            self._track = self._anywhere(scan)
        if self._track is None:
            self.scans_without_pose += 1
            return []
        track, sight = self._track, self._sight(scan, self._track.belief)
        if self._localizes_itself and not self._is_anywhere:
            track = self._found_again(self._judged(track, sight), scan)
            if track.belief is not sight.robot:
                sight = sight.by(track.belief)
        if self._doubt.is_lost:
            self._track = track
            return self._unobserved(sight)
        if self._follows_precisely(track.belief, scan):
            return self._sense_precisely(track, sight)
        return self._sense_by_turns(track, sight)

    def _sense_precisely(self, track: Track, sight: Sight) -> list[Estimate]:
        """p(l, s, d | o_k) of a pose known to centimetres: Gaussian, given each door's state."""
        scan, pose = sight.scan, self._pose
        assert pose is not None
        surfaces = self._sensing.surfaces(float(scan.rays.origins[0, 2]))
        near = self._near(sight, sight.valid)
        known = self._standing(near.pointed_at, sight)
        before_known = np.minimum.reduce([sight.anywhere, *known.values()]) - BEFORE_OBJECTS
        pose.correct(scan, surfaces, before_known, sight.entries.min(axis=0, initial=np.inf))
        robot = pose.belief(self._draws)
        self.odometry_error.note(track.belief, robot)
        sight = sight.by(robot)
        rows = self._observe_doors(near, sight, pose.vantage(scan), known)
        furniture = [name for name in near.pointed_at if name not in self._doors]
        if furniture:
            observation = self._observe(near, sight, robot, furniture)
            weights = self._localizer.correct(
                robot, self.settings.object_updates.tempering * observation.log_evidence
            )
            observation = observation.settled_by(weights)
            for name in observation.fits:
                if observation.predicted[name].settled:
                    changed = observation.beliefs[name].belief
                    self._consistency.note(observation.unmoved[name], changed)
            descent = Descent(self._forgotten(track), None)
            self._believed.keep_in_view(observation.beliefs, descent, near.names)
            rows |= {name: observation.fits.get(name) for name in observation.beliefs}
        self._track = track.corrected(robot, self._odometry)
        self.corrections += 1
        return self._rows(rows)

    def _observe_doors(
        self, near: Near, sight: Sight, vantage: Vantage, known: Mapping[str, FloatArray]
    ) -> dict[str, float | None]:
        """p(s_i, d_i | o_k) of the doors that beams point at; how well each explains them, where they tell.

        Objects whose state is ``known`` are expected at ranges (n,) m.
        """
        scan, fits = sight.scan, dict[str, float | None]()
        doors = [name for name in near.pointed_at if name in self._doors]
        if not doors:
            return fits
        surfaces = self._sensing.surfaces(float(scan.rays.origins[0, 2]))
        walls, _ = surfaces.meet(vantage.origins, vantage.directions, scan.range_max)
        for name in doors:
            entered = sight.entries[sight.names.index(name)]
            beams = np.flatnonzero(sight.valid & (entered < np.minimum(walls, scan.range_max)))
            if len(beams) == 0:
                continue
            others = [ranges for other, ranges in known.items() if other != name]
            background = np.minimum.reduce([walls, *others])[beams]
            blur = np.where(np.isfinite(background), _blur(vantage, self.map_error), 0.0)
            before = self._believed.marginals[name]
            belief, is_observed = self._doors.observe(
                name, before, scan, vantage, beams, background, blur, self._sensing, self._driven_m
            )
            if is_observed:
                belief = altered(belief, last_observed_ns=scan.stamp_ns)
            self._believed.keep([(name, belief)])
            fits[name] = self._fit(belief, sight, beams, background) if is_observed else None
        return fits

    def _standing(self, names: Iterable[str], sight: Sight) -> dict[str, FloatArray]:
        """Expected ranges (n,) of each object near by whose state is known."""
        out = {}
        for name in names:
            belief = self._believed.marginals[name]
            if belief.settled:
                ranges = np.full(len(sight.scan), np.inf)
                alone = sight.whole.object(name, belief.mean[None], sight.robot.mean[None])
                ranges[sight.valid] = alone[0, 0]
                out[name] = ranges
        return out

    def _fit(
        self, belief: ObjectBelief, sight: Sight, beams: IntArray, background: FloatArray
    ) -> float:
        """Share of the beams that bear on a door which its mean state explains."""
        chosen = np.zeros(len(sight.scan), dtype=bool)
        chosen[beams] = True
        every = np.ones(len(beams), dtype=bool)
        return sight.view(chosen).share_explained(
            belief.item.name, belief.mean[None], sight.robot.mean, background, every
        )

    def _sense_by_turns(self, track: Track, sight: Sight) -> list[Estimate]:
        """p(l | o_k) and p(s_i | o_k) as marginals, each from its share of the beams (section 2.2)."""
        scan = sight.scan
        self._believed.collapse()
        localizing, observing = self._schedule.share_out(scan)
        if not self._localizes_itself or self._pose is not None:
            localizing, observing = np.zeros_like(localizing), scan.valid
        if localizing.any():
            self.odometry_error.forget()
            track = self._localize(track, sight, localizing)
            self.corrections += 1
        self._track = track
        if not observing.any() or not self._is_narrow(track.belief):
            return []
        robot = track.belief.thinned(self.settings.object_updates.robot_samples, self._rng)
        sight = sight.by(track.belief)
        near, rows = self._near(sight, observing), dict[str, float | None]()
        names = near.pointed_at
        if self._is_linear(scan):
            names = [name for name in names if name not in self._doors]
            if _is_tight(track.belief):
                first = self.settings.building_error.range_std_m**2
                vantage = Vantage.of(track.belief, scan, first)
                known = self._standing(near.pointed_at, sight)
                rows = self._observe_doors(near, sight, vantage, known)
        observation = self._observe(near, sight, robot, names)
        self._believed.keep((name, each.belief) for name, each in observation.beliefs.items())
        return self._rows(rows | {name: observation.fits.get(name) for name in observation.beliefs})

    def _unobserved(self, sight: Sight) -> list[Estimate]:
        """What is believed of the objects that a lost robot thinks it is near."""
        near = self._near(sight, sight.valid).names
        beliefs = {name: self._believed.at(name, sight.scan.stamp_ns) for name in near}
        return [
            row
            for name, belief in beliefs.items()
            for row in self._published(name, belief).estimates(None, lost=True)
        ]

    def _drive(self, pose: FloatArray) -> None:
        """p(l) <- integral of p(l | a, l') p(l'), for a new odometry reading a."""
        if self._odometry is not None:
            step = between(self._odometry, pose)
            self._driven_m += math.hypot(step[0], step[1])
            if self._track is not None:
                self._track = self._driven(self._track, step)
            self._doubt.drive(step)
        self._odometry = pose

    def _driven(self, track: Track, step: FloatArray) -> Track:
        if not self._localizes_itself:
            return track.moved(track.belief.moved(step))
        error = self.odometry_error
        if self._pose is not None:
            variances = motion_variances(step, self.settings.localization)
            self._pose.drive(*error.drive(step, variances))
            return track.moved(self._pose.belief(self._draws))
        return track.moved(self._localizer.predict(track.belief, step, self._rng, error))

    def _localize(self, track: Track, sight: Sight, beams: BoolArray) -> Track:
        """p(l | o_k) <- alpha p(o_k | l) p(l)."""
        robot = track.belief
        if not self._is_narrow(robot) and not track.moved_enough(
            self._odometry, self.settings.localization
        ):
            return track
        beams = evenly_spread(beams, self.settings.localization.max_beams)
        evidence = self._log_likelihood(sight, beams)
        corrected = self._localizer.correct(robot, evidence)
        renewed, _ = self._localizer.renew(corrected, self._rng)
        return track.corrected(renewed, self._odometry)

    # --- what the steps need --------------------------------------------------------

    def _forgotten(self, track: Track) -> float:
        """Share of what robot samples know by themselves that is forgotten since the last scan.

        As the robot drives, the samples' errors become others.
        """
        if track.corrected_at is None or self._odometry is None:
            return 1.0
        x, y, turned = between(track.corrected_at, self._odometry).tolist()
        driven = math.hypot(x, y) + LEVER * abs(turned)
        return -math.expm1(-driven / self.settings.object_updates.correlation_m)

    def _sight(self, scan: Scan, robot: PoseBelief) -> Sight:
        return Sight(scan, robot, self._sensing.view(scan), self._believed.surroundings)

    def _near(self, sight: Sight, beams: BoolArray) -> Near:
        return sight.near(self.settings.object_updates.max_distance, beams)

    def _observe(
        self, near: Near, sight: Sight, robot: PoseBelief, names: Sequence[str] | None = None
    ) -> Observation:
        """What a scan says of the objects that beams point at, or of some of them, given each robot sample."""
        names = near.pointed_at if names is None else names
        return observe(
            self._believed,
            sight.view(near.beams),
            names,
            robot,
            sight.scan.stamp_ns,
            self.settings.object_updates.tempering,
            self.map_error,
            scenery=[name for name in near.pointed_at if name not in names],
        )

    def _log_likelihood(
        self, sight: Sight, beams: BoolArray, but: Collection[str] = ()
    ) -> FloatArray:
        """Tempered log p(o_k | l) (l,) of some beams, objects but those named where they may be."""
        robot, objects = sight.robot, []
        if self._is_narrow(robot):
            objects = self._scenery(sight.seen_by(beams, but), self._believed.marginals)
        blur = self._localizer.blur(robot)
        told = sight.view(beams).pose_log_likelihood(robot.poses, blur, objects)
        return self.settings.localization.tempering * told

    def _scenery(
        self, names: Iterable[str], beliefs: Mapping[str, ObjectBelief]
    ) -> list[UncertainObject]:
        """Objects that localization must reckon with, each where it may be."""
        states = self.settings.localization.object_states
        return [self._represented(beliefs[name], states) for name in names]

    def _rows(self, fits: Mapping[str, float | None]) -> list[Estimate]:
        """What is believed of objects near by now, and how well each explains the beams that bear on it."""
        return [
            row
            for name, fit in fits.items()
            for row in self._published(name, self._believed.marginals[name]).estimates(fit)
        ]

    def _published(self, name: str, belief: ObjectBelief) -> ObjectBelief:
        """The belief of somebody who knows that the building's model is off."""
        if name in self._doors and self.settings.object_updates.inference == "joint":
            return belief  # the errors are in it
        factor = self._consistency.factor(belief.item.kind)
        return self._widened(name, belief, factor, self.map_error)

    def _is_linear(self, scan: Scan) -> bool:
        """Whether doors are inferred jointly with the errors of robot and hinges, by outlines."""
        s = self.settings.object_updates
        return s.inference == "joint" and self._sensing.is_level(scan)

    def _follows_precisely(self, robot: PoseBelief, scan: Scan) -> bool:
        """Whether the robot's pose is known to centimetres, so that scans are linear in its error."""
        may = self._localizes_itself and self._is_linear(scan)
        if self._pose is None and may and _is_tight(robot):
            self._believed.collapse()
            errors = self.settings.building_error, self.settings.beam_model
            self._pose = PoseFilter(robot, *errors, self._learnt)
        elif self._pose is not None and not self._is_narrow(robot):
            self._leave_pose()
        return may and self._pose is not None

    def _leave_pose(self) -> None:
        """Go on with samples of the pose alone."""
        if self._pose is not None:
            self._learnt, self._pose = self._pose.learnt, None
            self._believed.collapse()

    def _is_narrow(self, robot: PoseBelief) -> bool:
        return robot.position_std <= self.settings.object_updates.max_position_std

    # --- lost, and found again ------------------------------------------------------

    def _judged(self, track: Track, sight: Sight) -> Track:
        """The track with its record of how well it explains scans kept up; a wide one's best pose counts."""
        s, robot, scan = self.settings.localization, sight.robot, sight.scan
        beams = evenly_spread(sight.valid, s.max_beams)
        if not np.count_nonzero(beams):
            return track
        view, poses, walls = sight.view(beams), robot.mean[None], sight.walls[None, beams]
        seen = sight.seen_by(beams)  # what was learnt since may be what made the track fit
        objects = self._scenery(seen, {name: self._believed.trusted(name) for name in seen})
        if not self._is_narrow(robot):
            poses, walls, objects = robot.poses, view.walls(robot.poses), []
        best, fit = view.best(poses, FIT_BLUR, objects, walls)
        through = share_through_walls(
            scan.ranges[beams], np.ascontiguousarray(walls[best]), s.doubt_margin
        )
        return track.judged(track.record.judged(through, fit, scan.stamp_ns, s))

    def _found_again(self, track: Track, scan: Scan) -> Track:
        """While the track is in doubt, search the whole building for a better place.

        The track is given up only for a place that explains the last scans surely better;
        what was learnt of objects since it last fitted is given up as soon as it is lost.
        """
        s, now, doubt = self.settings.localization, scan.stamp_ns, self._doubt
        fits, is_narrow = track.record.fits(s) and not doubt.is_lost, self._is_narrow(track.belief)
        if not is_narrow:
            doubt.blur(track.belief.position_std)
        elif track.record.may_have_slid:
            doubt.blur(SLIDE)
        self._leave_earlier_looks(fits, now)
        if fits and not (doubt.is_new and is_narrow):
            if doubt.dispel(now):
                self._believed.trust()
            return track
        if track.record.is_wrong(s) and not doubt.is_lost and doubt.may_search(now):
            self._search.forget()
            self._lose(now)
        found = self._searched(scan, track.belief.mean[None], fits)
        if found is None:
            return track
        match doubt.weigh(found, track.belief.mean, now):
            case Verdict.HERE:
                self._search.forget()
                doubt.settle(now)
                self._believed.trust()
            case Verdict.NOT_HERE:
                self._lose(now)
            case Verdict.ELSEWHERE:
                if not doubt.is_lost:
                    self._lose(now)
                return self._found(found.poses[0], now)
        return track

    def _leave_earlier_looks(self, fits: bool, now_ns: int) -> None:
        """Once a track that has fitted for a while doesn't any more, the robot may have been taken from where it was."""
        long = self.settings.localization.doubt_after * NANOSECONDS
        if fits:
            self._fits_from_ns = self._fits_from_ns or now_ns
        elif self._fits_from_ns is not None:
            if now_ns - self._fits_from_ns >= long:
                self._search.forget()
            self._fits_from_ns = None

    def _lose(self, now_ns: int) -> None:
        """Say that the robot is lost, and take back what was learnt of objects since it fitted."""
        self._doubt.rise(now_ns)
        self.odometry_error.forget()
        self._believed.go_back()
        self._leave_pose()

    def _found(self, place: FloatArray, now_ns: int) -> Track:
        self._doubt.found(now_ns)
        self._search.forget()
        self._leave_pose()
        spread = np.diag(FOUND_STD**2)
        return Track(self._localizer.start(place, spread, self._rng))

    def _searched(self, scan: Scan, also: FloatArray, fits: bool) -> Hypotheses | None:
        """Where the robot may be by this scan and those before it, if it is time for a search.

        A new track that ``fits`` is held against other places once looks from several tell them apart.
        """
        if self._odometry is None or not self._search.note(scan, self._odometry):
            return None
        is_early = self._doubt.is_new and self._search.looks <= self.settings.search.confirmed
        if not self._doubt.may_search(scan.stamp_ns) or (fits and is_early):
            return None
        return self._search.hypotheses(self._explained, also, self._search_rng)

    def _explained(self, scan: Scan) -> LogLikelihood:
        """Tempered log p(o | l) (p,) of a scan, for poses near each other, from each with its own objects."""
        s, anywhere = self.settings.localization, PoseBelief(np.zeros((1, 3)), Weights.uniform(1))
        looked = self._sight(scan, anywhere)
        beams = evenly_spread(looked.valid, s.max_beams)
        view = looked.view(beams)

        def log_likelihood(poses: FloatArray, blur: float) -> FloatArray:
            sight = looked.by(PoseBelief(poses, Weights.uniform(len(poses))))
            objects = self._scenery(sight.seen_by(beams), self._believed.priors)
            return s.tempering * view.pose_log_likelihood(poses, blur, objects)

        return log_likelihood

    def _anywhere(self, scan: Scan) -> Track | None:
        """The track of a robot that may be anywhere: where its scans up to this one fit."""
        now = scan.stamp_ns
        if self._odometry is None:
            return None
        if not self._doubt.is_lost:
            self._doubt.rise(now)
        found = self._searched(scan, np.empty((0, 3)), fits=False)
        if found is None:
            return self._track
        if self._doubt.weigh(found, None, now) is Verdict.ELSEWHERE:
            self._is_anywhere = False
            return self._found(found.poses[0], now)
        return Track(found.belief(self.settings.localization.max_particles, self._search_rng))

    # --- the robot's start ----------------------------------------------------------

    def _start(self, pose: FloatArray | None) -> PoseBelief | None:
        if pose is None:
            return None
        if self._is_anywhere:
            raise SettingsError("--initial-pose and --global exclude each other; give one.")
        return self._localizer.start(pose, self._localizer.told_covariance, self._rng)

    def _be_told(self, record: InitialPose | GaussianRobotBelief | RobotBelief) -> None:
        """Take a pose belief from outside: as the start, or as the recorded belief."""
        is_start = isinstance(record, InitialPose)
        if self._localizes_itself and not is_start:
            if self._track is not None or self._is_anywhere:
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
        self._believed.collapse()
        self._leave_pose()
        self.odometry_error.forget()
        self._track = Track(belief)
        self._search.forget()
        if is_start:
            self._doubt.start_anew(self._now_ns)


def _widened(
    believed: Believed, name: str, belief: ObjectBelief, factor: float, std_m: float
) -> ObjectBelief:
    return believed.filters[name].widened(belief, factor, std_m)


def _is_tight(robot: PoseBelief) -> bool:
    """Whether a belief of the pose is so narrow that it may be taken for a Gaussian."""
    return robot.position_std <= TIGHT_M and math.sqrt(robot.covariance[2, 2]) <= TIGHT_RAD


def _blur(vantage: Vantage, wall_std: float) -> float:
    """m^2 by which walls behind objects read off, as they and the robot are off."""
    return wall_std**2 + float(vantage.covariance[0, 0] + vantage.covariance[1, 1]) + ROUGH**2


def _whitened(count: int) -> FloatArray:
    """Draws (n, 3) of a standard normal distribution, with exactly its mean and covariance."""
    draws = np.random.default_rng(0).standard_normal((count, 3))
    draws -= draws.mean(axis=0)
    return np.asarray(draws @ np.linalg.inv(np.linalg.cholesky(draws.T @ draws / count)).T)
