"""Verification tasks in a laser's own terms, and light checks (III-D, E of Elfring et al. 2012).

An object is believed to be somewhere. Only a few beams can meet it, within certain ranges: the
region of interest. Their readings are compared under three hypotheses: the object is there, as
believed; it is near by; or it isn't there. That takes microseconds, so that many objects can be
checked many times a second.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from objstate.building import outline
from objstate.building.model import Building, Kind, MovableObject
from objstate.config import FurnitureSettings, Settings
from objstate.errors import QueryError, SettingsError
from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later
from objstate.maintenance.answers import Falsification
from objstate.maintenance.tasks import Outcome
from objstate.objects import ObjectBelief
from objstate.particles import Weights, evenly, quantiles
from objstate.records import Rays

if TYPE_CHECKING:
    from objstate.maintenance import check_kernels
else:
    check_kernels = Later("objstate.maintenance.check_kernels")

REGION = 0.95  # of the belief lies in the region of interest
COMB = 7  # states of a door that stand for its belief
SPREAD = 1.3  # deviations of furniture's belief at which states stand for it, besides its mean
NEAR_STATES = 16  # states elsewhere between a door's limits
NEAR_PLACES = 32  # places elsewhere about furniture
NEAR_SPREAD = 2.0  # pushes (``nudge_m``, ``nudge_deg``) from its place that these reach
LEVEL = 1e-3  # by which directions and origins of a level laser's beams may differ from one plane
PLASTIC = 1.2207440846057596  # the sequence of low discrepancy in three dimensions (Roberts 2018)
WALLS = "the building"
MAJORITY = 0.5  # of the beams that would meet an object, from which on it counts as hidden
NAT = 1.0  # by which another hypothesis must explain the readings better, to be one
TINY = 1e-300
NOWHERE = np.array([[0.0, 0.0, 1.0, 0.0]])  # the placement of what is where its outline says
VERDICTS = (Outcome.CONFIRMED, Outcome.MOVED, Outcome.ABSENT)  # of the hypotheses, in their order


@dataclass(frozen=True)
class Region:
    """The part of a scan that can meet an object."""

    beams: IntArray = field(repr=False)  # (k,) their numbers
    near: float  # m
    far: float  # m


@dataclass(frozen=True)
class Checked:
    """The posterior over three hypotheses about an object after a scan."""

    object: str
    believed: float  # log-likelihood of: it is there, as believed
    elsewhere: float  # it is there, elsewhere near
    absent: float  # it isn't there
    beams: int  # that were used
    bearing: int  # of these, that would meet the object were nothing before it
    hidden_by: Mapping[str, int]  # of these, that were stopped before it, by what; "" is unknown

    @property
    def hidden(self) -> float:
        """Share of the beams towards the object that were stopped before it; 1 without any."""
        return sum(self.hidden_by.values()) / self.bearing if self.bearing else 1.0

    def posterior(self, presence: float, moved: float) -> tuple[float, float, float]:
        """Posterior of the hypotheses, by prior probabilities of presence and of a move."""
        prior = np.array([presence * (1.0 - moved), presence * moved, 1.0 - presence])
        log = np.array([self.believed, self.elsewhere, self.absent])
        weights = prior * np.exp(log - log.max())
        there, near, absent = (weights / weights.sum()).tolist()
        return there, near, absent


@dataclass(frozen=True)
class Verdict:
    """The outcome of a light check."""

    outcome: Outcome
    probability: float  # of that, given the readings; of a hidden object, that it is as believed
    hidden_by: str | None = None  # what stops most of the beams before it; "": something unknown


class LightCheck:
    """Checks one object with one level laser, for constant beliefs.

    Args:
        building: the walls and the objects.
        rays: the laser's beams in the robot's frame.
        range_max: m, of the laser.
        belief: of the object.
        others: beliefs about all objects; certain ones stand before or behind it.
        settings: the estimator's, with its beam model and exponent.
        robot_std: m, of the robot's position, which all beams share.
        robot_yaw_std: rad.

    Raises:
        SettingsError: the laser isn't level.
    """

    def __init__(
        self,
        building: Building,
        rays: Rays,
        range_max: float,
        belief: ObjectBelief,
        others: Mapping[str, ObjectBelief] | None = None,
        settings: Settings | None = None,
        robot_std: float = 0.02,
        robot_yaw_std: float = 0.01,
    ) -> None:
        settings = settings or Settings()
        self.belief = belief
        self._mount, self._bearings = _level(rays)
        self._stds = robot_std, robot_yaw_std
        height, item = float(rays.origins[0, 2]), belief.item
        self._height = height
        self._corners = np.ascontiguousarray(belief.footprint(REGION))
        self._around, self._owners, self._names = _around(
            building, height, belief, others or {}, range_max
        )
        self._outline = outline(item.mesh, height).reshape(-1, 4)
        ends = self._outline.reshape(-1, 2)
        self._radius = float(np.hypot(ends[:, 0], ends[:, 1]).max(initial=0.0))
        believed, (near, blur) = _believed(belief), _elsewhere(belief, settings)
        self._states = states = np.concatenate([believed, near])
        self._placements = _placements(item, states)
        beam = settings.beam_model
        off = float(np.hypot(*(self._corners.mean(axis=0) - _middle(belief)))) + self._radius
        hit = beam.sigma_hit**2 + robot_std**2 + (robot_yaw_std * off) ** 2
        self._variances = np.full(len(states), hit)
        self._variances[len(believed) :] += blur**2
        self._background = hit
        self._hypotheses = np.repeat(np.arange(2), [len(believed), len(near)])
        self._log_weights = -np.log(
            np.repeat([len(believed), len(near)], [len(believed), len(near)])
        )
        shares = np.array([beam.z_hit, beam.z_max, beam.z_short, beam.z_rand])
        hits, missing, short, rand = shares / shares.sum()
        tempering = settings.object_updates.tempering
        self._model = np.array(
            [hits, missing, short, beam.lambda_short, rand, range_max, tempering]
        )

    def region(self, pose: FloatArray) -> Region:
        """The beams of a robot at a pose (3,) that can meet the object, and their ranges."""
        sector = self._sector(self._laser(pose))
        middle, half = (sector[0] + sector[1]) / 2.0, (sector[1] - sector[0]) / 2.0
        turn = (self._bearings - middle + np.pi) % (2.0 * np.pi) - np.pi
        return Region(np.flatnonzero(np.abs(turn) <= half), float(sector[2]), float(sector[3]))

    def __call__(self, ranges: FloatArray, pose: FloatArray) -> Checked:
        """The posterior after the ranges (n,) of a scan from a robot at a pose (3,).

        Raises QueryError for ranges of another number of beams, and for a pose that is none.
        """
        if np.shape(ranges) != self._bearings.shape:
            raise QueryError(
                f"Ranges of shape {np.shape(ranges)} are none of a laser with {len(self._bearings)} "
                "beams; give one for each of the rays that the check was made with."
            )
        laser = self._laser(pose)
        out, hidden = np.empty(3), np.zeros(len(self._names) + 1)
        beams, bearing = check_kernels.check(
            laser,
            self._bearings,
            ranges,
            self._sector(laser),
            self._around,
            self._owners,
            self._outline,
            self._radius,
            self._placements,
            self._variances,
            self._hypotheses,
            self._log_weights,
            self._background,
            self._model,
            out,
            hidden,
        )
        names = (*self._names, "")
        by = {names[k]: int(hidden[k]) for k in np.flatnonzero(hidden).tolist()}
        believed, near, absent = out.tolist()
        return Checked(self.belief.item.name, believed, near, absent, beams, bearing, by)

    def verdict(self, checked: Checked, moved: float) -> Verdict:
        """The outcome, for an object that was moved since it was seen with a probability.

        Hidden is what most beams can't reach, unless another hypothesis explains the readings
        better than what was believed by more than a nat. Nothing is falsified by that.
        """
        presence = self.belief.presence
        chances = dict(zip(VERDICTS, checked.posterior(presence, moved), strict=True))
        better = max(checked.elsewhere, checked.absent) - checked.believed
        if checked.hidden >= MAJORITY and better <= NAT:
            by = max(checked.hidden_by, key=lambda name: checked.hidden_by[name], default=None)
            return Verdict(Outcome.HIDDEN, chances[Outcome.CONFIRMED], by)
        found = max(chances, key=lambda each: chances[each])
        return Verdict(found, chances[found])

    def updated(self, checked: Checked, moved: float) -> ObjectBelief:
        """The belief after a check: a part as before, and the rest spread near by.

        Its presence follows Bayes' rule, so that what is hidden stays as probable as it was.
        """
        belief = self.belief
        there, near, _ = checked.posterior(belief.presence, moved)
        elsewhere = near / (there + near)
        log = belief.weights.values * (1.0 - elsewhere)
        if belief.item.kind is not Kind.PLANAR:
            spread = _spread_over(belief.states[:, 0], self._states[self._hypotheses == 1, 0])
            return belief.with_weights(Weights.of(log + elsewhere * spread))
        states, count = self._states[self._hypotheses == 1], len(log)
        weights = np.concatenate([log, np.full(len(states), elsewhere / len(states))])
        all_states = np.concatenate([belief.states, states])
        kept = evenly(Weights.of(weights), count)
        after = belief.with_samples(all_states[kept], Weights.uniform(count))
        return replace(after, presence=there + near)

    def falsification(self, checked: Checked, moved: float) -> Falsification:
        """Log-likelihood ratio of the object's absence to its presence near by."""
        there = np.logaddexp(
            checked.believed + np.log1p(-moved), checked.elsewhere + np.log(max(moved, TINY))
        )
        return Falsification(checked.object, checked.absent - float(there))

    def probability_hidden(self, pose: FloatArray, others: Mapping[str, ObjectBelief]) -> float:
        """Probability that a beam to the object is stopped before it by walls and other objects.

        The mean over the beams from a robot at ``pose`` (3,) that would meet it, others
        independent of each other; 1 if no beam would.
        """
        laser, chosen = self._laser(pose), self.region(pose).beams
        bearings = self._bearings[chosen]
        alone = self._ranges(laser, bearings, self._outline, self._placements[:1])[0]
        walls = self._around[self._owners == 0]
        free = (self._ranges(laser, bearings, walls, NOWHERE)[0] >= alone).astype(float)
        for name, other in others.items():
            if name != self.belief.item.name:
                comb = other.states[evenly(other.weights, COMB)]
                shape = outline(other.item.mesh, self._height).reshape(-1, 4)
                ranges = self._ranges(laser, bearings, shape, _placements(other.item, comb))
                free *= 1.0 - other.presence * (ranges < alone).mean(axis=0)
        bears = np.isfinite(alone)
        return 1.0 - float(free[bears].mean()) if bears.any() else 1.0

    @staticmethod
    def _ranges(
        laser: FloatArray, bearings: FloatArray, shape: FloatArray, placements: FloatArray
    ) -> FloatArray:
        """(s, n) m, what beams read of a shape (k, 4) alone, in each placement (s, 4)."""
        out = np.empty((len(placements), len(bearings)))
        check_kernels.ranges_of(laser, bearings, shape, placements, out)
        return out

    def _laser(self, pose: FloatArray) -> FloatArray:
        """(4,) as the loops take it. Raises QueryError."""
        x, y, yaw = pose.tolist()
        if not math.isfinite(x + y + yaw):
            raise QueryError(f"The pose ({x}, {y}, {yaw}) must be finite; give x m, y m, yaw rad.")
        cos, sin = math.cos(yaw), math.sin(yaw)
        ahead, left = self._mount
        return np.array([x + cos * ahead - sin * left, y + sin * ahead + cos * left, cos, sin])

    def _sector(self, laser: FloatArray) -> FloatArray:
        out = np.empty(4)
        check_kernels.sector(laser, self._corners, *self._stds, out)
        return out


def _level(rays: Rays) -> tuple[tuple[float, float], FloatArray]:
    """The place, m, of a level laser, and the bearings (n,) of its beams on the robot."""
    is_level = np.abs(rays.directions[:, 2]).max() <= LEVEL
    if not is_level or np.ptp(rays.origins, axis=0).max() > LEVEL:
        raise SettingsError(
            "Light checks need a laser whose beams lie in one level plane and leave from one point."
        )
    x, y = rays.origins[0, :2].tolist()
    return (x, y), np.arctan2(rays.directions[:, 1], rays.directions[:, 0])


def _middle(belief: ObjectBelief) -> FloatArray:
    """(2,) the origin of the object's frame in its believed state."""
    return np.asarray(belief.item.transforms(belief.mean[None])[0, :2, 3])


def _around(
    building: Building,
    height: float,
    belief: ObjectBelief,
    others: Mapping[str, ObjectBelief],
    range_max: float,
) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
    """Segments (m, 4) of walls and certain objects in reach, their owners (m,), and names."""
    names, parts = [WALLS], [outline(building.walls, height)]
    for name, other in others.items():
        if name != belief.item.name and other.is_certain:
            names.append(name)
            place = other.item.transforms(other.mean[None])[0]
            parts.append(outline(other.item.mesh, height, place))
    owners = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    segments = np.concatenate(parts)
    start, along = segments[:, 0] - _middle(belief), segments[:, 1] - segments[:, 0]
    share = -(start * along).sum(axis=1) / (along**2).sum(axis=1)
    nearest = start + share.clip(0.0, 1.0)[:, None] * along
    within = np.hypot(*nearest.T) <= range_max
    return segments[within].reshape(-1, 4), owners[within], tuple(names)


def _believed(belief: ObjectBelief) -> FloatArray:
    """States (s, d) that stand for a belief, the most central first."""
    if belief.item.kind is Kind.PLANAR:
        steps = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
        return np.asarray(belief.mean + SPREAD * belief.std * steps)
    shares = (np.arange(COMB) + 0.5) / COMB
    comb = quantiles(belief.states[:, 0], belief.weights.values, shares)
    return np.asarray(comb[np.argsort(np.abs(shares - 0.5), kind="stable")][:, None])


def _elsewhere(belief: ObjectBelief, settings: Settings) -> tuple[FloatArray, float]:
    """States (s, d) of the object near by, and their spacing, m."""
    item, std = belief.item, belief.std
    if item.kind is not Kind.PLANAR:
        states = np.linspace(item.lower, item.upper, NEAR_STATES, endpoint=not item.wraps)
        step = float(states[1] - states[0])
        off = np.abs(states - belief.mean[0])
        widest = (item.upper - item.lower) / 4.0  # some state is always farther off
        states = states[off > min(max(step / 2.0, 2.0 * float(std[0])), widest)]
        width = 1.0 if item.kind is Kind.SLIDING else _leaf(item) / 2.0
        return states[:, None], step / 4.0 * width
    own = settings.for_object(item.name, "furniture")
    assert isinstance(own, FurnitureSettings)  # furniture has no others
    reach = NEAR_SPREAD * np.array([own.nudge_m, own.nudge_m, math.radians(own.nudge_deg)])
    steps = PLASTIC ** -np.arange(1.0, 4.0)
    unit = 2.0 * ((0.5 + np.arange(1.0, NEAR_PLACES + 1)[:, None] * steps) % 1.0) - 1.0
    states = belief.mean + unit * (reach + 2.0 * std)
    spacing = 2.0 * float(reach[0]) / NEAR_PLACES ** (1.0 / 3.0)
    return states, spacing / 4.0


def _spread_over(states: FloatArray, chosen: FloatArray) -> FloatArray:
    """(n,) normalized weights, spread evenly over the states nearest to the chosen."""
    step = float(np.diff(chosen).min(initial=np.inf)) if len(chosen) > 1 else np.inf
    weights = (np.abs(states[:, None] - chosen).min(axis=1) <= step / 2.0).astype(float)
    return np.asarray(weights / weights.sum())


def _leaf(item: MovableObject) -> float:
    """m from the hinge to the leaf's outer edge."""
    plan = item.mesh.vertices[:, :2]
    return float(np.hypot(plan[:, 0], plan[:, 1]).max())


def _placements(item: MovableObject, states: FloatArray) -> FloatArray:
    """(s, 4) x, y, cosine and sine of the object's frame in each state (s, d)."""
    moved = item.transforms(states)
    return np.column_stack([moved[:, :2, 3], moved[:, 0, 0], moved[:, 1, 0]])
