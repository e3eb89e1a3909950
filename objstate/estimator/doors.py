"""What scans say of doors: each door's posterior, from where the robot is believed to stand."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from objstate.building.model import Building, Kind
from objstate.config import BeamModelSettings, DoorSettings, Settings
from objstate.geometry import FloatArray, IntArray
from objstate.lazy import Later
from objstate.localization.pose_filter import Vantage
from objstate.objects import ObjectBelief
from objstate.objects.mixture import DoorMixture, Doorway
from objstate.records import NANOSECONDS, Scan
from objstate.sensing import Sensing

if TYPE_CHECKING:
    from objstate.objects import mixture_kernels as kernels
else:
    kernels = Later("objstate.objects.mixture_kernels")

FIRST_DOORS = 4.0  # doors that the first guess of the hinges' deviation counts for
ELSEWHERE_SIGMAS = 3.0  # by which a hinge surely is off its place
ELSEWHERE_M = 0.03  # m, and by as much at least
EDGE_SHARE = 0.1  # of the beams beside an edge, that the surface next to it stops
LEAST_DENSITY = 1e-9  # 1/m, of a range that nothing explains


class Doors:
    """The doors of a building that move in the plane, and what is learnt of all their hinges."""

    def __init__(self, building: Building, settings: Settings) -> None:
        self._error, self._beam_model = settings.building_error, settings.beam_model
        self._doorways: dict[str, Doorway] = {}
        for name, item in building.objects.items():
            if item.kind is not Kind.PLANAR:
                chosen = settings.for_object(name, "door")
                assert isinstance(chosen, DoorSettings)
                self._doorways[name] = Doorway(item, chosen, self._error)
        self._shapes: dict[tuple[str, float], kernels.Shape] = {}
        self._hinges: dict[str, tuple[float, float]] = {}  # squares, m^2, and how much they tell
        self._driven: dict[str, float] = {}  # m, at the last scan that observed it

    def __contains__(self, name: str) -> bool:
        return name in self._doorways

    @property
    def hinge_variance(self) -> float:
        """m^2 in each direction by which hinges are off, by the doors seen so far."""
        squares, told = np.sum(list(self._hinges.values()), axis=0) if self._hinges else (0.0, 0.0)
        first = self._error.hinge_std_m**2
        return float((FIRST_DOORS * first + squares) / (FIRST_DOORS + told))

    def observe(
        self,
        name: str,
        belief: ObjectBelief,
        scan: Scan,
        vantage: Vantage,
        beams: IntArray,
        background: FloatArray,
        blur: FloatArray,
        sensing: Sensing,
        driven_m: float,
    ) -> tuple[ObjectBelief, bool]:
        """A door's belief after a scan, and whether some beam reached its leaf.

        The ``beams`` (k,) may meet the leaf; without it they would read the ``background`` (k,) m,
        give or take a variance ``blur`` (k,) m^2. The robot has driven ``driven_m`` so far.
        """
        door = self._doorways[name]
        before = belief.joint or DoorMixture.of(door, belief, self.hinge_variance)
        seconds = (
            0.0 if before.stamp_ns is None else (scan.stamp_ns - before.stamp_ns) / NANOSECONDS
        )
        way = driven_m - self._driven.get(name, -math.inf)
        self._driven[name] = driven_m
        kept = math.exp(-way / self._error.robot_length_m)
        mixture = before.later(max(seconds, 0.0), kept, vantage.covariance)
        looked = kernels.Beams(
            vantage.place,
            vantage.origins[beams],
            vantage.directions[beams],
            scan.ranges[beams],
            background,
            blur,
        )
        height = float(scan.rays.origins[0, 2])
        noise = _noise(self._beam_model, vantage, scan.range_max)
        mixture, reached = mixture.given(looked, noise, self._shape(name, height, sensing))
        mixture = mixture.at(scan.stamp_ns)
        self._learn(name, mixture)
        return mixture.on_lattice(belief), reached > 0

    def elsewhere(self, belief: ObjectBelief) -> FloatArray | None:
        """(2,) m by which a door's hinge surely is off its place in the model; None where it isn't."""
        if belief.joint is None:
            return None
        offset, covariance = belief.joint.hinge
        away = float(np.hypot(*offset))
        if away < ELSEWHERE_M:
            return None
        std = math.sqrt(float(offset @ covariance @ offset)) / away
        return offset if away > ELSEWHERE_SIGMAS * std else None

    def _learn(self, name: str, mixture: DoorMixture) -> None:
        """Take in how far a hinge is off, by as much as is known of it."""
        mean, covariance = mixture.hinge
        prior = self._error.hinge_std_m**2
        told = np.maximum(1.0 - np.diag(covariance) / max(prior, self.hinge_variance), 0.0)
        squares = float(told @ (mean**2 + np.diag(covariance))) / 2.0
        self._hinges[name] = squares, float(told.sum()) / 2.0

    def _shape(self, name: str, height: float, sensing: Sensing) -> kernels.Shape:
        key = name, height
        if key not in self._shapes:
            door, segments = self._doorways[name], sensing.outline(name, height)
            along = segments[:, 2:] - segments[:, :2]
            lengths = np.hypot(along[:, 0], along[:, 1])
            segments, along = segments[lengths > 0.0], along[lengths > 0.0]
            normals = np.column_stack([-along[:, 1], along[:, 0]]) / lengths[lengths > 0.0, None]
            self._shapes[key] = kernels.Shape(
                np.ascontiguousarray(segments), np.ascontiguousarray(normals), door.turn, door.slide
            )
        return self._shapes[key]


def _noise(s: BeamModelSettings, vantage: Vantage, range_max: float) -> kernels.Noise:
    """The beam model of a laser, as the loops take it."""
    total = s.z_hit + s.z_short + s.z_max + s.z_rand
    hit, short, missing, random = (each / total for each in (s.z_hit, s.z_short, s.z_max, s.z_rand))
    unexpected = short / (hit + short)
    return kernels.Noise(
        hit,
        max(random / range_max, LEAST_DENSITY),
        max(missing, LEAST_DENSITY),
        vantage.variance,
        range_max,
        unexpected,
        1.0 - 1.0 / s.short_run if unexpected > 0.0 else 0.0,
        s.lambda_short,
        s.short_std,
        vantage.independence,
        EDGE_SHARE,
    )
