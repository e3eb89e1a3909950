"""What is left out of an outline was hidden: rays from where a laser fits are as long as before."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from objstate.building.model import Mesh
from objstate.building.outline import outline
from objstate.building.visible import LASER_ROOM, visible
from objstate.geometry import BoolArray, FloatArray
from objstate.sensing import segments
from tests.rooms import block, enclosure, fence

CELL = 0.05  # m


def cells(occupied: BoolArray, turn: float = 0.0) -> Mesh:
    """A box for each occupied cell of a map."""
    cos, sin = np.cos(turn), np.sin(turn)
    middles = CELL * np.argwhere(occupied) @ np.array([[cos, sin], [-sin, cos]])
    return Mesh.joined([block(*middle, CELL, CELL, turn) for middle in middles])


def ranges(walls: FloatArray, rays: FloatArray) -> FloatArray:
    return np.asarray(segments.cast(rays, np.ascontiguousarray(walls.reshape(-1, 4))))


def rays_from_free_places(segments: FloatArray, count: int, seed: int) -> FloatArray:
    """Rays (n, 4) from where no wall is nearer than a laser needs."""
    rng = np.random.default_rng(seed)
    places = rng.uniform(
        segments.min(axis=(0, 1)) - 1.0, segments.max(axis=(0, 1)) + 1.0, (count, 2)
    )
    walls = shapely.union_all(shapely.linestrings(segments))
    places = places[shapely.distance(shapely.points(places), walls) > LASER_ROOM]
    bearings = rng.uniform(-np.pi, np.pi, len(places))
    return np.column_stack([places, np.cos(bearings), np.sin(bearings)])


def assert_looks_the_same(walls: Mesh, seed: int = 0) -> tuple[int, int]:
    """How many segments the outline has, and how many of them are visible."""
    whole = outline(walls, 0.3)
    left = visible(whole)
    rays = rays_from_free_places(whole, 3000, seed)
    assert len(rays) > 100
    np.testing.assert_array_equal(ranges(left, rays), ranges(whole, rays))
    return len(whole), len(left)


@pytest.mark.parametrize("turn", [0.0, 0.37])
def test_walls_of_cells_are_as_few_segments_as_walls_of_boxes(turn: float) -> None:
    occupied = np.zeros((80, 60), dtype=bool)
    occupied[:6], occupied[-6:], occupied[:, :6], occupied[:, -6:] = True, True, True, True
    occupied[30:34, 6:40] = True
    whole, left = assert_looks_the_same(cells(occupied, turn))
    assert whole > 50
    assert left == 4 + 4 + 3  # outside, inside, and the wall that stands out from a side


@pytest.mark.parametrize("seed", range(4))
def test_a_noisy_map_looks_the_same_from_everywhere(seed: int) -> None:
    rng = np.random.default_rng(seed)
    occupied = rng.random((50, 50)) < 0.04
    occupied[20:25, 5:45] |= rng.random((5, 40)) < 0.9
    whole, left = assert_looks_the_same(cells(occupied, 0.1 * seed), seed)
    assert left < whole


@pytest.mark.parametrize("seed", range(4))
def test_boxes_that_overlap_look_the_same(seed: int) -> None:
    rng = np.random.default_rng(seed)
    boxes = [
        block(*rng.uniform(-3, 3, 2), rng.uniform(0.3, 3.0), rng.uniform(0.05, 0.19), turn)
        for turn in rng.uniform(-3, 3, 30)
    ]
    assert_looks_the_same(Mesh.joined(boxes), seed)


def test_a_room_that_is_a_box_keeps_what_stands_in_it() -> None:
    """A region as large as a room is seen from within, whether or not it was meant to be solid."""
    room = Mesh.joined([block(0.0, 0.0, 5.0, 4.0), block(1.0, 1.0, 0.5, 0.5), enclosure(9.0, 9.0)])
    whole = outline(room, 0.3)
    rays = np.array([[-1.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0]])
    np.testing.assert_allclose(ranges(visible(whole), rays), [2.0, 0.75], atol=1e-9)


def test_sheets_without_thickness_stay() -> None:
    sheet = fence(np.array([[0.0, 0.0], [3.0, 0.0], [3.0, 2.0]]))
    whole = outline(sheet, 0.3)
    np.testing.assert_array_equal(visible(whole), whole)


def test_nothing_stays_nothing() -> None:
    assert visible(np.zeros((0, 2, 2))).shape == (0, 2, 2)
