"""Updates of furniture by scans."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from functools import cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import FurnitureSettings, Settings
from objstate.estimator.believed import Believed
from objstate.estimator.doors import beam_noise
from objstate.estimator.exposure import Exposure, Exposures, Seen
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import Later, altered
from objstate.localization import Vantage
from objstate.objects import ObjectBelief
from objstate.objects.exclusion import alike, compete, exclusive
from objstate.objects.furniture_mixture import (
    PROPOSED,
    About,
    Conditioned,
    FurnitureMixture,
    Piece,
    traced,
)
from objstate.objects.ground import OUTLINE_STD, Floor, bodies, half_height
from objstate.objects.proposals import TracedOutline
from objstate.objects.shape import static_of
from objstate.particles import Weights, systematic
from objstate.sensing import Sensing

if TYPE_CHECKING:
    from objstate.objects import components, repeats
    from objstate.objects import mixture_kernels as kernels
else:
    components = Later("objstate.objects.components")
    kernels = Later("objstate.objects.mixture_kernels")
    repeats = Later("objstate.objects.repeats")

TRIED = 400  # states that are tried, of which some are proposed
APART = 2.0  # m beside a piece, from which on other furniture doesn't matter
AROUND = 1.5  # m beside a piece within which it is remembered what stands there
FEWEST_ENDS = 3  # least number of ends of beams that may show an object
ON_OBJECT = 0.1  # m from a certain object within which a beam counts as stopped by it


class Furniture:
    """The furniture of a building that a level laser sees."""

    def __init__(self, building: Building, settings: Settings, sensing: Sensing) -> None:
        self._beam_model = settings.beam_model
        floor = cache(lambda height: Floor.of(sensing.walls_at(height)))
        self._pieces: dict[str, Piece] = {}
        for name, item in building.objects.items():
            if item.kind is Kind.PLANAR:
                chosen = settings.for_object(name, "furniture")
                assert isinstance(chosen, FurnitureSettings)
                self._pieces[name] = Piece(item, chosen, partial(floor, half_height(item)))
        self._groups = alike(self._pieces)
        self._alike = {
            name: [other for other in group if other != name]
            for group in self._groups
            for name in group
        }
        self._outlines: dict[tuple[str, float], Outline] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._pieces

    def observe(
        self, names: Sequence[str], believed: Believed, exposures: Exposures
    ) -> dict[str, Seen]:
        """The pieces' beliefs after a scan, and whether some beam reached each.

        Those that look alike are updated together: no two stand at one place. So pieces that aren't
        named are, too, if they may stand where a named one does.
        """
        beliefs = believed.marginals
        mixtures, rivals = self._with_rivals(names, beliefs)
        seen, conditioned = dict[str, Seen](), dict[str, Conditioned]()
        for name, before in mixtures.items():
            belief, exposure = beliefs[name], exposures.of(name, unless=rivals[name])
            about = self._about(beliefs, rivals[name], exposure)
            after, beams, reached = self._given(
                belief, before, about, exposure, believed.rngs[name]
            )
            seen[name] = Seen(belief, exposure, beams, reached > 0)
            if isinstance(after, FurnitureMixture):
                mixtures[name] = after
            else:
                conditioned[name] = after
        for group in self._groups:
            own = [name for name in group if name in conditioned]
            together = exclusive([conditioned[name] for name in own])
            mixtures |= zip(own, together, strict=True)
        return {
            name: each._replace(
                belief=mixtures[name].at(each.exposure.scan.stamp_ns).sampled(each.belief)
            )
            for name, each in seen.items()
        }

    def _with_rivals(
        self, names: Sequence[str], beliefs: Mapping[str, ObjectBelief]
    ) -> tuple[dict[str, FurnitureMixture], dict[str, list[str]]]:
        """The mixtures of named pieces and of all their rivals, and the rivals of each."""
        rivals, left, mixtures = dict[str, list[str]](), list(names), dict[str, FurnitureMixture]()
        while left:
            name = left.pop(0)
            for each in (name, *self._alike[name]):
                mixtures.setdefault(each, self._mixture(beliefs[each]))
            rivals[name] = [
                other for other in self._alike[name] if compete(mixtures[name], mixtures[other])
            ]
            left += [other for other in rivals[name] if other not in rivals and other not in left]
        return {name: mixtures[name] for name in rivals}, rivals

    def _about(
        self, beliefs: Mapping[str, ObjectBelief], rivals: Collection[str], exposure: Exposure
    ) -> About:
        """What is about a piece: walls that are off as it is seen among them, and other furniture.

        Not that which looks alike, and competes with it for a place.
        """
        name, walls = exposure.name, exposure.errors
        belief, static = beliefs[name], self._outline(name, exposure.sight.height).static
        places = np.stack([belief.item.home, belief.mean])[:, :2]
        others = [
            (other.item, other.mean, other.presence)
            for each, other in beliefs.items()
            if each in self._pieces
            and each not in (name, *rivals)
            and other.is_certain
            and np.hypot(*(places - other.mean[:2]).T).min() < self._pieces[name].reach + APART
        ]
        of_shift = np.array([1.0, 1.0, 0.0]) * walls.shift_std**2
        std = math.hypot(walls.std, OUTLINE_STD)
        return About(static + of_shift, std, bodies(belief.item, others))

    def _mixture(self, belief: ObjectBelief) -> FurnitureMixture:
        """The mixture of a belief, as of its last scan."""
        if isinstance(belief.joint, FurnitureMixture):
            return belief.joint
        piece = self._pieces[belief.item.name]
        known = belief.stamp_ns is not None
        return FurnitureMixture.of(piece, belief) if known else FurnitureMixture.unknown(piece)

    def _given(
        self,
        belief: ObjectBelief,
        before: FurnitureMixture,
        about: About,
        exposure: Exposure,
        rng: np.random.Generator,
    ) -> tuple[Conditioned | FurnitureMixture, IntArray, int]:
        """A mixture after a scan or, where no beam may meet the piece, only predicted.

        With it, the beams that may meet it, and the number of those that reach its likeliest place.
        """
        scan, vantage = exposure.scan, exposure.vantage
        seconds = exposure.seconds_since(before.stamp_ns)
        outline = self._outline(exposure.name, exposure.sight.height)
        mixture = before.later(seconds, *exposure.carried(), vantage.covariance, about)
        if outline.traced is not None:
            stopped = exposure.stopped
            if belief.is_certain:
                holds = outline.traced.holds(belief.mean[None], stopped, ON_OBJECT)
                stopped = stopped[~holds[0]]
            proposed = _through(stopped, outline.traced, mixture, rng)
            mixture = mixture.proposing(proposed, vantage.covariance)
        until = np.minimum(exposure.background, scan.range_max)
        beams = np.flatnonzero(_entering(mixture.circles(), vantage, until) & scan.valid)
        if len(beams) == 0:
            return mixture, beams, 0
        noise = beam_noise(self._beam_model, vantage, scan.range_max)
        readings = exposure.beams(beams)
        if belief.is_certain and outline.traced is not None:
            mixture, standing = self._standing(belief, mixture, exposure, noise, outline.traced)
            readings = readings._replace(others=readings.others + standing[beams])
        else:
            mixture = altered(mixture, ends={})
        conditioned, reached = mixture.given(readings, noise, outline.shape)
        return conditioned, beams, reached

    def _standing(
        self,
        belief: ObjectBelief,
        mixture: FurnitureMixture,
        exposure: Exposure,
        noise: kernels.Noise,
        outline: TracedOutline,
    ) -> tuple[FurnitureMixture, FloatArray]:
        """The mixture that remembers what a scan shows about a piece that is known to stand there.

        With it (n,) 1/m, densities of the ranges of all beams by what stood beside it before.
        """
        scan, vantage = exposure.scan, exposure.vantage
        x, y, _ = belief.mean
        around = np.array([[x, y, self._pieces[exposure.name].reach + AROUND]])
        near = np.flatnonzero(_entering(around, vantage, np.full(len(scan), np.inf)) & scan.valid)
        out = np.zeros(len(scan))
        if len(near):
            seen = repeats.followed(mixture.ends, scan.laser, exposure.beams(near), noise)
            mixture, ends = altered(mixture, ends=seen), seen[scan.laser]
            explained = outline.holds(belief.mean[None], ends.points, ON_OBJECT)[0]
            out[near] = np.where(explained, 0.0, repeats.standing(ends))
        return mixture, out

    def _outline(self, name: str, height: float) -> Outline:
        key = name, height
        if key not in self._outlines:
            piece = self._pieces[name]
            shape = piece.shape(height)
            self._outlines[key] = Outline(
                shape, static_of(shape, OUTLINE_STD), traced(piece.item, height)
            )
        return self._outlines[key]


class Outline(NamedTuple):
    """A piece of furniture at a laser's height."""

    shape: kernels.Shape
    static: FloatArray  # (3,) variances of x, y, yaw by errors of its parts
    traced: TracedOutline | None


def _entering(circles: FloatArray, vantage: Vantage, until: FloatArray) -> BoolArray:
    """Which beams (n,) enter one of circles (c, 3) before ranges (n,) m."""
    out = np.empty(len(until), dtype=bool)
    components.meeting(circles, vantage.origins, vantage.directions, until, out)
    return out


def _through(
    stopped: FloatArray,
    outline: TracedOutline,
    mixture: FurnitureMixture,
    rng: np.random.Generator,
) -> FloatArray:
    """At most ``PROPOSED`` states (p, 3) whose outline passes through ends of beams (k, 2)."""
    if len(stopped) < FEWEST_ENDS:
        return np.empty((0, 3))
    states, explained = outline.states_through(stopped, TRIED, rng)
    if len(states) == 0:
        return states
    able = mixture.density(states) * np.exp(explained - explained.max())
    if not able.sum() > 0.0:
        return np.empty((0, 3))
    return states[np.unique(systematic(Weights.of(able), PROPOSED, rng))]
