"""The independent simulator casts rays exactly, and what is measured means what it says."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.independent import metrics
from benchmarks.independent.__main__ import main
from benchmarks.independent.drive import OdometryErrors, Route, corridor_drive, odometry
from benchmarks.independent.lasers import Corridor, hits, rig, scans
from benchmarks.independent.metrics import SECOND, Door, Durations, Estimates, Robot
from benchmarks.independent.model import ModelErrors, model_of, urdf
from benchmarks.independent.options import seeds_of
from benchmarks.independent.results import Measured, from_json, read_estimates, to_json
from benchmarks.independent.scenarios import SCENARIOS
from benchmarks.independent.shapes import all_edges, cast, cast_circles, overlap, placed, rectangle
from benchmarks.independent.simulator import GENERATOR, simulate, simulated
from benchmarks.independent.table import comparison, paired_difference, table
from benchmarks.independent.world import Course, World, WorldOptions, corridor
from benchmarks.smoothing import Told
from objstate import load_building
from objstate.logs import open_log
from objstate.records import Scan

STILL = Course(np.linspace(0.0, 60.0, 601), np.full(601, 5.0))  # a robot that stays 5 m along


def around(count: int) -> np.ndarray:
    bearings = np.linspace(-np.pi, np.pi, count, endpoint=False)
    return np.column_stack([np.cos(bearings), np.sin(bearings)])


def test_rays_within_a_square_end_on_its_sides() -> None:
    directions = around(97)
    origins = np.tile([0.3, -0.2], (97, 1))
    ranges, index = cast(origins, directions, all_edges([rectangle(4.0, 2.0)]))
    ends = origins + ranges[:, None] * directions
    np.testing.assert_allclose(np.maximum(np.abs(ends[:, 0]) / 2, np.abs(ends[:, 1])), 1.0)
    assert set(index) == {0, 1, 2, 3}


def test_rays_at_nothing_read_infinity() -> None:
    ranges, index = cast(np.zeros((3, 2)), around(3), np.empty((0, 4)))
    assert np.isinf(ranges).all()
    assert (index == -1).all()
    assert np.isinf(cast_circles(np.zeros((3, 2)), around(3), np.empty((0, 3)))).all()


def test_a_ray_at_a_leg_ends_on_its_near_side() -> None:
    ranges = cast_circles(np.zeros((1, 2)), np.array([[1.0, 0.0]]), np.array([[2.0, 0.0, 0.07]]))
    np.testing.assert_allclose(ranges, 1.93)


def test_polygons_overlap_only_where_they_share_area() -> None:
    square = rectangle(1.0, 1.0)
    assert overlap(square, placed(square, 0.9, 0.0, 0.5))
    assert not overlap(square, placed(square, 1.01, 0.0))


def bare_world(seed: int) -> World:
    world = corridor(seed, WorldOptions(moves=0, walkers=0, boxes=0), STILL)
    shut = [Course(np.zeros(1), np.zeros(1)) for _ in world.doors]
    return replace(world, clutter=[], courses=shut)


@pytest.mark.parametrize("seed", range(5))
def test_closed_leaves_fill_their_doorways(seed: int) -> None:
    """With every door shut, no ray from the corridor gets out by more than a doorway's gaps."""
    world = bare_world(seed)
    origins = np.tile([world.length / 2, 0.0], (720, 1))
    no_glass = np.zeros(720, np.bool_)
    met, _ = hits(Corridor(world), origins, around(720), 0.0, 30.0, no_glass)
    ends = origins + met.ranges[:, None] * around(720)
    assert np.mean(np.abs(ends[:, 1]) > world.half + 0.2) < 0.01


@pytest.mark.parametrize("seed", range(5))
def test_leaves_turn_clear_of_the_walls(seed: int) -> None:
    world = bare_world(seed)
    for door in world.doors:
        for angle in np.linspace(0.1, door.limit, 7):
            tip = door.outlines(angle)[0][1:3]
            assert not any(
                overlap(placed(rectangle(0.02, 0.02), *point), wall.outline)
                for point in tip
                for wall in world.walls
            )


def test_a_model_without_errors_is_the_world_and_loads(tmp_path: Path) -> None:
    world = corridor(1, WorldOptions(), STILL)
    model = model_of(world, ModelErrors(), 1)
    assert (model.doors, model.walls) == (world.doors, world.walls)
    path = tmp_path / "building.urdf"
    path.write_text(urdf(model))
    building = load_building(path)
    assert sorted(building.objects) == [door.name for door in world.doors]


def test_errors_of_another_size_point_the_same_way() -> None:
    world = corridor(1, WorldOptions(), STILL)
    small, large = (
        np.array([(d.x, d.y) for d in model_of(world, ModelErrors(hinge=size), 1).doors])
        - [(d.x, d.y) for d in world.doors]
        for size in (0.02, 0.05)
    )
    np.testing.assert_allclose(large, 2.5 * small, atol=1e-9)


def test_perfect_wheels_tell_the_robots_way() -> None:
    drive = corridor_drive(3)
    still = OdometryErrors(scale=0.0, turn_scale=0.0, noise=0.0, turn_noise=0.0, drift=0.0)
    times, poses = odometry(3, drive, still)
    np.testing.assert_allclose(poses + drive.poses[0], drive.at(times), atol=0.01)


@pytest.mark.parametrize("kind", ["two", "wide", "skewed", "turning"])
def test_readings_lie_around_the_exact_ranges(kind: str) -> None:
    world, drive = bare_world(1), corridor_drive(1)
    short = replace(drive, times=drive.times[:100], poses=drive.poses[:100])  # it stands still
    for scan in scans(1, Corridor(world), short, rig(kind)):
        laser = rig(kind)[scan.laser]
        origin = drive.poses[0][:2] + np.array([laser.x, laser.y])
        bearings = laser.yaw + laser.angles
        directions = np.column_stack([np.cos(bearings), np.sin(bearings)])
        exact, _ = cast(
            np.tile(origin, (len(bearings), 1)),
            directions,
            all_edges(
                [
                    *(wall.outline for wall in world.walls),
                    *(d.outlines(0.0)[0] for d in world.doors),
                ]
            ),
        )
        near = exact < 4.0
        assert np.median(np.abs(scan.ranges - exact)[near]) < 0.03  # m
        assert np.isfinite(scan.ranges[exact > laser.range_max + 0.5]).sum() <= 2  # mixed


def test_ranges_mix_only_where_neighbours_end_on_different_surfaces() -> None:
    world, drive = bare_world(1), corridor_drive(1)
    short = replace(drive, times=drive.times[:100], poses=drive.poses[:100])  # it stands still
    exactly = {"noise": 0.0, "noise_share": 0.0, "footprint": 0.0, "mixed": 1.0}
    laser = replace(rig("wide")[0], dropout=0.0, grazing_dropout=0.0, **exactly)
    bearings = laser.yaw + laser.angles
    origin = drive.poses[0][:2] + np.array([laser.x, laser.y])
    walls = [wall.outline for wall in world.walls]
    walls += [outline for door in world.doors for outline in door.outlines(0.0)]
    directions = np.column_stack([np.cos(bearings), np.sin(bearings)])
    exact, index = cast(np.tile(origin, (len(bearings), 1)), directions, all_edges(walls))
    on_one = (index[:-1] == index[1:]) & (exact[:-1] < laser.range_max - 0.1)
    slanted = on_one & (np.abs(np.diff(exact)) > 0.15)  # m, as far apart as at an edge
    assert slanted.sum() > 5
    for scan in scans(1, Corridor(world), short, [laser]):
        off = np.abs(scan.ranges - exact)[:-1]
        assert (off[slanted] < 0.001).all()
        assert (off[~on_one & np.isfinite(exact[:-1])] > 0.05).any()


@pytest.mark.parametrize("name", SCENARIOS)
def test_every_scenario_gives_a_plan_for_every_seed(name: str) -> None:
    for seed in range(6):
        plan = SCENARIOS[name](seed)
        world = corridor(seed, plan.world, STILL)
        assert 10 <= len(world.doors) <= 14
        assert rig(plan.rig)


def test_a_drive_is_a_log_that_objstate_reads_and_the_same_again(tmp_path: Path) -> None:
    drives = [simulated("turning", 1, tmp_path / name) for name in ("a", "b")]
    contents = [
        {path.name: path.read_bytes() for path in sorted(drive.glob("*.[mtuj]*"))}
        for drive in drives
    ]
    assert contents[0] == contents[1]
    facts = json.loads((drives[0] / "facts.json").read_text())
    records = list(open_log([drives[0] / "log.mcap"]))
    assert sum(isinstance(record, Scan) for record in records) > 5 * 50
    assert facts["doors"]


def door(*changes: tuple[float, float], limit: float = 90.0) -> Door:
    """True angles, deg, from times, s, on; in view all the time."""
    times, angles = zip(*changes, strict=True)
    return Door(
        (np.array(times) * SECOND).astype(np.int64),
        np.radians(angles),
        (0.0, float(np.radians(limit))),
        (np.arange(0.0, 100.0, 0.2) * SECOND).astype(np.int64),
    )


def rows(
    *values: tuple[float, float, float, float], p_closed: list[float] | None = None
) -> Estimates:
    """Time, s, median, lower and upper, deg."""
    times, medians, lower, upper = np.array(values).T
    return Estimates(
        (times * SECOND).astype(np.int64),
        *np.radians([medians, lower, upper]),
        None if p_closed is None else np.array(p_closed),
    )


def test_an_interval_that_touches_the_truth_holds_it() -> None:
    (value,) = metrics.final_values({"d": door((0.0, 0.0))}, {"d": rows((1.0, 0.5, 0.0, 1.0))})
    assert value.inside
    assert value.at_limit
    np.testing.assert_allclose([value.error, value.width], [0.5, 1.0])


def test_a_final_value_is_compared_with_the_truth_at_its_own_time() -> None:
    truth = {"d": door((0.0, 10.0), (5.0, 90.0))}
    (value,) = metrics.final_values(truth, {"d": rows((4.0, 11.0, 9.0, 12.0))})
    assert value.truth == pytest.approx(10.0)
    assert not value.at_limit


def test_a_door_that_was_moving_when_last_seen_has_no_final_value() -> None:
    truth = {"d": door((0.0, 10.0), (5.0, 20.0), (5.05, 30.0), (5.1, 40.0))}
    counted = [
        len(metrics.final_values(truth, {"d": rows((time, 10.0, 9.0, 11.0))}))
        for time in (4.85, 4.95, 5.05, 5.15, 5.25)
    ]
    assert counted == [1, 0, 0, 0, 1]


@pytest.mark.parametrize(
    ("row", "counts"),
    [
        ((0.0, 20.0, 18.0, 22.0), True),
        ((0.0, 14.9, 13.0, 17.0), False),  # right enough
        ((0.0, 20.0, 12.0, 23.0), False),  # not sure
        ((0.0, 16.0, 9.5, 18.0), False),  # the interval holds the truth
    ],
)
def test_sure_and_wrong_is_far_off_outside_a_narrow_interval(
    row: tuple[float, float, float, float], counts: bool
) -> None:
    share = metrics.sure_and_wrong({"d": door((0.0, 10.0))}, {"d": rows(row)}, SECOND // 2)
    assert share == Durations(0.5 if counts else 0.0, 0.5)


def test_an_estimate_counts_until_the_next_but_no_longer_than_a_second() -> None:
    stamps = (np.array([0.0, 0.25, 10.0]) * SECOND).astype(np.int64)
    np.testing.assert_allclose(metrics.holding_times(stamps, 12 * SECOND), [0.25, 1.0, 1.0])


def test_values_after_ends_leave_out_doors_that_move_on_or_are_out_of_view() -> None:
    truth = door((0.0, 0.0), (10.0, 90.0), (11.0, 0.0), (50.0, 90.0), (101.0, 0.0))
    ends = [("d", second * SECOND) for second in (10, 11, 50, 101)]
    estimates = {"d": rows((13.5, 2.0, 0.0, 3.0), (52.0, 80.0, 70.0, 90.0))}
    values = metrics.values_after_ends({"d": truth}, estimates, ends)
    assert [round(value.error) for value in values] == [2, 10]


def test_closed_is_told_by_p_closed_where_there_is_one() -> None:
    truth = {"d": door((0.0, 0.0), (5.0, 3.0), (8.0, 60.0))}
    flat = [(float(second), 1.0, 0.0, 2.0) for second in range(10)]
    assert metrics.misclassified(truth, {"d": rows(*flat)}, 10 * SECOND) is None
    sure = {"d": rows(*flat, p_closed=[0.9] * 10)}
    assert metrics.misclassified(truth, sure, 10 * SECOND) == Durations(5.0, 10.0)
    assert metrics.misclassified(truth, sure, 10 * SECOND, largest=6.0) == Durations(3.0, 8.0)


def test_a_robot_that_is_lost_or_far_off_is_not_localized() -> None:
    stamps = np.arange(11) * SECOND
    true = np.column_stack([np.arange(11.0), np.zeros(11)])
    off = true + np.where(np.arange(11) == 7, 1.0, 0.02)[:, None] * [0.0, 1.0]
    measured = metrics.robot(stamps, off, stamps, true, [(9 * SECOND, 10 * SECOND)])
    assert measured.error == pytest.approx(0.02)
    assert measured.localized == Durations(3.0, 5.0)  # of 5 to 10 s, without 7 and 9


def measured(seed: int, error: float) -> Measured:
    value = metrics.Value("d", 1, 10.0, error, 3.0, inside=error < 1.5, at_limit=False)
    robot = Robot(0.01, Durations(9.0, 10.0))
    wrong = Durations(1.0, 50.0)
    told = Told(moved=4, found=3, listed=5, right=seed)
    return Measured("nothing", seed, "estimates", [value], [], wrong, None, wrong, robot, 2.0, told)


def test_measurements_survive_json() -> None:
    drives = [measured(1, 0.5), measured(2, 2.0)]
    assert from_json(to_json(drives)) == drives


def test_tables_pool_drives_and_pair_them_by_seed() -> None:
    new, old = [measured(1, 0.5), measured(2, 2.0)], [measured(2, 1.0), measured(3, 9.0)]
    assert "1.25" in table(new)
    assert "50 % of 2" in table(new)
    assert "6 of 8; 3 of 10" in table(new)
    assert "| nothing | 1 | +1.00" in comparison(new, old)


def test_a_paired_difference_leaves_out_what_is_missing() -> None:
    mean, error, count = paired_difference([1.0, 2.0, np.nan], [0.0, 0.0, 0.0])
    assert (mean, error, count) == (1.5, 0.5, 2)


def test_seeds_are_ranges_and_single_ones() -> None:
    assert seeds_of("1:4,7") == [1, 2, 3, 7]


def test_a_run_prints_a_table_and_pairs_with_itself(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    figures, drive = tmp_path / "a.json", tmp_path / "cache" / f"v{GENERATOR}" / "turning" / "1"
    drive.mkdir(parents=True)
    one_way = replace(SCENARIOS["turning"](1), route=Route(returns=False))
    simulate(one_way, 1, drive)  # found in the cache
    arguments = ["--scenarios", "turning", "--seeds", "1", "--jobs", "1"]
    arguments += ["--cache", str(tmp_path / "cache"), "--keep", str(tmp_path / "kept")]
    assert main([*arguments, "--json", str(figures)]) == 0
    filtered, smoothed = from_json(figures.read_text())
    assert (filtered.table, smoothed.table) == ("estimates", "smoothed")
    assert len(filtered.finals) > 5
    assert filtered.movements is None
    assert smoothed.movements is not None
    assert smoothed.movements.moved > 0
    assert f"| turning | 1 | {len(filtered.finals)} |" in capsys.readouterr().out
    kept = read_estimates(tmp_path / "kept" / "turning" / "1" / "estimates.parquet")
    assert sorted(kept) == [value.door for value in filtered.finals]
    assert main([*arguments, "--against", str(figures)]) == 0
    assert "| turning | 1 | +0.00" in capsys.readouterr().out
