"""What lasers read of a world: exact ranges first, then everything that real ones do to them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from benchmarks.independent.drive import Drive
from benchmarks.independent.shapes import (
    Bools,
    Floats,
    Hits,
    Ints,
    all_edges,
    cast,
    cast_circles,
    cosines,
    distance_to,
    edges,
)
from benchmarks.independent.world import Person, World

SEEN_WITHIN = 6.0  # m; beams that end on a leaf nearer than this see it
EDGE = 0.15  # m between neighbouring ranges where a beam may fall on both
GRAZING = 0.17  # cosine of incidence below which many beams get no return


@dataclass(frozen=True)
class Laser:
    """A laser, how it is really mounted, and what it gets wrong."""

    frame: str
    x: float
    y: float
    yaw: float
    angles: Floats  # (n,) rad, evenly spaced
    range_max: float
    rate: float  # Hz
    phase: float = 0.0  # of its first scan, in scans
    range_min: float = 0.1
    noise: float = 0.008  # m
    noise_share: float = 0.002  # of the range
    footprint: float = 0.002  # m of noise at 45 deg of incidence, per metre
    bias: float = 0.0  # m
    dropout: float = 0.005  # share of the beams without return
    grazing_dropout: float = 0.3
    mixed: float = 0.4  # share of the beams beside an edge that mix both ranges
    turn_time: float = 0.0  # s from the first to the last beam
    tells_turn: bool = True  # whether time_increment says so
    clock: float = 0.0  # s that its stamps run ahead of the odometry's


@dataclass(frozen=True)
class Scan:
    """One scan."""

    laser: int
    time: float  # s, true time of the first beam
    ranges: Floats  # (n,)
    beams_on: Ints  # (owned,) beams that really ended on each leaf or thing


def rig(kind: str) -> list[Laser]:
    """``two``: front and rear; ``wide``: one of 270 degrees; ``turning``: one of 360."""
    if kind == "two":
        half = np.radians(np.arange(181) - 90.0)
        front = Laser("front", 0.2, 0.0, 0.0, half, 10.0, 5.0)
        return [front, replace(front, frame="rear", x=-0.2, yaw=np.pi, phase=0.5)]
    if kind == "wide":
        return [Laser("laser", 0.15, 0.0, 0.0, np.radians(np.arange(541) / 2 - 135.0), 12.0, 10.0)]
    around = np.radians(np.arange(360) - 180.0)
    turning = Laser("lidar", 0.0, 0.0, 0.0, around, 8.0, 10.0, turn_time=0.1, tells_turn=False)
    if kind == "skewed":
        return [turning]
    if kind == "turning":
        noise = {"noise": 0.005, "noise_share": 0.01}
        return [replace(turning, rate=5.0, turn_time=0.2, tells_turn=True, **noise)]
    raise ValueError(f"There is no rig '{kind}'.")


class Scene(Protocol):
    """What lasers see: things that stand still or move, and people."""

    people: list[Person]

    @property
    def owned(self) -> int:
        """Number of doors or things of which beams are counted."""

    def segments(self, time: float) -> tuple[Floats, Bools, Ints]:
        """Segments (s, 4), whether they are of glass, and whose they are, else -1."""


class Corridor:
    """The segments of a corridor, at any time."""

    def __init__(self, world: World) -> None:
        self.people, self.owned = world.people, len(world.doors)
        fixed = [*world.walls, *world.clutter]
        self._world = world
        self._fixed = all_edges([piece.outline for piece in fixed])
        self._fixed_glass = np.repeat([piece.transmission > 0.0 for piece in fixed], 4)

    def segments(self, time: float) -> tuple[Floats, Bools, Ints]:
        """Segments (s, 4), whether they are of glass, and whose leaf they are, else -1."""
        parts, glass = [self._fixed], [self._fixed_glass]
        owners = [np.full(len(self._fixed), -1)]
        for number, (door, course) in enumerate(
            zip(self._world.doors, self._world.courses, strict=True)
        ):
            for which, outline in enumerate(door.outlines(course.at(time))):
                parts.append(edges(outline))
                glass.append(np.full(4, which == 0 and door.transmission > 0.0))
                owners.append(np.full(4, number))
        return np.vstack(parts), np.concatenate(glass), np.concatenate(owners)


def hits(
    scene: Scene, origins: Floats, directions: Floats, time: float, reach: float, passes: Bools
) -> tuple[Hits, Ints]:
    """Where rays end, those that pass glass behind it, and whose they are, else -1."""
    segments, glass, owners = scene.segments(time)
    near = distance_to(origins.mean(0), segments) < reach + 0.2
    segments, glass, owners = segments[near], glass[near], owners[near]
    ranges, index = cast(origins, directions, segments)
    if glass.any() and passes.any():
        solid = np.flatnonzero(~glass)
        behind, which = cast(origins[passes], directions[passes], segments[solid])
        ranges[passes] = behind
        index[passes] = np.where(which >= 0, solid[which] if len(solid) else -1, -1)
    cosine = cosines(directions, segments, index)
    legs = [person.legs(time) for person in scene.people]
    circles = np.vstack(legs) if legs else np.empty((0, 3))
    of_people = cast_circles(origins, directions, circles)
    before = of_people < ranges
    index, cosine = np.where(before, -1, index), np.where(before, 1.0, cosine)
    owner = np.where(index >= 0, owners[index] if len(owners) else -1, -1)
    return Hits(np.where(before, of_people, ranges), index, cosine), owner


def scans(seed: int, scene: Scene, drive: Drive, lasers: list[Laser]) -> list[Scan]:
    """All scans of a drive, by time."""
    result = []
    for number, laser in enumerate(lasers):
        rng = np.random.default_rng([seed, 31, number])
        for time in np.arange(laser.phase / laser.rate, drive.duration - 0.3, 1 / laser.rate):
            result.append(_scan(rng, scene, drive, number, laser, float(time)))
    return sorted(result, key=lambda scan: scan.time)


def _scan(
    rng: np.random.Generator,
    scene: Scene,
    drive: Drive,
    number: int,
    laser: Laser,
    time: float,
) -> Scan:
    count = len(laser.angles)
    times = time + laser.turn_time * np.arange(count) / count
    poses = drive.at(times)
    cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    origins = poses[:, :2] + np.column_stack(
        [cos * laser.x - sin * laser.y, sin * laser.x + cos * laser.y]
    )
    bearings = poses[:, 2] + laser.yaw + laser.angles
    directions = np.column_stack([np.cos(bearings), np.sin(bearings)])
    passes = rng.random(count) < 1 / 3
    met, owner = hits(scene, origins, directions, float(times.mean()), laser.range_max, passes)
    seen = owner[(owner >= 0) & (met.ranges < min(SEEN_WITHIN, laser.range_max))]
    seen_of = np.bincount(seen, minlength=scene.owned)
    return Scan(number, time, _read(rng, laser, met), seen_of)


def _read(rng: np.random.Generator, laser: Laser, hits: Hits) -> Floats:
    """Exact ranges as a laser reads them."""
    count, exact = len(hits.ranges), hits.ranges
    ranges = exact.copy()
    after = np.minimum(np.arange(count) + 1, count - 1)
    following = exact[after]
    with np.errstate(invalid="ignore"):
        beside = np.abs(following - exact) > EDGE
    beside &= np.isfinite(exact) & np.isfinite(following)
    beside &= hits.index != hits.index[after]  # on one slanted wall, a beam mixes nothing
    mixed = beside & (rng.random(count) < laser.mixed)
    share = rng.random(count)
    ranges[mixed] = (share * exact)[mixed] + ((1 - share) * following)[mixed]

    slope = np.minimum(np.sqrt(1 - hits.cosine**2) / np.maximum(hits.cosine, 0.05), 5.0)
    reach = np.where(np.isfinite(ranges), ranges, 0.0)
    sigma = np.sqrt(
        laser.noise**2 + (laser.noise_share * reach) ** 2 + (laser.footprint * reach * slope) ** 2
    )
    ranges += laser.bias + sigma * rng.standard_normal(count)
    lost = rng.random(count) < np.where(
        hits.cosine < GRAZING, laser.dropout + laser.grazing_dropout, laser.dropout
    )
    ranges[lost | (ranges > laser.range_max)] = np.inf
    return np.round(np.maximum(ranges, laser.range_min), 3)
