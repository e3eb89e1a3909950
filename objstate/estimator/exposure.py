"""The part of a scan that shows one object, while the pose is known to centimetres."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from objstate.estimator.sight import Sight
from objstate.geometry import BoolArray, FloatArray, IntArray
from objstate.lazy import Later
from objstate.localization import Carried, Vantage, WallErrors
from objstate.objects import ObjectBelief
from objstate.records import NANOSECONDS, Scan
from objstate.sensing.surfaces import Surfaces

if TYPE_CHECKING:
    from objstate.localization import pose_update
    from objstate.objects import mixture_kernels as kernels
    from objstate.sensing.sweeps import Scenery
else:
    pose_update = Later("objstate.localization.pose_update")
    kernels = Later("objstate.objects.mixture_kernels")

ROUGH = 0.01  # m; standard deviation of the roughness of walls behind objects


@dataclass(frozen=True, eq=False)
class Exposure:
    """A scan and the ranges of its beams (n,) without one object."""

    name: str
    sight: Sight
    vantage: Vantage
    carry: Callable[[str, Vantage], Carried]
    walls: FloatArray  # (n,) m
    background: FloatArray  # (n,) m, to the walls and all other objects whose state is certain
    blur: FloatArray  # (n,) m^2, its variance
    normals: FloatArray  # (n, 2) of those walls, 0 where there is none
    others: FloatArray  # (n,) 1/m, density of the ranges to other objects whose state isn't known
    errors: WallErrors

    @property
    def scan(self) -> Scan:
        """The scan."""
        return self.sight.scan

    def seconds_since(self, stamp_ns: int | None) -> float:
        """s from a stamp to the scan; 0 from none."""
        past = 0 if stamp_ns is None else self.scan.stamp_ns - stamp_ns
        return max(past / NANOSECONDS, 0.0)

    def carried(self) -> Carried:
        """How the robot's error carried over since the object's last scan; to be called once."""
        return self.carry(self.name, self.vantage)

    @property
    def entered(self) -> FloatArray:
        """(n,) m at which beams enter the circle that holds the object; inf where they miss it."""
        return self.sight.entered(self.name)

    @property
    def stopped(self) -> FloatArray:
        """(k, 2) m, ends of beams that something stopped before the background."""
        sight = self.sight
        short = sight.view(sight.valid).stopped_short(
            sight.robot.mean, self.background[sight.valid]
        )
        return np.ascontiguousarray(short[:, :2])

    def beams(self, chosen: IntArray | BoolArray) -> kernels.Beams:
        """Some of the beams, as the compiled loops take them."""
        vantage = self.vantage
        meets_wall = self.background[chosen] == self.walls[chosen]
        return kernels.Beams(
            vantage.place,
            vantage.origins[chosen],
            vantage.directions[chosen],
            self.scan.ranges[chosen] - vantage.bias,
            self.background[chosen],
            self.blur[chosen],
            np.where(meets_wall[:, None], self.normals[chosen], 0.0),
            self.others[chosen],
        )


class Seen(NamedTuple):
    """An object's belief after a scan."""

    belief: ObjectBelief
    exposure: Exposure
    beams: IntArray  # (k,) indices of those that may meet it
    is_observed: bool  # whether some of them reached it


class Others(NamedTuple):
    """The objects in range whose state isn't certain."""

    names: Sequence[str]
    scenery: Scenery  # the same in states of their beliefs
    entries: FloatArray  # (j, n) m at which beams enter the circles that hold them


class Exposures:
    """The exposures of a scan; walls are cast once for all objects.

    Objects whose state is certain are expected at ranges ``known`` (n,) m, ``others`` in states of
    their beliefs. ``errors`` are those of walls. ``carry`` gives how the robot's error carried over
    since an object was seen last.
    """

    def __init__(
        self,
        sight: Sight,
        vantage: Vantage,
        surfaces: Surfaces,
        known: Mapping[str, FloatArray],
        others: Others,
        errors: WallErrors,
        carry: Callable[[str, Vantage], Carried],
    ) -> None:
        self._sight, self._vantage, self._known, self._carry = sight, vantage, known, carry
        self._errors, reach = errors, sight.scan.range_max
        self._walls, of_walls, numbers = errors.meet(
            surfaces, vantage.origins, vantage.directions, reach
        )
        of_pose = float(vantage.covariance[0, 0] + vantage.covariance[1, 1])
        squares = np.where(numbers >= 0, self._walls, 0.0) ** 2
        slanted = vantage.noise.slant * squares * surfaces.slopes(numbers, vantage.directions)
        self._variance = of_walls + of_pose + ROUGH**2 + slanted
        self._normals, meets = np.zeros((len(numbers), 2)), numbers >= 0
        self._normals[meets] = surfaces.normals[numbers[meets]]
        self._others, noise = others, vantage.noise
        self._measured = sight.scan.ranges - vantage.bias
        self._densities = np.empty((len(others.names), len(squares)))  # of each other object
        pose_update.expect_each(
            others.scenery,
            others.entries,
            vantage.origins,
            vantage.directions,
            self._measured,
            self._walls,
            noise.variance,
            noise.growth,
            of_pose + ROUGH**2,
            self._densities,
        )

    def of(self, name: str, unless: Collection[str] = ()) -> Exposure:
        """The exposure of one object, before all certain ones ``unless`` they are named."""
        left_out = {name, *unless}
        known = [ranges for other, ranges in self._known.items() if other not in left_out]
        background = np.minimum.reduce([self._walls, *known])
        among = [k for k, other in enumerate(self._others.names) if other not in left_out]
        entered = self._others.entries[among].min(axis=0, initial=np.inf)
        anywhere = np.where(self._measured > entered, pose_update.STANDING, 0.0)
        others = self._densities[among].sum(axis=0) + anywhere
        blur = np.where(np.isfinite(background), self._variance, 0.0)
        return Exposure(
            name,
            self._sight,
            self._vantage,
            self._carry,
            self._walls,
            background,
            blur,
            self._normals,
            others,
            self._errors,
        )
