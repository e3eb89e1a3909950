"""A room that the map lacks, and that looks like another one."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
import pytest

from objstate.building.model import Building, Mesh
from objstate.estimator import Estimator
from objstate.geometry import FloatArray, between, compose
from objstate.records import InitialPose, Odometry, Record, Scan
from objstate.sensing import ExpectedRanges
from tests.rooms import block, building, fan, scan_of, wall

HZ, SPEED, TURN = 5.0, 0.5, 0.6  # scans a second, m/s, rad/s
NOISE, SLIP, RANGE_MAX = 0.01, 0.02, 10.0  # m, 1, m
WEST, EAST, ROOM = -2.0, 16.0, 3.2  # m, ends of the corridor, and the length of a room along it
CLOSED = wall((10.5, 1.05), (11.5, 1.05))  # the door was closed while the map was made
CLOSE = np.diag([0.0025, 0.0025, 0.001])  # covariance of where it starts
BEGIN_NS = 1_700_000_000_000_000_000


def room(left: float, *, is_north: bool) -> Mesh:
    """Three walls of a room beside the corridor, 3 m deep, with a cabinet in it."""
    side = 1.0 if is_north else -1.0
    corners = [(left, 1.0), (left, 4.0), (left + ROOM, 4.0), (left + ROOM, 1.0)]
    x, y = np.array(corners).T
    if not is_north:  # the same room, turned by half a turn
        x = 2.0 * left + ROOM - x
    places = list(zip(x.tolist(), (side * y).tolist(), strict=True))
    cabinet = block(left + ROOM / 2.0 + side * 1.2, side * 3.7, 0.8, 0.5)
    return Mesh.joined([*(wall(a, b) for a, b in pairwise(places)), cabinet])


def floor(*more: Mesh) -> Building:
    """A corridor whose southern room is open."""
    sides = [
        wall((WEST, 1.05), (10.5, 1.05)),
        wall((11.5, 1.05), (EAST, 1.05)),
        wall((WEST, -1.05), (4.5, -1.05)),
        wall((5.5, -1.05), (EAST, -1.05)),
        wall((WEST, -1.05), (WEST, 1.05)),
        wall((EAST, -1.05), (EAST, 1.05)),
    ]
    return building(Mesh.joined([*sides, room(3.4, is_north=False), *more]))


def route() -> Iterator[FloatArray]:
    """Along the corridor, into the northern room, about in there, and out again."""
    pose = np.array([2.0, 0.0, 0.0])
    legs = [(9.0, 0.0), (0.0, np.pi / 2), (2.4, 0.0), (0.0, 2 * np.pi), (0.0, np.pi), (2.4, 0.0)]
    for way, turn in [*legs, (0.0, np.pi / 2), (3.0, 0.0)]:
        count = int(np.ceil(max(way / SPEED, abs(turn) / TURN) * HZ))
        for _ in range(count):
            yield pose
            pose = compose(pose, np.array([way, 0.0, turn]) / count)


def drive(seed: int) -> tuple[list[Record], list[FloatArray]]:
    """Odometry and scans, and the true poses of these."""
    rng, expected, rays = np.random.default_rng(seed), ExpectedRanges(floor(NORTHERN)), fan(181)
    records, poses = list[Record](), list(route())
    odometry, before = np.array([-2.0, 7.0, 0.4]), poses[0]
    for number, pose in enumerate(poses):
        step = between(before, pose)
        slip = SLIP * np.abs(step).sum() * rng.standard_normal(3) * np.array([1.0, 1.0, 0.3])
        odometry, before = compose(odometry, step + slip), pose
        stamp = BEGIN_NS + round(number / HZ * 1e9)
        ranges = expected.scene({}, pose[None], rays)[0]
        ranges = ranges + NOISE * rng.standard_normal(len(ranges))
        scan = scan_of(ranges, rays, stamp, "front", odometry, RANGE_MAX)
        records += [Odometry(stamp, odometry), scan]
    return records, poses


NORTHERN = room(9.4, is_north=True)


@pytest.mark.parametrize("seed", [0, 2, 3])
def test_in_a_room_that_the_map_lacks_the_robot_is_seldom_believed_in_one_that_looks_like_it(
    seed: int,
) -> None:
    records, poses = drive(seed)
    estimator, wrong = Estimator(floor(CLOSED), seed=seed), list[bool]()
    for record in [InitialPose(BEGIN_NS, poses[0], CLOSE), *records]:
        estimator.feed(record)
        if isinstance(record, Scan):
            assert estimator.robot is not None
            off = float(np.hypot(*(estimator.robot.mean - poses[len(wrong)])[:2]))
            wrong.append(off > 0.75 and estimator.p_localized > 0.9)
    assert estimator.lost  # in the room nothing is as the map has it
    assert sum(wrong) / HZ < 10.0  # s, of 24 s in the room and 8 s behind it
