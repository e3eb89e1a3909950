"""Doors that hang elsewhere than the model says: looks at them are remembered, and held
against other places of the hinge where they are strange.

A look is strange where the leaf's own readings lie aside of it, by a line through them, or
where what stops beams before the walls isn't the leaf. Next to nothing is done while looks
are as they should be.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.config import Settings
from objstate.estimator.sight import Sight
from objstate.geometry import BoolArray, FloatArray, transform, transform_from_pose
from objstate.objects import ObjectBelief, filter_for
from objstate.objects.belief import SETTLED_ANGLE
from objstate.objects.doors import LatticeFilter
from objstate.objects.hanging import Hanging, Look, find_hinge
from objstate.records import Scan
from objstate.sensing import BeamModel, ScanView, Sensing, cast_from

STOPPED = 0.15  # m short of a wall, by which something has stopped a beam
ASIDE = 0.15  # m from the leaf within which a reading may be one of it
BEYOND = 0.05  # m past the leaf's edges, likewise
POINTS = 5  # readings that a look needs at least
SPAN = 0.25  # m along the leaf that they must cover for a line


@dataclass(frozen=True, eq=False)
class Leaf:
    """A hinged leaf from above, along and across, seen from its hinge."""

    along: FloatArray  # (2,) unit vectors in the link's frame
    across: FloatArray  # (2,)
    near: float  # m along, where it begins and ends
    far: float
    sides: tuple[float, float]  # m across
    reach: float  # m, of its farthest corner from the hinge

    @staticmethod
    @lru_cache(maxsize=4096)
    def of(item: MovableObject) -> Leaf:
        plan = item.mesh.vertices[:, :2]
        _, axes = np.linalg.eigh(np.cov(plan.T))
        across, along = plan @ axes[:, 0], plan @ axes[:, 1]
        return Leaf(
            along=axes[:, 1],
            across=axes[:, 0],
            near=float(along.min()),
            far=float(along.max()),
            sides=(float(across.min()), float(across.max())),
            reach=float(np.hypot(plan[:, 0], plan[:, 1]).max()),
        )


@dataclass(frozen=True, eq=False)
class Glance:
    """One scan in which a door was seen, as it is remembered."""

    scan: Scan
    pose: FloatArray  # (3,)
    walls: FloatArray  # (n,) m, expected of all beams
    shift_std: float  # m by which robot and walls may be off
    others: Mapping[str, FloatArray]  # states (d,) of the doors beside it that are known


@dataclass
class Watch:
    """What is remembered of one door, and what has been strange since its hinge was last looked for."""

    glances: list[Glance] = field(default_factory=list)
    spacing: float = 0.0  # m driven between glances
    driven: float = -np.inf  # m, at the last
    count: int = 0  # glances since
    wait: int = 0  # so many are needed before the next search
    stopped: int = 0  # beams
    strange: int = 0  # of them, that the leaf didn't stop
    pull: float = 0.0  # sum of offsets over variances, 1/m
    hold: float = 0.0  # sum of one over variances, 1/m^2

    settled: FloatArray | None = None  # (d,) the state at the last glance, where it was known
    jumped: bool = False  # whether that changed

    def since_now(self, wait: int) -> None:
        self.count = self.stopped = self.strange = 0
        self.jumped = False
        self.wait = wait


class Hinges:
    """Where doors hang, learnt over a log."""

    def __init__(self, building: Building, settings: Settings) -> None:
        self._building = building
        self._settings = settings.hinges
        model = settings.beam_model
        sharp = min(model.sigma_hit, settings.hinges.sigma_hit)
        # what stands behind a leaf is remembered, and need not be cast
        self._sensing = Sensing(
            replace(building, walls=Mesh.empty()),
            BeamModel(model.model_copy(update={"sigma_hit": sharp})),
        )
        self._filters = {
            name: door
            for name, item in building.objects.items()
            if item.kind is Kind.HINGED
            and isinstance(door := filter_for(item, settings), LatticeFilter)
        }
        self._watches = {
            name: Watch(spacing=settings.hinges.every_m, wait=settings.hinges.least_looks)
            for name in self._filters
        }
        self.found: dict[str, Hanging] = {}  # of doors that surely hang elsewhere

    def is_due(self, belief: ObjectBelief, driven: float) -> bool:
        """Whether a door is to be looked at after so many m of driving, or since it has changed."""
        watch = self._watches.get(belief.item.name)
        return watch is not None and (
            driven - watch.driven >= watch.spacing or _has_changed(watch, belief)
        )

    def note(
        self,
        belief: ObjectBelief,
        sight: Sight,
        driven: float,
        map_error: float,
        others: Mapping[str, FloatArray],
    ) -> None:
        """Remember a scan in which a door was seen, and how strange it looked there."""
        watch, s = self._watches[belief.item.name], self._settings
        watch.driven = driven
        watch.jumped |= _has_changed(watch, belief)
        watch.settled = belief.mean if belief.settled else None
        pose = sight.robot.mean
        ends = _stopped(sight.scan, pose, sight.walls)
        hinge = belief.item.origin[:2, 3]
        leaf = Leaf.of(belief.item)
        ends = ends[((ends - hinge) ** 2).sum(axis=1) <= (leaf.reach + s.most_m) ** 2]
        if len(ends) < POINTS:
            return
        shift_std = float(np.hypot(sight.robot.position_std, map_error))
        watch.glances.append(Glance(sight.scan, pose, sight.walls, shift_std, others))
        if len(watch.glances) > s.looks:  # every other one: those of long ago count as well
            watch.glances = watch.glances[1::2]
            watch.spacing *= 2.0
        off, std, strange = _line(belief, leaf, ends, pose)
        watch.count += 1
        watch.stopped += len(ends)
        watch.strange += strange
        if np.isfinite(std):
            variance = std**2 + shift_std**2
            watch.pull += off / variance
            watch.hold += 1.0 / variance

    def seems_off(self, name: str) -> bool:
        """Whether what has been read of a door is worth a search for its hinge."""
        watch, s = self._watches[name], self._settings
        if len(watch.glances) < s.least_looks or (watch.count < watch.wait and not watch.jumped):
            return False
        if watch.jumped:
            return True
        pulled = abs(watch.pull) >= s.doubt_sigmas * np.sqrt(watch.hold) and watch.hold > 0.0
        return pulled or watch.strange >= s.doubt_share * watch.stopped

    def search(self, name: str, sensing: Sensing) -> Hanging | None:
        """Where a door's hinge is, by all that is remembered of it; None where nothing is new."""
        watch = self._watches[name]
        looks = [self._look(name, glance, sensing) for glance in watch.glances]
        hanging = find_hinge(self._filters[name], looks, self._settings)
        watch.since_now(2 * max(watch.count, self._settings.least_looks))
        if watch.jumped: watch.pull = watch.hold = 0.0
        if hanging.elsewhere >= (0.5 if name in self.found else self._settings.sure):
            self.found[name] = hanging
            watch.pull = watch.hold = 0.0
            return hanging
        return self.found.pop(name, None) and hanging

    def _look(self, name: str, glance: Glance, sensing: Sensing) -> Look:
        item, scan = self._building[name], glance.scan
        within = Leaf.of(item).reach + self._settings.most_m
        beams = scan.valid & _passes(scan, glance.pose, item.origin[:2, 3], within)
        background = glance.walls[beams]
        behind = sensing.view(scan, beams)
        for other, state in glance.others.items():
            alone = behind.object(other, state[None], glance.pose[None])[0, 0]
            background = np.minimum(background, alone)
        view: ScanView = self._sensing.view(scan, beams)
        return Look(scan.stamp_ns, view, glance.pose, background, glance.shift_std)

    def std(self, belief: ObjectBelief) -> float:
        """m by which a door may hang aside of where it is taken to, along the normal of its leaf."""
        item = belief.item
        watch = self._watches.get(item.name)
        if watch is None or watch.hold == 0.0:
            return 0.0
        if item.name not in self.found:
            return math.sqrt(max((watch.pull / watch.hold) ** 2 - 1.0 / watch.hold, 0.0))
        turn = item.transforms(belief.mean[None])[0, :2, :2]
        normal = turn @ Leaf.of(item).across
        return float(np.sqrt(normal @ self.found[item.name].covariance @ normal))

    def forget(self) -> None:
        """Forget all looks: the robot wasn't where it thought."""
        for watch in self._watches.values():
            watch.glances = []
            watch.since_now(self._settings.least_looks)


def _has_changed(watch: Watch, belief: ObjectBelief) -> bool:
    """Whether a door that was known isn't what it was."""
    if watch.settled is None:
        return False
    return not belief.settled or abs(float(belief.mean[0] - watch.settled[0])) > SETTLED_ANGLE


def rehung(item: MovableObject, offset: FloatArray) -> MovableObject:
    """A door hung elsewhere by an offset (2,) m."""
    return replace(item, origin=transform(np.eye(3), [*offset, 0.0]) @ item.origin)


def _stopped(scan: Scan, pose: FloatArray, walls: FloatArray) -> FloatArray:
    """Where beams end (k, 2) m that something stopped short of the walls (n,)."""
    short = scan.ranges < walls - STOPPED
    origins, directions = cast_from(transform_from_pose(pose), scan.rays.take(short))
    return np.asarray(origins[:, :2] + directions[:, :2] * scan.ranges[short, None])


def _passes(scan: Scan, pose: FloatArray, place: FloatArray, distance: float) -> BoolArray:
    """Which beams (n,) come within a distance of a place (2,), m."""
    origins, directions = cast_from(transform_from_pose(pose), scan.rays)
    to = place - origins[:, :2]
    level = np.hypot(directions[:, 0], directions[:, 1]).clip(min=1e-9)
    along = (to * directions[:, :2]).sum(axis=1) / level
    aside = np.abs(to[:, 0] * directions[:, 1] - to[:, 1] * directions[:, 0]) / level
    return np.asarray((aside <= distance) & (along >= -distance))


def _line(
    belief: ObjectBelief, leaf: Leaf, ends: FloatArray, pose: FloatArray
) -> tuple[float, float, int]:
    """How far (m, and its deviation) a line through a leaf's readings passes its hinge.

    ``ends`` (k, 2) m are where beams were stopped, by the leaf or not; also how many not. The deviation
    is infinite where too few tell.
    """
    place = belief.item.transforms(belief.best[None])[0]
    own = (ends - place[:2, 3]) @ place[:2, :2]
    eye = (pose[:2] - place[:2, 3]) @ place[:2, :2] @ leaf.across
    side = leaf.sides[1] if eye > sum(leaf.sides) / 2.0 else leaf.sides[0]
    lever, off = own @ leaf.along, own @ leaf.across - side
    on = (np.abs(off) <= ASIDE) & (lever >= leaf.near - BEYOND) & (lever <= leaf.far + BEYOND)
    strange = len(ends) - int(np.count_nonzero(on))
    lever, off = lever[on], off[on]
    if len(lever) < POINTS or np.ptp(lever) < SPAN:
        return 0.0, np.inf, strange
    middle, spread = lever.mean(), lever - lever.mean()
    squares = spread @ spread
    slope = spread @ off / squares
    at_hinge = off.mean() - slope * middle
    rest = off - at_hinge - slope * lever
    variance = (rest @ rest) / (len(rest) - 2) * (1.0 / len(rest) + middle**2 / squares)
    return float(at_hinge), float(np.sqrt(variance)), strange
