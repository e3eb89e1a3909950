"""Doors are found in a map and drives, and walls that lean in a map are put straight."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks import floors
from benchmarks.finding import Tally, closed, compare
from benchmarks.floors import Floor, make_drives
from objstate.building.door_table import SLIDES, Door
from objstate.building.from_map import building_of_map
from objstate.building.occupancy import OccupancyMap
from objstate.config import BeamModelSettings
from objstate.discovery import candidates, learn_doors
from objstate.discovery.doorway import Cells, Doorway, background, doorway, ended_on
from objstate.discovery.explaining import Explained
from objstate.discovery.gathering import Beams
from objstate.discovery.lattice import SLIDS, SWINGS, Lattice, Rests, chained
from objstate.discovery.modes import Refined
from objstate.discovery.nearby import Nearby
from objstate.discovery.proposals import Backgrounds, Shown
from objstate.discovery.registering import registered
from objstate.discovery.scoring import (
    DRAWN,
    FILLED,
    WAY,
    Behind,
    Drawn,
    Leaf,
    log_prior,
    turned,
    with_things,
)
from objstate.discovery.things import Thing, bare, things_of
from objstate.discovery.walls import (
    BIN,
    WALLS,
    Opening,
    Stretches,
    WallLine,
    distinct,
    fitted,
    openings,
    wall_shares,
)
from objstate.geometry import FloatArray

THICK, HALF, DEPTH, LENGTH = 0.14, 1.0, 2.5, 10.0  # m

SEEDS = (8, 10)
STATES = (  # in the map, and in each drive
    {"single": 1.45, "left": 1.5, "right": 0.0, "sliding": 0.0},
    {"single": 0.86, "left": 0.0, "right": 1.05, "sliding": 0.5},
    {"single": 0.68, "left": 0.2, "right": 0.15, "sliding": 0.9},
)


def floor() -> Floor:
    """A corridor with three doors, one of which slides, an opening without a leaf, and a niche."""
    out = Floor(half=HALF, length=LENGTH)
    gaps = {1: [(1.0, 1.9), (5.0, 5.9), (7.4, 8.4)], -1: [(1.5, 2.3), (4.5, 6.2)]}
    for side, between in gaps.items():
        ends = [-THICK, *(end for gap in between for end in gap), LENGTH + THICK]
        for left, right in zip(ends[::2], ends[1::2], strict=True):
            out.walls.append((left, right, *sorted((side * HALF, side * (HALF + THICK)))))
        back = HALF + THICK + DEPTH
        out.walls.append((-THICK, LENGTH + THICK, *sorted((side * back, side * (back + THICK)))))
        for x in (-THICK, LENGTH, 3.7):
            near = HALF + THICK if x == 3.7 else 0.0
            out.walls.append((x, x + THICK, *sorted((side * near, side * back))))
    niche = sorted((-HALF - 0.4, -HALF - 0.5))
    out.walls.append((1.4, 2.4, *niche))
    y = HALF + THICK
    out.doors.append(Door("single", np.array([1.01, y]), 0.0, 1, 0.88, 1.8))
    out.doors.append(Door("left", np.array([4.51, -y]), 0.0, -1, 0.835, 1.8))
    out.doors.append(Door("right", np.array([6.19, -y]), np.pi, 1, 0.835, 1.8))
    out.doors.append(Door("sliding", np.array([7.41, HALF + THICK / 2]), 0.0, SLIDES, 0.98, 0.95))
    return out


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Tally:
    """What is found in two drives, before which doors were moved, with each of some seeds."""
    tally = Tally()
    for seed in SEEDS:
        folder, states = tmp_path_factory.mktemp("floor"), iter(STATES)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(floors, "states_of", lambda floor, rng, states=states: next(states))
            drives = make_drives(floor(), folder, seed=seed, count=2, moved=1.0)
        learnt = learn_doors(drives.logs, drives.map, folder / "learnt", jobs=1)
        assert learnt.urdf == folder / "learnt" / "building.urdf"
        assert (Path(learnt.urdf).parent / "doors.csv").exists()
        compare(floor(), learnt.candidates, tally)
    return tally


def test_doors_are_found_and_other_openings_are_none(found: Tally) -> None:
    assert found.found + found.swapped == 4 * len(SEEDS)
    assert found.found >= 3 * len(SEEDS)
    assert found.false == 0
    assert found.slides == found.said == [True] * len(SEEDS)


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


def test_a_line_of_which_the_map_has_a_leaning_piece_is_fitted_as_far_as_it_goes() -> None:
    rng = np.random.default_rng(4)
    ends = np.column_stack([rng.uniform(0.0, 16.0, 4000), 1.0 + 0.01 * rng.standard_normal(4000)])
    lean = np.array([np.cos(0.006), np.sin(0.006)])
    pieces = [WallLine(np.array([8.0, 1.0]), lean, 6.0), WallLine(np.array([2.0, 1.02]), lean, 4.0)]
    doorposts = np.column_stack([np.full(400, 13.5), np.linspace(1.0, 1.15, 400)])
    seen = Beams.joined([beams(each, np.array([8.0, -3.0])) for each in (ends, doorposts)])
    (line,) = fitted(pieces, seen)
    np.testing.assert_allclose([line.start[1], line.at(line.length)[1]], 1.0, atol=0.01)
    assert line.length > 14.0


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


@given(st.sampled_from([SWINGS, SLIDS]), st.sampled_from([0.2, 0.5, 1.0]))
def test_where_a_leaf_stands_is_a_distribution_whatever_its_limit(
    rests: Rests, share: float
) -> None:
    step = share * rests.step
    lattice = Lattice.of(np.arange(0.0, rests.widest, step), rests, step)
    assert np.exp(lattice.log_limit).sum() == pytest.approx(1.0)
    np.testing.assert_allclose(np.exp(lattice.log_prior).sum(axis=1), 1.0, atol=0.06)


def leaf(sense: int = 1) -> Leaf:
    return Leaf(np.zeros(2), 0.0, sense, 0.9, 0, False, 1.0)


@given(st.floats(0.0, 1.0))
def test_a_leaf_that_slides_stays_in_line_and_leaves_its_opening(share: float) -> None:
    (at,) = turned(leaf(SLIDES), np.array([share]))
    np.testing.assert_allclose(at, [-share * 0.9, 0.0, 0.0, 0.9], atol=1e-12)
    cells = np.column_stack([np.linspace(0.05, 0.85, 17), np.zeros(17)])
    filled = Drawn(None, 0.0, np.zeros(2), 1.0, cells, -3.0)
    turned_away = replace(filled, turn=np.radians(60.0), from_end=False)
    behind = Behind(np.empty(0), np.empty(0), (filled, turned_away))
    log_map, is_there = behind.map_of(leaf(SLIDES), np.array([0.0, share]))
    assert is_there[0]
    assert log_map[0] >= log_map[1]
    assert behind.turn_in_map(leaf(SLIDES)) is None


@given(st.integers(0, 1000), st.integers(1, 3))
def test_things_that_change_nothing_tell_nothing_of_a_leaf(seed: int, things: int) -> None:
    lattice, rng = leaf().lattice, np.random.default_rng(seed)
    count = len(lattice.angles)
    log_map, gain = rng.normal(0.0, 2.0, count), rng.normal(0.0, 3.0, (count, 4))
    stays, way = np.full(4, 0.8), np.zeros(count)
    alone = lattice.log_evidence(log_map, way, gain, stays)
    beside = lattice.log_evidence(log_map, way, np.tile(gain, (1 + things, 1)), stays)
    assert beside == pytest.approx(alone)


@pytest.mark.parametrize(("angle_deg", "is_right"), [(0.0, False), (60.0, True), (100.0, False)])
def test_a_map_is_right_beside_a_leaf_only_where_it_shows_the_leaf(
    angle_deg: float, is_right: bool
) -> None:
    place = looked_at(np.array([[0.5, -0.1]]), np.array([0.5, 2.0]))
    turn = np.radians(60.0)
    cells = np.linspace(0.05, 0.9, 18)[:, None] * np.array([np.cos(turn), np.sin(turn)])
    shown = Drawn(False, turn, np.zeros(2), 1.0, cells, -10.0)
    far = np.full((3, place.beams.shape[1]), 9.0)
    as_is = Behind(far, place.log_likelihood(far))
    behind = replace(as_is, drawn=(shown,), as_is=as_is)
    beside = behind.beside(place, leaf(), np.radians([angle_deg]))
    assert bool(np.isfinite(beside.as_drawn[0])) == is_right
    assert behind.turn_in_map(leaf()) == pytest.approx(turn, abs=np.radians(3.0))


@pytest.mark.parametrize(
    ("stretches", "is_wall"),
    [
        (((0.0, 0.95), (2.5, 4.0)), False),
        (((0.0, 0.95), (3.5, 6.0)), False),
        (((0.0, 0.95), (1.2, 2.2), (2.6, 4.5)), True),
        (((0.0, 2.0),), True),
    ],
)
def test_a_leaf_in_line_with_other_things_is_no_piece_of_a_wall(
    stretches: tuple[tuple[float, float], ...], is_wall: bool
) -> None:
    line = WallLine(np.zeros(2), np.array([1.0, 0.0]), 6.0, stretches)
    assert line.holds(np.array([0.05, 0.01]), 0.0, 0.9) == is_wall


@pytest.mark.parametrize(("aside", "is_wall"), [(0.03, True), (0.12, False), (-0.13, False)])
def test_a_leaf_before_a_wall_is_no_piece_of_it(aside: float, is_wall: bool) -> None:
    line = WallLine(np.zeros(2), np.array([1.0, 0.0]), 4.0, ((0.0, 0.9), (1.4, 3.8)))
    assert line.holds(np.array([0.05, aside]), np.radians(3.0), 0.8) == is_wall


@given(st.floats(0.6, 1.2))
def test_what_shows_a_leaf_does_not_show_that_it_is_a_wall(length: float) -> None:
    wall = (1.5, 1.5 + 1.9 * length)
    alone, with_its_own = (
        WallLine(np.zeros(2), np.array([1.0, 0.0]), 6.0, solid)
        for solid in ((wall,), ((0.0, length), wall))
    )
    assert not alone.holds(np.zeros(2), 0.0, length)
    assert not with_its_own.holds(np.zeros(2), 0.0, length)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.5, 1.4), st.floats(-0.02, 0.02), st.integers(0, 1000))
def test_jambs_are_where_beams_begin_to_pass(width: float, off: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    low = 2.0 + off
    places = rng.uniform(0.0, 6.0, 8000)
    passes = (places > low) & (places < low + width)
    depth = np.where(passes, 2.0, 0.0) + 0.01 * rng.standard_normal(8000)
    at_wall = np.column_stack([places, np.ones(8000)])
    origins = np.column_stack([rng.uniform(0.0, 6.0, 8000), np.full(8000, -0.5)])
    way = at_wall - origins
    ends = at_wall + depth[:, None] * way / np.hypot(*way.T)[:, None]
    seen = replace(
        beams(ends, np.zeros(2)),
        origins=origins,
        directions=way / np.hypot(*way.T)[:, None],
        ranges=np.hypot(*(ends - origins).T),
    )
    plan = drawn(places[~passes])
    line = WallLine(np.array([0.0, 1.0]), np.array([1.0, 0.0]), 6.0)
    (found,) = distinct(openings([line], plan, seen))
    assert found.start[0] == pytest.approx(low, abs=0.015)
    assert found.end[0] == pytest.approx(low + width, abs=0.015)


def drawn(places: FloatArray) -> OccupancyMap:
    """A map whose only wall is at y = 1, at places (n,); all else is free."""
    occupied = np.zeros((80, 120), dtype=bool)
    occupied[20, np.floor(places / 0.05).astype(int)] = True
    return OccupancyMap(occupied, ~occupied, 0.05, np.zeros(3))


@given(st.floats(0.0, 2.0), st.floats(0.3, 1.5), st.floats(-np.pi, np.pi))
def test_beams_that_ended_on_a_leaf_are_told_from_others(x: float, width: float, b: float) -> None:
    along = np.array([np.cos(b), np.sin(b)])
    normal = np.array([-along[1], along[0]])
    hinge = np.array([x, 1.0])
    on = hinge + np.linspace(0.05, 0.95, 7)[:, None] * width * along
    ends = np.concatenate([on, on + 0.3 * normal, hinge + (width + 0.3) * along[None]])
    origin = hinge + 3.0 * normal
    where = looked_at(ends, origin)
    found = ended_on(where, beams(ends, origin), np.array([[*hinge, b, width]]))
    assert found.tolist() == list(range(7))


def corridor() -> tuple[FloatArray, OccupancyMap]:
    """Points (n, 2) of a corridor of 6 m, whose walls step back by 10 cm behind 3 m, and its map."""
    along = np.arange(0.01, 6.0, 0.02)
    y = np.where(along < 3.0, 1.0, 1.1)
    step = np.arange(1.01, 1.1, 0.02)
    end = np.arange(-1.09, 1.1, 0.02)
    points = np.concatenate(
        [
            *(np.column_stack([along, sign * y]) for sign in (1.0, -1.0)),
            *(np.column_stack([np.full(len(step), 3.0), sign * step]) for sign in (1.0, -1.0)),
            np.column_stack([np.full(len(end), 6.0), end]),
        ]
    )
    corner = np.array([-1.025, -2.025])  # the walls are in the middle of cells
    occupied = np.zeros((80, 160), dtype=bool)
    column, row = np.floor((points - corner) / 0.05).astype(int).T
    occupied[row, column] = True
    return points, OccupancyMap(occupied, ~occupied, 0.05, np.array([*corner, 0.0]))


def seen_from(points: FloatArray, at: float, seed: int) -> Beams:
    """A scan of some of these points, from so far along the corridor."""
    rng = np.random.default_rng(seed)
    some = points[rng.choice(len(points), 400, replace=False)]
    return beams(some + 0.01 * rng.standard_normal(some.shape), np.array([at, 0.0]))


def moved(scan: Beams, x: float, y: float, turn: float) -> Beams:
    """The same from another place."""
    cos, sin = np.cos(turn), np.sin(turn)
    return replace(
        scan,
        origins=scan.origins + np.array([x, y]),
        directions=scan.directions @ np.array([[cos, sin], [-sin, cos]]),
    )


def off_by(found: Beams, right: Beams) -> tuple[FloatArray, FloatArray]:
    """How far off the places (s, 2) of scans are, and the sines (s,) of their turns."""
    first = right.scans[:-1]
    mine, truth = found.directions[first], right.directions[first]
    turn = truth[:, 0] * mine[:, 1] - truth[:, 1] * mine[:, 0]
    return found.origins[first] - right.origins[first], turn


@settings(max_examples=20, deadline=None)
@given(st.floats(-0.06, 0.06), st.floats(-0.04, 0.04), st.floats(-0.01, 0.01))
def test_a_scan_that_was_placed_wrongly_is_registered_to_the_others(
    x: float, y: float, turn: float
) -> None:
    points, plan = corridor()
    scans = [seen_from(points, at, seed) for seed, at in enumerate((2.0, 3.0, 4.0, 5.0))]
    right = Beams.joined(scans)
    lines = [WallLine(np.array([0.0, 1.0]), np.array([1.0, 0.0]), 3.0)]
    _, found = registered(lines, Beams.joined([moved(scans[0], x, y, turn), *scans[1:]]), plan)
    off, turned = off_by(found, right)
    assert np.hypot(*(off[0] - off[1:].mean(axis=0))) < 0.006
    assert abs(turned[0] - turned[1:].mean()) < 0.003


def test_two_passes_that_were_placed_apart_agree_and_stay_with_the_map() -> None:
    points, plan = corridor()
    first = [seen_from(points, at, seed) for seed, at in enumerate((1.0, 2.0, 3.0, 4.0, 5.0))]
    second = [seen_from(points, at, seed) for seed, at in enumerate((1.5, 2.5, 3.5, 4.5), 5)]
    # somebody walks beside the robot on its second way: the map doesn't show that
    person = np.random.default_rng(9).uniform(-0.15, 0.15, (100, 2))
    walked = []
    for k, scan in enumerate(second):
        beside = beams(person + np.array([2.0 + 1.02 * k, 0.4]), scan.origins[0])
        walked.append(replace(Beams.joined([scan, beside]), scan=np.zeros(500, dtype=int)))
    right = Beams.joined([*first, *walked])
    placed = Beams.joined([*first, *(moved(scan, 0.08, 0.0, 0.0) for scan in walked)])
    lines = [WallLine(np.array([0.0, 1.0]), np.array([1.0, 0.0]), 3.0)]
    off, _ = off_by(registered(lines, placed, plan)[1], right)
    assert np.abs(off[5:, 0].mean() - off[:5, 0].mean()) < 0.015
    assert np.abs(off).max() < 0.03


@given(st.floats(0.05, 0.4), st.floats(1.5, 3.0))
def test_things_that_overlap_stop_a_beam_once(depth: float, away: float) -> None:
    ends = np.column_stack([np.linspace(0.1, 0.9, 30), np.full(30, -depth)])
    place = looked_at(ends, np.array([0.5, away]))
    far = np.full((3, place.beams.shape[1]), 9.0)
    behind = Behind(far, place.log_likelihood(far))
    thing = np.array([[-0.3, -depth, 0.0, 1.6]])
    once, twice = (
        with_things(place, behind, np.tile(thing, (n, 1))).log_likelihood for n in (1, 2)
    )
    np.testing.assert_allclose(once, twice, atol=0.1)
    assert once[0] > behind.log_likelihood[0] + 20.0


def in_two_looks(first: float, second: float) -> tuple[Doorway, Behind]:
    """A doorway where beams end so far behind its line, m, and what there is without anything."""
    x = np.linspace(0.1, 0.9, 60)
    ends = np.column_stack([x, np.where(np.arange(60) < 30, -first, -second)])
    place = looked_at(ends, np.array([0.5, 2.0]))
    group = np.minimum(np.arange(place.beams.shape[1]) // 30, 1)
    two = {"groups": 2, "exponents": np.ones(2), "stays": np.array([0.5, 0.9])}
    place = replace(place, group=group, **two)
    far = np.full((3, len(group)), np.inf)
    return place, Behind(far, place.log_likelihood(far))


@given(st.floats(0.0, 0.1))
def test_what_the_map_shows_a_little_off_is_there_from_the_first(depth: float) -> None:
    place, open_ = in_two_looks(depth, depth)
    cells = np.column_stack([np.linspace(0.05, 0.85, 17), np.full(17, -depth)])
    shown = Drawn(None, 0.0, np.zeros(2), 1.0, cells, -3.0)
    open_ = replace(open_, drawn=(shown,))
    wrong = np.full((3, place.beams.shape[1]), 1.8)  # the map has it elsewhere
    as_is = Behind(wrong, place.log_likelihood(wrong), is_shown=True)
    closed = replace(leaf(), hinge=np.array([0.0, -depth]), width=1.0)
    where = turned(closed, np.zeros(1))
    known, new = Thing(-3.0, where, ((closed, np.zeros(1)),)), Thing(-3.0, where)
    logs = [bare(place, as_is, [open_], [], [thing]) for thing in (known, new)]
    # it was there with 1/2 and stays with 1/2; or comes since, as one of four states
    assert logs[0] - logs[1] == pytest.approx(np.log(0.25 + 0.125) - np.log(0.125), abs=0.2)
    elsewhere = replace(open_, drawn=(replace(shown, points=cells + np.array([0.0, 0.6])),))
    assert bare(place, as_is, [elsewhere], [], [known]) == pytest.approx(logs[1])


@pytest.mark.parametrize(("second", "is_it"), [(0.1, True), (4.0, False)])
def test_a_wall_is_there_in_all_looks_or_in_none(second: float, is_it: bool) -> None:
    place, as_is = in_two_looks(0.1, second)
    as_is = replace(as_is, is_shown=True)
    face = np.array([[-0.1, -0.1, 0.0, 1.2]])
    wall, thing = Thing(-3.0, face, stays=True), Thing(-3.0, face)
    none, walled, moved = (bare(place, as_is, [as_is], [], e) for e in ([], [wall], [thing]))
    assert moved > none + 10.0
    assert (walled > moved - 5.0) == is_it


@given(st.floats(-0.05, 0.05), st.floats(-0.04, 0.04), st.floats(1.5, 3.0))
def test_a_wall_of_the_map_lies_where_readings_show_it(
    off: float, lean: float, away: float
) -> None:
    ends = np.column_stack([np.linspace(-0.15, 1.15, 600), np.zeros(600)])
    place = looked_at(ends, np.array([0.5, away]))
    right, askew = np.array([[-0.2, 0.0, 1.2, 0.0]]), np.array([[-0.2, off, 1.2, off + lean]])
    best = background(place, right, is_fitted=False)[1][0]
    lost = best - background(place, askew, is_fitted=False)[1][0]
    assert best - background(place, askew)[1][0] < 0.25 * lost + 1.0
    through = background(place, askew + np.array([0.0, -0.4, 0.0, -0.4]))[1][0]
    assert through < best - 20.0  # another wall, which is elsewhere


@given(st.floats(-0.02, 0.02))
def test_a_beam_may_pass_the_end_of_a_wall_on_either_side(beyond: float) -> None:
    place = looked_at(np.array([[0.5 + beyond, 0.0]]), np.array([0.5 + beyond, 2.0]))
    expected, (log,) = background(place, np.array([[-1.0, 0.0, 0.5, 0.0]]))
    assert np.isfinite(expected).any()
    assert np.isinf(expected).any()
    surely = background(place, np.array([[-1.0, 0.0, 1.5, 0.0]]))[1][0]
    assert surely - 2.0 < log < surely - 0.1


@given(st.floats(0.3, 2.0), st.floats(-np.pi, np.pi), st.sampled_from([1, -1]))
def test_no_leaf_has_come_through_what_stands_in_its_way(
    at: float, bearing: float, sense: int
) -> None:
    away = np.linspace(0.3, 0.7, 9)[:, None]
    cells = away * np.array([np.cos(bearing + sense * at), np.sin(bearing + sense * at)])
    hung = replace(leaf(sense), bearing=bearing)
    behind = Behind(np.empty(0), np.empty(0), cells=cells)
    angles = np.array([0.0, 0.9 * at, at + 0.5])
    if 0.3 * at < WAY:  # at the closed leaf
        angles = angles[:2]
    assert (behind.log_way(hung, angles) < 0.0).tolist() == [False, False, True][: len(angles)]
    other_way = replace(hung, sense=-sense)
    assert not behind.log_way(other_way, np.array([0.0, 1.0, 2.0])).any()


@given(st.integers(0, 1000), st.floats(0.0, 1.5))
def test_all_points_near_a_line_are_found_by_their_squares(seed: int, near: float) -> None:
    rng = np.random.default_rng(seed)
    points, ends = rng.uniform(-4.0, 4.0, (200, 2)), rng.uniform(-6.0, 6.0, (2, 2))
    found = Nearby.of(points).strip(ends[0], ends[1], near)
    way = ends[1] - ends[0]
    share = np.clip((points - ends[0]) @ way / (way @ way), 0.0, 1.0)
    off = np.hypot(*(points - ends[0] - share[:, None] * way).T)
    assert set(np.flatnonzero(off < near)) <= set(found)
    assert len(set(found)) == len(found)


@given(st.integers(20, 200), st.integers(5, 60))
def test_a_gap_lies_in_a_wall_if_both_sides_of_it_do(side: int, width: int) -> None:
    count = 2 * side + width
    gap = np.zeros(count, dtype=bool)
    gap[side : side + width] = True
    in_wall = Stretches.of([(~gap, gap)], WALLS).wall(side, side + width)
    alone = ~gap & (np.abs(np.arange(count) - count / 2.0) < width / 2.0 + 5.0)
    between_posts = Stretches.of([(alone, ~alone)], WALLS).wall(side, side + width)
    unknown = Stretches.of([(gap & False, gap)], WALLS).wall(side, side + width)
    assert in_wall > unknown >= between_posts
    assert 0.0 < unknown < 0.5


@given(st.floats(0.0, 180.0), st.integers(0, 1000))
def test_walls_run_in_few_directions(turned: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    along_walls = np.tile([turned, turned + 90.0], 6) + rng.normal(0.0, 0.5, 12)
    turns = np.radians(np.concatenate([along_walls, rng.uniform(0.0, 180.0, 48)]))
    lengths = np.repeat([8.0, 2.0], [12, 48])
    lines = [
        WallLine(np.zeros(2), np.array([np.cos(turn), np.sin(turn)]), length)
        for turn, length in zip(turns, lengths, strict=True)
    ]
    wall = [np.ones(round(length / BIN), dtype=bool) for length in lengths]
    shows = [[(each, ~each)] for each in wall[:12]] + [[(~each, each)] for each in wall[12:]]
    shares = wall_shares(lines, shows)
    off = np.abs((np.degrees(turns) - turned + 45.0) % 90.0 - 45.0)
    assert shares[:12].min() > WALLS
    assert shares[off > 10.0].mean() < WALLS / 2.0
    assert shares[off > 10.0].max() < 1.1 * WALLS  # one that is alone in its direction keeps it
    assert (shares > 0.0).all()
    assert (shares < 1.0).all()


def test_a_line_alone_tells_nothing_of_directions() -> None:
    bins = np.ones(80, dtype=bool)
    line = WallLine(np.zeros(2), np.array([1.0, 0.0]), 2.0)
    assert wall_shares([line], [[(bins, ~bins)]]) == pytest.approx(WALLS)


def looked_at(ends: FloatArray, origin: FloatArray) -> Doorway:
    """A doorway that was looked at once."""
    opening = Opening(np.zeros(2), np.array([1.0, 0.0]))
    walls = [WallLine(np.zeros(2), np.array([1.0, 0.0]), 1.0)]
    points = np.concatenate([ends, np.zeros((1, 2))])
    return doorway([opening], walls, drawn(np.zeros(1)), beams(points, origin), BeamModelSettings())


def test_a_map_without_a_leaf_has_free_cells_there() -> None:
    plan = drawn(np.array([1.0, 2.0]))
    points = plan.to_building(np.array([[20.5, 20.5]]))
    np.testing.assert_allclose(plan.to_cells(points), [[20.5, 20.5]])
    less = plan.without(points)
    assert (plan.occupied.sum(), less.occupied.sum()) == (2, 1)
    assert less.free[20, 20]


def test_a_doorway_that_nobody_looked_into_has_no_looks() -> None:
    opening = Opening(np.array([50.0, 0.0]), np.array([51.0, 0.0]))
    seen = beams(np.zeros((1, 2)), np.array([0.5, 2.0]))
    place = doorway([opening], [], drawn(np.zeros(1)), seen, BeamModelSettings())
    assert (place.groups, place.seconds.shape) == (0, (0, 2))


def test_walls_that_cross_a_line_are_no_jambs_of_it() -> None:
    size = 120
    occupied = np.zeros((size, size), dtype=bool)
    across = np.arange(size)
    occupied[across, 40] = occupied[across, 65] = True  # walls along y, at 2 and 3.25 m
    lean = np.radians(40.0)
    way = np.array([np.cos(lean), np.sin(lean)])
    for place in np.arange(0.0, 0.8, 0.02):  # a leaf that leans and goes on through both
        x, y = np.array([1.2, 1.0]) + place * way
        occupied[int(y / 0.05), int(x / 0.05)] = True
    plan = OccupancyMap(occupied, ~occupied, 0.05, np.zeros(3))
    walls = [WallLine(np.array([x, 0.0]), np.array([0.0, 1.0]), 6.0) for x in (2.025, 3.275)]
    leaning = WallLine(np.array([1.2, 1.0]), way, 4.0)
    seen = beams(np.array([[5.0, 5.0]]), np.array([4.0, 5.0]))
    assert not openings([*walls, leaning], plan, seen)
    assert openings([leaning], plan, seen)


@pytest.mark.parametrize(("turn_deg", "length", "hides"), [(-26.0, 0.9, False), (0.0, 6.0, True)])
def test_a_leaf_that_stands_ajar_hides_no_opening_but_the_near_face_of_a_wall_does(
    turn_deg: float, length: float, hides: bool
) -> None:
    places = np.arange(0.0, 6.0, 0.02)
    plan = drawn(places[(places < 2.0) | (places > 2.9)])
    far = WallLine(np.array([0.0, 1.0]), np.array([1.0, 0.0]), 6.0, ((0.0, 5.0),))
    turn = np.radians(turn_deg)
    along = np.array([np.cos(turn), np.sin(turn)])
    start = np.array([2.0, 0.98]) if turn else np.array([0.0, 0.86])
    near = WallLine(start, along, length, ((0.0, length),))
    ends = start + np.arange(0.01, length, 0.002)[:, None] * along
    found = openings([far, near], plan, beams(ends, np.array([2.45, -1.0])))
    assert (not found) == hides


def test_a_map_shows_which_half_of_an_opening_is_filled() -> None:
    places = np.arange(0.0, 6.0, 0.02)
    opening = Opening(np.array([2.0, 1.025]), np.array([3.6, 1.025]))
    cells = Cells.about(drawn(places[places < 2.8]), opening.middle, 1.5)
    along = cells.middles[:, 0] - 2.0
    between = cells.in_doorway(opening)
    assert cells.fill(between & (along < 0.8), opening, 0.5)
    assert not cells.fill(between & (along > 0.8), opening, 0.5)
    assert not cells.fill(between, opening, 1.0)


@pytest.mark.parametrize("is_seen_behind", [False, True])
def test_a_piece_of_wall_that_a_map_lacks_is_open_where_something_passed(
    is_seen_behind: bool,
) -> None:
    places = np.arange(0.0, 6.0, 0.02)
    plan = drawn(places[(places < 2.0) | (places > 2.9)])
    if not is_seen_behind:
        plan.free[int(1.0 / plan.resolution) :] = False
    wall = WallLine(np.array([0.0, 1.025]), np.array([1.0, 0.0]), 6.0, ((0.0, 5.0),))
    seen = beams(np.array([[0.5, 1.025], [5.5, 1.025]]), np.array([3.0, -1.0]))
    assert bool(openings([wall], plan, seen)) == is_seen_behind


def test_a_leaf_that_is_a_line_of_its_own_shows_that_its_wall_is_open() -> None:
    places = np.arange(0.0, 6.0, 0.02)
    plan = drawn(places[(places < 2.0) | (places > 2.9)])
    wall = WallLine(np.array([0.0, 1.025]), np.array([1.0, 0.0]), 6.0, ((0.0, 5.0),))
    leaf = WallLine(np.array([2.0, 1.15]), np.array([1.0, 0.0]), 0.9, ((0.0, 0.9),))
    plan.free[20:] = False  # the map knows only what is before the wall
    ends = np.column_stack([np.arange(2.0, 2.9, 0.002), np.full(450, 1.15)])
    assert openings([wall, leaf], plan, beams(ends, np.array([2.45, -1.0])))


@pytest.mark.parametrize("is_known", [False, True])
def test_nobody_mapped_a_door_where_a_map_knows_nothing(is_known: bool) -> None:
    places = np.arange(0.0, 6.0, 0.02)
    plan = drawn(places[(places < 2.0) | (places > 2.9)])
    if not is_known:
        plan.free[:, 38:60] = False
    wall = WallLine(np.array([0.0, 1.025]), np.array([1.0, 0.0]), 6.0, ((0.0, 5.0),))
    passing = np.column_stack([np.linspace(2.0, 2.9, 450), np.full(450, 3.0)])
    assert bool(openings([wall], plan, beams(passing, np.array([2.45, -1.0])))) == is_known


@pytest.mark.parametrize("back", [0, 2, 4, 19])
def test_the_side_of_a_recess_is_no_leaf_that_stands_open(back: int) -> None:
    """Its back may hold a doorway, beside which there are so many cells of wall."""
    plan = with_gap()
    plan.occupied[20:36, 40] = True  # from the jamb on, about as long as a leaf
    plan.occupied[36, 40 : 40 + back] = True
    found = {leaf.from_end for leaf in shown_in_gap(plan)}
    assert found == (set() if back >= 4 else {False})


def test_a_leaf_that_leans_against_a_wall_is_no_side_of_a_recess() -> None:
    plan = with_gap()
    turn = np.radians(116.0)
    places = np.array([2.025, 1.025]) + np.arange(0.0, 0.88, 0.01)[:, None] * (
        np.array([np.cos(turn), np.sin(turn)])
    )
    columns, rows = np.floor(places / 0.05).astype(int).T
    plan.occupied[rows, columns] = True
    plan.occupied[rows[-1] :, columns[-1]] = True
    assert {leaf.from_end for leaf in shown_in_gap(plan)} == {False}


def test_the_steps_of_a_recess_are_less_surely_a_leaf_than_what_is_straight() -> None:
    straight, steps = with_gap(), with_gap()
    ways = np.arange(0.0, 0.8, 0.01)
    places = np.array([2.025, 1.025]) + 0.8**0.5 * ways[:, None] * np.array([0.75, 1.0])
    for x, y in places:
        straight.occupied[int(y / 0.05), int(x / 0.05)] = True
        row, column = int((y + 0.06) / 0.05 // 4 * 4), int(x / 0.05 // 3 * 3)
        steps.occupied[row, column : column + 4] = steps.occupied[row : row + 5, column] = True
    told = {
        name: min(leaf.log_none for leaf in shown_in_gap(plan))
        for name, plan in {"straight": straight, "steps": steps}.items()
    }
    assert told["straight"] == DRAWN
    assert told["steps"] > DRAWN + 2.0


def with_gap() -> OccupancyMap:
    """A map of a wall with an opening of 0.9 m."""
    return drawn(np.arange(0.0, 6.0, 0.02)[~np.isin(np.arange(300), np.arange(100, 145))])


def shown_in_gap(plan: OccupancyMap) -> list[Drawn]:
    """The leaves that a map shows there."""
    place = replace(looked_at(np.array([[2.45, 1.0]]), np.array([2.45, 0.2])), walls=[])
    place.openings[:] = [Opening(np.array([2.0, 1.025]), np.array([2.9, 1.025]))]
    place = replace(place, middle=np.array([2.45, 1.025]), radius=1.5)
    return [leaf for leaf, _ in Shown.about(place, plan).leaves[0]]


@pytest.mark.parametrize("is_wall", [False, True])
def test_what_lies_where_a_leaf_is_found_is_no_leaf_if_it_is_a_piece_of_a_wall(
    is_wall: bool,
) -> None:
    plan = drawn(np.arange(0.0, 6.0, 0.02)[~np.isin(np.arange(300), np.arange(100, 145))])
    plan.occupied[20:37, 40] = True  # as long as a leaf, from the jamb on
    place = replace(looked_at(np.array([[2.45, 1.0]]), np.array([2.45, 0.2])), walls=[])
    place.openings[:] = [Opening(np.array([2.0, 1.025]), np.array([2.9, 1.025]))]
    place = replace(place, middle=np.array([2.45, 1.025]), radius=1.5)
    shown = Shown.about(place, plan)
    about = Backgrounds.of(place, shown)
    wall = WallLine(np.array([2.02, 1.0]), np.array([0.0, 1.0]), 5.0, ((0.0, 5.0),))
    about = replace(about, place=replace(place, walls=[wall] if is_wall else []))
    ((number, its),) = ((n, each) for n, each in shown.proposed(place) if not each.from_end)
    again = about.redrawn([its], about.cleared[0][number])
    assert (again is None) == is_wall


@pytest.mark.parametrize("turn", [0.0, 90.0])
def test_what_fills_an_opening_beside_an_open_leaf_is_no_leaf(turn: float) -> None:
    """A leaf that was closed when the map was made is what fills it."""
    plan = drawn(np.arange(0.0, 6.0, 0.02))
    plan.occupied[20:37, 40] = True  # as long as a leaf, from the jamb on
    place = replace(looked_at(np.array([[2.45, 1.0]]), np.array([2.45, 0.2])), walls=[])
    place.openings[:] = [Opening(np.array([2.0, 1.025]), np.array([2.9, 1.025]))]
    place = replace(place, middle=np.array([2.45, 1.025]), radius=1.5)
    closed, opened = Backgrounds.of(place, Shown.about(place, plan)).cleared[0]
    background = opened if turn else closed
    assert {round(abs(np.degrees(each.turn))) for each in background.drawn} == {turn}
    filling = np.array([2.5, 1.025])
    is_left = bool((np.hypot(*(background.cells - filling).T) < 0.04).any())
    assert is_left == (turn > 0.0)


@pytest.mark.parametrize("depth", [0.1, 0.25])
@pytest.mark.parametrize(("turn_deg", "log_none"), [(20.0, FILLED), (50.0, DRAWN)])
def test_what_is_nearly_closed_fills_an_opening_however_deep_it_hangs(
    depth: float, turn_deg: float, log_none: float
) -> None:
    plan = drawn(np.arange(0.0, 6.0, 0.02)[~np.isin(np.arange(300), np.arange(100, 145))])
    along, turn = np.linspace(0.0, 0.88, 40), np.radians(turn_deg)
    rows = ((1.025 + depth + along * np.sin(turn)) / 0.05).astype(int)
    plan.occupied[rows, ((2.0 + along * np.cos(turn)) / 0.05).astype(int)] = True
    place = replace(looked_at(np.array([[2.45, 1.0]]), np.array([2.45, 0.2])), walls=[])
    place.openings[:] = [Opening(np.array([2.0, 1.025]), np.array([2.9, 1.025]))]
    place = replace(place, middle=np.array([2.45, 1.025]), radius=1.5)
    shown = [each for each, _ in Shown.about(place, plan).leaves[0] if each.from_end is False]
    assert [round(np.degrees(each.turn), -1) for each in shown] == [turn_deg]
    assert shown[0].log_none == log_none


def test_a_thing_in_line_with_a_wall_is_more_probable_than_elsewhere() -> None:
    place = looked_at(np.array([[0.5, -0.1]]), np.array([0.5, 2.0]))
    behind = Behind(np.empty(0), np.zeros(1))
    covariance = np.diag(np.square([0.01, 0.01, 0.01, 0.02]))
    open_ = Refined(leaf(), behind, covariance, 0.0, np.array([np.pi / 2]), 0.0)
    wall = WallLine(np.array([0.0, -2.0]), np.array([0.0, 1.0]), 5.0, ((0.0, 5.0),))
    costs = [things_of(replace(place, walls=walls), [(open_,)])[0][0] for walls in ([], [wall])]
    assert costs[1] > costs[0] + 5.0


def test_a_leaf_may_stand_in_what_a_map_has_of_it() -> None:
    place = looked_at(np.array([[0.5, -0.1]]), np.array([0.5, 2.0]))
    turn = np.radians(60.0)
    cells = np.linspace(0.05, 0.9, 18)[:, None] * np.array([np.cos(turn), np.sin(turn)])
    shown = Drawn(False, turn, np.zeros(2), 1.0, cells, -10.0)
    far, wall = (np.full((3, place.beams.shape[1]), away) for away in (9.0, 2.1))
    without, as_is = (Behind(each, place.log_likelihood(each)) for each in (far, wall))
    gained = as_is.log_likelihood - without.log_likelihood
    on_map = replace(without, drawn=(shown,), as_is=as_is)
    angles = np.radians([0.0, 60.0])
    gains = [each.gains(place, leaf(), angles)[:, 0] for each in (without, on_map)]
    assert gains[1][0] == gains[0][0]
    assert gains[1][1] >= max(gains[0][1], gained[0]) > gains[0][1] - 1e-9


@pytest.mark.parametrize("sense", [1, -1])
def test_no_leaf_hangs_before_its_wall(sense: int) -> None:
    place = looked_at(np.array([[2.45, 1.0]]), np.array([2.45, 0.2]))
    start, bearing = place.openings[0].jamb(False)
    inward = place.inward(start, bearing)
    width = place.openings[0].width
    inside, before = (
        log_prior(place, Leaf(start + deep * inward, bearing, sense, width, 0, False, 1.0))
        for deep in (0.1, -0.1)
    )
    assert np.isfinite(inside)
    assert before == -np.inf


def limited(seen: float, walls: list[WallLine], drawn_turn: float = 0.0) -> float:
    """The limit, rad, of a leaf that was seen open, and that the map may show."""
    place = replace(looked_at(np.array([[0.5, -0.1]]), np.array([0.5, 2.0])), walls=walls)
    cells = np.linspace(0.05, 0.9, 18)[:, None] * np.array([np.cos(drawn_turn), np.sin(drawn_turn)])
    shown = (Drawn(False, drawn_turn, np.zeros(2), 1.0, cells, DRAWN),) if drawn_turn else ()
    behind = Behind(np.empty(0), np.zeros(1), shown)
    best = Refined(leaf(), behind, np.eye(4), 0.0, np.array([seen]), 0.0)
    return candidates.limit_of(place, best)


@given(st.floats(0.0, np.pi), st.floats(0.4, 2.9))
def test_a_door_that_was_never_seen_wider_may_open_wider(seen: float, turn: float) -> None:
    assert limited(seen, []) == pytest.approx(np.pi)
    wall = WallLine(np.array([-3.0, 0.0]), np.array([1.0, 0.0]), 3.0, ((0.0, 3.0),))
    assert limited(seen, [wall], turn) == pytest.approx(np.pi)


@given(st.floats(0.15, 0.5), st.floats(0.0, 2.4), st.floats(0.4, 2.4))
def test_no_door_opens_into_a_wall_beside_it_unless_it_was_seen_there(
    away: float, seen: float, turn: float
) -> None:
    side = WallLine(np.array([-away, 0.0]), np.array([0.0, 1.0]), 3.0, ((0.0, 3.0),))
    touches = np.pi / 2.0 + np.arcsin(away / 0.9)
    limit = limited(seen, [side], turn)
    assert limit > max(seen, turn)
    if touches > max(seen, turn):
        assert touches < limit < touches + 0.5


def test_a_leaf_that_was_seen_beyond_a_piece_is_not_stopped_by_it() -> None:
    """A short piece 30 cm behind the wall, as a leaf's own readings make it."""
    solid = (0.0, 0.4), (1.5, 3.0)
    piece = WallLine(np.array([0.3, 0.3]), np.array([1.0, 0.0]), 3.0, solid)
    assert limited(np.radians(10.0), [piece]) < np.radians(40.0)
    # beyond its beginning, but not beyond its end
    assert limited(np.radians(40.0), [piece]) == pytest.approx(np.pi)


def test_an_opening_that_an_accepted_leaf_closes_holds_no_other(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Even where what is left of its readings tells more of another leaf than they told before."""
    places = np.arange(0.0, 6.0, 0.02)
    plan = drawn(places[(places < 2.0) | (places > 4.0)])
    whole = Opening(np.array([2.0, 1.025]), np.array([4.0, 1.025]))
    half = Opening(np.array([2.0, 1.025]), np.array([2.9, 1.025]))
    told = {2.0: [4.0], 0.9: [1.0, 9.0]}  # log odds, in turn

    def explained(place: Doorway, plan: OccupancyMap) -> Explained:
        width = round(place.openings[0].width, 1)
        leaves = tuple(
            Refined(each, Behind(np.empty(0), np.empty(0)), np.eye(4), 0.0, np.zeros(1), 0.0)
            for each in (
                Leaf(np.array([2.0, 1.025]), 0.0, 1, 1.0, 0, False, 0.5),
                Leaf(np.array([4.0, 1.025]), np.pi, -1, 1.0, 0, True, 0.5),
            )[: 2 if width > 1.5 else 1]
        )
        log_odds = told[width].pop(0)
        return Explained(leaves, 1.0, 1.0 / (1.0 + np.exp(-log_odds)), log_odds, 0.0, np.zeros(2))

    monkeypatch.setattr(candidates, "explain", explained)
    off_walls = Opening(np.array([8.0, 5.0]), np.array([8.9, 5.0]), p_wall=0.01)
    monkeypatch.setattr(candidates, "openings", lambda *_: [whole, half, off_walls])
    seen = beams(np.array([[2.5, 1.5], [3.5, 1.5]]), np.array([3.0, 0.0]))
    found = candidates.find_doors(plan, building_of_map(plan), seen, BeamModelSettings())
    assert [round(each.log_odds) for each in found.candidates] == [4, 4]
    assert (found.openings, found.passed_over) == (3, [off_walls])
