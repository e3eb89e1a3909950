"""A corridor with doors, and a robot that drives through it: records with known truth."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from objstate.building.model import Building, Mesh
from objstate.geometry import FloatArray, between, compose
from objstate.records import Odometry, Rays, Record, Scan
from objstate.sensing import ExpectedRanges
from tests.rooms import building, door, fan, scan_of, wall

SPEED = 0.7  # m/s
ODOMETRY_STEP = 0.05  # s
SCAN_EVERY = 4  # odometry readings
RANGE_MAX = 8.0  # m
NOISE = 0.03  # m
SLIP = 0.01  # of a step, and of rad per m: the odometry's own error
LENGTH = 10.0  # m of the corridor
DOORS = {
    "a": (2.5, 1.0, 0.0),
    "b": (4.5, -1.0, 50.0),
    "c": (6.0, 1.0, 82.0),
    "d": (8.0, -1.0, 20.0),
}
WIDTH = 0.9  # m of a leaf
START = np.array([0.8, 0.1, 0.05])
START_NS = 1_000_000_000


def corridor() -> Building:
    """Two metres wide, closed at its ends, with two doors on each side and rooms behind."""
    walls = [wall((0.0, -3.0), (0.0, 3.5)), wall((LENGTH, -2.6), (LENGTH, 3.2))]
    for side in (-1.0, 1.0):
        gaps = sorted(x for x, y, _ in DOORS.values() if y == side)
        edges = [0.0, *(edge for x in gaps for edge in (x, x + WIDTH)), LENGTH]
        walls += [
            wall((start, side), (end, side))
            for start, end in zip(edges[::2], edges[1::2], strict=True)
        ]
        walls.append(wall((0.0, side * 3.0), (LENGTH, side * 2.8)))
    # doors open into the rooms: away from the corridor, to either side of it
    leaves = [
        door(name, x, y) if y > 0 else door(name, x + WIDTH, y, np.pi)
        for name, (x, y, _) in DOORS.items()
    ]
    return building(Mesh.joined(walls), *leaves)


def truth() -> dict[str, FloatArray]:
    return {name: np.radians([angle]) for name, (_, _, angle) in DOORS.items()}


@dataclass(frozen=True)
class Drive:
    """Records and the poses in which the scans were really taken."""

    records: list[Record]
    poses: dict[int, FloatArray]  # by stamp, at scans


def path(seconds: float) -> Iterator[FloatArray]:
    """True poses at the odometry's rate: along the corridor, weaving a little."""
    pose = START
    for k in range(int(seconds / ODOMETRY_STEP) + 1):
        yield pose
        turn = 0.25 * np.cos(0.9 * k * ODOMETRY_STEP) * ODOMETRY_STEP
        pose = compose(pose, np.array([SPEED * ODOMETRY_STEP, 0.0, turn - 0.1 * pose[2] * 0.1]))


def drive(
    seed: int,
    seconds: float = 10.0,
    lasers: Mapping[str, Rays] | None = None,
    states: Mapping[str, FloatArray] | None = None,
    place: Building | None = None,
) -> Drive:
    """A drive along the corridor; lasers read with noise, the odometry slips."""
    rng = np.random.default_rng(seed)
    place = corridor() if place is None else place
    expected = ExpectedRanges(place)
    lasers = {"front": fan(181)} if lasers is None else lasers
    states = truth() if states is None else states
    records: list[Record] = []
    poses: dict[int, FloatArray] = {}
    odometry, before = np.array([5.0, -3.0, 1.0]), START
    for k, pose in enumerate(path(seconds)):
        step = between(before, pose)
        slip = SLIP * np.hypot(*step[:2]) * rng.standard_normal(3)
        odometry, before = compose(odometry, step + slip), pose
        stamp = START_NS + round(k * ODOMETRY_STEP * 1e9)
        records.append(Odometry(stamp, odometry))
        if k % SCAN_EVERY == 0:
            poses[stamp] = pose
            records += [
                _read(expected, states, pose, rays, rng, stamp, name, odometry)
                for name, rays in lasers.items()
            ]
    return Drive(records, poses)


def _read(
    expected: ExpectedRanges,
    states: Mapping[str, FloatArray],
    pose: FloatArray,
    rays: Rays,
    rng: np.random.Generator,
    stamp: int,
    laser: str,
    odometry: FloatArray,
) -> Scan:
    ranges = expected.scene(states, pose[None], rays)[0]
    ranges = ranges + NOISE * rng.standard_normal(len(ranges))
    return scan_of(ranges, rays, stamp, laser, odometry, RANGE_MAX)
