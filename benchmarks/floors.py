"""Floors of many kinds with known doors, maps made of scans, and drives: what finding doors is measured on.

A floor has a corridor with rooms on both sides. Rooms have a hinged door, a double door, or an
opening without a leaf; between them are niches, and gaps in which a shelf stands. Walls are of
several thicknesses, so that some closed leaves lie flush with the corridor's wall, and others behind it.

Rooms are all but empty, and the robot stays in the corridor. ``furnished`` floors have rooms full of
desks, chairs and shelves, and the robot drives into half of them. On ``with_sliding`` floors half of
the doors slide: along the corridor's wall, in it, or behind it. On ``entered`` floors the robot
drives into most rooms that are open on that day, and the map isn't made along the walls. On
``recessed`` ones half of the doors lie at the back of alcoves. Floors ``with_windows`` have outer walls
with a row of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from benchmarks.scan_map import write_map
from objstate.building.door_table import SLIDES, Door
from objstate.building.leaves import leaf_of_door
from objstate.building.model import Building, Mesh
from objstate.building.shapes import Box
from objstate.building.writing import write_buildings
from objstate.geometry import FloatArray, compose, transform_from_pose
from objstate.logs import open_log
from objstate.recording.tum import read_tum
from objstate.records import Scan
from objstate.simulation import simulate

WALL_HEIGHT, LEAF_HEIGHT, LEAF = 2.5, 2.0, 0.04  # m
# m, of a leaf that slides on a wall: over the jamb, and before it
OVERLAP, BESIDE_WALL = 0.03, 0.04
SLIT = 0.01  # m between a leaf and its frame
DEPTH = 3.5  # m, of rooms
MAP_SCANS = 3  # every so many scans of the mapping drive count
ALCOVE_DEPTH, ALCOVE_ASIDE = (0.25, 0.8), (0.05, 0.4)  # m, of doors at the back of one
ENTERED = 0.8  # of the rooms of an ``entered`` floor that are open
WIDE_OPEN = math.radians(80.0)  # so that a robot can pass

LASER = """\
  - frame: laser
    mount: {x: 0.15, z: 0.3}
    beams: 361
    angle_min: -2.356194490
    angle_max: 2.356194490
    range_max: 10.0
    rate: 5.0
    sigma: 0.02
    false_share: 0.005
"""


class Room(NamedTuple):
    """What lies behind a gap in a corridor's wall: along it from ``x0`` to ``x1``, m."""

    x0: float
    x1: float
    side: int
    gap: tuple[float, float]  # m along the corridor
    depth: tuple[float, float]  # m from the corridor's middle
    doors: tuple[str, ...]


class Piece(NamedTuple):
    """A box that stands somewhere: x, y, heading, length, width in m and rad."""

    x: float
    y: float
    yaw: float
    length: float
    width: float


@dataclass
class Floor:
    """A floor as it was built."""

    walls: list[tuple[float, float, float, float]] = field(default_factory=list)  # x0, x1, y0, y1
    doors: list[Door] = field(default_factory=list)
    shelves: list[Piece] = field(default_factory=list)  # which may be missing on some days
    length: float = 0.0
    half: float = 0.0
    rooms: list[Room] = field(default_factory=list)  # that a robot may enter
    furniture: list[Piece] = field(default_factory=list)
    visited: list[Room] = field(default_factory=list)  # in every drive
    is_entered: bool = False  # in each drive where it is open
    turn: float = 0.0  # rad, of the map's frame

    @property
    def building(self) -> Building:
        """Its walls and doors."""
        parts = []
        for x0, x1, y0, y1 in self.walls:
            middle = transform_from_pose(np.array([(x0 + x1) / 2, (y0 + y1) / 2, 0.0]))
            middle[2, 3] = WALL_HEIGHT / 2
            parts.append(Box((x1 - x0, y1 - y0, WALL_HEIGHT)).mesh().moved(middle))
        walls = Mesh(
            np.concatenate([part.vertices for part in parts]),
            np.concatenate([part.faces + 8 * k for k, part in enumerate(parts)]),
        )
        leaves = {door.name: leaf_of_door(door, LEAF, LEAF_HEIGHT) for door in self.doors}
        return Building("floor", walls, leaves)

    @property
    def doors_in_map(self) -> list[Door]:
        """Its doors, in the frame of the map."""
        return [
            replace(
                door,
                hinge=compose(self.map_pose, np.array([*door.hinge, 0.0]))[:2],
                closed_bearing=door.closed_bearing + self.turn,
            )
            for door in self.doors
        ]

    @property
    def map_pose(self) -> FloatArray:
        """(3,) of the floor in the map."""
        return np.array([0.0, 0.0, self.turn])


def make_floor(seed: int, *, recessed: bool = False) -> Floor:
    """A floor of eight to twelve bays on each side of a corridor, perhaps with ``recessed`` doors."""
    rng, own = np.random.default_rng([seed, 11]), np.random.default_rng([seed, 16])
    floor = Floor(half=float(rng.uniform(0.9, 1.4)))
    thick = float(rng.choice([0.10, 0.14, 0.20]))
    bays = int(rng.integers(5, 8))
    widths = rng.uniform(2.6, 4.2, bays)
    floor.length = float(widths.sum())
    for side in (1, -1):
        begin = 0.0
        for width in rng.permutation(widths):
            _bay(floor, rng, begin, float(width), side, thick, own if recessed else None)
            begin += float(width)
        back = floor.half + thick + DEPTH
        _wall(floor, side, -thick, floor.length + thick, back, back + thick)
        _wall(floor, side, -thick, 0.0, 0.0, back)
        _wall(floor, side, floor.length, floor.length + thick, 0.0, back)
    return floor


def _bay(
    floor: Floor,
    rng: np.random.Generator,
    begin: float,
    width: float,
    side: int,
    thick: float,
    recesses: np.random.Generator | None,
) -> None:
    near, far = floor.half, floor.half + thick
    back = far + DEPTH
    kind = rng.choice(["door", "double", "opening", "niche", "shelf"], p=[0.6, 0.1, 0.1, 0.1, 0.1])
    gap = {
        "door": rng.uniform(0.75, 1.1),
        "double": rng.uniform(1.4, 1.9),
        "opening": rng.uniform(0.8, 1.3),
        "niche": rng.uniform(0.7, 1.2),
        "shelf": rng.uniform(0.8, 1.2),
    }[str(kind)]
    left = begin + float(rng.uniform(0.35, width - gap - 0.35))
    right = left + float(gap)
    if recesses is not None and kind in ("door", "double") and recesses.random() < 0.5:
        aside = recesses.uniform(*ALCOVE_ASIDE, 2)
        deep = float(recesses.uniform(*ALCOVE_DEPTH))
        low = max(left - float(aside[0]), begin + 0.1)
        high = min(right + float(aside[1]), begin + width - 0.1)
        _wall(floor, side, begin, low, near, far + deep)
        _wall(floor, side, high, begin + width, near, far + deep)
        near, far = near + deep, far + deep
        _wall(floor, side, low, left, near, far)
        _wall(floor, side, right, high, near, far)
    else:
        _wall(floor, side, begin, left, near, far)
        _wall(floor, side, right, begin + width, near, far)
    if begin + width < floor.length:
        _wall(floor, side, begin + width, begin + width + 0.1, floor.half + thick, back)
    if rng.random() < 0.5:  # a cupboard in the room
        x = begin + float(rng.uniform(0.2, width - 1.2))
        y = floor.half + thick + float(rng.uniform(2.2, DEPTH - 0.5))
        _wall(floor, side, x, x + 0.8, y, y + 0.4)
    if kind == "niche":
        back_of_niche = near + float(rng.uniform(0.3, 0.5))
        _wall(floor, side, left - 0.1, right + 0.1, back_of_niche, back_of_niche + 0.1)
        for x in (left - 0.1, right):
            _wall(floor, side, x, x + 0.1, far, back_of_niche)
    if kind == "shelf":
        middle, deep = (left + right) / 2, side * (near + 0.02 + 0.15)
        floor.shelves.append(Piece(middle, deep, 0.0, right - left - 0.06, 0.3))
    names = list[str]()
    if kind in ("door", "double"):
        into_room = bool(rng.random() < 0.8)
        limit = round(float(rng.uniform(1.5, 2.1)), 4) if into_room else 1.57
        y = far if into_room else near
        leaf = (right - left - 2 * SLIT) if kind == "door" else (right - left) / 2 - 1.5 * SLIT
        at_left = bool(rng.random() < 0.5)
        for is_left in (True, False) if kind == "double" else (at_left,):
            name = f"door_{len(floor.doors) + 1:02d}"
            hinge = np.array([left + SLIT if is_left else right - SLIT, side * y])
            sense = (1 if is_left == into_room else -1) * side
            bearing = 0.0 if is_left else math.pi
            floor.doors.append(Door(name, hinge, bearing, sense, float(leaf), limit))
            names.append(name)
    if kind in ("door", "double", "opening"):
        inside = begin, begin + width
        floor.rooms.append(Room(*inside, side, (left, right), (far, back), tuple(names)))


def with_sliding(floor: Floor, seed: int) -> Floor:
    """The floor with leaves that slide in half of its doorways, where there is wall beside them."""
    rng = np.random.default_rng([seed, 14])
    doors = {door.name: door for door in floor.doors}
    for room in floor.rooms:
        near, far = floor.half, room.depth[0]
        depth = float(rng.choice([near - BESIDE_WALL, (near + far) / 2, far + BESIDE_WALL]))
        over = SLIT if near < depth < far else -OVERLAP
        low, high = room.gap[0] + over, room.gap[1] - over
        beside = {True: room.gap[0] - room.x0, False: room.x1 - room.gap[1]}
        is_left = [True, False] if len(room.doors) == 2 else [beside[True] > beside[False]]
        width = (high - low) / len(is_left)
        is_narrow = any(beside[left] < 0.8 * width for left in is_left)
        if not room.doors or rng.random() < 0.5 or is_narrow:
            continue
        for name, left in zip(room.doors, is_left, strict=True):
            hinge = np.array([low if left else high, room.side * depth])
            bearing = 0.0 if left else math.pi
            travel = round(min(width, beside[left]), 4)
            doors[name] = Door(name, hinge, bearing, SLIDES, width, travel)
    floor.doors = list(doors.values())
    return floor


def with_windows(floor: Floor, seed: int) -> Floor:
    """The floor with windows in its outer walls, behind the rooms: panes in niches, which stay shut."""
    rng = np.random.default_rng([seed, 17])
    deep = float(rng.choice([0.08, 0.14, 0.22]))  # m, of the niches
    spacing, width = float(rng.uniform(1.3, 2.2)), float(rng.uniform(0.7, 1.2))
    for side in (1, -1):
        wall = max(floor.walls, key=lambda each: min(side * each[2], side * each[3]))
        floor.walls.remove(wall)
        x0, x1, back = wall[0], wall[1], min(abs(wall[2]), abs(wall[3]))
        _wall(floor, side, x0, x1, back + deep, back + deep + 0.05)
        middles = np.arange(spacing / 2.0, floor.length - width / 2.0, spacing)
        ends = [x0, *np.sort([*(middles - width / 2.0), *(middles + width / 2.0)]).tolist(), x1]
        for begin, end in zip(ends[::2], ends[1::2], strict=True):
            _wall(floor, side, begin, end, back, back + deep)
    return floor


def entered(floor: Floor, seed: int) -> Floor:
    """The floor with a few things in its rooms, entered where these are open, and a turned map."""
    rng = np.random.default_rng([seed, 15])
    _furnish(floor, rng, (1, 5))
    floor.is_entered = True
    floor.turn = float(rng.uniform(0.04, 0.5) * rng.choice([-1.0, 1.0]))
    return floor


def furnished(floor: Floor, seed: int) -> Floor:
    """The floor with desks, chairs, shelves and cabinets in its rooms, half of which are visited."""
    rng = np.random.default_rng([seed, 13])
    _furnish(floor, rng, (6, 15), visited=0.5)
    return floor


def _furnish(
    floor: Floor, rng: np.random.Generator, counts: tuple[int, int], visited: float = 0.0
) -> None:
    for room in floor.rooms:
        middle = (room.gap[0] + room.gap[1]) / 2
        near, far = room.depth
        wide = room.x1 - room.x0
        for _ in range(int(rng.integers(*counts))):
            kind = rng.choice(["desk", "shelf", "cabinet", "partition", "chair", "chair"])
            length, width = {
                "desk": (rng.uniform(1.2, 1.8), 0.8),
                "shelf": (rng.uniform(0.7, 1.6), rng.uniform(0.25, 0.4)),
                "cabinet": (rng.uniform(0.4, 0.7), rng.uniform(0.4, 0.6)),
                "partition": (rng.uniform(0.6, 1.4), 0.04),
                "chair": (0.6, 0.6),
            }[str(kind)]
            along_wall = kind != "chair" and rng.random() < 0.7
            yaw = float(rng.choice([0.0, math.pi / 2]) if along_wall else rng.uniform(0, math.pi))
            reach = (
                abs(math.cos(yaw)) * length + abs(math.sin(yaw)) * width,
                abs(math.sin(yaw)) * length + abs(math.cos(yaw)) * width,
            )
            if reach[0] > wide - 0.3 or reach[1] > far - near - 0.3:
                continue
            x = float(rng.uniform(room.x0 + reach[0] / 2, room.x1 - reach[0] / 2))
            y = float(rng.uniform(near + 0.1 + reach[1] / 2, far - 0.05 - reach[1] / 2))
            if along_wall:
                y = far - 0.03 - reach[1] / 2 if rng.random() < 0.5 else y
                x = room.x0 + 0.15 + reach[0] / 2 if rng.random() < 0.4 else x
            # the way through the door stays free, as far as the robot goes
            if abs(x - middle) < 0.65 + reach[0] / 2 and y - reach[1] / 2 < near + 2.1:
                continue
            floor.furniture += _parts(str(kind), x, room.side * y, yaw, length, width, rng)
        if rng.random() < visited:
            floor.visited.append(room)


def _parts(
    kind: str,
    x: float,
    y: float,
    yaw: float,
    length: float,
    width: float,
    rng: np.random.Generator,
) -> list[Piece]:
    """What a level laser meets of a piece of furniture."""
    cos, sin = math.cos(yaw), math.sin(yaw)

    def at(u: float, v: float, long: float, wide: float) -> Piece:
        return Piece(x + cos * u - sin * v, y + sin * u + cos * v, yaw, long, wide)

    if kind == "chair":
        turns = rng.uniform(0, 2 * math.pi) + np.arange(5) * 2 * math.pi / 5
        return [at(0.27 * math.cos(a), 0.27 * math.sin(a), 0.05, 0.05) for a in turns]
    if kind != "desk":
        return [at(0.0, 0.0, length, width)]
    ends = [
        at(u, v, 0.05, 0.05) for u in (-length / 2, length / 2) for v in (-width / 2, width / 2)
    ]
    style = rng.random()
    if style < 0.3:  # with a panel behind
        ends.append(at(0.0, width / 2 - 0.05, length, 0.03))
    elif style < 0.6:  # with side panels
        ends += [at(u, 0.0, 0.03, width) for u in (-length / 2, length / 2)]
    if rng.random() < 0.6:  # drawers
        ends.append(at(length / 2 - 0.3, 0.1, 0.42, 0.6))
    return ends


def _wall(floor: Floor, side: int, x0: float, x1: float, y0: float, y1: float) -> None:
    low, high = sorted((side * y0, side * y1))
    floor.walls.append((x0, x1, low, high))


def states_of(floor: Floor, rng: np.random.Generator) -> dict[str, float]:
    """Doors as people leave them: closed, wide open, or anywhere."""
    found = {}
    for door in floor.doors:
        kind = rng.random()
        angle = 0.0 if kind < 0.45 else door.upper if kind < 0.65 else rng.uniform(0.1, door.upper)
        found[door.name] = float(angle)
    return found


@dataclass(frozen=True)
class Drives:
    """What a robot has of a floor."""

    map: Path
    logs: list[Path]
    states: list[dict[str, float]]  # of the doors: in the map, then in each drive


def make_drives(floor: Floor, folder: Path, seed: int, count: int, moved: float) -> Drives:
    """A map of a first drive, and ``count`` more, before each of which a share of the doors is moved."""
    rng = np.random.default_rng([seed, 12])
    write_buildings(folder / "building", {".": floor.building}, {".": None})
    movable = [door.name for door in floor.doors if rng.random() < moved]
    states = [states_of(floor, rng)]
    for _ in range(count):
        other = states_of(floor, rng)
        states.append(states[0] | {name: other[name] for name in movable})
    passed = {name for room in floor.visited for name in room.doors}
    wide_open = {door.name: door.upper for door in floor.doors if door.name in passed}
    states = [state | wide_open for state in states]
    for number, state in enumerate(states):
        scene = folder / f"drive{number}.scene.yaml"
        shelves = [shelf for shelf in floor.shelves if moved == 0.0 or rng.random() < 0.7]
        boxes = [*shelves, *floor.furniture]
        scene.write_text(_scene(floor, state, boxes, rng, seed * 100 + number))
        if not (folder / f"drive{number}").is_dir():
            simulate(scene, folder / f"drive{number}")
    logs = [folder / f"drive{number}" / "log.mcap" for number in range(1, count + 1)]
    return Drives(make_map(folder / "drive0", folder, floor.map_pose), logs, states)


def make_map(drive: Path, folder: Path, pose: FloatArray) -> Path:
    """The map of a drive whose true path is known, in which the building has a pose (3,)."""
    path = read_tum(drive / "path.tum")
    poses = dict(zip(path.stamps_ns.tolist(), compose(pose, path.poses), strict=True))
    scans = [each for each in open_log([drive / "log.mcap"]) if isinstance(each, Scan)]
    placed = [replace(scan, odometry=poses[scan.stamp_ns]) for scan in scans[::MAP_SCANS]]
    return write_map(placed, folder)


def _scene(
    floor: Floor,
    state: dict[str, float],
    pieces: Sequence[Piece],
    rng: np.random.Generator,
    seed: int,
) -> str:
    ends = 0.7, floor.length - 0.7
    aside = rng.uniform(-0.25, 0.25, 4) * floor.half
    points = [
        (ends[0], aside[0]), (floor.length / 2, aside[1]), (ends[1], aside[1]),
        (floor.length / 2, aside[2]), (ends[0], aside[3]),
    ]  # fmt: skip
    visited = floor.visited
    if floor.is_entered:
        upper = {door.name: door.upper if door.slides else WIDE_OPEN for door in floor.doors}
        visited = [
            room
            for room in floor.rooms
            if all(state[name] >= upper[name] for name in room.doors) and rng.random() < ENTERED
        ]
    for room in visited:
        middle, inside = sum(room.gap) / 2, room.side * (room.depth[0] + 1.4)
        points += [(middle, 0.0), (middle, inside), (middle, 0.0)]
    points = [points[0], *(b for a, b in pairwise(points) if math.dist(a, b) > 0.05)]
    written = "".join(f"    - {{x: {x:.3f}, y: {y:.3f}}}\n" for x, y in points)
    objects = "".join(
        f"  - {{name: {name}, initial: {angle:.5f}}}\n" for name, angle in state.items()
    )
    boxes = "".join(
        f"  - {{size: [{each.length:.3f}, {each.width:.3f}, 1.8], "
        f"pose: {{x: {each.x:.3f}, y: {each.y:.3f}, yaw: {each.yaw:.4f}}}}}\n"
        for each in pieces
    )
    return (
        f"building: building/floor.urdf\nseed: {seed}\nroute:\n  speed: 0.6\n  corner_radius: 0.3\n"
        f"  waypoints:\n{written}lasers:\n{LASER}"
        + (f"objects:\n{objects}" if objects else "")
        + (f"boxes:\n{boxes}" if boxes else "")
    )
