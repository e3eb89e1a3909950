"""Doors are found in a map and drives, and walls that lean in a map are put straight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.finding import Tally, closed, compare
from benchmarks.floors import Floor, make_drives
from objstate.building.door_table import Door
from objstate.discovery import learn_doors
from objstate.discovery.gathering import Beams
from objstate.discovery.scoring import chained
from objstate.discovery.walls import WallLine, fitted
from objstate.geometry import FloatArray

THICK, HALF, DEPTH = 0.14, 1.0, 2.5  # m


def floor() -> Floor:
    """A corridor with a door, an opening without a leaf, a niche, and a double door."""
    out = Floor(half=HALF, length=8.0)
    gaps = {1: [(1.0, 1.9), (5.0, 5.9)], -1: [(1.5, 2.3), (4.5, 6.2)]}
    for side, between in gaps.items():
        ends = [-THICK, *(end for gap in between for end in gap), 8.0 + THICK]
        for left, right in zip(ends[::2], ends[1::2], strict=True):
            out.walls.append((left, right, *sorted((side * HALF, side * (HALF + THICK)))))
        back = HALF + THICK + DEPTH
        out.walls.append((-THICK, 8.0 + THICK, *sorted((side * back, side * (back + THICK)))))
        for x in (-THICK, 8.0, 3.7):
            near = HALF + THICK if x == 3.7 else 0.0
            out.walls.append((x, x + THICK, *sorted((side * near, side * back))))
    niche = sorted((-HALF - 0.4, -HALF - 0.5))
    out.walls.append((1.4, 2.4, *niche))
    y = HALF + THICK
    out.doors.append(Door("single", np.array([1.01, y]), 0.0, 1, 0.88, 1.8))
    out.doors.append(Door("left", np.array([4.51, -y]), 0.0, -1, 0.835, 1.8))
    out.doors.append(Door("right", np.array([6.19, -y]), np.pi, 1, 0.835, 1.8))
    return out


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Tally:
    """What is found in two drives, before which doors were moved."""
    folder, tally = tmp_path_factory.mktemp("floor"), Tally()
    drives = make_drives(floor(), folder, seed=5, count=2, moved=1.0)
    learnt = learn_doors(drives.logs, drives.map, folder / "learnt")
    assert learnt.urdf == folder / "learnt" / "building.urdf"
    assert (Path(learnt.urdf).parent / "doors.csv").exists()
    compare(floor(), learnt.candidates, tally)
    return tally


def test_doors_are_found_and_other_openings_are_none(found: Tally) -> None:
    assert found.found + found.swapped == 3
    assert found.found >= 2
    assert found.false == 0


def test_hinges_widths_and_bearings_are_about_right(found: Tally) -> None:
    assert max(found.hinge_m) < 0.15
    assert max(found.width_m) < 0.1
    assert max(found.bearing_deg) < 3.0


def test_closed_leaves_go_from_the_hinge_to_the_edge() -> None:
    along, middle = closed(Door("a", np.array([1.0, 2.0]), np.pi / 2.0, 1, 0.8, 1.5))
    np.testing.assert_allclose(along, [0.0, 1.0], atol=1e-12)
    np.testing.assert_allclose(middle, [1.0, 2.4], atol=1e-12)


def beams(ends: FloatArray, origin: FloatArray) -> Beams:
    """Beams from a place (2,) that end at points (n, 2)."""
    off = ends - origin
    ranges = np.hypot(*off.T)
    count = len(ends)
    zeros = np.zeros(count, dtype=np.int64)
    return Beams(
        np.tile(origin, (count, 1)), off / ranges[:, None], ranges, np.full(count, 10.0),
        zeros, zeros, np.zeros(count),
    )  # fmt: skip


@settings(max_examples=20, deadline=None)
@given(st.floats(-0.03, 0.03), st.floats(-0.008, 0.008), st.integers(0, 1000))
def test_a_line_that_leans_in_the_map_is_fitted_to_the_readings(
    off: float, lean: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    places = rng.uniform(0.0, 8.0, 600)
    ends = np.column_stack([places, 1.0 + 0.02 * rng.standard_normal(600)])
    along = np.array([np.cos(lean), np.sin(lean)])
    start = np.array([0.0, 1.0 + off - 4.0 * np.sin(lean)])
    (line,) = fitted([WallLine(start, along, 8.0)], beams(ends, np.array([4.0, -1.0])))
    assert line.at(0.0)[1] == pytest.approx(1.0, abs=0.01)
    assert line.at(8.0)[1] == pytest.approx(1.0, abs=0.01)


@settings(max_examples=30, deadline=None)
@given(st.integers(1, 4), st.integers(1, 4), st.floats(0.01, 0.99), st.integers(0, 1000))
def test_looks_are_summed_over_all_courses_of_states(
    states: int, looks: int, stay: float, seed: int
) -> None:
    from itertools import pairwise, product

    rng = np.random.default_rng(seed)
    prior, gain = rng.dirichlet(np.ones(states)), rng.normal(0.0, 2.0, (states, looks))
    first = rng.dirichlet(np.ones(states))
    total = 0.0
    for course in product(range(states), repeat=looks + 1):
        p = first[course[0]]
        for k, (before, after) in enumerate(pairwise(course)):
            p *= (stay * (before == after) + (1.0 - stay) * prior[after]) * np.exp(gain[after, k])
        total += p
    stays = np.full(looks, stay)
    assert chained(np.log(first), np.log(prior), gain, stays) == pytest.approx(np.log(total))
