"""Walls that are passed over could not have changed a range, and they cost next to nothing."""

from __future__ import annotations

from time import perf_counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.building.model import Mesh
from objstate.config import BeamModelSettings
from objstate.geometry import FloatArray, transform_from_pose
from objstate.sensing import BeamModel, ScanView, Sensing, cast_from, segments
from objstate.sensing.neighbourhood import Walls
from tests.rooms import block, building, enclosure, fan, scan_of

FAR = 80.0  # m
BEAMS = fan(181, 1.5 * np.pi)


def view_of(walls: Mesh, range_max: float = FAR) -> ScanView:
    scan = scan_of(np.full(len(BEAMS), 1.0), BEAMS, range_max=range_max)
    return Sensing(building(walls), BeamModel(BeamModelSettings())).view(scan)


def clutter(count: int, size: float, seed: int) -> Mesh:
    """Boxes of 5 cm, as the cells of a noisy map, and a few walls, all over a square."""
    rng = np.random.default_rng(seed)
    places, turns = rng.uniform(-size, size, (count, 2)), rng.uniform(-3.0, 3.0, count)
    boxes = [block(*place, 0.05, 0.05, turn) for place, turn in zip(places, turns, strict=True)]
    lengths = rng.uniform(1.0, 12.0, count // 20)
    boxes += [
        block(*place[::-1], length, 0.1, turn)
        for place, turn, length in zip(places, turns, lengths, strict=False)
    ]
    return Mesh.joined(boxes)


def lines_of(walls: Mesh) -> FloatArray:
    """The segments (m, 4) of walls at the laser's height."""
    return Sensing(building(walls), BeamModel(BeamModelSettings())).walls_at(0.3)


def by_each_segment(lines: FloatArray, pose: FloatArray) -> FloatArray:
    """Ranges (n,) of every beam against every segment."""
    origins, directions = cast_from(transform_from_pose(pose), BEAMS)
    return np.asarray(segments.cast(np.hstack([origins[:, :2], directions[:, :2]]), lines))


@settings(max_examples=30)
@given(st.integers(0, 10_000), st.floats(0.0, 12.0), st.integers(1, 250))
def test_ranges_are_those_of_all_segments(seed: int, spread: float, count: int) -> None:
    """From poses close together, and from poses all over the building."""
    walls = clutter(150, 8.0, seed)
    rng = np.random.default_rng(seed)
    poses = rng.uniform([-spread, -spread, -3.0], [spread, spread, 3.0], (count, 3)) / 2.0
    found, lines = view_of(walls).walls(poses), lines_of(walls)
    for k in rng.integers(0, count, 4):
        np.testing.assert_allclose(found[k], by_each_segment(lines, poses[k]), atol=1e-9)


def test_a_scan_costs_no_more_for_what_is_out_of_sight() -> None:
    """A hundred times as many walls behind those that are seen take about the same time."""
    poses = np.random.default_rng(0).normal(0.0, 0.05, (100, 3))

    def seconds(far: int) -> float:
        boxes = [block(8.0 + 0.3 * (k % 200), 0.3 * (k // 200), 0.1, 0.1) for k in range(far)]
        view = view_of(Mesh.joined([enclosure(10.0, 10.0), *boxes]))
        view.walls(poses)
        taken = []
        for _ in range(5):
            begin = perf_counter()
            view.walls(poses + 1e-6)  # other poses: what was found for the last isn't the answer
            taken.append(perf_counter() - begin)
        return min(taken)

    assert seconds(5000) < 5.0 * seconds(50)


def test_asking_in_turns_from_near_and_from_afar_finds_neighbours_once() -> None:
    """A search asks from all over the building between two scans that ask from one place."""
    walls = Walls(np.random.default_rng(1).uniform(-40.0, 40.0, (500, 4)))
    here = np.array([0.3, 0.4])
    found = walls.near(here[None], 20.0)
    for x in np.arange(-40.0, 40.0, 0.9):
        walls.near(np.array([[x, 0.0]]), 20.0)
        assert walls.near(here[None] + 0.1, 19.9) is found


def test_the_walls_near_several_places_are_those_near_each_in_turn() -> None:
    walls = Walls(np.random.default_rng(1).uniform(-40.0, 40.0, (500, 4)))
    places = np.array([[0.3, 0.4], [20.0, -7.0], [0.2, 0.1]])
    together = walls.near(places, 10.0)
    begin = 0
    for place, middle, end in zip(places, together.places, together.ends, strict=True):
        alone = walls.near(place[None], 10.0)
        np.testing.assert_array_equal(middle, alone.places[0])
        np.testing.assert_array_equal(together.groups[begin:end], alone.groups)
        np.testing.assert_array_equal(together.distances[begin:end], alone.distances)
        begin = end
    assert begin == len(together.groups)


@pytest.mark.parametrize("reach", [0.5, 3.0, 50.0])
def test_groups_hold_each_wall_once_and_none_in_reach_is_left_out(reach: float) -> None:
    rng = np.random.default_rng(2)
    start = rng.uniform(-20.0, 20.0, (400, 2))
    segments = np.hstack([start, start + rng.normal(0.0, 1.5, (400, 2))])
    walls = Walls(segments)
    groups = walls.groups
    assert sorted(groups.segments.tolist()) == sorted(segments.tolist())
    for place in rng.uniform(-20.0, 20.0, (20, 2)):
        near = walls.near(place[None], reach)
        assert (np.diff(near.distances) >= 0.0).all()
        given = {
            tuple(row)
            for group in near.groups
            for row in groups.segments[groups.starts[group] : groups.starts[group + 1]].tolist()
        }
        ends = np.linspace(segments[:, :2], segments[:, 2:], 50, axis=1)
        gap = np.hypot(*(ends - place).transpose(2, 0, 1)).min(axis=1)
        assert {tuple(row) for row in segments[gap <= reach].tolist()} <= given


def test_there_may_be_no_walls() -> None:
    assert np.isinf(view_of(Mesh.empty()).walls(np.zeros((3, 3)))).all()
