"""Buildings, lasers and drives to measure in."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.outline import outline
from objstate.building.shapes import Box
from objstate.geometry import FloatArray, between, transform
from objstate.records import InitialPose, Odometry, Rays, Record, Scan
from objstate.sensing import ExpectedRanges

HEIGHT = 2.5  # m, of walls
LASER_HEIGHT = 0.3  # m
RANGE_MAX = 8.0  # m
NOISE = 0.03  # m, of a range
THICK = 0.12  # m, of walls
UP = np.array([0.0, 0.0, 1.0])

ROOM_WIDTH, ROOM_DEPTH = 4.0, 5.0  # m
CORRIDOR = 2.4  # m wide
PITCH = CORRIDOR + 2.0 * ROOM_DEPTH + 1.0  # m between corridors
GAP = 0.9  # m, doorways
FURNITURE = 4  # fixed boxes in each room
SPEED = 0.7  # m/s
SCANS_PER_SECOND = 5.0


def boxes(centres: FloatArray, sizes: FloatArray) -> Mesh:
    """Boxes from the floor up: centres and sizes (b, 2) m."""
    unit = Box((1.0, 1.0, HEIGHT)).mesh()
    scale = np.column_stack([sizes, np.ones(len(sizes))])
    place = np.column_stack([centres, np.full(len(centres), HEIGHT / 2)])
    vertices = unit.vertices * scale[:, None] + place[:, None]
    starts = len(unit.vertices) * np.arange(len(centres))
    return Mesh(vertices.reshape(-1, 3), (unit.faces + starts[:, None, None]).reshape(-1, 3))


def hall(triangles: int) -> Mesh:
    """A square hall with boxes all over, of about so many triangles; the middle is free."""
    count = max(triangles // 12 - 4, 1)
    side = 2.0 * np.ceil(np.sqrt(count)) + 4.0
    rng = np.random.default_rng(1)
    grid = np.arange(-side / 2 + 2.0, side / 2 - 1.0, 1.9)
    centres = np.array(np.meshgrid(grid, grid)).reshape(2, -1).T
    centres = centres[np.hypot(*centres.T) > 1.5]
    centres = centres[np.argsort(np.hypot(*centres.T))][:count]
    sizes = rng.uniform(0.2, 0.8, (len(centres), 2))
    ring = np.array([[0.0, 1.0], [0.0, -1.0], [1.0, 0.0], [-1.0, 0.0]]) * side / 2
    walls = np.array([[side, THICK], [side, THICK], [THICK, side], [THICK, side]])
    return boxes(np.concatenate([centres, ring]), np.concatenate([sizes, walls]))


def office(corridors: int, rooms: int) -> Building:
    """Corridors with so many rooms on each side, a door and fixed furniture in every room."""
    rng = np.random.default_rng(2)
    centres, sizes, doors = [], [], {}
    length = rooms * ROOM_WIDTH
    for corridor in range(corridors):
        middle = corridor * PITCH
        for side in (-1.0, 1.0):
            front, back = (middle + side * (CORRIDOR / 2 + away) for away in (0.0, ROOM_DEPTH))
            pieces = [([length / 2, back], [length, THICK])]
            for room in range(rooms + 1):
                x = room * ROOM_WIDTH
                pieces.append(([x, (front + back) / 2], [THICK, ROOM_DEPTH]))
                if room == rooms:
                    break
                jamb = (ROOM_WIDTH - GAP) / 2
                pieces += [
                    ([x + jamb / 2, front], [jamb, THICK]),
                    ([x + ROOM_WIDTH - jamb / 2, front], [jamb, THICK]),
                ]
                for place in rng.uniform([0.6, 1.2], [3.4, 4.4], (FURNITURE, 2)):
                    pieces.append(([x + place[0], front + side * place[1]], [0.9, 0.5]))
                name = f"door_{len(doors):05d}"
                doors[name] = door(name, x + jamb, front, opens=side)
            centres += [centre for centre, _ in pieces]
            sizes += [size for _, size in pieces]
    for x in (0.0, length):
        centres += [[x, corridor * PITCH] for corridor in range(corridors)]
        sizes += [[THICK, CORRIDOR]] * corridors
    return Building("office", boxes(np.array(centres), np.array(sizes)), doors)


def closets(movable: int) -> Building:
    """A corridor with eight doors about its middle, of which the last ones are fixed and closed."""
    hinges = [(x, y) for x in (-2.2, -1.1, 0.0, 1.1) for y in (-1.2, 1.2)]
    items = {
        f"door_{k}": door(f"door_{k}", x, y, opens=np.sign(y)) for k, (x, y) in enumerate(hinges)
    }
    sides = np.array([[0.0, -2.4], [0.0, 2.4], [-6.0, 0.0], [6.0, 0.0]])
    walls = boxes(sides, np.array([[12.0, THICK], [12.0, THICK], [THICK, 4.8], [THICK, 4.8]]))
    shut = [item.mesh.moved(item.transforms(np.zeros((1, 1)))[0]) for item in items.values()]
    chosen = dict(list(items.items())[:movable])
    return Building("closets", Mesh.joined([walls, *shut[movable:]]), chosen)


def door(name: str, x: float, y: float, opens: float) -> MovableObject:
    """A leaf hinged at (x, y) that points along x when closed and opens to +y (1) or -y (-1)."""
    middle = transform(np.eye(3), np.array([GAP / 2, 0.0, 1.0]))
    leaf = Box((GAP, 0.04, 2.0)).mesh().moved(middle)
    origin = transform(np.eye(3), np.array([x, y, 0.0]))
    return MovableObject(name, Kind.HINGED, origin, opens * UP, 0.0, np.pi / 2, leaf)


def u_shape(name: str, x: float, y: float) -> MovableObject:
    """Three boards in the shape of a U of 37 cm by 37 cm that should stand at (x, y), open towards +x."""
    parts = [
        ((0.01, 0.37), (-0.18, 0.0)),
        ((0.37, 0.01), (0.0, 0.18)),
        ((0.37, 0.01), (0.0, -0.18)),
    ]
    mesh = Mesh.joined(
        [
            Box((*size, 1.0)).mesh().moved(transform(np.eye(3), np.array([*at, 0.5])))
            for size, at in parts
        ]
    )
    origin = transform(np.eye(3), np.array([x, y, 0.0]))
    return MovableObject(name, Kind.PLANAR, origin, UP, 0.0, 0.0, mesh)


def laser(beams: int, field_of_view: float = np.pi) -> Rays:
    """The beams of a level laser in the middle of the robot that looks ahead."""
    bearings = np.linspace(-field_of_view / 2, field_of_view / 2, beams)
    flat = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(beams)])
    return Rays(np.tile([0.0, 0.0, LASER_HEIGHT], (beams, 1)), flat)


def scan_from(
    building: Building,
    states: Mapping[str, FloatArray],
    pose: FloatArray,
    rays: Rays,
    rng: np.random.Generator,
    stamp_ns: int = 0,
) -> Scan:
    """What a laser reads from a robot pose (3,), with the objects in their states."""
    ranges = ExpectedRanges(building).scene(states, pose[None], rays)[0]
    return _scan(ranges, rays, rng, stamp_ns)


def about(pose: FloatArray, count: int, seed: int = 5) -> FloatArray:
    """Samples (count, 3) of a robot belief about a pose: 3 cm and 1.5 degrees wide."""
    rng = np.random.default_rng(seed)
    return pose + rng.standard_normal((count, 3)) * [0.03, 0.03, np.radians(1.5)]


def segments(mesh: Mesh) -> int:
    """How many segments a level laser sees of a mesh."""
    return len(outline(mesh, LASER_HEIGHT))


@dataclass(frozen=True, eq=False)
class Drive:
    """What a robot records on a straight way, in time order."""

    building: Building
    states: Mapping[str, FloatArray]
    start: tuple[float, float]  # m
    rays: Rays

    def records(self, scans: int) -> list[Record]:
        """Records up to so many scans, the same for every building that looks the same from there."""
        return list(self._records(scans))

    def _records(self, scans: int) -> Iterator[Record]:
        expected, rng = ExpectedRanges(self.building), np.random.default_rng(3)
        begin, step = np.array([*self.start, 0.0]), SPEED / SCANS_PER_SECOND
        yield InitialPose(1, begin, np.diag([0.02, 0.02, np.radians(2.0)]) ** 2)
        for k in range(scans):
            stamp = 1 + round(k * 1e9 / SCANS_PER_SECOND)
            pose = begin + np.array([k * step, 0.0, 0.0])
            yield Odometry(stamp, between(begin, pose))
            ranges = expected.scene(self.states, pose[None], self.rays)[0]
            yield _scan(ranges, self.rays, rng, stamp)


def _scan(ranges: FloatArray, rays: Rays, rng: np.random.Generator, stamp_ns: int) -> Scan:
    read = ranges + NOISE * rng.standard_normal(len(ranges))
    read = np.where(read >= RANGE_MAX, np.inf, read.clip(min=0.05))
    return Scan(stamp_ns, "laser", read, rays, 0.02, RANGE_MAX)


def ajar(names: Sequence[str]) -> dict[str, FloatArray]:
    """States of doors, each open by another angle."""
    return {name: np.array([0.2 + 1.2 * (0.37 * k % 1.0)]) for k, name in enumerate(names)}
