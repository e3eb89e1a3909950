"""Small buildings, lasers and scans that tests put together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.geometry import FloatArray, rotation_from_rpy, transform, transform_from_pose
from objstate.records import Rays, Scan
from objstate.sensing import ExpectedRanges

WALL_HEIGHT = 2.5  # m
LASER_HEIGHT = 0.3  # m


def placed(
    x: float, y: float, z: float = 0.0, rpy: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> FloatArray:
    """A rigid transform (4, 4)."""
    return transform(rotation_from_rpy(*rpy), np.array([x, y, z]))


def block(x: float, y: float, width: float, depth: float, yaw: float = 0.0) -> Mesh:
    """A box from the floor to the ceiling about (x, y)."""
    middle = placed(x, y, WALL_HEIGHT / 2, (0.0, 0.0, yaw))
    return Box((width, depth, WALL_HEIGHT)).mesh().moved(middle)


def wall(start: tuple[float, float], end: tuple[float, float], thickness: float = 0.1) -> Mesh:
    """A wall whose middle line runs from ``start`` to ``end``."""
    (ax, ay), (bx, by) = start, end
    length, yaw = float(np.hypot(bx - ax, by - ay)), float(np.arctan2(by - ay, bx - ax))
    return block((ax + bx) / 2, (ay + by) / 2, length, thickness, yaw)


def enclosure(width: float, depth: float) -> Mesh:
    """Four walls about the origin, inner faces ``width`` by ``depth`` apart."""
    x, y = width / 2 + 0.05, depth / 2 + 0.05
    sides = [((-x, -y), (x, -y)), ((x, -y), (x, y)), ((x, y), (-x, y)), ((-x, y), (-x, -y))]
    return Mesh.joined([wall(start, end) for start, end in sides])


def fence(points: FloatArray) -> Mesh:
    """Upright sheets without thickness between points (n, 2) and back to the first."""
    count = len(points)
    low = np.column_stack([points, np.zeros(count)])
    vertices = np.concatenate([low, low + np.array([0.0, 0.0, WALL_HEIGHT])])
    here, after = np.arange(count), (np.arange(count) + 1) % count
    lower = np.column_stack([here, after, after + count])
    upper = np.column_stack([here, after + count, here + count])
    return Mesh(vertices, np.concatenate([lower, upper]))


def door(
    name: str,
    x: float,
    y: float,
    bearing: float = 0.0,
    width: float = 0.9,
    limits: tuple[float, float] = (0.0, np.pi / 2),
    wraps: bool = False,
    thickness: float = 0.04,
) -> MovableObject:
    """A leaf hinged at (x, y) that points to ``bearing`` when closed and opens to the left."""
    leaf = Box((width, thickness, 2.0)).mesh().moved(placed(width / 2, 0.0, 1.0))
    origin, up = placed(x, y, 0.0, (0.0, 0.0, bearing)), np.array([0.0, 0.0, 1.0])
    return MovableObject(name, Kind.HINGED, origin, up, *limits, leaf, wraps)


def sliding_door(
    name: str, x: float, y: float, bearing: float = 0.0, width: float = 0.9
) -> MovableObject:
    """A leaf from (x, y) towards ``bearing`` that slides on in that direction by its width."""
    leaf = Box((width, 0.04, 2.0)).mesh().moved(placed(width / 2, 0.0, 1.0))
    origin, along = placed(x, y, 0.0, (0.0, 0.0, bearing)), np.array([1.0, 0.0, 0.0])
    return MovableObject(name, Kind.SLIDING, origin, along, 0.0, width, leaf)


def table(
    name: str, x: float, y: float, yaw: float = 0.0, size: tuple[float, float] = (1.2, 0.6)
) -> MovableObject:
    """A chest on the floor that should stand at (x, y, yaw)."""
    chest = Box((*size, 0.7)).mesh().moved(placed(0.0, 0.0, 0.35))
    origin = placed(x, y, 0.0, (0.0, 0.0, yaw))
    return MovableObject(name, Kind.PLANAR, origin, np.array([0.0, 0.0, 1.0]), 0.0, 0.0, chest)


def standing(name: str, mesh: Mesh) -> MovableObject:
    """Anything that stands on the floor, at the origin of the building in its home state."""
    return MovableObject(name, Kind.PLANAR, np.eye(4), np.array([0.0, 0.0, 1.0]), 0.0, 0.0, mesh)


def building(walls: Mesh, *objects: MovableObject) -> Building:
    return Building("test", walls, {each.name: each for each in objects})


def fan(
    count: int, field_of_view: float = np.pi, towards: float = 0.0, mount: FloatArray | None = None
) -> Rays:
    """``count`` beams of a laser that sweeps its own horizontal plane, mounted on ``base_link``."""
    bearings = towards + np.linspace(-field_of_view / 2, field_of_view / 2, count)
    return beams_at(bearings, placed(0.0, 0.0, LASER_HEIGHT) if mount is None else mount)


def beams_at(bearings: FloatArray, mount: FloatArray) -> Rays:
    """Beams at ``bearings`` (n,) rad of a laser mounted at a transform (4, 4)."""
    flat = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))])
    return Rays(np.tile(mount[:3, 3], (len(bearings), 1)), flat @ mount[:3, :3].T)


def scan_of(
    ranges: FloatArray,
    rays: Rays,
    stamp_ns: int = 0,
    laser: str = "laser",
    odometry: FloatArray | None = None,
    range_max: float = 8.0,
) -> Scan:
    """A scan that read ``ranges`` (n,); those beyond ``range_max`` as nothing."""
    read = np.where(ranges >= range_max, np.inf, ranges)
    return Scan(stamp_ns, laser, read, rays, 0.02, range_max, odometry)


def observed(
    expected: ExpectedRanges,
    states: Mapping[str, FloatArray],
    pose: FloatArray,
    rays: Rays,
    rng: np.random.Generator | None = None,
    noise: float = 0.02,
    range_max: float = 8.0,
) -> Scan:
    """What a laser reads from ``pose`` (3,) with the objects in ``states``; exact without ``rng``."""
    ranges = expected.scene(states, pose[None], rays)[0]
    if rng is not None:
        ranges = ranges + noise * rng.standard_normal(len(ranges))
    return scan_of(ranges, rays, range_max=range_max)


def combined(whole: Building, states: Mapping[str, FloatArray]) -> Mesh:
    """Walls and objects as one mesh, each object moved to its state."""
    moved: Iterable[Mesh] = (
        whole[name].mesh.moved(whole[name].transforms(state[None])[0])
        for name, state in states.items()
    )
    return Mesh.joined([whole.walls, *moved])


def in_map(rays: Rays, pose: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Origins and directions (n, 3) of beams in the building's frame, one by one."""
    base = transform_from_pose(pose)
    origins = [(base @ np.append(origin, 1.0))[:3] for origin in rays.origins]
    directions = [base[:3, :3] @ direction for direction in rays.directions]
    return np.array(origins), np.array(directions)
