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
from objstate.estimator import hinge_kernels
from objstate.estimator.hinge_kernels import ASIDE, FAR, NEAR, POINTS, STOPPED
from objstate.estimator.sight import Sight
from objstate.geometry import BoolArray, FloatArray, between, wrap
from objstate.objects import ObjectBelief, filter_for
from objstate.objects.belief import SETTLED_ANGLE
from objstate.objects.doors import LEAN, LatticeFilter, leaf_axes
from objstate.objects.hanging import Hanging, Look, find_hinge
from objstate.records import NANOSECONDS, Scan
from objstate.sensing import BeamModel, Sensing
from objstate.sensing.view import EXPLAINED_SIGMAS

TURNED = math.radians(30.0)  # from the angle that is believed: by more, only a leaf may be
LONGEST_BOX = 0.5  # m; what shows less of itself may be a box
KNOWN = 0.95  # probability of being open by about an angle from which a door's angle is known
DOUBTED = 0.9  # the same, below which it isn't any more
AFTER_JUMP = 3  # looks at a door that suddenly is another, by which all its looks are asked
KEPT = 0.5  # probability down to which a door that was found elsewhere stays there
LEAVES_KEPT = 4096  # leaves of so many doors are remembered


class Hinges:
    """Where doors hang: looks at them, and what became of those that looked strange."""

    def __init__(self, building: Building, settings: Settings) -> None:
        self._hung: dict[MovableObject, Hanging] = {}  # doors as they were found to hang elsewhere
        self._building = building
        self._settings = settings.hinges
        sharp = min(settings.beam_model.sigma_hit, settings.hinges.sigma_hit)
        each = {"sigma_hit": sharp, "short_run": 1.0}  # a leaf that hangs aside is no box beside it
        model = BeamModel(settings.beam_model.model_copy(update=each))
        self._sensing = Sensing(
            replace(building, walls=Mesh.empty()), model
        )  # walls are remembered
        self._filters = {
            name: door
            for name, item in building.objects.items()
            if item.kind is Kind.HINGED
            and isinstance(door := filter_for(item, settings), LatticeFilter)
        }
        self._watches = self._unseen()

    def is_due(self, belief: ObjectBelief, driven: float) -> bool:
        """Whether a door is to be looked at, after so many m of driving."""
        watch = self._watches.get(belief.item.name)
        return watch is not None and watch.is_due(belief, driven)

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
        robot = sight.robot
        glance = _Glance(sight.scan, robot.mean, sight.walls, robot.position_std, map_error, others)
        look = self._strangeness(belief, belief.item, glance)
        self._watches[belief.item.name].add(glance, look, belief, driven)

    def seems_off(self, name: str) -> bool:
        """Whether what has been read of a door is worth a search for its hinge."""
        watch = self._watches[name]
        return watch.is_strange or watch.is_to_be_asked

    def search(
        self, believed: ObjectBelief, sensing: Sensing, sharper: float = 1.0
    ) -> ObjectBelief | None:
        """What to believe of a door after a search for its hinge, hung where it surely is.

        In its place, too, where it suddenly was another and all looks rather say otherwise.
        None where nothing changes. ``sensing`` knows where the others hang. Looks tell by a factor ``sharper`` more
        than the settings have it.
        """
        watch, item = self._watches[believed.item.name], self._building[believed.item.name]
        looks = [self._look(item, glance, sensing) for glance in watch.glances]
        hanging = find_hinge(self._filters[item.name], looks, self._settings, sharper)
        is_in_place = np.array_equal(believed.item.hinge, item.hinge)
        if self._is_elsewhere(item, hanging, believed, watch):
            belief = _rehung(item, hanging)
            self._hung[belief.item] = hanging
        elif (
            watch.has_jumped and _contradicts(hanging.belief, believed)
            if is_in_place
            else hanging.elsewhere < KEPT
        ):
            belief = hanging.belief
        else:
            watch.searched(None)
            return None
        watch.searched(belief)
        return belief

    def _is_elsewhere(
        self,
        item: MovableObject,
        hanging: Hanging,
        believed: ObjectBelief,
        watch: _Watch,
    ) -> bool:
        """Whether a door surely hangs elsewhere than is believed, or where it was found already.

        Decimetres away, or open by quite another angle than its being aside explains, the leaf must explain most of
        the beams that seemed strange, and some look must show most of its length: a box is shorter.
        """
        s, before = self._settings, believed.item.hinge - item.hinge
        is_in_place = not before.any()
        if hanging.elsewhere < (s.sure if is_in_place else KEPT):
            return False
        offset = hanging.offset
        if is_in_place and np.hypot(*offset) < s.least_sigmas * _lasting_std(watch.glances):
            return False
        leaf, strayed = _Leaf.of(item), float(np.hypot(*(offset - before)))
        turned = abs(float(wrap(hanging.belief.mean - believed.mean)[0]))
        if strayed <= ASIDE and turned <= min(SETTLED_ANGLE + strayed * LEAN / leaf.reach, TURNED):
            return True
        here = self._held_against(hanging.belief_in_place, watch.lately)
        there = self._held_against(_rehung(item, hanging), watch.lately)
        shown = max(look.span for look in there)
        is_leaf = shown >= max(s.least_shown * leaf.length, LONGEST_BOX)
        return is_leaf and _unexplained(there) <= s.most_strange * _unexplained(here)

    def _held_against(self, belief: ObjectBelief, glances: list[_Glance]) -> list[_Strangeness]:
        """A door's leaf in its most probable state against what stopped beams near it at each glance."""
        item = self._building[belief.item.name]
        return [
            replace(self._strangeness(belief, item, glance), passed=self._passed(belief, glance))
            for glance in glances
        ]

    def _passed(self, belief: ObjectBelief, glance: _Glance) -> int:
        """How many beams of a glance went through where a door's leaf is in its most probable state."""
        item, scan = belief.item, glance.scan
        beams = self._beams(item, glance)
        aside = np.append(item.hinge - self._building[item.name].hinge, 0.0)
        view = self._sensing.view(scan, beams)
        leaf = view.object(item.name, belief.best[None], glance.pose[None] - aside)[0, 0]
        meets = leaf < np.minimum(glance.walls[beams], scan.range_max) - STOPPED
        margin = EXPLAINED_SIGMAS * math.hypot(self._settings.sigma_hit, glance.shift_std)
        return int(np.count_nonzero(meets & (scan.ranges[beams] > leaf + margin)))

    def _beams(self, item: MovableObject, glance: _Glance) -> BoolArray:
        """Which beams (n,) of a glance may tell of a door, wherever its hinge is."""
        within = _Leaf.of(item).reach + self._settings.most_m
        return glance.scan.valid & _passes(glance.scan, glance.pose, item.hinge, within)

    def _strangeness(
        self, belief: ObjectBelief, item: MovableObject, glance: _Glance
    ) -> _Strangeness:
        """A door's leaf in its most probable state against what stopped beams near the swing of an ``item`` at a glance."""
        leaf, swing, rays = _Leaf.of(belief.item), _Leaf.of(item), glance.scan.rays
        stopped, strange, aside, std, span = hinge_kernels.look(
            glance.scan.ranges,
            glance.walls,
            rays.origins,
            rays.directions,
            glance.pose,
            swing.hinge,
            swing.outwards,
            swing.half,
            swing.reach,
            self._settings.most_m,
            float(belief.best[0]),
            leaf.hinge,
            leaf.turns,
            leaf.sides,
        )
        return _Strangeness(stopped, strange, aside, std, span)

    def std(self, belief: ObjectBelief) -> float:
        """m by which a door may hang aside of where it is taken to, along the normal of its leaf."""
        item, hanging = belief.item, self._hung.get(belief.item)
        if hanging is None:
            watch = self._watches.get(item.name)
            return 0.0 if watch is None else watch.aside
        turn = item.transforms(belief.mean[None])[0, :2, :2]
        normal = turn @ _Leaf.of(item).axes[:, 1]
        return float(np.sqrt(normal @ hanging.covariance @ normal))

    def forget(self) -> None:
        """Forget all looks: the robot wasn't where it thought."""
        self._watches = self._unseen()

    def _unseen(self) -> dict[str, _Watch]:
        return {name: _Watch(door, self._settings) for name, door in self._filters.items()}

    def _look(self, item: MovableObject, glance: _Glance, sensing: Sensing) -> Look:
        scan, pose, beams = glance.scan, glance.pose, self._beams(item, glance)
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
    robot_std: float  # m by which the robot may be off
    map_error: float  # m by which walls may be
    others: Mapping[str, FloatArray]  # states (d,) of the known doors beside it

    @property
    def shift_std(self) -> float:
        """m by which both together may be off."""
        return math.hypot(self.robot_std, self.map_error)


@dataclass(frozen=True)
class _Strangeness:
    """How a leaf's readings lie about it, seen from one place."""

    stopped: int  # beams that something stopped near it
    strange: int  # of these, beams that the leaf didn't stop
    aside: float = 0.0  # m by which a line through the readings passes the hinge
    std: float = math.inf  # m, of that
    span: float = 0.0  # m along the leaf that they cover
    passed: int = 0  # beams that went through where the leaf is taken to be


class _Watch:
    """What is remembered of one door, and what was strange since its hinge was last looked for."""

    def __init__(self, door: LatticeFilter, settings: HingeSettings) -> None:
        self._door = door
        self._settings = settings
        self._shown: list[_Glance] = []  # those that show something of the door
        self._glimpse: _Glance | None = None  # since: next to nothing, by which it is another
        self._spacing = settings.every_m
        self._driven = -math.inf  # m, at the last glance
        self._known: float | None = None  # rad, the angle at the last glance at which it was known
        self._known_ns = 0
        self._another_ns = 0  # when the door last was another than it had been
        self._wait = settings.least_looks  # glances until the next search
        self._pull = 0.0  # sum of what lines pass the hinge by, over their variances, 1/m
        self._hold = 0.0  # sum of one over these variances, 1/m^2
        self._restart()

    def _restart(self) -> None:
        self._count = self._stopped = self._strange = 0
        self.looks_since_jump = 0  # at a door that suddenly was another; 0: it wasn't

    def is_due(self, belief: ObjectBelief, driven: float) -> bool:
        """Whether it is time for a glance; of a door that seems to be another, sooner."""
        away = driven - self._driven
        if away < self._settings.every_m:
            return False
        return away >= self._spacing or self.has_jumped or self.is_another(belief)

    def add(self, glance: _Glance, look: _Strangeness, belief: ObjectBelief, driven: float) -> None:
        """Remember one more glance; of many, every other one, so that those of long ago count too.

        A glance at next to nothing of it is left out, but for the last one if that changed what is believed.
        """
        self._driven = driven
        is_shown, is_another = look.stopped >= POINTS, self.is_another(belief)
        if not (is_shown or is_another):
            return
        self.looks_since_jump += is_another or self.has_jumped
        if is_another:
            self._another_ns = glance.scan.stamp_ns
        self._know(belief)
        self._glimpse = None if is_shown else glance
        if not is_shown:
            return
        self._shown.append(glance)
        if len(self._shown) > self._settings.looks:
            self._shown = self._shown[::-2][::-1]  # the last among them
            self._spacing *= 2.0
        self._count += 1
        self._stopped += look.stopped
        self._strange += look.strange
        if look.std < math.inf:
            variance = look.std**2 + glance.shift_std**2
            self._pull += look.aside / variance
            self._hold += 1.0 / variance

    @property
    def has_jumped(self) -> bool:
        """Whether the door suddenly was another since its hinge was last looked for."""
        return self.looks_since_jump > 0

    @property
    def is_to_be_asked(self) -> bool:
        """Whether all looks are to say what the door is that suddenly was another.

        At once, where next to nothing shows it; a leaf that is seen is looked at for a while.
        """
        is_shown = self._glimpse is None
        return self.looks_since_jump >= (AFTER_JUMP if is_shown else 1)

    @property
    def glances(self) -> list[_Glance]:
        """All that are remembered, in the order of their stamps."""
        return self._shown if self._glimpse is None else [*self._shown, self._glimpse]

    @property
    def lately(self) -> list[_Glance]:
        """Those at the door as it is now: since it last was another."""
        return [each for each in self.glances if each.scan.stamp_ns >= self._another_ns]

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
        angle = float(belief.mean[0])
        if _share_about(angle, belief) >= KNOWN:
            self._known, self._known_ns = angle, belief.stamp_ns or 0

    def is_another(self, belief: ObjectBelief) -> bool:
        """Whether a door that was known isn't what it was, by more than somebody may have moved it unseen."""
        if self._known is None:
            return False
        unseen_s = ((belief.stamp_ns or 0) - self._known_ns) / NANOSECONDS
        return _share_about(self._known, belief) < DOUBTED * self._door.stayed(unseen_s)


def _contradicts(belief: ObjectBelief, other: ObjectBelief) -> bool:
    """Whether a door is open by about some angle more probably than by somebody else's belief of it."""
    angle = float(belief.best[0])
    return _share_about(angle, other) < DOUBTED * _share_about(angle, belief)


def _share_about(angle: float, belief: ObjectBelief) -> float:
    """Probability that a door is open by about an angle, rad."""
    near = np.abs(wrap(belief.states[:, 0] - angle)) <= SETTLED_ANGLE
    return float(belief.weights.values[near].sum())


@dataclass(frozen=True, eq=False)
class _Leaf:
    """A hinged leaf from above, as the loops take it."""

    axes: FloatArray  # (2, 2) unit vectors along and across, as columns; in the link's frame
    turns: FloatArray  # (3, 2, 2) in the building: a part of them, what the sine of the angle adds, and the cosine
    sides: FloatArray  # (4,) m along, where it begins and ends, and across
    reach: float  # m, of its farthest corner from the hinge
    hinge: FloatArray  # (2,) m of the floor
    outwards: FloatArray  # (2, 2) halfway between its limits, along from the hinge and across
    half: float  # rad, by which it turns from there to both sides

    @property
    def length(self) -> float:
        """m along."""
        return float(self.sides[FAR] - self.sides[NEAR])

    @staticmethod
    @lru_cache(maxsize=LEAVES_KEPT)
    def of(item: MovableObject) -> _Leaf:
        plan = item.mesh.vertices[:, :2]
        axes = np.column_stack(leaf_axes(item)[::-1])
        lower, upper = (plan @ axes).min(axis=0), (plan @ axes).max(axis=0)
        middle = (item.lower + item.upper) / 2.0
        halfway, *quarters = item.transforms(np.array([[middle], [0.0], [np.pi / 2.0], [np.pi]]))
        closed, aside, opposite = (each[:2, :2] @ axes for each in quarters)
        still = (closed + opposite) / 2.0  # a turn is linear in the sine and cosine of its angle
        away = np.array([math.copysign(1.0, lower[0] + upper[0]), 1.0])
        return _Leaf(
            axes=axes,
            turns=np.array([still, aside - still, closed - still]),
            sides=np.array([lower[0], upper[0], lower[1], upper[1]]),
            reach=float(np.hypot(plan[:, 0], plan[:, 1]).max()),
            hinge=halfway[:2, 3].copy(),
            outwards=halfway[:2, :2] @ (away * axes),
            half=(item.upper - item.lower) / 2.0,
        )


def _rehung(item: MovableObject, hanging: Hanging) -> ObjectBelief:
    """What is believed of a door, hung where it seems to be if it is elsewhere."""
    return replace(hanging.belief, item=item.hung_at(item.hinge + hanging.offset))


def _unexplained(looks: list[_Strangeness]) -> int:
    """How many beams something else than a door's leaf stopped, or the leaf should have stopped."""
    return sum(each.strange + each.passed for each in looks)


def _lasting_std(glances: list[_Glance]) -> float:
    """m by which all glances together may be off: the robot's error is another in each, the walls' isn't."""
    robot = float(np.median([glance.robot_std for glance in glances]))
    return math.hypot(robot / math.sqrt(len(glances)), glances[-1].map_error)


def _passes(scan: Scan, pose: FloatArray, place: FloatArray, distance: float) -> BoolArray:
    """Which beams (n,) come within a distance of a place (2,), m."""
    directions, _ = scan.rays.courses
    x, y = (between(pose, np.array([*place, 0.0]))[:2] - scan.rays.origins[:, :2]).T
    along = x * directions[:, 0] + y * directions[:, 1]
    aside = x * directions[:, 1] - y * directions[:, 0]
    return np.asarray((np.abs(aside) <= distance) & (along >= -distance))
