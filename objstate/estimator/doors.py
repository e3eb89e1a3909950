"""Updates of doors by scans, and what is learnt over all doors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Building, Kind, MovableObject
from objstate.config import BeamModelSettings, DoorSettings, Settings
from objstate.estimator.believed import Believed
from objstate.estimator.exposure import Exposure, Exposures, Seen
from objstate.geometry import FloatArray
from objstate.lazy import Later, altered
from objstate.localization import Vantage
from objstate.objects import ObjectBelief
from objstate.objects.doorframe import BearingReading, bearing_by_walls
from objstate.objects.mixture import PACES, DoorMixture, Doorway, Statics
from objstate.objects.shape import shape_of
from objstate.particles import Weights
from objstate.sensing import Sensing

if TYPE_CHECKING:
    from objstate.objects import mixture_kernels as kernels
else:
    kernels = Later("objstate.objects.mixture_kernels")

ELSEWHERE_SIGMAS = 3.0  # standard deviations from which on a hinge counts as off its place
ELSEWHERE_M = 0.03  # m, and at least this distance
OUTLIERS = 0.01  # share of doors whose hinge or bearing has the widest deviation
NEGLIGIBLE = 5e-3  # probability of a deviation below which it is left out
WIDEST_M, WIDEST_DEG = 0.03, 3.0  # deviations of hinges and bearings with which doors are filtered
# number of deviations on the grid, and the smallest in units of the first guess
GRID, LEAST = 15, 0.1
FACTOR = 1.0  # prior standard deviation of the logarithm of a deviation
USUAL_PACE_STD = 1.5  # prior standard deviation of the logarithm of doors' usual pace
PACES_STD = 1.0  # of the logarithm of a door's pace about the usual one
EDGE_SHARE = 0.1  # of the beams beside an edge that meet the other surface; of those of both
LEAST_DENSITY = 1e-9  # 1/m, of a random range


class Doors:
    """The doors of a building that move in the plane, and what is learnt over all of them."""

    def __init__(self, building: Building, settings: Settings, sensing: Sensing) -> None:
        self._building, self._settings, self._sensing = building, settings, sensing
        self._shapes: dict[tuple[str, float], kernels.Shape] = {}
        error = settings.building_error
        self._known = {
            name: Statics(own.hinge_std_m**2, math.radians(own.bearing_std_deg) ** 2)
            for name, own in error.doors.items()
        }
        self._hinge = Deviation(error.hinge_std_m, WIDEST_M)
        self._bearing = Deviation(math.radians(error.bearing_std_deg), math.radians(WIDEST_DEG))
        self._paces = Paces()

    def __contains__(self, name: str) -> bool:
        return self._building.objects[name].kind is not Kind.PLANAR

    @property
    def statics(self) -> Statics:
        """Deviations of hinges and bearings, learnt from the doors seen so far."""
        return Statics(self._hinge.variance, self._bearing.variance)

    def _widest(self, name: str) -> Statics:
        """The prior with which a door is filtered; it is published under narrower ones."""
        widest = Statics(self._hinge.variances[-1], self._bearing.variances[-1])
        return Statics(*map(max, widest, self._known.get(name, widest)))

    def observe(
        self, names: Sequence[str], believed: Believed, exposures: Exposures
    ) -> dict[str, Seen]:
        """The doors' beliefs after a scan, and whether some beam reached each leaf.

        Doors are left out where no beam enters the circle that holds them before it meets a wall.
        """
        seen = {name: self._seen(believed.marginals[name], exposures.of(name)) for name in names}
        return {name: each for name, each in seen.items() if each is not None}

    def _seen(self, belief: ObjectBelief, exposure: Exposure) -> Seen | None:
        scan, vantage = exposure.scan, exposure.vantage
        until = np.minimum(exposure.walls, scan.range_max)
        beams = np.flatnonzero(scan.valid & (exposure.entered < until))
        if len(beams) == 0:
            return None
        before = belief.joint
        if not isinstance(before, DoorMixture):
            door = self._doorway(belief.item, exposure.sight.height)
            before = DoorMixture.of(door, belief, self._widest(belief.item.name))
        before = before.among(self._paces.of(exposure.name))
        posterior = before.later(exposure.seconds_since(before.stamp_ns), *exposure.carried())
        noise = beam_noise(self._settings.beam_model, vantage, scan.range_max)
        shape = self._shape(before.door, exposure.sight.height)
        readings = exposure.beams(beams)
        posterior, reached = posterior.given(scan.laser, readings, noise, shape, scan.stamp_ns)
        self._learn(exposure.name, posterior)
        return Seen(self._read_off(posterior, belief), exposure, beams, reached > 0)

    def elsewhere(self, belief: ObjectBelief) -> FloatArray | None:
        """(2,) m, offset of a door's hinge where it is significant; None elsewhere.

        Of a sliding door, it is that across the rail: along it, an offset is a state.
        """
        if not isinstance(belief.joint, DoorMixture) or belief.presence < 0.5:
            return None
        offset, covariance = belief.joint.hinge
        offset = offset + belief.item.hinge - self._building.objects[belief.item.name].hinge
        slide = belief.joint.door.slide
        offset = offset - (offset @ slide) * slide
        away = float(np.hypot(*offset))
        if away < ELSEWHERE_M:
            return None
        std = math.sqrt(float(offset @ covariance @ offset)) / away
        return offset if away > ELSEWHERE_SIGMAS * std else None

    def cases(self, door: Doorway) -> list[tuple[float, Statics]]:
        """Deviations that a door's hinge and bearing may have, with probabilities."""
        name = door.item.name
        if name in self._known:
            own = self._known[name]
            return [(1.0, own if door.turn else Statics(own.hinge, 0.0))]
        bearings = self._bearing.cases(name) if door.turn else [(1.0, 0.0)]
        return [
            (share * probability, Statics(hinge, bearing))
            for share, hinge in self._hinge.cases(name)
            for probability, bearing in bearings
        ]

    def paces(self, belief: ObjectBelief) -> FloatArray:
        """(k,) probabilities of how often a door is moved, of ``PACES``."""
        by_others = self._paces.of(belief.item.name)
        if not isinstance(belief.joint, DoorMixture):
            return by_others
        return belief.joint.among(by_others).posterior_paces

    def _read_off(self, posterior: DoorMixture, belief: ObjectBelief) -> ObjectBelief:
        """The posterior of a door's state, averaged over the deviations of hinge and bearing."""
        door, presence = posterior.door, 1.0 - posterior.unmet
        shares, statics = zip(*self.cases(door), strict=True)
        each, p_moving = door.on_lattice(posterior.under(statics), belief)
        by_case = np.array(shares)
        weights, p_moving = door.published(by_case @ each, by_case @ (each * p_moving), presence)
        return altered(
            belief,
            weights=Weights(weights),
            p_moving=p_moving,
            presence=presence,
            stamp_ns=posterior.stamp_ns,
            joint=posterior,
        )

    def _learn(self, name: str, posterior: DoorMixture) -> None:
        """Update what is learnt over all doors; not deviations, where the door's are known."""
        log = posterior.log_paces
        relative = log - np.logaddexp.reduce(log + np.log(posterior.paces))
        self._paces.observe(name, _if_met(posterior, relative))
        if name in self._known:
            return
        if posterior.door.turn:
            evidence = posterior.log_evidence("bearing", self._bearing.variances)
            self._bearing.observe(name, _if_met(posterior, evidence))
        evidence = posterior.log_evidence("hinge", self._hinge.variances)
        self._hinge.observe(name, _if_met(posterior, evidence))

    def _doorway(self, item: MovableObject, height: float) -> Doorway:
        chosen = self._settings.for_object(item.name, "door")
        assert isinstance(chosen, DoorSettings)
        error = self._settings.building_error
        return Doorway(item, chosen, error, self._bearing_of(item, height))

    def _bearing_of(self, item: MovableObject, height: float) -> BearingReading | None:
        """The closed bearing of a door by the walls beside it, unless more is known of it."""
        if item.name in self._known or item.kind is not Kind.HINGED:
            return None
        leaf = self._sensing.outline(item.name, height) + np.tile(item.hinge, 2)
        std = self._settings.building_error.wall_std_m
        return bearing_by_walls(item, leaf, self._sensing.walls_at(height), std)

    def _shape(self, door: Doorway, height: float) -> kernels.Shape:
        key = door.item.name, height
        if key not in self._shapes:
            self._shapes[key] = shape_of(
                self._sensing.outline(door.item.name, height),
                door.turn,
                door.slide,
                is_leaf=door.turn != 0.0,
            )
        return self._shapes[key]


class Deviation:
    """The deviation of an error that each door has independently: p(deviation | z) on a grid.

    Each door contributes the likelihood of its readings, with its own error integrated out. The
    prior is lognormal about a first guess. Some doors are outliers, whose errors have the widest
    deviation.
    """

    def __init__(self, first: float, widest: float) -> None:
        deviations = np.geomspace(LEAST * first, max(widest, 2.0 * first), GRID)
        self.variances = deviations**2  # (k,)
        log_prior = -0.5 * (np.log(deviations / first) / FACTOR) ** 2
        self._log_prior = np.asarray(log_prior)
        self._rows: dict[str, int] = {}  # of each door seen so far
        self._logs = np.empty((0, GRID))  # (doors, k) log-likelihood of each deviation
        self._weights = _normalized(log_prior)

    @property
    def variance(self) -> float:
        """Square of the posterior mean of the deviation."""
        return float(self._weights @ np.sqrt(self.variances)) ** 2

    def observe(self, name: str, log_likelihood: FloatArray) -> None:
        """Replace the log-likelihoods (k,), up to a constant, of all readings of a door."""
        usual = log_likelihood - log_likelihood[-1] + math.log1p(-OUTLIERS)
        both = np.logaddexp(usual, math.log(OUTLIERS))
        if name not in self._rows:
            self._rows[name], self._logs = len(self._logs), np.vstack([self._logs, both])
        self._logs[self._rows[name]] = both
        self._weights = _normalized(self._log_prior + self._logs.sum(axis=0))

    def cases(self, name: str) -> list[tuple[float, float]]:
        """Variances that a door's own error may have, and their probabilities."""
        log = self._logs[self._rows[name]] if name in self._rows else np.zeros(GRID)
        outlying = OUTLIERS * np.exp(-log) * self._weights  # the door is an outlier
        usual, widest = self._weights - outlying, float(outlying.sum())
        cases = [
            (1.0 - widest, float(usual @ self.variances)),
            (widest, widest * self.variances[-1]),
        ]
        kept = [(share, total / share) for share, total in cases if share > NEGLIGIBLE]
        every = sum(share for share, _ in kept)
        return [(share / every, variance) for share, variance in kept]


class Paces:
    """How often doors are moved, in units of their settings: p(pace | z) on a grid.

    The paces of a building's doors are distributed about a usual one, which isn't known.
    """

    def __init__(self) -> None:
        logs = np.log(PACES)
        self._about = np.exp(-0.5 * ((logs - logs[:, None]) / PACES_STD) ** 2)  # usual, own
        self._about /= self._about.sum(axis=1, keepdims=True)
        self._log_prior = -0.5 * (logs / USUAL_PACE_STD) ** 2
        self._logs: dict[str, FloatArray] = {}  # (k,) log-likelihoods of the usual pace, by door
        self._log_all = self._log_prior

    def observe(self, name: str, log_likelihood: FloatArray) -> None:
        """Replace the log-likelihoods (k,), up to a constant, of all readings of a door."""
        self._logs[name] = np.log(self._about @ np.exp(log_likelihood - log_likelihood.max()))
        self._log_all = self._log_prior + np.sum(list(self._logs.values()), axis=0)

    def of(self, name: str) -> FloatArray:
        """(k,) prior probabilities of a door's pace, by all other doors."""
        own = self._logs.get(name)
        others = self._log_all if own is None else self._log_all - own
        return np.asarray(_normalized(others) @ self._about)


def _if_met(posterior: DoorMixture, log: FloatArray) -> FloatArray:
    """Log evidence (k,) of a door, given ``log`` (k,) if beams meet its leaf."""
    odds = posterior.log_unmet
    return np.asarray(np.logaddexp(log - np.logaddexp(0.0, odds), -np.logaddexp(0.0, -odds)))


def _normalized(log: FloatArray) -> FloatArray:
    """Normalized weights of logarithms."""
    weights = np.exp(log - log.max())
    return np.asarray(weights / weights.sum())


def beam_noise(s: BeamModelSettings, vantage: Vantage, range_max: float) -> kernels.Noise:
    """The beam model of a laser, as the loops take it."""
    total = s.z_hit + s.z_short + s.z_max + s.z_rand
    hit, short, missing, random = (each / total for each in (s.z_hit, s.z_short, s.z_max, s.z_rand))
    unexpected = short / (hit + short)
    return kernels.Noise(
        hit,
        max(random / range_max, LEAST_DENSITY),
        max(missing, LEAST_DENSITY),
        vantage.noise.variance,
        vantage.noise.growth,
        vantage.noise.slant,
        range_max,
        unexpected,
        1.0 - 1.0 / s.short_run if unexpected > 0.0 else 0.0,
        s.lambda_short,
        s.short_std,
        vantage.independence.both,
        vantage.independence.beams,
        EDGE_SHARE,
    )
