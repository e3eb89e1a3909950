"""The camera, and the perceptor of obstacles (section 5.2).

A picture is cast ray by ray, so that what goes wrong in the thesis goes wrong here: a camera that is
rolled sees an upright pole aslant, finds its side above the base, and projects that far behind it; an
obstacle whose base is below the picture has no place.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from objstate.experiments.darmstadt.setting import (
    BOX,
    OUTLIERS_WITHIN,
    POLE_HEIGHT,
    POLE_RADIUS,
    Scene,
)
from objstate.geometry import BoolArray, FloatArray, IntArray, rotation_about, wrapped
from objstate.grid import Camera, Percepts

NO_OBSTACLE = -1
HORIZON = math.radians(3.0)  # rad below which the floor is told from what is beyond it


@dataclass(frozen=True)
class Optics:
    """A webcam at the height of the robot's head, which is above its feet."""

    height: float = 0.52  # m above the floor
    wide: float = math.radians(60.0)  # rad, opening angles
    high: float = math.radians(45.0)
    columns: int = 64  # scan lines
    rows: int = 160

    def rays(self) -> FloatArray:
        """(columns, rows, 3) directions from left to right and from the bottom up, x ahead, z up."""
        left = np.linspace(1.0, -1.0, self.columns) * math.tan(self.wide / 2.0)
        up = np.linspace(-1.0, 1.0, self.rows) * math.tan(self.high / 2.0)
        y, z = np.meshgrid(left, up, indexing="ij")
        return np.stack([np.ones_like(y), y, z], axis=-1)


OPTICS = Optics()
RAYS = OPTICS.rays()


@dataclass(frozen=True)
class Aim:
    """Angles of the head, rad: left, down, and rolled."""

    pan: float
    tilt: float
    roll: float = 0.0

    def rotation(self) -> FloatArray:
        """(3, 3) from the picture to the robot's frame."""
        turned = rotation_about([0.0, 0.0, 1.0], self.pan) @ rotation_about([0, 1, 0], self.tilt)
        return np.asarray(turned @ rotation_about([1.0, 0.0, 0.0], self.roll))


@dataclass(frozen=True, eq=False)
class Lines:
    """Scan lines on the floor, in the robot's frame."""

    starts: FloatArray = field(repr=False)  # (n, 2) m
    ends: FloatArray = field(repr=False)  # (n, 2) m
    obstacle: BoolArray = field(repr=False)  # (n,)

    def percepts(self, pose: FloatArray, pan_std: float, tilt_std: float) -> Percepts:
        """As the grid takes them, with the thesis' rule for outliers."""
        camera = Camera(OPTICS.height, pan_std, tilt_std, within=OUTLIERS_WITHIN)
        return camera.percepts(self.starts, self.ends, self.obstacle, pose)


def take(scene: Scene, pose: FloatArray, aim: Aim) -> IntArray:
    """(columns,) the lowest row of each scan line that shows an obstacle, or none."""
    yaw = rotation_about([0.0, 0.0, 1.0], pose[2])
    rays = RAYS @ (yaw @ aim.rotation()).T
    hit = np.zeros(rays.shape[:2], dtype=bool)
    for pole in scene.poles - pose[:2]:
        bearing = math.atan2(pole[1], pole[0]) - pose[2] - aim.pan
        if abs(wrapped(bearing)) < OPTICS.wide:  # else it can't show
            hit |= _meets_pole(rays, pole)
    for box in scene.boxes:
        hit |= _meets_box(rays, box - pose[:2])
    return np.where(hit.any(axis=1), hit.argmax(axis=1), NO_OBSTACLE)


def lines(rows: IntArray, aim: Aim, reach: float) -> Lines:
    """What the perceptor makes of a picture, with the angles that were read: places on the floor.

    Scan lines whose lowest pixel shows an obstacle have no base and are left out, as are obstacles
    beyond the reach, m. Free ones end at the upper edge, or at the reach.
    """
    column = np.arange(len(rows))
    obstacle = rows != NO_OBSTACLE
    turn = aim.rotation().T
    begins, first = _on_floor(RAYS[:, 0] @ turn)
    reached, courses = _on_floor(RAYS[column, np.where(obstacle, rows, -1)] @ turn)
    ends = np.where(obstacle, reached, np.minimum(reached, reach))
    usable = np.isfinite(begins) & (begins < ends) & (rows != 0) & (ends <= reach)
    return Lines(
        begins[usable, None] * first[usable], ends[usable, None] * courses[usable], obstacle[usable]
    )


def shows(pose: FloatArray, aim: Aim, place: FloatArray, scene: Scene, reach: float) -> bool:
    """Whether a place (2,) m on the floor is in the picture and nothing stands before it."""
    off = place - pose[:2]
    away = math.hypot(*off)
    if not 0.0 < away <= reach:
        return False
    left, down = (
        wrapped(math.atan2(off[1], off[0]) - pose[2] - aim.pan),
        math.atan2(OPTICS.height, away),
    )
    if abs(left) > OPTICS.wide / 2.0 or abs(down - aim.tilt) > OPTICS.high / 2.0:
        return False
    way = pose[:2] + np.linspace(0.0, 1.0, 1 + math.ceil(away / 0.02))[:-1, None] * off
    return bool((scene.distances(way) > 0.0).all())


def _on_floor(rays: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where rays (n, 3) meet the floor: distances (n,), infinite at the horizon, and directions (n, 2)."""
    away = np.hypot(rays[:, 0], rays[:, 1])
    down = -rays[:, 2] / away
    below = down > math.tan(HORIZON)
    distance = np.where(below, OPTICS.height / np.where(below, down, 1.0), np.inf)
    return distance, rays[:, :2] / away[:, None]


def _meets_pole(rays: FloatArray, pole: FloatArray) -> BoolArray:
    """Which rays (..., 3) from the camera meet a pole at (2,) m from the robot."""
    along = rays[..., :2] @ pole
    flat = (rays[..., :2] ** 2).sum(axis=-1)
    inside = along**2 - flat * (pole @ pole - POLE_RADIUS**2)
    at = (along - np.sqrt(np.maximum(inside, 0.0))) / flat
    height = OPTICS.height + at * rays[..., 2]
    return np.asarray((inside > 0.0) & (at > 0.0) & (height >= 0.0) & (height <= POLE_HEIGHT))


def _meets_box(rays: FloatArray, box: FloatArray) -> BoolArray:
    """Which rays (..., 3) from the camera meet a box about (2,) m from the robot."""
    middle = np.append(box, BOX[2] / 2.0 - OPTICS.height)
    with np.errstate(divide="ignore", invalid="ignore"):
        one, other = (middle - np.array(BOX) / 2.0) / rays, (middle + np.array(BOX) / 2.0) / rays
    near, far = np.minimum(one, other).max(axis=-1), np.maximum(one, other).min(axis=-1)
    return np.asarray((near <= far) & (far > 0.0))
