"""Beams are told apart by what they hit."""

from __future__ import annotations

import numpy as np
import pytest

from objstate.building.model import MovableObject
from objstate.estimator import Estimator
from objstate.run.scene.hits import Hit, HitFinder
from tests.rooms import building, enclosure, fan, scan_of, sliding_door, table

AHEAD = 1  # of three beams, at -45, 0 and 45 degrees


def hit_ahead(reading: float, *objects: MovableObject) -> Hit:
    """What a beam hit that read so much, from the middle of a room whose wall is 5 m ahead."""
    room = building(enclosure(10.0, 8.0), *objects)
    estimator = Estimator(room, initial_pose=np.zeros(3))
    assert estimator.robot is not None
    scan = scan_of(np.array([5.0, reading, 5.0]), fan(3, np.pi / 2))
    return Hit(HitFinder(room).hits(scan, estimator.robot, estimator)[AHEAD])


@pytest.mark.parametrize(
    ("reading", "hit"), [(4.95, Hit.WALL), (3.0, Hit.UNEXPECTED), (6.5, Hit.BEYOND)]
)
def test_a_wall_explains_what_reads_about_its_distance(reading: float, hit: Hit) -> None:
    assert hit_ahead(reading) == hit


@pytest.mark.parametrize(
    ("reading", "hit"), [(2.45, Hit.OBJECT), (1.0, Hit.UNEXPECTED), (4.95, Hit.BEYOND)]
)
def test_an_object_explains_it_where_it_is_believed(reading: float, hit: Hit) -> None:
    assert hit_ahead(reading, table("chest", 3.0, 0.0)) == hit


def test_an_object_behind_a_wall_explains_nothing() -> None:
    assert hit_ahead(4.95, table("chest", 6.0, 0.0)) == Hit.WALL


def test_a_sliding_door_far_along_its_rail_counts() -> None:
    rail = sliding_door("s", 2.0, -2.0, np.pi / 2, width=3.0)  # believed half open
    assert hit_ahead(2.0, rail) == Hit.OBJECT
