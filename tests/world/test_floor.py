"""What drives left of their grids, asked by planners: it ages, and the newest that knows a place counts."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import numpy as np
import pytest

from objstate.errors import WorldError
from objstate.grid import CountCells, Grid, Layout, circle
from objstate.world import FloorMemory, World
from objstate.world.store import DriveEntry, open_store
from tests.world.examples import BUILDING, OBJECTS, SECOND, at_angle, desk_at

LAYOUT = Layout(0.1, 60, 80, np.array([-4.0, -3.0, 0.2]))
LIFE = 100.0  # s
BOX = np.array([-1.5, -1.0])
AROUND = BOX + 0.3 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
FREE = AROUND + np.array([1.5, 0.0])
FAR = AROUND + np.array([100.0, 0.0])


def left(stamp_ns: int, *, box: bool = True, where: np.ndarray = BOX) -> FloorMemory:
    """All floor within a metre of a place was seen free at a moment, but for a box."""
    grid = Grid(LAYOUT, CountCells(max_age_s=LIFE))
    grid.draw(circle(LAYOUT, where, 2.0, 0.0), stamp_ns)
    if box:
        for _ in range(8):
            grid.draw(circle(LAYOUT, where, 0.2, 1.0), stamp_ns)
    return FloorMemory.of(grid, grid.values(stamp_ns), stamp_ns)


def world_of(*floors: FloorMemory) -> World:
    return World(OBJECTS, World.of(OBJECTS).settings, {}, tuple(each.kept() for each in floors))


def test_values_come_back_as_the_grid_has_them_and_age_alike() -> None:
    grid = Grid(LAYOUT, CountCells(max_age_s=LIFE))
    grid.draw(circle(LAYOUT, BOX, 1.0, 0.0), 0)
    grid.draw(circle(LAYOUT, BOX, 0.3, 0.9), 30 * SECOND)
    memory = FloorMemory.of(grid, grid.values(50 * SECOND), 50 * SECOND)
    for second in (50, 80, 120, 140, 200):
        expected = grid.values(second * SECOND)
        assert memory.values(second * SECOND) == pytest.approx(expected, abs=0.01)


def test_a_box_is_in_the_way_until_it_is_forgotten() -> None:
    world = world_of(left(0))
    chances = [world.occupied(AROUND, stamp_ns=s * SECOND) for s in (0, 30, 60, 200)]
    sure = [each.unlisted for each in chances]
    assert sure[0] > 0.9
    assert sure == sorted(sure, reverse=True)
    assert [each.known for each in chances] == [1.0, 1.0, 1.0, 0.0]
    assert chances[0].seen_ns == 0
    assert chances[-1].unlisted == 0.0
    assert chances[-1].seen_ns is None
    assert world.occupied(FREE, stamp_ns=0).unlisted < 0.05
    elsewhere = world.occupied(FAR, stamp_ns=0)
    assert (elsewhere.known, elsewhere.probability) == (0.0, 0.0)


def test_a_path_meets_what_is_within_the_robots_radius() -> None:
    world = world_of(left(0))
    beside = BOX + np.array([[-1.0, 0.5], [1.0, 0.5]])
    assert world.occupied(beside, 0.2, 0).unlisted < 0.05
    assert world.occupied(beside, 0.4, 0).unlisted > 0.9


def test_what_a_path_leads_around_is_not_in_its_way() -> None:
    about = np.vstack([AROUND, AROUND[:1]])
    around_box, around_desk = BOX + 3.0 * (about - BOX), np.array([3.0, 1.0]) + 5.0 * (about - BOX)
    world = world_of(left(0)).with_beliefs([desk_at(3.0, 0)])
    assert world.occupied(around_box, 0.1, stamp_ns=0).unlisted < 0.05
    assert world.occupied(around_desk, 0.1, stamp_ns=0).blockers == ()
    through = np.vstack([around_desk, [3.0, 1.0]])
    assert [each.object for each in world.occupied(through, 0.1, stamp_ns=0).blockers] == ["desk"]


def test_the_newest_drive_that_knows_a_cell_counts() -> None:
    gone = world_of(left(0), left(10 * SECOND, box=False))
    assert gone.occupied(AROUND, stamp_ns=5 * SECOND).unlisted > 0.8
    assert gone.occupied(AROUND, stamp_ns=10 * SECOND).unlisted < 0.05
    other = world_of(left(0), left(10 * SECOND, box=False, where=BOX + np.array([4.0, 0.0])))
    found = other.occupied(AROUND, stamp_ns=10 * SECOND)
    assert found.unlisted > 0.8
    assert found.seen_ns == 0


def test_objects_and_the_grid_are_in_the_way_together() -> None:
    world = World.of(OBJECTS, None, [at_angle(0.0, 0)])
    leaf = world.objects["door"].mesh.vertices[:, :2]
    spot = np.array([0.4, 0.0]) + 0.1 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    assert np.abs(leaf).max() > 0.5
    found = world.occupied(spot)
    assert [each.object for each in found.blockers] == ["door"]
    assert found.probability == pytest.approx(found.blockers[0].probability)
    assert found.probability > 0.95
    clear = world.occupied(spot + np.array([0.0, 0.5]))
    assert clear.probability < 0.01


def test_a_world_in_a_database_keeps_what_drives_left(place: str) -> None:
    store = open_store(place, BUILDING)
    assert store.add(DriveEntry("one", 0, SECOND), [], left(SECOND))
    assert store.add(DriveEntry("two", 2 * SECOND, 3 * SECOND), [])
    assert not store.add(DriveEntry("one", 0, SECOND), [], left(SECOND))
    world = open_store(place).load()
    assert len(world.floors) == 1
    assert world.latest_ns == store.latest_ns() == SECOND
    assert world.occupied(AROUND).unlisted > 0.9
    assert not store.load(without="one").floors
    assert not store.load(until_ns=0).floors
    assert len(store.load(since_ns=100 * SECOND).floors) == 1
    assert not store.load(since_ns=101 * SECOND).floors


def test_worlds_made_before_there_were_floors_go_on(tmp_path: Path) -> None:
    path = tmp_path / "world.db"
    open_store(path, BUILDING).add(DriveEntry("old", 0, SECOND), [at_angle(0.3, SECOND)])
    with sqlite3.connect(path) as connection:
        connection.execute("DROP TABLE drive_floor")
        connection.execute("UPDATE world SET form = 1")
    store = open_store(path)
    assert not store.load().floors
    assert store.add(DriveEntry("new", SECOND, 2 * SECOND), [], left(2 * SECOND))
    assert len(store.load().floors) == 1


@pytest.mark.parametrize("cut", [0, 20, -1])
def test_a_damaged_floor_is_told(cut: int) -> None:
    packed = left(0).pack()
    with pytest.raises(WorldError, match="damaged"):
        FloorMemory.unpack(packed[:cut], 0)


@pytest.mark.parametrize(
    "area",
    [
        np.zeros((0, 2)),
        np.array([[0.0, 0.0], [1.0, 1.0]]),
        np.array([[0.0, 0.0], [1.0, np.nan], [1.0, 1.0]]),
        np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]),  # edges cross
        np.array([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0]]),  # encloses nothing
    ],
)
def test_areas_that_are_none_are_refused(area: np.ndarray) -> None:
    with pytest.raises(WorldError, match="polygon"):
        world_of().occupied(area)
