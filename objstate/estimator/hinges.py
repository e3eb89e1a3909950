"""Doors that hang elsewhere than the model says, learnt over a log.

Looks at each door are remembered. Where they are strange, its hinge is looked for: where a
line through the leaf's readings passes the hinge, where what stopped beams isn't the leaf,
or where a door that was known suddenly is another. While nothing is strange, next to
nothing is done.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.config import HingeSettings, Settings
from objstate.estimator.sight import Sight
from objstate.geometry import BoolArray, FloatArray, between, transform
from objstate.objects import ObjectBelief, filter_for
from objstate.objects.belief import SETTLED_ANGLE
from objstate.objects.doors import LatticeFilter, leaf_axes
from objstate.objects.hanging import Hanging, Look, find_hinge
from objstate.records import Scan
from objstate.sensing import BeamModel, Sensing

STOPPED = 0.15  # m short of a wall, by which something has stopped a beam
ASIDE = 0.15  # m from the leaf within which a reading may be one of it
BEYOND = 0.05  # m past the leaf's edges, likewise
POINTS = 5  # readings of the leaf that a line needs
SPAN = 0.25  # m along the leaf that they must cover
KEPT = 0.5  # probability down to which a door that was found elsewhere stays there
LEAVES_KEPT = 4096  # leaves of so many doors are remembered


class Hinges:
    """Where doors hang: looks at them, and what became of those that looked strange."""

    def __init__(self, building: Building, settings: Settings) -> None:
        self.found: dict[str, Hanging] = {}  # of doors that surely hang elsewhere
        self._building = building
        self._settings = settings.hinges
        sharp = min(settings.beam_model.sigma_hit, settings.hinges.sigma_hit)
        model = BeamModel(settings.beam_model.model_copy(update={"sigma_hit": sharp}))
        self._sensing = Sensing(
            replace(building, walls=Mesh.empty()), model
        )  # walls are remembered
        self._filters = {
            name: door
            for name, item in building.objects.items()
            if item.kind is Kind.HINGED
            and isinstance(door := filter_for(item, settings), LatticeFilter)
        }
        self._watches = {name: _Watch(settings.hinges) for name in self._filters}

    def is_due(self, belief: ObjectBelief, driven: float) -> bool:
        """Whether a door is to be looked at, after so many m of driving.

        A door that was found elsewhere is, too, as soon as it seems to be another.
        """
        name = belief.item.name
        watch = self._watches.get(name)
        if watch is None:
            return False
        return watch.is_due(driven) or (name in self.found and watch.is_another(belief))

    def note(
        self,
        belief: ObjectBelief,
        sight: Sight,
        driven: float,
        map_error: float,
        others: Mapping[str, FloatArray],
    ) -> None:
        """Remember a scan in which a door was seen, and how strange it looked.

        ``driven`` and ``map_error`` are in m; ``others`` are states (d,) of known doors beside it.
        """
        robot, leaf = sight.robot, _Leaf.of(belief.item)
        shift_std = math.hypot(robot.position_std, map_error)
        hinge, within = belief.item.origin[:2, 3], leaf.reach + self._settings.most_m
        ends = _stopped(sight.scan, robot.mean, sight.walls, hinge, within)
        self._watches[belief.item.name].add(
            _Glance(sight.scan, robot.mean, sight.walls, shift_std, others),
            leaf.held_against(ends, belief, robot.mean),
            belief,
            driven,
        )

    def seems_off(self, name: str) -> bool:
        """Whether what has been read of a door is worth a search for its hinge."""
        watch = self._watches[name]
        return watch.is_strange or (name in self.found and watch.has_jumped)

    def search(self, name: str, sensing: Sensing) -> ObjectBelief | None:
        """What is believed of a door after a search for its hinge, hung where it surely is.

        None where it stays where it hangs, in the model's place. ``sensing`` knows where the others hang.
        """
        watch, item = self._watches[name], self._building[name]
        looks = [self._look(item, glance, sensing) for glance in watch.glances]
        hanging = find_hinge(self._filters[name], looks, self._settings)
        before = self.found.get(name)
        if self._is_elsewhere(item, hanging, before, watch.glances):
            self.found[name] = hanging
            belief = replace(hanging.belief, item=_rehung(item, hanging.offset))
        elif before is not None and hanging.elsewhere < KEPT:
            del self.found[name]
            belief = hanging.belief
        else:
            watch.searched(None)
            return None
        watch.searched(belief)
        return belief

    def _is_elsewhere(
        self, item: MovableObject, hanging: Hanging, before: Hanging | None, glances: list[_Glance]
    ) -> bool:
        """Whether a door surely hangs elsewhere than before, or where it was found already.

        Decimetres away, the leaf must be what stopped most of those beams that seemed strange.
        """
        s = self._settings
        if hanging.elsewhere < (s.sure if before is None else KEPT):
            return False
        offset = hanging.offset
        doubtful = s.least_sigmas * float(np.median([glance.shift_std for glance in glances]))
        if before is None and np.hypot(*offset) < doubtful:
            return False
        if np.hypot(*(offset - (0.0 if before is None else before.offset))) <= ASIDE:
            return True
        there = replace(hanging.belief, item=_rehung(item, offset))
        strange = self._strange(hanging.belief_in_place, glances)
        return self._strange(there, glances) <= s.most_strange * strange

    def _strange(self, belief: ObjectBelief, glances: list[_Glance]) -> float:
        """Share of the beams stopped near a door that its leaf didn't stop."""
        leaf, hinge = _Leaf.of(belief.item), belief.item.origin[:2, 3]
        within = leaf.reach + self._settings.most_m
        looks = [
            leaf.held_against(
                _stopped(glance.scan, glance.pose, glance.walls, hinge, within), belief, glance.pose
            )
            for glance in glances
        ]
        return sum(each.strange for each in looks) / max(sum(each.stopped for each in looks), 1)

    def std(self, belief: ObjectBelief) -> float:
        """m by which a door may hang aside of where it is taken to, along the normal of its leaf."""
        item = belief.item
        if item.name not in self.found:
            watch = self._watches.get(item.name)
            return 0.0 if watch is None else watch.aside
        turn = item.transforms(belief.mean[None])[0, :2, :2]
        normal = turn @ _Leaf.of(item).across
        return float(np.sqrt(normal @ self.found[item.name].covariance @ normal))

    def forget(self) -> None:
        """Forget all looks: the robot wasn't where it thought."""
        self._watches = {name: _Watch(self._settings) for name in self._watches}

    def _look(self, item: MovableObject, glance: _Glance, sensing: Sensing) -> Look:
        scan, pose = glance.scan, glance.pose
        within = _Leaf.of(item).reach + self._settings.most_m
        beams = scan.valid & _passes(scan, pose, item.origin[:2, 3], within)
        view, background = sensing.view(scan, beams), glance.walls[beams]
        for other, state in glance.others.items():
            background = np.minimum(background, view.object(other, state[None], pose[None])[0, 0])
        sharp = self._sensing.view(scan, beams)
        return Look(scan.stamp_ns, sharp, pose, background, glance.shift_std)


@dataclass(frozen=True, eq=False)
class _Glance:
    """One scan in which a door was seen, as it is remembered."""

    scan: Scan  # of n beams
    pose: FloatArray  # (3,)
    walls: FloatArray  # (n,) m, expected of all beams
    shift_std: float  # m by which robot and walls may be off
    others: Mapping[str, FloatArray]  # states (d,) of the known doors beside it


@dataclass(frozen=True)
class _Strangeness:
    """How a leaf's readings lie about it, seen from one place."""

    stopped: int  # beams that something stopped near it
    strange: int  # of these, beams that the leaf didn't stop
    aside: float = 0.0  # m by which a line through the readings passes the hinge
    std: float = math.inf  # m, of that


class _Watch:
    """What is remembered of one door, and what was strange since its hinge was last looked for."""

    def __init__(self, settings: HingeSettings) -> None:
        self.glances: list[_Glance] = []
        self._settings = settings
        self._spacing = settings.every_m
        self._driven = -math.inf  # m, at the last glance
        self._known: float | None = None  # rad, the angle at the last glance, where it was known
        self._wait = settings.least_looks  # glances until the next search
        self._pull = 0.0  # sum of what lines pass the hinge by, over their variances, 1/m
        self._hold = 0.0  # sum of one over these variances, 1/m^2
        self._restart()

    def _restart(self) -> None:
        self._count = self._stopped = self._strange = 0
        self.has_jumped = False

    def is_due(self, driven: float) -> bool:
        return driven - self._driven >= self._spacing

    def add(self, glance: _Glance, look: _Strangeness, belief: ObjectBelief, driven: float) -> None:
        """Remember one more glance; of many, every other one, so that those of long ago count too.

        A glance at next to nothing of it is left out, but for one that changed what is believed.
        """
        self._driven = driven
        if look.stopped < POINTS and not self.is_another(belief):
            return
        self.has_jumped |= self.is_another(belief)
        self._know(belief)
        self.glances.append(glance)
        if len(self.glances) > self._settings.looks:
            self.glances = self.glances[1::2]
            self._spacing *= 2.0
        self._count += 1
        self._stopped += look.stopped
        self._strange += look.strange
        if look.std < math.inf:
            variance = look.std**2 + glance.shift_std**2
            self._pull += look.aside / variance
            self._hold += 1.0 / variance

    @property
    def is_strange(self) -> bool:
        s = self._settings
        if self._count < self._wait:
            return False
        is_aside = abs(self._pull) >= s.doubt_sigmas * math.sqrt(self._hold) > 0.0
        return is_aside or self._strange > s.doubt_share * self._stopped

    @property
    def aside(self) -> float:
        """m by which the leaf's readings surely lie aside of it."""
        if self._hold == 0.0:
            return 0.0
        by_chance = self._settings.doubt_sigmas**2 / self._hold
        return math.sqrt(max((self._pull / self._hold) ** 2 - by_chance, 0.0))

    def searched(self, belief: ObjectBelief | None) -> None:
        """A search has told what to believe of the door from now on, or nothing: then wait longer."""
        self._wait = 2 * max(self._count, self._settings.least_looks)
        if belief is not None or self.has_jumped:  # lines were those of another state
            self._pull = self._hold = 0.0
        if belief is not None:
            self._know(belief)
        self._restart()

    def _know(self, belief: ObjectBelief) -> None:
        self._known = float(belief.mean[0]) if belief.settled else None

    def is_another(self, belief: ObjectBelief) -> bool:
        """Whether a door that was known isn't what it was."""
        if self._known is None:
            return False
        return not belief.settled or abs(float(belief.mean[0]) - self._known) > SETTLED_ANGLE


@dataclass(frozen=True, eq=False)
class _Leaf:
    """A hinged leaf from above, along and across, seen from its hinge."""

    along: FloatArray  # (2,) unit vectors in the link's frame
    across: FloatArray  # (2,)
    near: float  # m along, where it begins and ends
    far: float
    sides: tuple[float, float]  # m across
    reach: float  # m, of its farthest corner from the hinge

    @staticmethod
    @lru_cache(maxsize=LEAVES_KEPT)
    def of(item: MovableObject) -> _Leaf:
        plan = item.mesh.vertices[:, :2]
        across, along = leaf_axes(item)
        return _Leaf(
            along=along,
            across=across,
            near=float((plan @ along).min()),
            far=float((plan @ along).max()),
            sides=(float((plan @ across).min()), float((plan @ across).max())),
            reach=float(np.hypot(plan[:, 0], plan[:, 1]).max()),
        )

    def held_against(
        self, ends: FloatArray, belief: ObjectBelief, pose: FloatArray
    ) -> _Strangeness:
        """The leaf in its most probable state against where beams end (k, 2) m, from a pose (3,)."""
        if len(ends) < POINTS:
            return _Strangeness(len(ends), 0)
        place = belief.item.transforms(belief.best[None])[0]
        turn, hinge = place[:2, :2], place[:2, 3]
        eye, own = (pose[:2] - hinge) @ turn, (ends - hinge) @ turn
        side = self.sides[int(eye @ self.across > sum(self.sides) / 2.0)]
        lever, off = own @ self.along, own @ self.across - side
        on = (np.abs(off) <= ASIDE) & (lever >= self.near - BEYOND) & (lever <= self.far + BEYOND)
        lever, off = lever[on], off[on]
        strange = len(ends) - len(lever)
        if len(lever) < POINTS or np.ptp(lever) < SPAN:
            return _Strangeness(len(ends), strange)
        middle = float(lever.mean())
        spread = lever - middle
        squares = float(spread @ spread)
        slope = float(spread @ off) / squares
        aside = float(off.mean()) - slope * middle
        rest = off - aside - slope * lever
        variance = float(rest @ rest) / (len(rest) - 2) * (1.0 / len(rest) + middle**2 / squares)
        return _Strangeness(len(ends), strange, aside, math.sqrt(variance))


def _rehung(item: MovableObject, offset: FloatArray) -> MovableObject:
    """A door whose hinge is elsewhere by an offset (2,) m."""
    return replace(item, origin=transform(np.eye(3), [*offset, 0.0]) @ item.origin)


def _stopped(
    scan: Scan, pose: FloatArray, walls: FloatArray, place: FloatArray, distance: float
) -> FloatArray:
    """Where beams end (k, 2) m that something near a place (2,) stopped short of the walls (n,)."""
    short = scan.ranges < walls - STOPPED
    rays, ranges = scan.rays, scan.ranges[short, None]
    ends = rays.origins[short, :2] + ranges * rays.directions[short, :2]
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    ends = ends @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
    off = ends - place
    return np.asarray(ends[(off * off).sum(axis=1) <= distance * distance])


def _passes(scan: Scan, pose: FloatArray, place: FloatArray, distance: float) -> BoolArray:
    """Which beams (n,) come within a distance of a place (2,), m."""
    directions, _ = scan.rays.courses
    x, y = (between(pose, np.array([*place, 0.0]))[:2] - scan.rays.origins[:, :2]).T
    along = x * directions[:, 0] + y * directions[:, 1]
    aside = x * directions[:, 1] - y * directions[:, 0]
    return np.asarray((np.abs(aside) <= distance) & (along >= -distance))
