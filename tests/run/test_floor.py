"""What a run maps of things that its building doesn't know."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from objstate.building.occupancy import read_map
from objstate.config import Settings
from objstate.geometry import FloatArray
from objstate.localization import PoseBelief
from objstate.objects import ObjectBelief, filter_for
from objstate.particles import Weights
from objstate.recording.candidates import read_candidates
from objstate.recording.grids import CLUTTER, GRID_MAP, ClutterWriter, read_clutter
from objstate.run import GRID_FILES, RunOptions, estimate_log
from objstate.run.floor import Floor
from objstate.world.store import open_store
from tests import rooms

ROOT = Path(__file__).parents[2]
SECOND = 10**9
BOX = np.array([1.5, 0.5])
HINGE = np.array([-1.0, 1.0])
POSE = np.array([-1.0, -1.0, 0.3])


class Simulated:
    """A room of 6 by 5 m with a door and a box, of which the building knows nothing."""

    def __init__(self, box: bool = True) -> None:
        self.door = rooms.door("door", *HINGE)
        walls = rooms.enclosure(6.0, 5.0)
        self.building = rooms.building(walls, self.door)
        things = [walls, rooms.block(*BOX, 0.5, 0.5)] if box else [walls]
        self.real = rooms.ExpectedRanges(rooms.building(rooms.Mesh.joined(things), self.door))
        self.rng = np.random.default_rng(4)

    def scan(self, second: float, angle: float, false_share: float = 0.02) -> Any:
        rays = rooms.fan(361, 2 * np.pi)
        ranges = self.real.scene({"door": np.array([angle])}, POSE[None], rays)[0]
        ranges = ranges + 0.02 * self.rng.standard_normal(len(ranges))
        false = self.rng.random(len(ranges)) < false_share
        ranges[false] = self.rng.uniform(0.1, 8.0, int(false.sum()))
        return rooms.scan_of(ranges, rays, round(second * SECOND))

    def belief(self, angle: float | None) -> ObjectBelief:
        prior = filter_for(self.door, Settings()).prior(np.random.default_rng(0))
        if angle is None:
            return prior
        off = np.abs(prior.states[:, 0] - angle)
        return prior.with_weights(Weights.of(np.exp(-0.5 * (off / 0.01) ** 2)))


def estimator(room: Simulated, angle: float | None, std: float = 0.005, lost: bool = False) -> Any:
    spread = np.diag([std, std, 0.2 * std]) ** 2
    robot = PoseBelief.gaussian(POSE, spread, 200, np.random.default_rng(1))
    robot.__dict__["_moments"] = (POSE, spread)
    belief = room.belief(angle)
    return SimpleNamespace(
        robot=robot,
        objects={"door": belief},
        object_at=lambda name, stamp_ns: belief,
        map_error=0.005,
        is_lost=lost,
    )


@pytest.fixture
def writer(tmp_path: Path) -> Any:
    with ClutterWriter(tmp_path) as opened:
        yield opened


def mapped(writer: Any, room: Simulated, state: Any, angle: float = 0.6) -> Floor:
    floor = Floor(room.building, Settings(), writer)
    for number in range(8):
        floor.note(room.scan(0.2 * number, angle), state, [])
    return floor


def near(places: FloatArray, middle: FloatArray, reach: float) -> Any:
    return np.abs(places - middle).max(axis=1) < reach


def test_a_box_is_mapped_and_walls_doors_and_false_readings_are_not(writer: Any) -> None:
    room = Simulated()
    floor = mapped(writer, room, estimator(room, 0.6))
    places = floor.clutter(2 * SECOND).places
    on_box = near(places, BOX, 0.33)
    assert on_box.sum() > 10  # the sides of 0.5 m that are seen
    assert (~on_box).sum() <= 2
    assert floor.doubts() == []


def test_a_run_without_a_level_scan_says_that_it_has_no_grid(writer: Any, tmp_path: Path) -> None:
    room = Simulated()
    floor = Floor(room.building, Settings(), writer)
    floor.write(tmp_path, SECOND, estimator(room, 0.6))
    assert not (tmp_path / GRID_MAP).exists()
    assert "no level laser" in floor.doubts()[0]


def test_a_door_that_is_elsewhere_than_believed_is_mapped(writer: Any) -> None:
    room = Simulated(box=False)
    floor = mapped(writer, room, estimator(room, 0.1), angle=1.2)
    leaf = HINGE + 0.6 * np.array([np.cos(1.2), np.sin(1.2)])
    assert near(floor.clutter(2 * SECOND).places, leaf, 0.2).sum() > 5
    right = mapped(writer, room, estimator(room, 1.2), angle=1.2)
    assert len(right.clutter(2 * SECOND).places) <= 2


@pytest.mark.parametrize("state", [{"lost": True}, {"std": 0.2}])
def test_a_robot_that_is_lost_or_unsure_maps_nothing(writer: Any, state: Any) -> None:
    room = Simulated()
    floor = mapped(writer, room, estimator(room, 0.6, **state))
    assert floor.taken == 0
    assert not len(floor.clutter(2 * SECOND).places)
    assert "took no scan in" in floor.doubts()[0]


def test_what_was_mapped_ages_while_the_robot_is_lost(writer: Any) -> None:
    room = Simulated()
    floor = mapped(writer, room, estimator(room, 0.6))
    before = len(floor.clutter(2 * SECOND).places)
    floor.note(room.scan(200.0, 0.6), estimator(room, 0.6, lost=True), [])
    assert floor.clutter(200 * SECOND).percent.max() < 70
    assert before > len(floor.clutter(400 * SECOND).places) == 0


def test_the_map_holds_walls_doors_and_the_box(writer: Any, tmp_path: Path) -> None:
    room = Simulated()
    state = estimator(room, 0.6)
    floor = mapped(writer, room, state)
    floor.write(tmp_path, 2 * SECOND, state)
    found = read_map(tmp_path / GRID_MAP)
    rows, columns = np.nonzero(found.occupied)
    places = found.to_building(np.column_stack([columns, rows]) + 0.5)
    leaf = HINGE + 0.5 * np.array([np.cos(0.6), np.sin(0.6)])
    for middle, reach in ((BOX, 0.35), (leaf, 0.1), (np.array([3.0, 0.0]), 0.1)):
        assert near(places, middle, reach).any()
    assert not near(places, np.array([0.0, 0.0]), 0.8).any()
    values = floor.occupied(2 * SECOND, state)
    assert values is not None
    assert ((values >= 0.0) & (values <= 1.0)).all()


def test_a_box_that_stays_becomes_a_candidate_and_is_written(writer: Any, tmp_path: Path) -> None:
    room = Simulated()
    state, floor = estimator(room, 0.6), Floor(room.building, Settings(), writer)
    for number in range(15):
        floor.note(room.scan(6.0 * number, 0.6), state, [])
    floor.write(tmp_path, 84 * SECOND, state)
    (found,) = read_candidates(tmp_path)
    assert found.probability > 0.8
    assert np.hypot(found.x - BOX[0], found.y - BOX[1]) < 0.25  # two of its sides are in sight
    assert found.length < 0.8  # its diagonal, and a cell


def test_a_door_of_unknown_angle_is_spread_over_its_swing(writer: Any) -> None:
    room = Simulated(box=False)
    state = estimator(room, None)
    floor = Floor(room.building, Settings(), writer)
    floor.note(room.scan(0.0, 0.6), state, [])
    values = floor.occupied(0, state)
    assert values is not None
    assert floor.grid is not None
    for angle in (0.4, 0.8, 1.2):
        place = HINGE + 0.6 * np.array([np.cos(angle), np.sin(angle)])
        column, row = floor.grid.layout.to_cells(place).astype(int)
        gain = values[row, column] - floor.grid.values(0)[row, column]
        assert 0.005 < gain < 0.3  # a leaf that may be there, as it may be elsewhere


def test_a_run_with_a_grid_writes_its_files_and_the_same_estimates(tmp_path: Path) -> None:
    drive = [ROOT / "logs/corridor.mcap"], ROOT / "models/corridor/corridor.urdf"
    options = RunOptions(end=6.0)
    world = tmp_path / "world.db"
    for name, grid in (("with", True), ("without", False), ("again", True)):
        memory = world if name == "again" else None
        estimate_log(*drive, tmp_path / name, options, grid=grid, world=memory)
    with_grid, without, again = (tmp_path / name for name in ("with", "without", "again"))
    assert all((with_grid / file).exists() for file in GRID_FILES)
    assert not any((without / file).exists() for file in GRID_FILES)
    estimates = "estimates.parquet"
    assert (with_grid / estimates).read_bytes() == (without / estimates).read_bytes()
    for file in GRID_FILES:
        assert (with_grid / file).read_bytes() == (again / file).read_bytes()
    assert read_clutter(with_grid).height == 2
    assert read_clutter(without).height == 0
    assert CLUTTER in GRID_FILES
    assert read_candidates(without) == []
    seen = open_store(world).load().occupied([[2.0, 0.0], [4.0, 0.0]], robot_radius=0.2)
    assert seen.known > 0.9  # of the corridor's floor ahead
    assert seen.unlisted < 0.1
