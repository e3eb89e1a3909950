"""What scans say of furniture: each piece's posterior, from where the robot is believed to stand."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import FurnitureSettings, Settings
from objstate.estimator.doors import beam_noise
from objstate.geometry import BoolArray, FloatArray
from objstate.lazy import Later
from objstate.localization import Carried, Vantage
from objstate.objects import ObjectBelief
from objstate.objects.furniture_mixture import PROPOSED, FurnitureMixture, Piece, traced
from objstate.objects.proposals import TracedOutline
from objstate.particles import Weights, systematic
from objstate.records import NANOSECONDS, Scan

if TYPE_CHECKING:
    from objstate.objects import furniture_kernels
    from objstate.objects import mixture_kernels as kernels
else:
    furniture_kernels = Later("objstate.objects.furniture_kernels")
    kernels = Later("objstate.objects.mixture_kernels")

TRIED = 400  # states through readings, of which some are proposed
FEWEST = 3  # ends of beams that may show an object
ON_OBJECT = 0.1  # m from where an object is known to stand, within which it stopped the beam


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

    def observe(
        self,
        name: str,
        belief: ObjectBelief,
        scan: Scan,
        vantage: Vantage,
        background: FloatArray,
        blur: FloatArray,
        stopped: FloatArray,
        carried: Carried,
        rng: np.random.Generator,
    ) -> tuple[ObjectBelief, BoolArray, bool]:
        """Its belief after a scan, the beams (n,) that may meet it, and whether some reached it.

        Without it, beams would read the ``background`` (n,) m, give or take a variance ``blur`` (n,) m^2. Something
        else ``stopped`` beams at places (k, 2) m. The robot's error since the last scan of it is ``carried``.
        """
        piece, now = self._pieces[name], scan.stamp_ns
        before = belief.joint
        if not isinstance(before, FurnitureMixture):
            known = belief.stamp_ns is not None
            before = (
                FurnitureMixture.of(piece, belief) if known else FurnitureMixture.unknown(piece)
            )
        seconds = 0.0 if before.stamp_ns is None else (now - before.stamp_ns) / NANOSECONDS
        mixture = before.later(max(seconds, 0.0), *carried, vantage.covariance)
        shape, outline = self._shape(name, float(scan.rays.origins[0, 2]))
        if outline is not None:
            if belief.settled:
                stopped = stopped[~outline.holds(belief.mean[None], stopped, ON_OBJECT)[0]]
            mixture = mixture.proposing(
                _through(stopped, outline, mixture, rng), vantage.covariance
            )
        beams = _meeting(mixture, vantage, np.minimum(background, scan.range_max)) & scan.valid
        if not beams.any():
            return mixture.at(now).sampled(belief), beams, False
        looked = kernels.Beams(
            vantage.place,
            np.ascontiguousarray(vantage.origins[beams]),
            np.ascontiguousarray(vantage.directions[beams]),
            scan.ranges[beams] - vantage.bias,
            background[beams],
            blur[beams],
        )
        noise = beam_noise(self._beam_model, vantage, scan.range_max)
        mixture, reached = mixture.given(looked, noise, shape)
        return mixture.at(now).sampled(belief), beams, reached > 0

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
    """At most ``PROPOSED`` states (p, 3) in which an outline runs through ends of beams (k, 2)."""
    if len(stopped) < FEWEST:
        return np.empty((0, 3))
    states, explained = outline.states_through(stopped, TRIED, rng)
    if len(states) == 0:
        return states
    able = mixture.density(states) * np.exp(explained - explained.max())
    if not able.sum() > 0.0:
        return np.empty((0, 3))
    return states[np.unique(systematic(Weights.of(able), PROPOSED, rng))]
