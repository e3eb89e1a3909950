"""The localization monitor: the probability of the followed place and of others.

The bank holds the probabilities; searches of the whole building propose other places.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import accumulate
from operator import or_
from typing import NamedTuple

import numpy as np

from objstate.config import Settings
from objstate.estimator.bank import Alike, Bank, Moment, Seen, seconds_of
from objstate.estimator.believed import Believed
from objstate.estimator.robot import Robot
from objstate.estimator.scenery import Scenery
from objstate.estimator.sight import Sight
from objstate.geometry import BoolArray, FloatArray, between, compose, crosses, transform_from_pose
from objstate.localization import (
    Anywhere,
    Keyframe,
    Learnt,
    LogLikelihood,
    PoseBelief,
    Search,
    apart,
)
from objstate.localization.anywhere import BLUR
from objstate.localization.search import INDEPENDENCE, SAME
from objstate.objects import ObjectBelief
from objstate.records import NANOSECONDS, Scan
from objstate.sensing import Sensing, cast_from

MOMENT_M, MOMENT_RAD, MOMENT_S = 0.2, 0.17, 0.5  # distance, turn and time between compared scans
REACH, CELL = 10.0, 0.25  # m up to which beams show the floor, and of its cells
AHEAD = 0.5  # m before the robot, which it is about to drive
INDEPENDENCE_OF_MOMENTS = INDEPENDENCE / 2.0  # they are twice as near as keyframes
NEAR = 0.15  # m of deviation up to which a belief surely lies near its mean


class Kept(NamedTuple):
    """The beliefs that belong to a hypothesis about the robot's place."""

    beliefs: Mapping[str, ObjectBelief]
    learnt: Learnt


class Monitor:
    """Compares the followed place with all others, and moves the robot to one that wins.

    A robot that ``is_anywhere`` has no followed place yet.
    """

    def __init__(
        self,
        settings: Settings,
        sensing: Sensing,
        scenery: Scenery,
        robot: Robot,
        believed: Believed,
        seed: int,
        *,
        is_anywhere: bool,
    ) -> None:
        self._settings, self._sensing, self._scenery = settings, sensing, scenery
        self._robot, self._believed = robot, believed
        self._rng = np.random.default_rng([seed, 2])
        self.is_anywhere = is_anywhere
        self._everywhere = Anywhere(sensing, settings)
        self._search = Search(sensing, settings)
        self.bank = Bank(settings, self._kept)  # how probable the followed place is
        # odometry (3,) and stamp of the last one
        self._moment: tuple[FloatArray, int] | None = None

    # --- a given place --------------------------------------------------------------

    def restart(self, now_ns: int, *, is_start: bool) -> None:
        """Note that a belief was given; as a start, it is probably right."""
        self._search.forget()
        if is_start:
            self.bank.start(self._kept)
            self._publish(now_ns)

    # --- propose: a robot that may be anywhere --------------------------------------

    def propose(self, scan: Scan) -> None:
        """Propose places for a robot that may be anywhere, by its scans so far."""
        robot, now = self._robot, scan.stamp_ns
        beams = self._everywhere.usable(scan)
        if robot.odometry is None or not beams.any():
            robot.forget()
            return
        self.bank.publish(0.0, now)
        chance = self._everywhere.chance(scan, self._scenery.thinned(beams)).mean
        if not self._search.note(Keyframe(scan, robot.odometry, chance=chance)):
            return
        found = self._search.hypotheses(self._explained, self._rng)
        if self.bank.begin(found):
            self.is_anywhere = False
            self._search.follow(0, 0)
            robot.found(found.poses[0], robot.learnt)
            self._publish(now)
        else:
            robot.follow(found.belief(self._settings.localization.max_particles, self._rng))

    # --- weigh: the followed place against others -----------------------------------

    def weigh(self, sight: Sight) -> None:
        """Update the probability of the followed place; move the robot if another place wins."""
        robot, scan = self._robot, sight.scan
        if not robot.is_filtered:
            self.bank.widen(sight.robot.position_std)
        if robot.odometry is not None and self._is_moment(scan, robot.odometry):
            beams = self._scenery.thinned(self._everywhere.usable(scan))
            if beams.any():
                chance = self._everywhere.chance(scan, beams)
                log_evidence = self._log_evidence(sight, beams)
                moment = Moment(scan, robot.odometry, sight.robot.mean, self._kept)
                self.bank.take(moment, log_evidence, chance)
                keyframe = Keyframe(
                    scan, robot.odometry, sight.robot.mean, *self.bank.odds, chance.mean
                )
                if self._search.note(keyframe):
                    self.bank.keyframe_kept()
                    self._search_elsewhere(sight)
        self._publish(scan.stamp_ns)

    def _publish(self, now_ns: int) -> None:
        assert self._robot.belief is not None
        self.bank.publish(_near_mean(self._robot.belief), now_ns)

    def _is_moment(self, scan: Scan, now: FloatArray) -> bool:
        """Whether the robot has moved, or time has passed, since the last compared scan."""
        if self._moment is not None:
            odometry, stamp_ns = self._moment
            step = between(odometry, now)
            way, waited = math.hypot(step[0], step[1]), (scan.stamp_ns - stamp_ns) / NANOSECONDS
            if way < MOMENT_M and abs(step[2]) < MOMENT_RAD and waited < MOMENT_S:
                return False
        self._moment = now, scan.stamp_ns
        return True

    def _log_evidence(self, sight: Sight, beams: BoolArray) -> float:
        """Tempered log p(o) of some beams from the followed place.

        Objects are taken as they were believed before the robot may have left the place, since
        later updates may be what makes a wrong place explain its scans.
        """
        scenery, beliefs = self._scenery, self.bank.before.beliefs
        tempering = self._settings.localization.tempering
        if self._robot.is_filtered:
            return tempering * scenery.log_likelihood_of_mean(sight, beams, BLUR, beliefs)
        log_likelihood = tempering * scenery.log_likelihood(sight, beams, BLUR, beliefs)
        return float(np.logaddexp.reduce(log_likelihood + sight.robot.weights.log))

    # --- search: other places -------------------------------------------------------

    def _search_elsewhere(self, sight: Sight) -> None:
        """Search the whole building if other places are probable enough; follow one that wins."""
        bank, now = self.bank, sight.scan.stamp_ns
        if not bank.may_search(now, self._settings.search.every_s):
            return
        within = SAME
        if self._scenery.is_narrow(sight):
            within = SAME + 2.0 * np.sqrt(np.diagonal(sight.robot.covariance))
        found = self._search.hypotheses(self._explained, self._rng, within)
        best = int(np.where(found.is_followed, -np.inf, found.log_odds).argmax())
        place = found.poses[best]
        first, gained = self._left(place)
        alike = self._alike(first, gained, float(found.carried[best]))
        is_surer = bank.weigh(found, best, alike, now)
        if not is_surer and (not bank.is_lost or bank.lost_since_ns is not None):
            return
        last = bank.moments[max(first - 1, 0)]
        kept, since_ns = last.kept, last.stamp_ns + min(first, 1)  # after the last one that fits
        if not is_surer:
            bank.lose(since_ns)
            return
        left = bank.departure(place)
        if left is not None and left.since_ns < since_ns:
            kept, since_ns = left.kept, left.since_ns
        self._search.follow(best, since_ns)
        bank.follow(found, best, kept, since_ns)
        # beliefs since then belong to a wrong hypothesis
        self._believed.restore(kept.beliefs)
        self._robot.found(place, kept.learnt)

    def _left(self, place: FloatArray) -> tuple[int, FloatArray]:
        """Since which moment scans favour the way to a place (3,); by how much each (m,) does."""
        moments, gained = self.bank.moments, []
        for moment in moments:
            log_likelihood = self._explained(moment.scan)
            there = compose(place, between(moments[-1].odometry, moment.odometry))
            both = np.array([[there], [moment.followed]])
            new, old = log_likelihood(both, BLUR)[:, 0].tolist()
            gained.append(new - old)
        return int(np.cumsum(gained[::-1])[::-1].argmax()), np.array(gained)

    def _alike(self, first: int, gained: FloatArray, carried: float) -> Alike:
        """How probable it is that a part which the map lacks looks like a place, from a moment on.

        The robot was ``carried`` to that place with this probability, if it is there, and each
        moment favours the place by ``gained`` (m,).
        """
        moments, gained = list(self.bank.moments)[first:], INDEPENDENCE_OF_MOMENTS * gained[first:]
        cells = [self._cells(moment) for moment in moments]
        begins = self.bank.begins(moments, _areas(cells[::-1])[::-1], gained)
        start, moments = self.bank.moments[max(first + begins - 1, 0)], moments[begins:]
        before, gained = gained[:begins].sum(), gained[begins:]
        since = -np.append(np.cumsum(gained[::-1])[::-1][1:], 0.0) - before
        off = np.array([each.followed[:2] - start.followed[:2] for each in moments])
        far = np.maximum.accumulate(np.hypot(*off.T))
        is_through = self._is_through([start, *moments])
        seen = Seen(seconds_of(moments), far, _areas(cells[begins:]), is_through)
        now, back = self.bank.alike(seen, since)
        return Alike(now * carried, back * carried)

    def _is_through(self, moments: Sequence[Moment[Kept]]) -> bool:
        """Whether the followed place goes through a wall of the map in some moments, or now."""
        ahead = compose(moments[-1].followed, np.array([AHEAD, 0.0, 0.0]))
        places = np.array([*(each.followed for each in moments), ahead])[:, :2]
        height = float(np.median(moments[0].scan.rays.origins[:, 2]))
        walls = self._sensing.walls_at(height).reshape(-1, 2, 2)
        return crosses(np.stack([places[:-1], places[1:]], axis=1), walls)

    def _cells(self, moment: Moment[Kept]) -> set[tuple[int, int]]:
        """The cells of the floor that beams have passed, in the odometry's frame."""
        beams = self._scenery.thinned(self._everywhere.usable(moment.scan))
        rays = moment.scan.rays.take(np.flatnonzero(beams))
        origins, directions = cast_from(transform_from_pose(moment.odometry), rays)
        ways = np.arange(0.5 * CELL, REACH, CELL)
        passed = moment.scan.ranges[beams, None] > ways
        places = origins[:, None, :2] + ways[:, None] * directions[:, None, :2]
        return set(map(tuple, np.floor(places[passed] / CELL).astype(int).tolist()))

    @property
    def _kept(self) -> Kept:
        """The present beliefs besides the pose."""
        return Kept(dict(self._believed.marginals), self._robot.learnt)

    def _explained(self, scan: Scan) -> LogLikelihood:
        """A function giving the tempered log p(o | l) of a scan for groups of nearby poses.

        Objects are averaged over their priors.
        """
        beams = self._scenery.thinned(scan.valid)
        view = self._sensing.view(scan, beams)
        view = view.take(np.ones(np.count_nonzero(beams), dtype=bool))  # these beams are all
        tempering, around = self._settings.localization.tempering, self._scenery.around

        def log_likelihood(poses: FloatArray, blur: float) -> FloatArray:
            return tempering * view.nearby_log_likelihood(poses, blur, around)

        return log_likelihood


def _areas(seen: Sequence[set[tuple[int, int]]]) -> FloatArray:
    """(m,) m2 of the floor that were seen up to each moment, by the cells that each shows."""
    return np.array([len(cells) * CELL**2 for cells in accumulate(seen, or_)])


def _near_mean(robot: PoseBelief) -> float:
    """Probability of a pose within 0.75 m and 20 degrees of the mean."""
    if robot.position_std <= NEAR and robot.covariance[2, 2] <= NEAR**2:
        return 1.0
    return float(robot.weights.values[apart(robot.poses, robot.mean) <= 1.0].sum())
