"""Closed doors flush with the wall tell nothing of where a robot is along its corridor."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import Building, Mesh
from objstate.estimator import Estimator
from objstate.records import InitialPose, Scan
from tests.estimator.drives import START, START_NS, WIDTH, drive
from tests.rooms import building, door, wall

DOORS = {"a": (5.0, 1.0), "b": (8.0, -1.0), "c": (11.0, 1.0)}
THICK = 0.16  # m, of the walls
IN_90 = 4.605  # squared deviations, in two dimensions


def bare_corridor() -> Building:
    """90 m long, so that no end is in view, with three doors that open into it."""
    walls, middle = [], 1.0 + THICK / 2.0
    for side in (-1.0, 1.0):
        gaps = sorted(x for x, y in DOORS.values() if y == side)
        edges = [-30.0, *(edge for x in gaps for edge in (x, x + WIDTH)), 60.0]
        walls += [
            wall((start, side * middle), (end, side * middle), THICK)
            for start, end in zip(edges[::2], edges[1::2], strict=True)
        ]
    leaves = [
        door(name, x, 1.02) if y > 0 else door(name, x + WIDTH, -1.02, np.pi)
        for name, (x, y) in DOORS.items()
    ]
    return building(Mesh.joined(walls), *leaves)


@pytest.mark.parametrize("seed", [2, 3])
def test_flush_doors_do_not_drag_the_robot_along_a_bare_corridor(seed: int) -> None:
    place = bare_corridor()
    driven = drive(seed, 20.0, states=dict.fromkeys(DOORS, np.zeros(1)), place=place)
    estimator = Estimator(place, seed=0)
    estimator.feed(InitialPose(START_NS, START, np.diag([1e-4, 1e-4, 1e-4])))
    errors, inside = [], []
    for record in driven.records:
        estimator.feed(record)
        if isinstance(record, Scan):
            robot = estimator.robot
            assert robot is not None
            off = (robot.mean - driven.poses[record.stamp_ns])[:2]
            errors.append(np.hypot(*off))
            inside.append(off @ np.linalg.solve(robot.covariance[:2, :2], off) < IN_90)
    assert np.mean(errors) < 0.1
    assert np.mean(inside) > 0.9
    closed = [estimator.objects[name].probability_closed for name in DOORS]
    assert all(each is not None and each > 0.9 for each in closed)
