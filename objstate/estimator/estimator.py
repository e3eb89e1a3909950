"""Simultaneous object state estimation and localization: Table 1, Schulz and Burgard 2001."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

import numpy as np

from objstate.building.model import Building, check_building
from objstate.config import Settings, check_settings
from objstate.errors import SettingsError
from objstate.estimator.admission import check
from objstate.estimator.believed import Believed
from objstate.estimator.joint import JointUpdate
from objstate.estimator.monitor import Monitor
from objstate.estimator.observation import MarginalUpdate
from objstate.estimator.publishing import Fits, lost_rows, rows
from objstate.estimator.robot import TIGHT_M, TIGHT_RAD, Robot
from objstate.estimator.scenery import Scenery
from objstate.estimator.schedule import Schedule
from objstate.estimator.sight import Near, Sight
from objstate.estimator.start import Start, check_seed
from objstate.estimator.thinning import NEVER_NS, Thinning
from objstate.estimator.width import Limit, TooWide
from objstate.geometry import BoolArray, FloatArray
from objstate.lazy import altered
from objstate.localization import PoseBelief, Vantage
from objstate.objects import ObjectBelief
from objstate.records import Estimate, Odometry, Record, Scan
from objstate.sensing import BeamModel, Sensing
from objstate.smoothing import History


class Estimator:
    """The beliefs about robot and objects, updated by records in time order.

    Args:
        building: the walls and the objects.
        settings: all settings; the defaults serve.
        seed: equal seeds and records give equal estimates, bit by bit.
        initial_pose: (3,) x m, y m, yaw rad in the building's frame, instead of the log's own.
        global_start: the robot may be anywhere in the building.
        belief: ``own`` localizes by odometry and scans; ``recorded`` takes the robot
            belief that the log holds, as in the paper's experiments.
        beliefs: known beliefs about objects, by name, in place of their priors; on the
            samples that these settings give, as ``World.at`` returns them.
        history: keep what smoothing needs, see ``histories``.
        observes: update objects; else the robot is localized only, among objects that may be in any
            state that their priors have.

    Raises:
        SettingsError: settings that contradict each other, an object's joint, or the samples of
            its belief; a seed, an initial pose or a robot belief that is none.
        BuildingError: beliefs about an object that the building doesn't have, or about another
            one than their name says.
        TypeError: a building or settings that aren't loaded, beliefs that aren't given by name.
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
        observes: bool = True,
    ) -> None:
        check_building(building)
        settings = Settings() if settings is None else settings
        check_settings(settings)
        check_seed(seed)
        if belief not in ("own", "recorded"):
            raise SettingsError(f"The robot belief '{belief}' is unknown; give own or recorded.")
        self.building = building
        self._observes = observes
        self.settings = s = settings.in_building(building.error)
        self._now_ns = NEVER_NS  # of the last record
        self.scans_without_pose = 0
        self.corrections = 0  # number of scans that localized the robot
        self.too_wide = TooWide()  # the recorded robot belief, for objects near it
        self._sensing = sensing = Sensing(building, BeamModel(s.beam_model))
        self._thinned, self._schedule = Thinning(s.scans), Schedule(s.object_updates)
        self._believed = Believed(building, s, seed, beliefs or {}, history=history)
        scenery = Scenery(s, self._believed)
        self._joint = JointUpdate(building, s, sensing, self._believed, scenery)
        self._marginal = MarginalUpdate(s.object_updates, self._believed)
        self._robot = Robot(s, sensing, scenery, seed, localizes=belief == "own")
        self.odometry_error = self._robot.odometry_error  # as learnt so far
        self._start = Start(self._robot, initial_pose, is_global=global_start)
        self.warnings = self._start.warnings
        parts = sensing, scenery, self._robot, self._believed
        self._monitor = Monitor(s, *parts, seed, is_anywhere=global_start)

    # --- what is believed -----------------------------------------------------------

    @property
    def robot(self) -> PoseBelief | None:
        """p(l), the robot belief; None while nothing is known about the robot's pose."""
        return self._robot.belief

    @property
    def objects(self) -> dict[str, ObjectBelief]:
        """p(s) of each object, as of its last update; values that later records don't change."""
        return dict(self._believed.marginals)

    def object_at(self, name: str, stamp_ns: int) -> ObjectBelief:
        """An object's belief predicted to a moment at or after its last update.

        Raises ValueError for an earlier moment, TypeError for one that is no integer, BuildingError
        for an unknown object.
        """
        return self._believed.then(self.building[name].name, stamp_ns)

    @property
    def lost(self) -> tuple[tuple[int, int], ...]:
        """Intervals (from, to) in ns in which the robot was probably lost."""
        return self._monitor.bank.stretches(self._thinned.now_ns)

    @property
    def is_lost(self) -> bool:
        """Whether the robot is probably lost, so that objects aren't updated."""
        return self._monitor.bank.is_lost

    @property
    def p_localized(self) -> float:
        """Probability that the robot is within 0.75 m and 20 degrees of the mean of ``robot``."""
        return self._monitor.bank.p_localized

    @property
    def lost_probabilities(self) -> tuple[float, ...]:
        """The largest probability of being lost in each interval in ``lost``."""
        return self._monitor.bank.probabilities

    @property
    def map_error(self) -> float:
        """m; standard deviation of walls from the building's model, as learnt."""
        return self._robot.wall_std

    def vantage(self, scan: Scan) -> Vantage:
        """From where the beams of the last scan left, with the laser's errors as learnt."""
        return self._robot.vantage(scan)

    def walls(self, scan: Scan) -> FloatArray:
        """(n,) m to the walls along a scan's beams, from the mean of ``robot``; NaN for invalid."""
        assert self.robot is not None
        return Sight.of(scan, self.robot, self._sensing, self._believed.surroundings).walls

    @property
    def hung_elsewhere(self) -> dict[str, FloatArray]:
        """Offsets (2,) m of hinges that are significantly off the model, by door.

        Not of doors that were seen last by a robot that was probably lost.
        """
        marginals, off = self._believed.marginals, self._joint.hung_elsewhere
        return {name: off[name] for name in off if not self._was_lost(marginals[name].stamp_ns)}

    def _was_lost(self, stamp_ns: int | None) -> bool:
        lost = self.lost
        return stamp_ns is not None and any(begin <= stamp_ns < end for begin, end in lost)

    @property
    def histories(self) -> dict[str, History]:
        """The history of each observed object for smoothing, with ``history``."""
        return self._joint.histories

    # --- the loop -------------------------------------------------------------------

    def feed(self, record: Record) -> list[Estimate]:
        """Update by one record; return the rows of the objects whose belief changed.

        Raises LogError for records out of time order and for numbers that are none; such a record
        changes nothing.
        """
        check(record, self._now_ns)
        self._now_ns = record.stamp_ns
        match record:
            case Odometry():
                self._robot.drive(record.pose, record.stamp_ns)
            case Scan():
                published = self._sense(record)
                p = self.p_localized if self._robot.localizes else 1.0
                return [altered(row, p_localized=p) for row in published]
            case belief:
                self._start.take(belief, self._monitor)
        return []

    def _sense(self, scan: Scan) -> list[Estimate]:
        """The body of Table 1's loop, for new sensory input o_k."""
        new = self._thinned(scan)
        if scan.odometry is not None:
            self._robot.drive(scan.odometry, scan.stamp_ns)
        if new is None:
            return []
        if self._monitor.is_anywhere:
            self._monitor.propose(new)
        if self._robot.belief is None:
            self.scans_without_pose += 1
            return []
        sight = Sight.of(new, self._robot.belief, self._sensing, self._believed.surroundings)
        if self._robot.localizes and not self._monitor.is_anywhere:
            self._monitor.weigh(sight)
            sight = sight.by(self._robot.belief)
        if self._robot.follows_precisely(self._joint.is_linear(new)):
            return self._update_precisely(sight)
        return self._update_by_turns(sight)

    def _update_precisely(self, sight: Sight) -> list[Estimate]:
        """p(l, s, d | o_k) for a pose known to centimetres: Gaussian, given each object's state."""
        near = self._near(sight, sight.valid)
        known = self._joint.known(near.pointed_at, sight)
        if not self._monitor.bank.is_unmapped:  # else scans don't tell where the robot is
            sight = sight.by(self._robot.correct(sight, near, known.keys()))
            self.corrections += 1
        if not self._observes:
            return []
        if self.is_lost:
            return self._lost(sight)
        fits = self._joint.observe(near.pointed_at, sight, self._robot, known)
        return rows(self._believed.marginals, fits)

    def _update_by_turns(self, sight: Sight) -> list[Estimate]:
        """p(l | o_k) and p(s_i | o_k) as marginals, each by its share of beams (section 2.2)."""
        robot, (localizing, observing) = self._robot, self._schedule.share_out(sight.scan)
        if robot.is_filtered or not robot.localizes:
            localizing, observing = np.zeros_like(localizing), sight.valid
        if localizing.any():
            sight = sight.by(robot.localize(sight, localizing))
            self.corrections += 1
        if not (self._observes and observing.any()):
            return []
        if not robot.localizes:
            self._note_width(sight, observing)
        if not robot.is_narrow:
            return []
        if self.is_lost:
            return self._lost(sight)
        near, fits = self._near(sight, observing), Fits()
        if not self._joint.is_linear(sight.scan):
            fits = self._marginal.observe(near, sight, robot)
        elif robot.is_tight:
            known = self._joint.known(near.pointed_at, sight)
            fits = self._joint.observe(near.pointed_at, sight, robot, known)
        return rows(self._believed.marginals, fits)

    def _note_width(self, sight: Sight, observing: BoolArray) -> None:
        """Note whether a recorded belief is too wide for the objects near it."""
        robot, is_linear = self._robot, self._joint.is_linear(sight.scan)
        is_used = robot.is_tight if is_linear else robot.is_narrow
        most_m = self.settings.object_updates.max_position_std
        limit = Limit(TIGHT_M, TIGHT_RAD) if is_linear else Limit(most_m)
        if is_used or not self._near(sight, observing).names:
            self.too_wide.end(sight.scan.stamp_ns)
        else:
            self.too_wide.note(sight.scan.stamp_ns, sight.robot, limit)

    def _near(self, sight: Sight, beams: BoolArray) -> Near:
        """The objects near the robot, and which of some beams (n,) point at them."""
        return sight.near(self.settings.object_updates.max_distance, beams)

    def _lost(self, sight: Sight) -> list[Estimate]:
        """Predict the objects near a robot that is probably lost."""
        near = self._near(sight, sight.valid).names
        return lost_rows(self._believed, near, sight.scan.stamp_ns)
