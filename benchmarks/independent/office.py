"""An office with furniture: what stands where and when, the robot's way, and the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.independent.drive import STEP, Drive, turn, wait
from benchmarks.independent.model import HEIGHT, box, numbers
from benchmarks.independent.shapes import Bools, Floats, Ints, edges, overlap, placed, rectangle
from benchmarks.independent.world import Person, Piece

INSET = 2.1  # m between the walls and the robot's way
FREE = 0.45  # m beside its way that furniture leaves
GAP = 0.03  # m at least between two things that stand
AWAY = 3.0  # s between the taking of a thing and its being put down
PART = 2.5  # m; walls come in pieces that long at most


@dataclass(frozen=True)
class Part:
    """An upright cuboid, or a cylinder, of a piece of furniture."""

    x: float
    y: float
    length: float  # m; of a cylinder its diameter
    width: float
    bottom: float = 0.0
    top: float = 0.75
    round: bool = False

    @property
    def outline(self) -> Floats:
        """Its corners (n, 2), seen from above."""
        if not self.round:
            return placed(rectangle(self.length, self.width), self.x, self.y)
        angles = np.arange(24) * np.pi / 12
        circle = self.length / 2 * np.column_stack([np.cos(angles), np.sin(angles)])
        return np.asarray(circle + np.array([self.x, self.y]))


@dataclass(frozen=True)
class Stay:
    """Where a thing is from a time on; ``pose`` (x, y, yaw) is None while it is away."""

    begin: float  # s
    pose: tuple[float, float, float] | None


@dataclass(frozen=True)
class Thing:
    """A piece of furniture."""

    name: str
    parts: tuple[Part, ...]
    order: int  # of its symmetry
    home: tuple[float, float, float]
    stays: tuple[Stay, ...] = ()

    @property
    def footprint(self) -> Floats:
        """Corners (4, 2) of the rectangle around it at yaw 0."""
        points = np.vstack([part.outline for part in self.parts])
        x, y = points.min(0), points.max(0)
        return np.array([[x[0], x[1]], [y[0], x[1]], [y[0], y[1]], [x[0], y[1]]])

    def at(self, time: float) -> tuple[float, float, float] | None:
        """Where it is at a time."""
        return [stay.pose for stay in self.stays if stay.begin <= time][-1]

    def outlines(self, time: float, height: float) -> list[Floats]:
        """What of it a laser at a height meets."""
        pose = self.at(time)
        met = [part for part in self.parts if part.bottom <= height < part.top]
        return [] if pose is None else [placed(part.outline, *pose) for part in met]


@dataclass(frozen=True)
class OfficeOptions:
    """What an office has of everything."""

    off: float = 0.1  # m, standard deviation of where things stand
    turned: float = float(np.radians(7.0))
    gone: int = 1  # things that aren't there
    moves: int = 0  # things that are carried elsewhere during the drive; every third for good
    clutter: int = 0  # boxes beside furniture that nobody drew
    walkers: int = 0
    wrong_size: float = 0.0  # m, standard deviation of a modelled thing's length and width
    crooked: float = 0.0  # m, standard deviation of where each true part is


@dataclass(frozen=True)
class Office:
    """What there is, and how it changes."""

    walls: list[Piece]
    clutter: list[Piece]
    things: list[Thing]
    people: list[Person]

    def segments(self, time: float) -> tuple[Floats, Bools, Ints]:
        """Segments (s, 4), whether they are of glass, and of which thing they are, else -1."""
        fixed = [edges(piece.outline) for piece in [*self.walls, *self.clutter]]
        parts, owners = fixed, [np.full(4 * len(fixed), -1)]
        for number, thing in enumerate(self.things):
            for outline in thing.outlines(time, LASER_HEIGHT):
                parts.append(edges(outline))
                owners.append(np.full(len(outline), number))
        segments = np.vstack(parts)
        return segments, np.zeros(len(segments), dtype=bool), np.concatenate(owners)

    @property
    def owned(self) -> int:
        """Number of things."""
        return len(self.things)


LASER_HEIGHT = 0.3  # m
Kind = tuple[int, Callable[[float, float], tuple[Part, ...]], tuple[float, float]]


def _solid(length: float, width: float) -> tuple[Part, ...]:
    return (Part(0.0, 0.0, length, width, 0.0, 1.2),)


def _legs(length: float, width: float, size: float, top: float) -> list[Part]:
    x, y = length / 2 - size / 2, width / 2 - size / 2
    return [Part(a * x, b * y, size, size, 0.0, top) for a in (-1, 1) for b in (-1, 1)]


def _desk(length: float, width: float) -> tuple[Part, ...]:
    return (*_legs(length, width, 0.05, 0.72), Part(0.0, 0.0, length, width, 0.72, 0.75))


def _table(length: float, width: float) -> tuple[Part, ...]:
    x = length / 2 - 0.1
    panels = [Part(side * x, 0.0, 0.04, width - 0.1, 0.0, 0.72) for side in (-1, 1)]
    return (*panels, Part(0.0, 0.0, length, width, 0.72, 0.75))


def _chair(length: float, width: float) -> tuple[Part, ...]:
    seat = Part(0.0, 0.0, length, width, 0.44, 0.48)
    back = Part(-length / 2 + 0.02, 0.0, 0.04, width, 0.48, 0.9)
    return (*_legs(length, width, 0.03, 0.44), seat, back)


def _armchair(length: float, width: float) -> tuple[Part, ...]:
    back = Part(-length / 2 + 0.08, 0.0, 0.16, width, 0.0, 0.9)
    arms = [Part(0.08, s * (width / 2 - 0.07), length - 0.16, 0.14, 0.0, 0.6) for s in (-1, 1)]
    return (back, *arms, Part(0.08, 0.0, length - 0.16, width - 0.28, 0.0, 0.25))


def _bin(length: float, _: float) -> tuple[Part, ...]:
    return (Part(0.0, 0.0, length, length, 0.0, 0.6, round=True),)


KINDS: dict[str, Kind] = {
    "cupboard": (2, _solid, (1.0, 0.45)),
    "shelf": (2, _solid, (0.9, 0.3)),
    "drawers": (2, _solid, (0.6, 0.42)),
    "desk": (2, _desk, (1.4, 0.7)),
    "table": (2, _table, (1.6, 0.8)),
    "chair": (1, _chair, (0.44, 0.42)),
    "armchair": (1, _armchair, (0.8, 0.75)),
    "bin": (360, _bin, (0.34, 0.34)),
}
AT_WALLS = ("cupboard", "shelf", "drawers", "armchair", "bin", "desk")
INSIDE = ("desk", "table", "chair", "chair")


def office(seed: int, options: OfficeOptions, duration: float) -> Office:
    """An office; the same seed gives the same walls, things and homes whatever the options."""
    rng = np.random.default_rng([seed, 101])
    length, width = size = _size(seed)
    walls = _walls(rng, *size)
    things: list[Thing] = []
    for side in range(4):
        for kind in rng.permutation(AT_WALLS)[: 3 if side % 2 == 0 else 2]:
            _add(rng, things, str(kind), walls, size, _by_wall(rng, size, side))
    for kind in INSIDE:
        _add(rng, things, kind, walls, size, _within(rng, size))
    way = _way(size)
    stand = _stood(np.random.default_rng([seed, 102]), things, walls, way, options, duration)
    rng = np.random.default_rng([seed, 103])
    clutter = _clutter(rng, stand, walls, way, options.clutter, duration)
    people = [
        Person(0.8, length - 0.8, y, rng.uniform(0.7, 1.2), rng.uniform(0.0, 60.0))
        for y in rng.uniform(0.25 * width, 0.75 * width, options.walkers)
    ]
    crooked = np.random.default_rng([seed, 104])
    return Office(
        walls, clutter, [_bent(crooked, thing, options.crooked) for thing in stand], people
    )


def _size(seed: int) -> tuple[float, float]:
    rng = np.random.default_rng([seed, 100])
    return float(rng.uniform(10.0, 12.0)), float(rng.uniform(7.5, 8.5))


def _walls(rng: np.random.Generator, length: float, width: float) -> list[Piece]:
    """Walls around, and pilasters, so that the room isn't the same from its other end."""
    pieces = []
    for begin, end, across, upright in (
        (0.0, length, -0.06, False),
        (0.0, length, width + 0.06, False),
        (0.0, width, -0.06, True),
        (0.0, width, length + 0.06, True),
    ):
        count = int(np.ceil((end - begin) / PART))
        for n in range(count):
            along = begin + (n + 0.5) * (end - begin) / count
            x, y = (across, along) if upright else (along, across)
            yaw = np.pi / 2 if upright else 0.0
            pieces.append(Piece(x, y, yaw, (end - begin) / count, 0.12))
    for x, y in ((0.3 * length, 0.0), (0.55 * length, width), (0.0, 0.35 * width)):
        pieces.append(Piece(x, y, 0.0, *rng.uniform(0.25, 0.5, 2)))
    off = rng.normal(0.0, 1.0, (len(pieces), 3)) * (0.004, 0.004, np.radians(0.2))
    return [
        Piece(p.x + dx, p.y + dy, p.yaw + dyaw, p.length, p.width)
        for p, (dx, dy, dyaw) in zip(pieces, off.tolist(), strict=True)
    ]


def _by_wall(
    rng: np.random.Generator, size: tuple[float, float], side: int
) -> Callable[[Floats], tuple[float, float, float]]:
    """A place with the back to a wall."""

    def place(footprint: Floats) -> tuple[float, float, float]:
        deep = float(np.ptp(footprint[:, 1])) / 2 + rng.uniform(GAP, 0.12)
        span = size[side % 2]
        along = rng.uniform(0.7, span - 0.7)
        x, y = ((along, deep), (size[0] - deep, along), (along, size[1] - deep), (deep, along))[
            side
        ]
        return float(x), float(y), side * np.pi / 2

    return place


def _within(
    rng: np.random.Generator, size: tuple[float, float]
) -> Callable[[Floats], tuple[float, float, float]]:
    """A place inside of the robot's way."""

    def place(_: Floats) -> tuple[float, float, float]:
        x = rng.uniform(INSET + 0.6, size[0] - INSET - 0.6)
        y = rng.uniform(INSET + 0.6, size[1] - INSET - 0.6)
        return float(x), float(y), float(rng.uniform(-np.pi, np.pi))

    return place


def _add(
    rng: np.random.Generator,
    things: list[Thing],
    kind: str,
    walls: Sequence[Piece],
    size: tuple[float, float],
    place: Callable[[Floats], tuple[float, float, float]],
) -> None:
    """Another thing where there is room; none where 200 tries find none."""
    order, parts, usual = KINDS[kind]
    dimensions = np.array(usual) * rng.uniform(0.9, 1.1)
    thing = Thing(f"{kind}_{len(things) + 1:02d}", parts(*dimensions.tolist()), order, (0, 0, 0))
    way = _way(size)
    for _ in range(200):
        pose = place(thing.footprint)
        others = [placed(other.footprint, *other.home) for other in things]
        if _has_room(thing, pose, others, walls, way):
            things.append(replace(thing, home=pose))
            return


def _has_room(
    thing: Thing,
    pose: tuple[float, float, float],
    others: Sequence[Floats],
    walls: Sequence[Piece],
    way: Floats,
) -> bool:
    """Whether it stands free of walls, of others, and of the robot's way."""
    around = thing.footprint * (1 + 2 * GAP / np.ptp(thing.footprint, axis=0))
    outline = placed(around, *pose)
    if any(overlap(outline, other) for other in [*others, *(wall.outline for wall in walls)]):
        return False
    local = placed(way - np.array(pose[:2]), 0.0, 0.0, -pose[2])
    low, high = thing.footprint.min(0) - FREE, thing.footprint.max(0) + FREE
    return not bool(((local > low) & (local < high)).all(1).any())


def _stood(
    rng: np.random.Generator,
    things: Sequence[Thing],
    walls: Sequence[Piece],
    way: Floats,
    options: OfficeOptions,
    duration: float,
) -> list[Thing]:
    """Things where they really stand, and when they are carried elsewhere."""
    order = rng.permutation(len(things)).tolist()
    gone, moved = order[: options.gone], order[options.gone : options.gone + options.moves]
    stand = [replace(thing, stays=(Stay(0.0, thing.home),)) for thing in things]
    for number in range(len(stand)):
        pose = None if number in gone else _aside(rng, stand, number, walls, way, options)
        stand[number] = replace(stand[number], stays=(Stay(0.0, pose),))
    for turn_, number in enumerate(moved):
        begin = float(rng.uniform(0.2, 0.8) * duration)
        wider = replace(options, off=0.3, turned=np.radians(25.0))
        to = None if turn_ % 3 == 2 else _aside(rng, stand, number, walls, way, wider)
        stays = [*stand[number].stays, Stay(begin, None)]
        stays += [Stay(begin + AWAY, to)] if to is not None else []
        stand[number] = replace(stand[number], stays=tuple(stays))
    return stand


def _aside(
    rng: np.random.Generator,
    stand: Sequence[Thing],
    number: int,
    walls: Sequence[Piece],
    way: Floats,
    options: OfficeOptions,
) -> tuple[float, float, float]:
    """A place near a thing's home where there is room; its home where 200 tries find none."""
    thing = stand[number]
    others = [
        placed(other.footprint, *stay.pose)
        for other in stand
        if other is not thing
        for stay in other.stays
        if stay.pose is not None
    ]
    for _ in range(200):
        off = rng.standard_normal(3) * (options.off, options.off, options.turned)
        x, y, yaw = (np.array(thing.home) + off).tolist()
        if _has_room(thing, (x, y, yaw), others, walls, way):
            return x, y, yaw
    return thing.home


def _clutter(
    rng: np.random.Generator,
    stand: Sequence[Thing],
    walls: Sequence[Piece],
    way: Floats,
    count: int,
    duration: float,
) -> list[Piece]:
    """Boxes, bags and stools that stand close to furniture."""
    pieces: list[Piece] = []
    for number in rng.integers(0, len(stand), 20 * count).tolist():
        pose = stand[number].at(0.0) or stand[number].home
        long, wide = rng.uniform(0.15, 0.4, 2).tolist()
        away = rng.uniform(0.3, 0.9) * np.array([np.cos(a := rng.uniform(0.0, 6.3)), np.sin(a)])
        at = (pose[0] + float(away[0]), pose[1] + float(away[1]), float(rng.uniform(0.0, 3.1)))
        bag = Thing("", (Part(0.0, 0.0, long, wide),), 1, at)
        others = [
            placed(part.outline, *stay.pose)
            for thing in stand
            for stay in thing.stays
            if stay.pose is not None
            for part in thing.parts
            if part.bottom < 0.4
        ]
        if len(pieces) < count and _has_room(bag, at, others, walls, way):
            pieces.append(Piece(*at, long, wide))
    return pieces


def _bent(rng: np.random.Generator, thing: Thing, std: float) -> Thing:
    """A thing whose parts aren't quite where they belong."""
    off = std * rng.standard_normal((len(thing.parts), 2))
    parts = [
        replace(part, x=part.x + dx, y=part.y + dy) if len(thing.parts) > 1 else part
        for part, (dx, dy) in zip(thing.parts, off.tolist(), strict=True)
    ]
    return replace(thing, parts=tuple(parts))


def _way(size: tuple[float, float]) -> Floats:
    """Corners and points (n, 2) of the robot's way around."""
    corners = _corners(size)
    legs = [np.linspace(a, b, 60) for a, b in zip(corners, np.roll(corners, -1, 0), strict=True)]
    return np.vstack(legs)


def _corners(size: tuple[float, float]) -> Floats:
    x, y = size[0] - INSET, size[1] - INSET
    return np.array([[INSET, INSET], [x, INSET], [x, y], [INSET, y]])


def office_drive(seed: int, rounds: int = 2) -> Drive:
    """Around the office, with a pause at each second corner."""
    rng = np.random.default_rng([seed, 105])
    corners = _corners(_size(seed))
    pose, poses = [*corners[0].tolist(), 0.0], []
    wait(poses, pose, 1.0)
    for number in range(1, 4 * rounds + 1):
        target = corners[number % 4]
        along = target - pose[:2]
        turn(poses, pose, float(np.arctan2(along[1], along[0])))
        begin, yaw = np.array(pose[:2]), pose[2]
        speed, swing = rng.uniform(0.35, 0.55), rng.uniform(-0.08, 0.08)
        steps = round(float(np.hypot(*along)) / speed / STEP)
        for step in range(1, steps + 1):
            pose[:2] = (begin + along * step / steps).tolist()
            pose[2] = yaw + swing * np.sin(2 * np.pi * step / steps)
            poses.append(tuple(pose))
        if number % 2 == 0:
            wait(poses, pose, rng.uniform(1.0, 2.0))
    wait(poses, pose, 0.5)
    return Drive(np.arange(len(poses)) * STEP, np.array(poses))


def modelled(seed: int, things: Sequence[Thing], wrong_size: float) -> list[Thing]:
    """Things as the model has them: each kind's form, of a length and width that may be off."""
    rng = np.random.default_rng([seed, 106])
    drawn = []
    for thing in things:
        _, parts, _ = KINDS[thing.name.rsplit("_", 1)[0]]
        length, width = np.ptp(thing.footprint, axis=0) + wrong_size * rng.standard_normal(2)
        drawn.append(replace(thing, parts=parts(float(length), float(width))))
    return drawn


def urdf(walls: Sequence[Piece], things: Sequence[Thing]) -> str:
    """The model as URDF: a link of boxes, and a planar joint for each thing."""
    lines = ['<?xml version="1.0"?>', '<robot name="office">', '  <link name="building">']
    lines += [box((w.x, w.y, HEIGHT / 2), w.yaw, (w.length, w.width, HEIGHT)) for w in walls]
    lines.append("  </link>")
    for thing in things:
        lines.append(f'  <link name="{thing.name}_body">')
        lines += [_visual(part) for part in thing.parts]
        x, y, yaw = thing.home
        lines += [
            "  </link>",
            f'  <joint name="{thing.name}" type="planar">',
            f'    <parent link="building"/><child link="{thing.name}_body"/>',
            f'    <origin xyz="{numbers((x, y, 0.0))}" rpy="0 0 {yaw:.6f}"/>',
            '    <axis xyz="0 0 1"/>',
            "  </joint>",
        ]
    return "\n".join([*lines, "</robot>", ""])


def _visual(part: Part) -> str:
    middle, tall = (part.bottom + part.top) / 2, part.top - part.bottom
    if not part.round:
        return box((part.x, part.y, middle), 0.0, (part.length, part.width, tall))
    return (
        f'    <visual><origin xyz="{numbers((part.x, part.y, middle))}"/>'
        f'<geometry><cylinder radius="{part.length / 2:.6f}" length="{tall:.6f}"/></geometry></visual>'
    )
