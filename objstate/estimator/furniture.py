"""Updates of furniture by scans."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import FurnitureSettings, Settings
from objstate.estimator.doors import beam_noise
from objstate.estimator.exposure import Exposure, Seen
from objstate.geometry import BoolArray, FloatArray
from objstate.lazy import Later
from objstate.localization import Vantage
from objstate.objects import ObjectBelief
from objstate.objects.furniture_mixture import PROPOSED, FurnitureMixture, Piece, traced
from objstate.objects.proposals import TracedOutline
from objstate.particles import Weights, systematic

if TYPE_CHECKING:
    from objstate.objects import furniture_kernels
    from objstate.objects import mixture_kernels as kernels
else:
    furniture_kernels = Later("objstate.objects.furniture_kernels")
    kernels = Later("objstate.objects.mixture_kernels")

TRIED = 400  # states that are tried, of which some are proposed
FEWEST = 3  # least number of ends of beams that may show an object
ON_OBJECT = 0.1  # m from a certain object within which a beam counts as stopped by it


class Furniture:
    """The furniture of a building that a level laser sees."""

    def __init__(self, building: Building, settings: Settings) -> None:
        self._beam_model = settings.beam_model
        self._pieces: dict[str, Piece] = {}
        for name, item in building.objects.items():
            if item.kind is Kind.PLANAR:
                chosen = settings.for_object(name, "furniture")
                assert isinstance(chosen, FurnitureSettings)
                self._pieces[name] = Piece(item, chosen)
        self._shapes: dict[tuple[str, float], tuple[kernels.Shape, TracedOutline | None]] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._pieces

    def observe(self, belief: ObjectBelief, exposure: Exposure, rng: np.random.Generator) -> Seen:
        """Its belief after a scan, and whether some beam reached it."""
        piece, scan, vantage = self._pieces[exposure.name], exposure.scan, exposure.vantage
        before, now = belief.joint, scan.stamp_ns
        if not isinstance(before, FurnitureMixture):
            known = belief.stamp_ns is not None
            before = (
                FurnitureMixture.of(piece, belief) if known else FurnitureMixture.unknown(piece)
            )
        seconds = exposure.seconds_since(before.stamp_ns)
        mixture = before.later(seconds, *exposure.carried(), vantage.covariance)
        shape, outline = self._shape(exposure.name, exposure.sight.height)
        if outline is not None:
            stopped = exposure.stopped
            if belief.is_certain:
                stopped = stopped[~outline.holds(belief.mean[None], stopped, ON_OBJECT)[0]]
            proposed = _through(stopped, outline, mixture, rng)
            mixture = mixture.proposing(proposed, vantage.covariance)
        until = np.minimum(exposure.background, scan.range_max)
        beams = np.flatnonzero(_meeting(mixture, vantage, until) & scan.valid)
        if len(beams) == 0:
            return Seen(mixture.at(now).sampled(belief), beams, is_observed=False)
        noise = beam_noise(self._beam_model, vantage, scan.range_max)
        mixture, reached = mixture.given(exposure.beams(beams), noise, shape)
        return Seen(mixture.at(now).sampled(belief), beams, reached > 0)

    def _shape(self, name: str, height: float) -> tuple[kernels.Shape, TracedOutline | None]:
        key = name, height
        if key not in self._shapes:
            piece = self._pieces[name]
            self._shapes[key] = piece.shape(height), traced(piece.item, height)
        return self._shapes[key]


def _meeting(mixture: FurnitureMixture, vantage: Vantage, until: FloatArray) -> BoolArray:
    """Which beams (n,) enter the circle of some component before ranges (n,) m."""
    out = np.empty(len(until), dtype=bool)
    furniture_kernels.meeting(mixture.circles(), vantage.origins, vantage.directions, until, out)
    return out


def _through(
    stopped: FloatArray,
    outline: TracedOutline,
    mixture: FurnitureMixture,
    rng: np.random.Generator,
) -> FloatArray:
    """At most ``PROPOSED`` states (p, 3) whose outline passes through ends of beams (k, 2)."""
    if len(stopped) < FEWEST:
        return np.empty((0, 3))
    states, explained = outline.states_through(stopped, TRIED, rng)
    if len(states) == 0:
        return states
    able = mixture.density(states) * np.exp(explained - explained.max())
    if not able.sum() > 0.0:
        return np.empty((0, 3))
    return states[np.unique(systematic(Weights.of(able), PROPOSED, rng))]
