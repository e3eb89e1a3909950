"""A scene: what a simulated drive is made of, as a small YAML file.

SI units and radians; times in seconds from the start of the drive. Every setting has
a default that serves.
"""

from __future__ import annotations

import os
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field, field_validator, model_validator

from objstate.config import (
    Angle,
    NonNegative,
    NonNegativeAngle,
    Positive,
    Share,
    Strict,
    load_yaml,
    parse_strict,
)
from objstate.kinds import SCENE

PointXY = tuple[float, float]
Region = tuple[float, float, float, float]  # x_min, y_min, x_max, y_max

# of people, boxes, samples or beams, and a second: what is more is a slip of the pen, and takes all
# memory
MOST = 100_000
Count = Annotated[int, Field(ge=1, le=MOST)]
Rate = Annotated[float, Field(gt=0, le=MOST)]  # Hz


class PlanarState(Strict):
    """Where a piece of furniture stands, or the robot, in the building's frame."""

    x: float
    y: float
    yaw: Angle = 0.0


class Waypoint(Strict):
    """A corner of the route."""

    x: float
    y: float
    pause: NonNegative = 0.0  # s, standing still there
    speed: Positive | None = None  # m/s on the way to it, instead of the route's
    kidnapped_to: PlanarState | None = None  # the robot is carried there, unnoticed by its wheels

    @property
    def left_from(self) -> PointXY:
        """Where the robot drives on from."""
        place = self.kidnapped_to or self
        return place.x, place.y


class Route(Strict):
    """Where the robot drives: straight from corner to corner."""

    waypoints: tuple[Waypoint, ...] = (Waypoint(x=0.0, y=0.0, pause=10.0),)
    start_yaw: Angle | None = None  # rad; without it, towards the second waypoint
    speed: Positive = 0.7  # m/s
    acceleration: Positive = 0.5  # m/s^2
    turn_rate: Positive = 0.8  # rad/s, turning on the spot and at most in a curve
    turn_acceleration: Positive = 1.5  # rad/s^2, turning on the spot
    corner_radius: NonNegative = 0.0  # m, how corners are rounded; 0: turned on the spot

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Route:
        if not self.waypoints:
            raise ValueError("a route needs at least one waypoint")
        if any(a.left_from == (b.x, b.y) for a, b in pairwise(self.waypoints)):
            raise ValueError("two waypoints in a row are at one place; use pause to stand there")
        return self


class OdometryNoise(Strict):
    """Wheel odometry. Random errors grow with the root of the way, so that no rate matters."""

    rate: Rate = 20.0  # Hz
    translation_noise: NonNegative = 0.01  # m after 1 m, along the way
    rotation_noise: NonNegative = 0.02  # rad after 1 rad of turning
    drift_noise: NonNegative = 0.01  # rad after 1 m of way
    translation_scale: float = 0.01  # systematic: share by which ways are counted too long
    rotation_scale: float = 0.01  # systematic: share by which turns are counted too wide
    drift: float = 0.0  # systematic: rad/m
    publish_tf: bool = False  # also on /tf as odom -> base_link


class Mount(Strict):
    """Where a laser sits on ``base_link``; roll, pitch, yaw as URDF defines them."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.3
    roll: Angle = 0.0
    pitch: Angle = 0.0
    yaw: Angle = 0.0


class Laser(Strict):
    """A laser scanner and what is wrong with it."""

    frame: str = "laser"
    mount: Mount = Mount()
    beams: Annotated[int, Field(ge=2, le=MOST)] = 181
    angle_min: Angle = -1.5707963267948966  # rad, the first beam
    angle_max: Angle = 1.5707963267948966  # rad, the last beam
    range_min: NonNegative = 0.05  # m
    range_max: Positive = 8.0  # m
    rate: Rate = 5.0  # Hz
    phase: Share = 0.0  # of a period, when the first scan is taken
    time_increment: NonNegative = 0.0  # s between beams
    sigma: NonNegative = 0.03  # m, range noise
    false_share: Share = 0.0  # readings that say anything between range_min and range_max
    no_return_share: Share = 0.0  # readings that miss what is there
    quantization: NonNegative = 0.001  # m, step of the readings; 0: none

    @model_validator(mode="after")
    def _is_possible(self) -> Laser:
        if self.range_max <= self.range_min:
            raise ValueError("range_max must exceed range_min")
        if self.angle_max <= self.angle_min:
            raise ValueError("angle_max must exceed angle_min")
        if self.time_increment * self.beams > 1.0 / self.rate:
            raise ValueError("a sweep (beams x time_increment) must end before the next begins")
        return self


Value = float | PlanarState
"""An angle (rad), an offset (m) or a place on the floor, by the kind of the object."""


class Change(Strict):
    """A movement of an object."""

    at: NonNegative  # s
    to: Value | Literal["random"]
    duration: NonNegative = 2.0  # s, in which it moves smoothly


class ObjectRule(Strict):
    """The states of the objects whose names match a pattern; the first rule that matches holds."""

    name: str = "*"  # pattern with * and ?
    initial: Value | Literal["home", "random", "spread"] = "home"  # spread: evenly, shuffled
    changes: tuple[Change, ...] = ()
    spread_xy: NonNegative = 0.3  # m, how far "random" moves furniture from where it should stand
    spread_yaw: NonNegativeAngle = 0.5  # rad, how far it turns it

    @model_validator(mode="after")
    def _one_after_the_other(self) -> ObjectRule:
        ends = [change.at + change.duration for change in self.changes]
        starts = [change.at for change in self.changes]
        if any(start < end for start, end in zip(starts[1:], ends, strict=False)):
            raise ValueError("changes must be in order, each over before the next begins")
        return self


class People(Strict):
    """A person who walks along a route, or people who walk about in a region."""

    route: tuple[PointXY, ...] = ()
    loop: bool = True  # there and back again; otherwise standing at the end
    count: Count = 1
    region: Region | None = None
    start: NonNegative = 0.0  # s, standing at the first point before
    speed: Positive = 1.2  # m/s
    shape: Literal["legs", "body"] = "legs"
    keep_distance: NonNegative = 0.5  # m from the robot's centre, at which they step aside

    @model_validator(mode="after")
    def _walk_somewhere(self) -> People:
        if bool(self.route) == (self.region is not None):
            raise ValueError("give people either a route or a region")
        return self


class Boxes(Strict):
    """Obstacles that the model does not know: one at a place, or a number in a region."""

    size: tuple[Positive, Positive, Positive] = (0.4, 0.4, 0.8)  # m
    pose: PlanarState | None = None
    count: Count = 1
    region: Region | None = None

    @model_validator(mode="after")
    def _stand_somewhere(self) -> Boxes:
        if (self.pose is None) == (self.region is None):
            raise ValueError("give boxes either a pose or a region")
        return self


class ModelError(Strict):
    """How the real building and robot differ from the model; each piece by itself."""

    wall_sigma: NonNegative = 0.0  # m, each connected piece of the walls, along x and y
    hinge_sigma: NonNegative = 0.0  # m, each hinge and rail, along x and y
    laser_sigma: NonNegative = 0.0  # m, each laser on the robot, along x and y
    laser_yaw_sigma: NonNegativeAngle = 0.0  # rad, each laser on the robot
    clock_offset: float = 0.0  # s by which the stamps of scans run ahead of the odometry's


class InitialPose(Strict):
    """What is recorded on /initialpose: drawn about the truth with these deviations."""

    sigma_xy: NonNegative = 0.2  # m
    sigma_yaw: NonNegativeAngle = 0.1  # rad


class RecordedBelief(Strict):
    """Samples of a localization's belief, recorded as geometry_msgs/PoseArray."""

    topic: str = "/particlecloud"
    rate: Rate = 2.0  # Hz
    count: Count = 100
    sigma_xy: NonNegative = 0.05  # m, of the samples about their mean
    sigma_yaw: NonNegativeAngle = 0.02  # rad
    error_xy: NonNegative = 0.03  # m, of the mean about the truth
    error_yaw: NonNegativeAngle = 0.01  # rad


class Scene(Strict):
    """A drive through a building."""

    building: Path  # URDF, relative to the scene's file
    route: Route = Route()
    odometry: OdometryNoise = OdometryNoise()
    lasers: tuple[Laser, ...] = (Laser(),)
    objects: tuple[ObjectRule, ...] = ()
    people: tuple[People, ...] = ()
    boxes: tuple[Boxes, ...] = ()
    model_error: ModelError = ModelError()
    initial_pose: InitialPose | None = InitialPose()
    belief: RecordedBelief | None = None
    start_time: Annotated[int, Field(ge=1, lt=2**31)] = 1_600_000_000  # s since 1970
    truth_step: Positive = 0.05  # s between true states while an object moves
    seed: Annotated[int, Field(ge=0)] = 0

    @field_validator("building")
    @classmethod
    def _is_a_path(cls, path: Path) -> Path:
        if "\0" in str(path):
            raise ValueError("a path can't hold a zero byte")
        return path

    @model_validator(mode="after")
    def _has_lasers(self) -> Scene:
        frames = [laser.frame for laser in self.lasers]
        if not frames or len(set(frames)) < len(frames):
            raise ValueError("a scene needs lasers, each with a frame of its own")
        return self


def load_scene(path: str | Path, seed: int | None = None) -> Scene:
    """The scene in a YAML file, its building's path made absolute.

    ``seed`` replaces the file's. Raises SettingsError naming the place and the cure.
    """
    path = Path(path)
    scene = parse_strict(Scene, load_yaml(path), str(path), SCENE)
    changes = {"building": Path(os.path.realpath(path.parent / scene.building))}
    return scene.model_copy(update=changes if seed is None else {**changes, "seed": seed})


def dump_scene(scene: Scene) -> str:
    """The scene as YAML with every setting spelled out, so that it can be repeated."""
    import yaml

    return str(yaml.safe_dump(scene.model_dump(mode="json"), sort_keys=False))
