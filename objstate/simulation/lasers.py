"""What the lasers read: rays cast from the moving robot, then the sensor's own faults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Building
from objstate.geometry import FloatArray, between, transform_from_pose
from objstate.records import Rays
from objstate.sensing.expected import ExpectedRanges, cast_from
from objstate.simulation.crowd import Crowd
from objstate.simulation.route import Motion
from objstate.simulation.scene import Laser
from objstate.simulation.states import StateHistory


@dataclass(frozen=True, eq=False)
class Exposure:
    """All that one sweep is exposed to, as it really is."""

    time: float  # s, of the first beam
    robot: FloatArray  # (3,) pose of ``base_link`` then
    rays: Rays  # (n,) as the laser is really mounted
    laser: Laser
    states: Mapping[str, FloatArray]  # (d,) of each object that may be in reach
    unmodelled: FloatArray  # (n,) m to people and boxes, which no model knows


class World:
    """All that a laser can see, as it really is."""

    def __init__(
        self, building: Building, history: Mapping[str, StateHistory], crowd: Crowd
    ) -> None:
        self._expected = ExpectedRanges(building)
        self._history = history
        self._crowd = crowd
        self._radius = {
            name: float(np.linalg.norm(item.mesh.vertices, axis=1).max(initial=0.0))
            for name, item in building.objects.items()
        }

    def near(self, time: float, robot: FloatArray, reach: float) -> dict[str, FloatArray]:
        """States (d,) of the objects that may be partly within ``reach`` m of the robot at (3,)."""
        states = {name: item.at(time) for name, item in self._history.items()}
        return {n: state for n, state in states.items() if self._gap(n, state, robot) < reach}

    def unmodelled(self, time: float, robot: FloatArray, rays: Rays) -> FloatArray:
        """True distances (n,) m to people and boxes along ``rays`` of the robot at (3,)."""
        origins, directions = cast_from(transform_from_pose(robot), rays)
        return self._crowd.distances(time, robot, origins, directions)

    def distances(self, time: float, robot: FloatArray, rays: Rays, reach: float) -> FloatArray:
        """True distances (n,) m along ``rays`` of the robot at (3,).

        Objects that are entirely farther than ``reach`` m from the robot are left out.
        """
        nearest = self._expected.scene(self.near(time, robot, reach), robot[None], rays)[0]
        return np.asarray(np.minimum(nearest, self.unmodelled(time, robot, rays)))

    def _gap(self, name: str, state: FloatArray, robot: FloatArray) -> float:
        """At least so far, in m, is an object from the robot."""
        place = self._history[name].object.transforms(state[None])[0, :2, 3]
        return float(np.hypot(*(place - robot[:2]))) - self._radius[name]


@dataclass(frozen=True, eq=False)
class Scanner:
    """A laser as it is really mounted."""

    settings: Laser
    mount: FloatArray  # (4, 4) on base_link

    def exposure(self, time: float, motion: Motion, world: World) -> Exposure:
        """What the sweep that begins at ``time`` s is exposed to."""
        robot = motion.at(time)
        rays = self._rays(time, robot, motion)
        return Exposure(
            time=time,
            robot=robot,
            rays=rays,
            laser=self.settings,
            states=world.near(time, robot, self._reach(rays)),
            unmodelled=world.unmodelled(time, robot, rays),
        )

    def sweep(self, time: float, motion: Motion, world: World) -> FloatArray:
        """True distances (n,) m of the sweep that begins at ``time`` s."""
        robot = motion.at(time)
        rays = self._rays(time, robot, motion)
        return world.distances(time, robot, rays, self._reach(rays))

    def _reach(self, rays: Rays) -> float:
        """How far from the robot, in m, a reading may come from."""
        return self.settings.range_max + float(np.linalg.norm(rays.origins, axis=1).max())

    def _rays(self, time: float, robot: FloatArray, motion: Motion) -> Rays:
        """Every beam from where the robot is at its time, in ``base_link`` at ``time``."""
        settings = self.settings
        bearings = np.linspace(settings.angle_min, settings.angle_max, settings.beams)
        moments = time + settings.time_increment * np.arange(settings.beams)
        moved = transform_from_pose(between(robot, motion.at(moments))) @ self.mount
        ahead = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(settings.beams)])
        directions = (moved[:, :3, :3] @ ahead[:, :, None])[:, :, 0]
        return Rays(moved[:, :3, 3], directions)


def reading(distances: FloatArray, laser: Laser, rng: np.random.Generator) -> FloatArray:
    """What a laser reports for true distances (n,) m.

    As REP-117 has it, ``+inf`` is no return and ``-inf`` too close.
    """
    count = len(distances)
    noisy = distances + laser.sigma * rng.standard_normal(count)
    missed = (rng.random(count) < laser.no_return_share) | (distances > laser.range_max)
    noisy[missed] = np.inf
    anything = rng.uniform(laser.range_min, laser.range_max, count)
    ranges = np.where(rng.random(count) < laser.false_share, anything, noisy)
    if laser.quantization > 0.0:
        ranges = np.round(ranges / laser.quantization) * laser.quantization
    ranges[ranges > laser.range_max] = np.inf
    ranges[ranges < laser.range_min] = -np.inf
    return ranges
