"""What scans say of doors: each door's posterior, from where the robot is believed to stand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import BeamModelSettings, DoorSettings, Settings
from objstate.estimator.exposure import Exposure, Seen
from objstate.geometry import FloatArray
from objstate.lazy import Later, altered
from objstate.localization import Vantage
from objstate.objects import ObjectBelief
from objstate.objects.mixture import NEVER, DoorMixture, Doorway, Statics
from objstate.objects.shape import shape_of
from objstate.particles import Weights
from objstate.sensing import Sensing

if TYPE_CHECKING:
    from objstate.objects import mixture_kernels as kernels
else:
    kernels = Later("objstate.objects.mixture_kernels")

ELSEWHERE_SIGMAS = 3.0  # by which a hinge surely is off its place
ELSEWHERE_M = 0.03  # m, and by as much at least
OUTLIERS = 0.01  # share of doors whose hinge or bearing is off as far as may be
NEGLIGIBLE = 5e-3  # probability of a deviation under which no door is read off
PARTS = 3  # of the deviations of bearings, under which doors are read off by turns
WIDEST_M, WIDEST_DEG = 0.03, 3.0  # deviations of hinges and bearings that doors are filtered with
GRID, LEAST = 15, 0.1  # deviations tried, from this share of the first guess on
FACTOR = 1.0  # standard deviation of the logarithm of a deviation, before any scan
EDGE_SHARE = 0.1  # of the beams beside an edge, that the surface next to it stops
LEAST_DENSITY = 1e-9  # 1/m, of a range that nothing explains


class Doors:
    """The doors of a building that move in the plane, and what is learnt of all of them."""

    def __init__(self, building: Building, settings: Settings, sensing: Sensing) -> None:
        self._building, self._settings, self._sensing = building, settings, sensing
        self._shapes: dict[tuple[str, float], kernels.Shape] = {}
        error = settings.building_error
        self._hinge = Deviation(error.hinge_std_m, WIDEST_M, 1)
        self._bearing = Deviation(
            math.radians(error.bearing_std_deg), math.radians(WIDEST_DEG), PARTS
        )

    def __contains__(self, name: str) -> bool:
        return self._building.objects[name].kind is not Kind.PLANAR

    @property
    def statics(self) -> Statics:
        """By how much hinges and bearings are off, by the doors seen so far."""
        return Statics(self._hinge.variance, self._bearing.variance)

    @property
    def _widest(self) -> Statics:
        """By how much they may be off at most; doors are filtered with it, and read off with what is learnt."""
        return Statics(self._hinge.variances[-1], self._bearing.variances[-1])

    def observe(
        self, belief: ObjectBelief, exposure: Exposure, rng: np.random.Generator
    ) -> Seen | None:
        """A door's belief after a scan, and whether some beam reached its leaf.

        None where no beam enters the circle that holds the door before it meets a wall.
        """
        scan, vantage = exposure.scan, exposure.vantage
        until = np.minimum(exposure.walls, scan.range_max)
        beams = np.flatnonzero(scan.valid & (exposure.entered < until))
        if len(beams) == 0:
            return None
        before = belief.joint
        if not isinstance(before, DoorMixture):
            before = DoorMixture.of(self._doorway(belief), belief, self._widest)
        mixture = before.later(exposure.seconds_since(before.stamp_ns), *exposure.carried())
        noise = beam_noise(self._settings.beam_model, vantage, scan.range_max)
        shape = self._shape(before.door, exposure.sight.height)
        mixture, reached = mixture.given(exposure.beams(beams), noise, shape)
        mixture = mixture.at(scan.stamp_ns)
        self._learn(exposure.name, mixture)
        return Seen(self._read_off(mixture, belief), beams, reached > 0)

    def elsewhere(self, belief: ObjectBelief) -> FloatArray | None:
        """(2,) m by which a door's hinge surely is off its place in the model; None where it isn't."""
        if not isinstance(belief.joint, DoorMixture):
            return None
        offset, covariance = belief.joint.hinge
        offset = offset + belief.item.hinge - self._building.objects[belief.item.name].hinge
        away = float(np.hypot(*offset))
        if away < ELSEWHERE_M:
            return None
        std = math.sqrt(float(offset @ covariance @ offset)) / away
        return offset if away > ELSEWHERE_SIGMAS * std else None

    def cases(self, mixture: DoorMixture) -> list[tuple[float, Statics]]:
        """Deviations that a door's hinge and bearing may be off by, with probabilities."""
        name, cases = mixture.door.item.name, [(1.0, self.statics)]
        for error, deviation in self._deviations(mixture.door).items():
            cases = [
                (share * probability, statics._replace(**{error: variance}))
                for share, statics in cases
                for probability, variance in deviation.cases(name)
            ]
        return cases

    def _read_off(self, mixture: DoorMixture, belief: ObjectBelief) -> ObjectBelief:
        """The posterior of a door's state, over how far off its hinge and bearing may be."""
        shares, statics = zip(*self.cases(mixture), strict=True)
        weights, swung = mixture.door.on_lattice(mixture.under(statics), belief)
        swung = np.array(shares) @ (weights * swung)
        weights = np.array(shares) @ weights
        swung = np.minimum(swung / np.maximum(weights, NEVER), 1.0)
        return altered(
            belief,
            weights=Weights(weights),
            swung=swung,
            stamp_ns=mixture.stamp_ns,
            joint=mixture,
        )

    def _deviations(self, door: Doorway) -> dict[str, Deviation]:
        """What is learnt over all doors, and applies to this one."""
        return {"hinge": self._hinge} | ({"bearing": self._bearing} if door.turn else {})

    def _learn(self, name: str, mixture: DoorMixture) -> None:
        """Take in what a door tells of how far hinges and bearings are off."""
        for error, deviation in self._deviations(mixture.door).items():
            deviation.told(name, mixture.log_evidence(error, deviation.variances))

    def _doorway(self, belief: ObjectBelief) -> Doorway:
        chosen = self._settings.for_object(belief.item.name, "door")
        assert isinstance(chosen, DoorSettings)
        return Doorway(belief.item, chosen, self._settings.building_error)

    def _shape(self, door: Doorway, height: float) -> kernels.Shape:
        key = door.item.name, height
        if key not in self._shapes:
            segments = self._sensing.outline(door.item.name, height)
            self._shapes[key] = shape_of(segments, door.turn, door.slide)
        return self._shapes[key]


class Deviation:
    """The deviation of an error that each door has its own of: p(deviation | z) on a grid.

    Each door tells the likelihood of its readings, with its own error summed over. The prior is
    lognormal about a first guess. Some doors are outliers, whose errors are as wide as the widest
    deviation. Doors are read off under the mean of each of so many ``parts`` of the grid.
    """

    def __init__(self, first: float, widest: float, parts: int) -> None:
        deviations = np.geomspace(LEAST * first, max(widest, 2.0 * first), GRID)
        self.variances = deviations**2  # (k,)
        self._parts = np.array_split(np.arange(GRID), parts)
        log_prior = -0.5 * (np.log(deviations / first) / FACTOR) ** 2
        self._log_prior = np.asarray(log_prior)
        self._doors: dict[str, FloatArray] = {}  # (k,) log-likelihood by each
        self._outliers: dict[str, FloatArray] = {}  # (k,) probability that a door is one
        self._weights = _normalized(log_prior)

    @property
    def variance(self) -> float:
        """Square of the posterior mean of the deviation."""
        return float(self._weights @ np.sqrt(self.variances)) ** 2

    def told(self, name: str, log_likelihood: FloatArray) -> None:
        """What all readings of a door tell (k,), up to a constant, in place of what they told before."""
        usual = log_likelihood - log_likelihood[-1] + math.log1p(-OUTLIERS)
        both = np.logaddexp(usual, math.log(OUTLIERS))
        self._doors[name], self._outliers[name] = both, OUTLIERS * np.exp(-both)
        self._weights = _normalized(self._log_prior + sum(self._doors.values()))

    def cases(self, name: str) -> list[tuple[float, float]]:
        """Variances that a door's own error may have, and their probabilities."""
        outlying = self._outliers.get(name, np.full(GRID, OUTLIERS)) * self._weights
        usual = self._weights - outlying
        cases = [
            (float(usual[part].sum()), float(usual[part] @ self.variances[part]))
            for part in self._parts
        ]
        cases.append((float(outlying.sum()), float(outlying.sum() * self.variances[-1])))
        kept = [(share, total / share) for share, total in cases if share > NEGLIGIBLE]
        every = sum(share for share, _ in kept)
        return [(share / every, variance) for share, variance in kept]


def _normalized(log: FloatArray) -> FloatArray:
    """Weights that sum to one, of their logarithms."""
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
        range_max,
        unexpected,
        1.0 - 1.0 / s.short_run if unexpected > 0.0 else 0.0,
        s.lambda_short,
        s.short_std,
        vantage.independence,
        EDGE_SHARE,
    )
