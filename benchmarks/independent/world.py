"""True worlds: a corridor of wall pieces and hinged doors, with boxes, glass and people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.independent.shapes import Floats, overlap, placed, rectangle

GAP = 0.01  # m between a leaf and the jamb on either side
ROOM_DEPTH = 3.5  # m
PIECE = 2.5  # m; walls longer than this come in several pieces
LEAST_JAMB = 0.5  # m of wall between a doorway and the next partition
AJAR = float(np.radians(3.0))
CLEARANCE = 0.5  # m from the corridor's middle that stays free for the robot


@dataclass(frozen=True)
class Piece:
    """A wall piece or a box: an upright cuboid."""

    x: float
    y: float
    yaw: float
    length: float
    width: float
    transmission: float = 0.0  # share of the beams that pass

    @property
    def outline(self) -> Floats:
        """Its corners (4, 2)."""
        return placed(rectangle(self.length, self.width), self.x, self.y, self.yaw)


@dataclass(frozen=True)
class Door:
    """A hinged door; its leaf turns about (x, y)."""

    name: str
    x: float
    y: float
    closed: float  # rad, bearing of the closed leaf from the hinge
    sense: int  # +1 opens counter-clockwise, -1 clockwise
    width: float  # m, hinge to free edge
    thickness: float
    limit: float  # rad, the widest opening
    transmission: float = 0.0
    handle: bool = False

    def outlines(self, angle: float) -> list[Floats]:
        """Corners of the leaf, and of what sticks out of it, at an angle."""
        aside = -self.sense * self.thickness / 2
        parts = [placed(rectangle(self.width, self.thickness), self.width / 2, aside)]
        if self.handle:
            grip = rectangle(HANDLE_LENGTH, self.thickness + 2 * HANDLE_DEPTH)
            parts.append(placed(grip, self.width - HANDLE_INSET, aside))
        bearing = self.closed + self.sense * angle
        return [placed(part, self.x, self.y, bearing) for part in parts]


NEAR = 2.0  # m along the corridor between a door and a robot that sees it move
MOVES_FROM = 8.0  # s from the start, and as long before the end
HANDLE_LENGTH = 0.12  # m
HANDLE_DEPTH = 0.05  # m out of either face
HANDLE_INSET = 0.10  # m from the free edge to the handle's middle


@dataclass(frozen=True)
class Course:
    """A value over time: straight between its knots, constant outside."""

    times: Floats  # (k,) s
    values: Floats  # (k,) rad for a door, m for a robot

    def at(self, time: float) -> float:
        """The value at a time."""
        return float(np.interp(time, self.times, self.values))


@dataclass(frozen=True)
class Person:
    """Two legs that walk to and fro along the corridor; with no speed, someone who stands."""

    begin: float  # m along the corridor
    end: float
    y: float
    speed: float  # m/s
    phase: float  # s
    radius: float = 0.07  # m, of a leg

    def legs(self, time: float) -> Floats:
        """Circles (2, 3) as x, y, radius."""
        span = max(self.end - self.begin, 0.1)
        way = (self.speed * (time + self.phase)) % (2 * span)
        x = self.begin + min(way, 2 * span - way)
        stride = 0.3 * min(self.speed, 1.0) * np.sin(2 * np.pi * 0.9 * (time + self.phase))
        if self.speed == 0.0:  # who stands shifts their weight now and then
            stride = 0.03 * np.sin(0.5 * (time + self.phase))
        return np.array(
            [[x + stride, self.y - 0.1, self.radius], [x - stride, self.y + 0.1, self.radius]]
        )


@dataclass(frozen=True)
class WorldOptions:
    """What a world has of everything."""

    angles: tuple[float, float] | None = None  # rad; every door between these
    moves: int = 4  # doors that are moved once, every other one while the robot is near
    automatic: bool = False  # every door opens and closes every 15 s
    walkers: int = 2
    standing: int = 0  # people before doors
    boxes: int = 3  # beside doors, in the corridor
    doorway_boxes: float = 0.0  # share of the doorways with a box in them
    glass_doors: float = 0.0  # share
    glass_walls: float = 0.0
    handles: bool = False
    frames: bool = False
    thickness: tuple[float, float] = (0.04, 0.04)  # m, from, to
    length: float | None = None  # m, of the corridor; None: 16 to 19 m
    rooms: int | None = None  # on each side; None: 5 to 7


@dataclass(frozen=True)
class World:
    """What there is, and how it moves."""

    length: float  # m, of the corridor from x = 0
    half: float  # m from its middle to either wall
    walls: list[Piece]  # those that a building's model knows
    clutter: list[Piece]  # those that it doesn't
    doors: list[Door]
    courses: list[Course]
    people: list[Person]
    ends: list[tuple[str, float]]  # door, and s when it came to rest


def dimensions(seed: int, length: float | None = None) -> tuple[float, float]:
    """Length and half width of a seed's corridor, m; the ``length`` may be given."""
    rng = np.random.default_rng([seed, 0])
    usual, half = rng.uniform(16.0, 19.0), rng.uniform(1.15, 1.45)
    return usual if length is None else length, half


def corridor(seed: int, options: WorldOptions, robot: Course, day: int = 0) -> World:
    """A corridor; the same seed gives the same walls and doors whatever the options and the day.

    ``robot`` is how far along the corridor the robot is, so that doors are moved before it.
    """
    rng = np.random.default_rng([seed, 1])
    length, half = dimensions(seed, options.length)
    thick = rng.uniform(0.10, 0.16)
    walls, doors = _ends(length, half, thick), []
    for side in (1, -1):
        for at, slot in _slots(rng, length, options.rooms):
            door, pieces = _bay(rng, at, slot, side, half, thick)
            doors.append(door)
            walls += pieces
    walls = [_as_built(rng, piece) for piece in walls]
    doors = [_named(door, number) for number, door in enumerate(doors, start=1)]

    doors = _furnished(np.random.default_rng([seed, 2]), doors, options)
    walls = _glazed(np.random.default_rng([seed, 3]), walls, options.glass_walls)
    today = [day] if day else []
    angles = _angles(np.random.default_rng([seed, 4, *today]), doors, options)
    courses, ends = _courses(
        np.random.default_rng([seed, 5, *today]), doors, angles, options, robot
    )
    rng = np.random.default_rng([seed, 6, *today])
    clutter = _frames(doors, thick, half) if options.frames else []
    clutter += _boxes(rng, doors, half, options.boxes)
    clutter += _doorway_boxes(rng, doors, courses, half, thick, options.doorway_boxes)
    clutter += _room_boxes(rng, doors, half)
    people = _people(np.random.default_rng([seed, 7]), doors, length, half, options)
    return World(length, half, walls, clutter, doors, courses, people, ends)


def _ends(length: float, half: float, thick: float) -> list[Piece]:
    """The walls at both ends."""
    width = 2 * (half + thick)
    return [
        Piece(-thick / 2, 0.0, np.pi / 2, width, thick),
        Piece(length + thick / 2, 0.0, np.pi / 2, width, thick),
    ]


def _slots(rng: np.random.Generator, length: float, rooms: int | None) -> list[tuple[float, float]]:
    """Begin and width of the rooms on one side."""
    count = int(rng.integers(5, 8))
    count = count if rooms is None else rooms
    width = length / count
    return [(number * width, width) for number in range(count)]


def _bay(
    rng: np.random.Generator, begin: float, slot: float, side: int, half: float, thick: float
) -> tuple[Door, list[Piece]]:
    """One room with its door, on the corridor's left (side 1) or right (-1)."""
    doorway = float(rng.choice([0.82, 0.90, 0.98]))
    left = begin + rng.uniform(LEAST_JAMB, slot - doorway - LEAST_JAMB)
    right = left + doorway
    at_left, into_room = rng.random() < 0.5, rng.random() < 0.85
    limit = round(float(rng.uniform(1.5, 1.95)), 4)
    x = left + GAP if at_left else right - GAP
    y = half + thick if into_room else half
    closed = 0.0 if at_left else np.pi
    sense = 1 if at_left == into_room else -1
    door = Door("", x, side * y, side * closed, side * sense, doorway - 2 * GAP, 0.04, limit)

    pieces = [*_run(begin, left, half + thick / 2, thick)]
    pieces += _run(right, begin + slot, half + thick / 2, thick)
    pieces += _run(begin, begin + slot, half + thick + ROOM_DEPTH, 0.1)
    middle = half + thick + ROOM_DEPTH / 2
    sides = (begin, begin + slot) if begin == 0.0 else (begin + slot,)
    pieces += [Piece(at, middle, np.pi / 2, ROOM_DEPTH, 0.1) for at in sides]
    return door, [Piece(p.x, side * p.y, side * p.yaw, p.length, p.width) for p in pieces]


def _run(begin: float, end: float, y: float, thick: float) -> list[Piece]:
    """A straight wall in pieces."""
    count = int(np.ceil((end - begin) / PIECE))
    each = (end - begin) / count
    return [Piece(begin + (n + 0.5) * each, y, 0.0, each, thick) for n in range(count)]


def _as_built(rng: np.random.Generator, piece: Piece) -> Piece:
    """Every piece stands a few millimetres aside, and turned; the model knows it."""
    dx, dy, turn = rng.normal(0.0, 1.0, 3) * (0.004, 0.004, np.radians(0.2))
    return Piece(piece.x + dx, piece.y + dy, piece.yaw + turn, piece.length, piece.width)


def _named(door: Door, number: int) -> Door:
    return Door(**{**vars(door), "name": f"door_{number:02d}"})


def _furnished(
    rng: np.random.Generator, doors: Sequence[Door], options: WorldOptions
) -> list[Door]:
    """Doors with the thickness, glass and handles that are asked for."""
    result = []
    for door in doors:
        thickness, glass = rng.uniform(*options.thickness), rng.random() < options.glass_doors
        changes = {"thickness": thickness, "transmission": 1 / 3 if glass else 0.0}
        result.append(Door(**{**vars(door), **changes, "handle": options.handles}))
    return result


def _glazed(rng: np.random.Generator, walls: Sequence[Piece], share: float) -> list[Piece]:
    """Walls of which some are glass."""
    glass = rng.random(len(walls)) < share
    return [
        Piece(**{**vars(wall), "transmission": 1 / 3 if is_glass else 0.0})
        for wall, is_glass in zip(walls, glass, strict=True)
    ]


def _angle(rng: np.random.Generator, door: Door, options: WorldOptions) -> float:
    """Closed, ajar, wide open, or between."""
    kind, between = rng.random(), rng.random()
    if options.angles is not None:
        low, high = options.angles
        return low + between * (min(high, door.limit) - low)
    if kind < 0.25:
        return 0.0
    if kind < 0.35:
        return AJAR
    if kind < 0.45:
        return door.limit
    return float(np.radians(6.0) + between * (door.limit - np.radians(11.0)))


def _angles(rng: np.random.Generator, doors: Sequence[Door], options: WorldOptions) -> list[float]:
    return [_angle(rng, door, options) for door in doors]


def _courses(
    rng: np.random.Generator,
    doors: Sequence[Door],
    angles: Sequence[float],
    options: WorldOptions,
    robot: Course,
) -> tuple[list[Course], list[tuple[str, float]]]:
    """How the doors move, and when each came to rest."""
    duration = float(robot.times[-1])
    if options.automatic:
        courses = [_automatic(rng, door, duration) for door in doors]
    else:
        courses = [Course(np.zeros(1), np.array([angle])) for angle in angles]
        for turn, number in enumerate(rng.choice(len(doors), options.moves, replace=False)):
            door, angle = doors[int(number)], angles[int(number)]
            begin = _moment(rng, door, robot, near=turn % 2 == 0)
            courses[int(number)] = _moved_once(rng, door, angle, options, begin)
    ends = [
        (door.name, float(time))
        for door, course in zip(doors, courses, strict=True)
        for time in course.times[2::2]
        if 0.0 < time < duration
    ]
    return courses, ends


def _moment(rng: np.random.Generator, door: Door, robot: Course, *, near: bool) -> float:
    """When a door begins to move: any time, or while the robot is near."""
    times = robot.times[(robot.times > MOVES_FROM) & (robot.times < robot.times[-1] - MOVES_FROM)]
    if near:
        middle = door.x + np.cos(door.closed) * door.width / 2
        off = np.abs(np.interp(times, robot.times, robot.values) - middle)
        times = times[off <= max(NEAR, off.min())]
    return float(rng.choice(times))


def _moved_once(
    rng: np.random.Generator, door: Door, angle: float, options: WorldOptions, begin: float
) -> Course:
    """A door that somebody opens or closes once, by 30 to 60 degrees a second."""
    target = angle
    while abs(target - angle) < np.radians(10.0):
        target = _angle(rng, door, options)
    takes = abs(target - angle) / np.radians(rng.uniform(30.0, 60.0))
    return Course(np.array([0.0, begin, begin + takes]), np.array([angle, angle, target]))


def _automatic(rng: np.random.Generator, door: Door, duration: float) -> Course:
    """Shut for some 5 s, opening in 2 s, open for some 6 s, shutting in 2 s."""
    period, open_for = 15.0, rng.uniform(5.0, 6.5)
    begin = rng.uniform(0.0, period) - period
    times, angles = [begin - 1.0], [0.0]
    while begin < duration:
        times += [begin, begin + 2.0, begin + 2.0 + open_for, begin + 4.0 + open_for]
        angles += [0.0, door.limit, door.limit, 0.0]
        begin += period
    return Course(np.array(times), np.array(angles))


def _frames(doors: Sequence[Door], thick: float, half: float) -> list[Piece]:
    """A profile around the wall at both jambs of every doorway, which narrows it by 1 cm."""
    pieces = []
    for door in doors:
        middle = np.sign(door.y) * (half + thick / 2)
        way = np.cos(door.closed)
        near, far = door.x - way * (GAP + 0.02), door.x + way * (door.width + GAP + 0.02)
        pieces += [Piece(x, middle, 0.0, 0.05, thick + 0.04) for x in (near, far)]
    return pieces


def _boxes(rng: np.random.Generator, doors: Sequence[Door], half: float, count: int) -> list[Piece]:
    """Boxes in the corridor, beside doors or before them."""
    inward = [door for door in doors if abs(door.y) > half + 0.01]  # leaves that open away
    pieces = []
    for number in rng.choice(len(inward), min(count, len(inward)), replace=False):
        door, size = inward[int(number)], rng.uniform(0.3, 0.5)
        middle = door.x + np.cos(door.closed) * door.width / 2
        x, y = middle + rng.uniform(-0.9, 0.9), half - size / 2 - rng.uniform(0.02, 0.12)
        y = np.sign(door.y) * max(y, CLEARANCE + size / 2)
        pieces.append(Piece(x, y, rng.normal(0.0, 0.05), size, size))
    return pieces


def _doorway_boxes(
    rng: np.random.Generator,
    doors: Sequence[Door],
    courses: Sequence[Course],
    half: float,
    thick: float,
    share: float,
) -> list[Piece]:
    """Boxes of 40 cm in doorways, clear of the leaf wherever that moves."""
    count, pieces = round(share * len(doors)), []
    for number in rng.permutation(len(doors))[:count]:
        door, course = doors[int(number)], courses[int(number)]
        leaves = [
            outline
            for angle in np.linspace(course.values.min(), course.values.max(), 9)
            for outline in door.outlines(float(angle))
        ]
        for _ in range(200):
            along = rng.uniform(0.2, door.width - 0.2)
            x = door.x + np.cos(door.closed) * along
            y = np.sign(door.y) * (half + thick / 2 + rng.uniform(-0.25, 0.25))
            box = Piece(x, y, rng.normal(0.0, 0.1), 0.4, 0.4)
            if not any(overlap(box.outline, leaf) for leaf in leaves):
                pieces.append(box)
                break
    return pieces


def _room_boxes(rng: np.random.Generator, doors: Sequence[Door], half: float) -> list[Piece]:
    """Cupboards in half of the rooms, beyond the reach of leaves."""
    pieces = []
    for door in doors:
        there, aside, deep, size = rng.random(), *rng.uniform(0.0, 1.0, 3)
        if there < 0.5:
            middle = door.x + np.cos(door.closed) * door.width / 2
            y = np.sign(door.y) * (half + 1.6 + 1.4 * deep)
            size = 0.4 + 0.5 * size
            pieces.append(Piece(middle + aside - 0.5, y, rng.normal(0.0, 0.2), size, 0.45))
    return pieces


def _people(
    rng: np.random.Generator,
    doors: Sequence[Door],
    length: float,
    half: float,
    options: WorldOptions,
) -> list[Person]:
    """Walkers on both sides of the corridor, and people who stand before doors."""
    people = []
    for number in range(options.walkers):
        y = (1 if number % 2 else -1) * rng.uniform(0.65, half - 0.25)
        begin, end = rng.uniform(0.5, length / 3), rng.uniform(length / 2, length - 0.5)
        speed, phase = rng.uniform(0.7, 1.3), rng.uniform(0.0, 60.0)
        people.append(Person(begin, end, y, speed, phase, rng.uniform(0.055, 0.08)))
    for number in rng.permutation(len(doors))[: options.standing]:
        door = doors[int(number)]
        x = door.x + np.cos(door.closed) * rng.uniform(0.1, door.width)
        y = np.sign(door.y) * rng.uniform(0.65, half - 0.25)
        people.append(Person(x, x, y, 0.0, rng.uniform(0.0, 60.0)))
    return people
