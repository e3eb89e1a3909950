"""Simultaneous object state estimation and localization: Table 1, Schulz and Burgard 2001."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from objstate.building.model import Building
from objstate.config import Settings
from objstate.errors import LogError, SettingsError
from objstate.estimator.bank import Bank, Moment
from objstate.estimator.believed import Believed
from objstate.estimator.doors import Doors
from objstate.estimator.furniture import Furniture
from objstate.estimator.kernels import evenly_spread
from objstate.estimator.observation import observe
from objstate.estimator.schedule import Schedule
from objstate.estimator.sight import Near, Sight
from objstate.estimator.thinning import Thinning
from objstate.estimator.tracking import Track
from objstate.geometry import BoolArray, FloatArray, IntArray, between, compose
from objstate.lazy import altered
from objstate.localization import (
    NOTHING,
    Anywhere,
    Carried,
    Decorrelation,
    Localizer,
    LogLikelihood,
    Look,
    OdometryError,
    PoseBelief,
    PoseFilter,
    RangeNoise,
    Search,
    Vantage,
    apart,
    motion_variances,
)
from objstate.localization.anywhere import BLUR
from objstate.localization.pose_filter import Learnt
from objstate.localization.search import SAME
from objstate.objects import ObjectBelief
from objstate.objects.steps import DoorStep, FurnitureStep, Step
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
from objstate.smoothing import DoorHistory, FurnitureHistory, History

MOMENT_M, MOMENT_RAD, MOMENT_S = 0.2, 0.17, 0.5  # after which a scan tells anew where the robot is
NEAR = 0.15  # m of deviation up to which a belief surely is near its mean
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
        history: keep what smoothing needs, see ``histories``.

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
        history: bool = False,
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
        self._believed = Believed(building, self.settings, seed, beliefs or {}, history=history)
        self._doors = Doors(building, self.settings)
        self._furniture = Furniture(building, self.settings)
        self._pose: PoseFilter | None = None  # while the robot's pose is known to centimetres
        self._learnt = NOTHING  # what such a filter knew of robot and building when it was left
        self._decorrelation = Decorrelation(self.settings.building_error.robot_length_m)
        self._draws = _whitened(self.settings.localization.min_particles)
        self._represented = lru_cache(maxsize=1024)(ObjectBelief.represented_by)  # few change
        self._odometry: FloatArray | None = None
        self._driven_m, self._driven_ns = 0.0, 0
        self._now_ns = 0
        self._start_is_told = initial_pose is not None or global_start
        self._is_anywhere = global_start  # and no place is more likely than others as yet
        start = self._start(initial_pose)
        self._track = None if start is None else Track(start)
        self._everywhere = Anywhere(self._sensing, self.settings)
        self._bank = Bank(self.settings, self._kept)
        self._moment: tuple[FloatArray, int] | None = None  # odometry (3,) and stamp of the last

    @property
    def robot(self) -> PoseBelief | None:
        """p(l), the robot belief; None while nothing is known of the robot's pose."""
        return None if self._track is None else self._track.belief

    @property
    def objects(self) -> dict[str, ObjectBelief]:
        """p(s) of each object, as of its last update; values that later records don't change."""
        return dict(self._believed.marginals)

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
        return belief

    @property
    def lost(self) -> tuple[tuple[int, int], ...]:
        """Stretches (from, to) in ns in which the robot was probably not where it was published to be."""
        return self._bank.stretches(self._now_ns)

    @property
    def is_lost(self) -> bool:
        """Whether the robot is probably not where it is published to be, so that objects aren't updated."""
        return self._bank.is_lost

    @property
    def p_localized(self) -> float:
        """Probability that the robot is within 0.75 m and 20 degrees of the mean of ``robot``."""
        return self._bank.p_localized

    @property
    def lost_probabilities(self) -> tuple[float, ...]:
        """Of each stretch in ``lost``, the largest probability in it that the robot was lost."""
        return self._bank.probabilities

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

    @property
    def histories(self) -> dict[str, History]:
        """What smoothing needs of each object seen, where the estimator was made with ``history``."""
        return {
            name: self._history(belief, belief.past.steps)
            for name, belief in self._believed.marginals.items()
            if belief.past is not None
        }

    def _history(self, belief: ObjectBelief, steps: Sequence[Step]) -> History:
        of_door = [step for step in steps if isinstance(step, DoorStep)]
        if of_door:
            last = of_door[-1].mixture(of_door[-1].blank)
            return DoorHistory(belief, of_door, self._doors.cases(last))
        return FurnitureHistory(belief, [step for step in steps if isinstance(step, FurnitureStep)])

    def feed(self, record: Record) -> list[Estimate]:
        """Take one record in; what it changed in the objects' beliefs comes back."""
        match record:
            case Odometry():
                self._drive(record.pose, record.stamp_ns)
            case Scan():
                rows = self._read(record)
                p = self.p_localized if self._localizes_itself else 1.0
                return [altered(row, p_localized=p) for row in rows]
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
            self._drive(scan.odometry, scan.stamp_ns)
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
            track = self._weighed(track, sight)
            if track.belief is not sight.robot:
                sight = sight.by(track.belief)
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
        entered = sight.entries.min(axis=0, initial=np.inf)
        about = self._resampled(sight, pose.independence(scan.laser)) if pose.is_wide else None
        pose.correct(scan, surfaces, before_known, entered, about)
        robot = pose.belief(self._draws)
        self.odometry_error.note(track.belief, robot)
        sight = sight.by(robot)
        self._track = track.corrected(robot, self._odometry)
        self.corrections += 1
        if self.is_lost:
            return self._unobserved(sight)
        rows = self._observe_doors(near, sight, pose.vantage(scan), known)
        rows |= self._observe_furniture(near, sight, pose.vantage(scan), known)
        return self._rows(rows)

    def _resampled(self, sight: Sight, independence: float) -> PoseBelief:
        """p(l | o_k) by the samples of p(l), from beams whose errors go together."""
        robot = sight.robot
        objects = self._scenery(sight.seen_by(sight.valid), self._believed.marginals)
        told = sight.view(sight.valid).pose_log_likelihood(robot.poses, self.map_error, objects)
        weights, _ = robot.weights.reweight(independence * told)
        return PoseBelief(robot.poses, weights)

    def _observe_doors(
        self, near: Near, sight: Sight, vantage: Vantage, known: Mapping[str, FloatArray]
    ) -> dict[str, float | None]:
        """p(s_i, d_i | o_k) of the doors that beams point at; how well each explains them, where they tell.

        Objects whose state is ``known`` are expected at ranges (n,) m.
        """
        scan, fits = sight.scan, dict[str, float | None]()
        doors = [name for name in near.pointed_at if name in self._doors and name in sight.names]
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
                name,
                before,
                scan,
                vantage,
                beams,
                background,
                blur,
                self._sensing,
                self._carried(name, vantage),
            )
            if is_observed:
                belief = altered(belief, last_observed_ns=scan.stamp_ns)
            self._believed.keep([(name, belief)])
            fits[name] = self._fit(belief, sight, beams, background) if is_observed else None
        return fits

    def _observe_furniture(
        self, near: Near, sight: Sight, vantage: Vantage, known: Mapping[str, FloatArray]
    ) -> dict[str, float | None]:
        """p(s_i | o_k) of the furniture that beams point at; how well each explains them, where they tell.

        Objects whose state is ``known`` are expected at ranges (n,) m.
        """
        scan, fits = sight.scan, dict[str, float | None]()
        names = [name for name in near.pointed_at if name in self._furniture]
        if not names:
            return fits
        surfaces = self._sensing.surfaces(float(scan.rays.origins[0, 2]))
        walls, _ = surfaces.meet(vantage.origins, vantage.directions, scan.range_max)
        for name in names:
            others = [ranges for other, ranges in known.items() if other != name]
            background = np.minimum.reduce([walls, *others])
            blur = np.where(np.isfinite(background), _blur(vantage, self.map_error), 0.0)
            seen = background[sight.valid]
            stopped = sight.view(sight.valid).stopped_short(sight.robot.mean, seen)[:, :2]
            before = self._believed.marginals[name]
            belief, beams, is_observed = self._furniture.observe(
                name,
                before,
                scan,
                vantage,
                background,
                blur,
                np.ascontiguousarray(stopped),
                self._carried(name, vantage),
                self._believed.rngs[name],
            )
            if is_observed:
                belief = altered(belief, last_observed_ns=scan.stamp_ns)
            self._believed.keep([(name, belief)])
            bears = np.flatnonzero(beams)
            fits[name] = self._fit(belief, sight, bears, background[bears]) if is_observed else None
        return fits

    def _carried(self, name: str, vantage: Vantage) -> Carried:
        """What is left of the robot's error since an object was observed last; it is observed now."""
        if self._pose is not None:
            return self._pose.carried(name, vantage)
        return self._decorrelation.carried(name, self._driven_m, vantage.covariance)

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
        """Share of the beams that bear on an object which its best state explains."""
        chosen = np.zeros(len(sight.scan), dtype=bool)
        chosen[beams] = True
        every = np.ones(len(beams), dtype=bool)
        states = belief.best[None] if belief.presence >= 0.5 else belief.states[:0]
        return sight.view(chosen).share_explained(
            belief.item.name, states, sight.robot.mean, background, every
        )

    def _sense_by_turns(self, track: Track, sight: Sight) -> list[Estimate]:
        """p(l | o_k) and p(s_i | o_k) as marginals, each from its share of the beams (section 2.2)."""
        scan = sight.scan
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
        sight = sight.by(track.belief)
        if self.is_lost:
            return self._unobserved(sight)
        near, rows = self._near(sight, observing), dict[str, float | None]()
        if not self._is_linear(scan):
            return self._rows(self._observe_each(near, sight))
        if _is_tight(track.belief):
            first = RangeNoise(self.settings.building_error.range_std_m**2, 0.0)
            vantage = Vantage.of(track.belief, scan, first)
            known = self._standing(near.pointed_at, sight)
            rows = self._observe_doors(near, sight, vantage, known)
            rows |= self._observe_furniture(near, sight, vantage, known)
        return self._rows(rows)

    def _observe_each(self, near: Near, sight: Sight) -> dict[str, float | None]:
        """p(s_i | o_k) of the objects that beams point at, by samples of the robot belief."""
        s = self.settings.object_updates
        robot = sight.robot.thinned(s.robot_samples, self._rng)
        observed = observe(
            self._believed,
            sight.view(near.beams),
            near.pointed_at,
            robot,
            sight.scan.stamp_ns,
            s.tempering,
            self.map_error,
        )
        self._believed.keep(observed.beliefs.items())
        return {name: observed.fits.get(name) for name in observed.beliefs}

    def _unobserved(self, sight: Sight) -> list[Estimate]:
        """What is believed of the objects that a lost robot thinks it is near."""
        near = self._near(sight, sight.valid).names
        beliefs = [self._believed.at(name, sight.scan.stamp_ns) for name in near]
        return [row for belief in beliefs for row in belief.estimates(None, lost=True)]

    def _drive(self, pose: FloatArray, stamp_ns: int) -> None:
        """p(l) <- integral of p(l | a, l') p(l'), for a new odometry reading a."""
        if self._odometry is not None:
            step = between(self._odometry, pose)
            self._driven_m += math.hypot(step[0], step[1])
            if self._track is not None:
                seconds = (stamp_ns - self._driven_ns) / NANOSECONDS
                self._track = self._driven(self._track, step, seconds)
        self._odometry, self._driven_ns = pose, stamp_ns

    def _driven(self, track: Track, step: FloatArray, seconds: float) -> Track:
        if not self._localizes_itself:
            return track.moved(track.belief.moved(step))
        error = self.odometry_error
        if self._pose is not None:
            variances = motion_variances(step, self.settings.localization)
            self._pose.drive(*error.drive(step, variances), seconds)
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

    def _sight(self, scan: Scan, robot: PoseBelief) -> Sight:
        return Sight(scan, robot, self._sensing.view(scan), self._believed.surroundings)

    def _near(self, sight: Sight, beams: BoolArray) -> Near:
        return sight.near(self.settings.object_updates.max_distance, beams)

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
            for row in self._believed.marginals[name].estimates(fit)
        ]

    def _is_linear(self, scan: Scan) -> bool:
        """Whether doors are inferred jointly with the errors of robot and hinges, by outlines."""
        s = self.settings.object_updates
        return s.inference == "joint" and self._sensing.is_level(scan)

    def _follows_precisely(self, robot: PoseBelief, scan: Scan) -> bool:
        """Whether the robot's pose is known to centimetres, so that scans are linear in its error."""
        may = self._localizes_itself and self._is_linear(scan)
        if self._pose is None and may and _is_tight(robot):
            errors = self.settings.building_error, self.settings.beam_model
            slips = self.settings.odometry_error.wheel_slips_per_hour
            self._pose = PoseFilter(robot, *errors, slips, self._learnt)
        elif self._pose is not None and not self._is_narrow(robot):
            self._leave_pose()
        return may and self._pose is not None

    def _leave_pose(self) -> None:
        """Go on with samples of the pose alone."""
        if self._pose is not None:
            self._learnt, self._pose = self._pose.learnt, None

    def _is_narrow(self, robot: PoseBelief) -> bool:
        return robot.position_std <= self.settings.object_updates.max_position_std

    # --- lost, and found again ------------------------------------------------------

    def _weighed(self, track: Track, sight: Sight) -> Track:
        """The track after this scan has told how probable it is, against others: theirs, if one wins."""
        robot, scan = track.belief, sight.scan
        if self._pose is None:
            self._bank.widen(robot.position_std)
        if self._odometry is not None and self._is_moment(scan, self._odometry):
            beams = evenly_spread(
                self._everywhere.usable(scan), self.settings.localization.max_beams
            )
            if beams.any():
                chance = self._everywhere.chance(scan, beams)
                told = self._log_evidence(sight, beams)
                moment = Moment(scan, self._odometry, robot.mean, self._kept)
                self._bank.take(moment, told, chance)
                track = self._searched(track, scan, chance.mean)
        self._bank.publish(_near_mean(track.belief), scan.stamp_ns)
        return track

    def _is_moment(self, scan: Scan, now: FloatArray) -> bool:
        """Whether the robot, by its odometry (3,), has moved on, or time passed, since the last moment."""
        if self._moment is not None:
            odometry, stamp_ns = self._moment
            step = between(odometry, now)
            way, waited = math.hypot(step[0], step[1]), (scan.stamp_ns - stamp_ns) / NANOSECONDS
            if way < MOMENT_M and abs(step[2]) < MOMENT_RAD and waited < MOMENT_S:
                return False
        self._moment = now, scan.stamp_ns
        return True

    def _log_evidence(self, sight: Sight, beams: BoolArray) -> float:
        """Tempered log p(o) of some beams from where the robot is followed to.

        With objects as they were believed before it may have left that place: what was learnt since
        may be what makes a wrong place explain its scans.
        """
        robot, view, tempering = (
            sight.robot,
            sight.view(beams),
            self.settings.localization.tempering,
        )
        objects = []
        if self._is_narrow(robot):
            objects = self._scenery(sight.seen_by(beams), self._bank.before.beliefs)
        if self._pose is None:
            told = tempering * view.pose_log_likelihood(robot.poses, BLUR, objects)
            return float(np.logaddexp.reduce(told + robot.weights.log))
        walls = sight.walls[None, beams]
        told = view.pose_log_likelihood(robot.mean[None], BLUR, objects, walls)
        return tempering * float(told[0])

    def _searched(self, track: Track, scan: Scan, chance: float) -> Track:
        """Search the whole building for other places, if they may be likelier; the likeliest is followed."""
        assert self._odometry is not None
        look = Look(scan, self._odometry, track.belief.mean, *self._bank.odds, chance)
        if not self._search.note(look):
            return track
        self._bank.looked()
        if not self._bank.may_search(scan.stamp_ns, self.settings.search.every_s):
            return track
        within, robot = SAME, track.belief
        if self._is_narrow(robot):
            within = SAME + 2.0 * np.sqrt(np.diagonal(robot.covariance))
        found = self._search.hypotheses(self._explained, self._search_rng, within)
        best, is_surer = self._bank.weigh(found, scan.stamp_ns)
        if not is_surer and (not self.is_lost or self._bank.lost_since_ns is not None):
            return track
        place = found.poses[best]
        kept, since_ns = self._left(place)
        if not is_surer:
            self._bank.lose(since_ns)
            return track
        self._search.follow(best, since_ns)
        self._bank.follow(found, best, kept, since_ns)
        return self._found(place, kept)

    def _left(self, place: FloatArray) -> tuple[Kept, int]:
        """What was believed before scans spoke for the way that ends in a place (3,), and since when."""
        moments, gained = self._bank.moments, []
        for moment in moments:
            log_likelihood = self._explained(moment.scan)
            there = compose(place, between(moments[-1].odometry, moment.odometry))
            new, old = (log_likelihood(each[None], BLUR)[0] for each in (there, moment.followed))
            gained.append(new - old)
        first = int(np.cumsum(gained[::-1])[::-1].argmax())
        last = moments[max(first - 1, 0)]
        return last.kept, last.stamp_ns + 1

    def _found(self, place: FloatArray, kept: Kept) -> Track:
        """Follow another place; what was learnt since the robot came there is that of a wrong hypothesis."""
        self._believed.restore(kept.beliefs)
        self._leave_pose()
        self._learnt = kept.learnt
        self.odometry_error.forget()
        return Track(self._localizer.start(place, np.diag(FOUND_STD**2), self._rng))

    @property
    def _kept(self) -> Kept:
        """What is believed now beside the pose."""
        learnt = self._learnt if self._pose is None else self._pose.learnt
        return Kept(dict(self._believed.marginals), learnt)

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
        now, beams = scan.stamp_ns, self._everywhere.usable(scan)
        if self._odometry is None or not beams.any():
            return None
        self._bank.publish(0.0, now)
        beams = evenly_spread(beams, self.settings.localization.max_beams)
        chance = self._everywhere.chance(scan, beams).mean
        if not self._search.note(Look(scan, self._odometry, chance=chance)):
            return self._track
        found = self._search.hypotheses(self._explained, self._search_rng)
        if self._bank.begin(found):
            self._is_anywhere = False
            self._search.follow(0, 0)
            track = self._found(found.poses[0], self._kept)
            self._bank.publish(_near_mean(track.belief), now)
            return track
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
        self._leave_pose()
        self.odometry_error.forget()
        self._track = Track(belief)
        self._search.forget()
        if is_start:
            self._bank.start(self._kept)
            self._bank.publish(_near_mean(belief), self._now_ns)


class Kept(NamedTuple):
    """What a hypothesis of the robot's place believes beside it."""

    beliefs: Mapping[str, ObjectBelief]
    learnt: Learnt


def _near_mean(robot: PoseBelief) -> float:
    """Probability of a pose within 0.75 m and 20 degrees of the mean."""
    if robot.position_std <= NEAR and robot.covariance[2, 2] <= NEAR**2:
        return 1.0
    return float(robot.weights.values[apart(robot.poses, robot.mean) <= 1.0].sum())


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
