"""People who walk, and boxes: obstacles that are not in the model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from objstate.building.model import Mesh
from objstate.geometry import FloatArray, transform, transform_from_pose
from objstate.sensing.casters import Caster, caster_of
from objstate.simulation.route import Motion
from objstate.simulation.scene import Boxes, People, PointXY, Region

SIDES = 24  # of a prism that stands for a cylinder
LEG_RADIUS, LEG_TOP = 0.07, 0.85  # m
BODY_RADIUS, BODY_TOP = 0.22, 1.75  # m
HIPS = 0.1  # m from the middle of a person to a leg
STRIDE = 1.4  # m walked from one step of a leg to its next
SWING = 0.3  # m that a leg swings ahead and back


@dataclass(frozen=True, eq=False)
class Walker:
    """One person: where they want to be over time, and how they look."""

    motion: Motion
    walked: FloatArray  # (n,) m on the way at each time of the motion
    shape: str
    keep_distance: float  # m

    def place(self, time: float, robot: FloatArray) -> FloatArray:
        """(3,) where the person stands; close to the robot they step out of its way."""
        wanted = self.motion.at(time)
        away = wanted[:2] - robot[:2]
        distance = float(np.hypot(*away))
        if distance >= self.keep_distance:
            return wanted
        aside = away / distance if distance > 0 else np.array([0.0, 1.0])
        return np.array([*(robot[:2] + self.keep_distance * aside), wanted[2]])

    def step(self, time: float) -> float:
        """rad, where in their stride the person is."""
        return 2 * np.pi * float(np.interp(time, self.motion.times, self.walked)) / STRIDE


class Crowd:
    """Casts rays at people and boxes."""

    def __init__(self, walkers: list[Walker], boxes: Mesh) -> None:
        self._walkers = walkers
        self._boxes = caster_of(boxes)
        self._leg = caster_of(_cylinder(LEG_RADIUS, 0.0, LEG_TOP))
        self._torso = caster_of(_cylinder(BODY_RADIUS, LEG_TOP, BODY_TOP))
        self._body = caster_of(_cylinder(BODY_RADIUS, 0.0, BODY_TOP))

    def distances(
        self, time: float, robot: FloatArray, origins: FloatArray, directions: FloatArray
    ) -> FloatArray:
        """Distances (n,) m to the nearest, along rays (n, 3) in the building's frame."""
        nearest = self._boxes.distances(origins, directions)
        for walker in self._walkers:
            person = walker.place(time, robot)
            for caster, place in self._limbs(walker, person, time):
                shifted = origins - np.array([*place, 0.0])
                nearest = np.minimum(nearest, caster.distances(shifted, directions))
        return nearest

    def _limbs(
        self, walker: Walker, person: FloatArray, time: float
    ) -> list[tuple[Caster, FloatArray]]:
        if walker.shape == "body":
            return [(self._body, person[:2])]
        ahead = np.array([np.cos(person[2]), np.sin(person[2])])
        left = np.array([-ahead[1], ahead[0]])
        swing = SWING * np.sin(walker.step(time)) * ahead
        return [
            (self._leg, person[:2] + HIPS * left + swing),
            (self._leg, person[:2] - HIPS * left - swing),
            (self._torso, person[:2]),
        ]


def walkers(groups: tuple[People, ...], duration: float, rng: np.random.Generator) -> list[Walker]:
    """All people of a scene, on their ways for ``duration`` s."""
    return [
        _walker(people, _points(people, duration, rng))
        for people in groups
        for _ in range(people.count)
    ]


def boxes_mesh(groups: tuple[Boxes, ...], rng: np.random.Generator) -> Mesh:
    """The boxes of a scene, standing on the floor."""
    placed = [
        _box(boxes.size).moved(transform_from_pose(_box_pose(boxes, rng)))
        for boxes in groups
        for _ in range(boxes.count)
    ]
    return Mesh.joined(placed)


def _points(people: People, duration: float, rng: np.random.Generator) -> list[PointXY]:
    """Corners of a person's way, enough for the whole drive."""
    if people.region is not None:
        points, length = [_within(people.region, rng)], 0.0
        while length < people.speed * duration:
            points.append(_within(people.region, rng))
            length += float(np.hypot(*np.subtract(points[-1], points[-2])))
        return points
    points, back = list(people.route), list(people.route[-2::-1])
    length = float(np.sum(np.hypot(*np.diff(np.array(points), axis=0).T)))
    if not people.loop or length == 0.0:
        return points
    rounds = int(np.ceil(people.speed * duration / length))
    for index in range(rounds):
        points += list(people.route[1:]) if index % 2 else back
    return points


def _walker(people: People, points: list[PointXY]) -> Walker:
    """A person on a way past ``points``; one point alone is a place to stand."""
    corners = np.array(points if len(points) > 1 else points * 2, dtype=float)
    steps = np.diff(corners, axis=0)
    yaws = np.arctan2(steps[:, 1], steps[:, 0])
    passed = np.concatenate([[0.0], np.cumsum(np.hypot(steps[:, 0], steps[:, 1]))])
    # people turn at once: each corner is passed with the old heading, then with the new
    walked = np.repeat(passed, 2)[1:-1]
    track = np.column_stack([np.repeat(corners, 2, axis=0)[1:-1], np.repeat(yaws, 2)])
    motion = Motion(people.start + walked / people.speed, track)
    return Walker(motion, walked, people.shape, people.keep_distance)


def _within(region: Region, rng: np.random.Generator) -> PointXY:
    x_min, y_min, x_max, y_max = region
    return float(rng.uniform(x_min, x_max)), float(rng.uniform(y_min, y_max))


def _box_pose(boxes: Boxes, rng: np.random.Generator) -> FloatArray:
    if boxes.pose is not None:
        return np.array([boxes.pose.x, boxes.pose.y, boxes.pose.yaw])
    assert boxes.region is not None  # the scene's check: a pose or a region
    return np.array([*_within(boxes.region, rng), rng.uniform(-np.pi, np.pi)])


def _box(size: tuple[float, float, float]) -> Mesh:
    """A box on the floor, its middle at the origin."""
    import trimesh

    box = trimesh.creation.box(size)
    upwards = transform(np.eye(3), [0.0, 0.0, size[2] / 2])
    return Mesh(np.asarray(box.vertices), np.asarray(box.faces)).moved(upwards)


def _cylinder(radius: float, bottom: float, top: float) -> Mesh:
    """An upright prism with ``SIDES`` sides about the origin."""
    import trimesh

    cylinder = trimesh.creation.cylinder(radius, height=top - bottom, sections=SIDES)
    upwards = transform(np.eye(3), [0.0, 0.0, (bottom + top) / 2])
    return Mesh(np.asarray(cylinder.vertices), np.asarray(cylinder.faces)).moved(upwards)
