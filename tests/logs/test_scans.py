"""REP-117 ranges, and beams that carry mounting and motion."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import BeamModelSettings
from objstate.geometry import compose, rotation_from_rpy, transform, transform_from_pose
from objstate.logs.notices import Notices
from objstate.logs.scans import BeamGeometry, clean_ranges, moved_rays, sweep_from
from objstate.records import Rays
from objstate.sensing import BeamModel


def message(ranges, **fields):
    defaults = {
        "angle_min": -1.0,
        "angle_max": 1.0,
        "angle_increment": 2.0 / max(len(ranges) - 1, 1),
        "time_increment": 0.0,
        "range_min": 0.5,
        "range_max": 10.0,
        "ranges": np.array(ranges, np.float32),
    }
    return SimpleNamespace(**(defaults | fields))


@pytest.mark.parametrize(
    ("given_range", "kept"),
    [
        (5.0, 5.0),
        (0.5, 0.5),
        (0.49, math.nan),
        (0.0, math.nan),
        (-1.0, math.nan),
        (10.0, math.inf),
        (10.01, math.nan),
        (math.inf, math.inf),
        (-math.inf, math.nan),
        (math.nan, math.nan),
    ],
)
def test_ranges_follow_rep_117(given_range, kept) -> None:
    ranges, _, _ = clean_ranges(message([given_range]), "laser", Notices())
    np.testing.assert_array_equal(ranges, np.array([kept], np.float32))


@pytest.mark.parametrize("range_max", [8.0, math.inf])
def test_a_reading_of_nothing_says_nothing_though_the_laser_has_no_least_range(range_max) -> None:
    scan = message([0.0, 2.0], range_min=0.0, range_max=range_max)
    np.testing.assert_array_equal(clean_ranges(scan, "laser", Notices())[0], [math.nan, 2.0])


@pytest.mark.parametrize("range_max", [0.0, -1.0, math.nan, math.inf])
def test_without_a_usable_maximum_readings_are_kept_and_inf_says_nothing(range_max) -> None:
    notices = Notices()
    ranges, _, limit = clean_ranges(message([3.0, math.inf], range_max=range_max), "laser", notices)
    np.testing.assert_array_equal(ranges, [3.0, math.nan])
    assert limit == 3.0
    assert "range_max" in notices.listed()[0]


@pytest.mark.parametrize("given_range", [math.inf, math.nan, 0.0, 0.02])
def test_a_laser_without_a_usable_maximum_sees_some_way_even_where_a_scan_shows_nothing(
    given_range,
) -> None:
    scan = message([given_range] * 3, range_min=0.0, range_max=0.0)
    ranges, _, limit = clean_ranges(scan, "laser", Notices())
    assert limit == 1.0
    told = BeamModel(BeamModelSettings())(ranges, limit)(np.full(3, 2.0))
    assert np.isfinite(told[np.isfinite(ranges)]).all()


def sweep(scan, mounting=None, notices=None):
    mounting = np.eye(4) if mounting is None else mounting
    return sweep_from(scan, 0, "laser", mounting, BeamGeometry(), notices or Notices())


def test_an_upside_down_laser_sweeps_the_other_way() -> None:
    mounting = transform(rotation_from_rpy(math.pi, 0, 0), (0.1, 0.2, 0.3))
    beams = sweep(message([1.0] * 3, angle_min=0.5, angle_increment=0.25), mounting).rays
    bearings = np.arctan2(beams.directions[:, 1], beams.directions[:, 0])
    np.testing.assert_allclose(bearings, [-0.5, -0.75, -1.0])
    np.testing.assert_allclose(beams.origins, np.tile([0.1, 0.2, 0.3], (3, 1)))


def test_a_tilted_laser_looks_down() -> None:
    mounting = transform(rotation_from_rpy(0, 0.2, 0), (0, 0, 1))
    beams = sweep(message([1.0], angle_min=0.0), mounting).rays
    np.testing.assert_allclose(beams.directions[0], [math.cos(0.2), 0, -math.sin(0.2)])


@pytest.mark.parametrize("roll", [0.0, math.pi])
@pytest.mark.parametrize("pitch", [0.0, 0.01, -0.03])
def test_a_laser_that_tilts_by_a_degree_is_level(roll: float, pitch: float) -> None:
    scan, mountings = (
        message([1.0] * 5, angle_min=-2.0, angle_increment=1.0),
        [transform(rotation_from_rpy(roll, each, 0.7), (0.1, 0.2, 0.3)) for each in (0.0, pitch)],
    )
    level, tilted = (sweep(scan, mounting).rays for mounting in mountings)
    np.testing.assert_allclose(tilted.directions, level.directions, atol=1e-12)
    assert tilted.directions[:, 2] == pytest.approx(0.0, abs=1e-12)


def test_negative_increments_are_fine_and_zero_is_not() -> None:
    notices = Notices()
    backwards = message([1.0] * 3, angle_min=1.0, angle_max=-1.0, angle_increment=-1.0)
    assert sweep(backwards, notices=notices) is not None
    assert notices.listed() == []
    assert sweep(message([1.0] * 3, angle_increment=0.0), notices=notices) is None
    assert sweep(message([]), notices=notices) is None
    assert sum(notices.dropped.values()) == 2


def test_a_count_that_disagrees_with_the_angles_is_told_and_the_ranges_rule() -> None:
    notices = Notices()
    scan = sweep(message([1.0] * 10, angle_increment=0.5), notices=notices)
    assert len(scan.ranges) == len(scan.rays) == 10
    sweep(message([1.0] * 7, angle_increment=0.5), notices=notices)
    (told,) = notices.listed()  # once for a laser that sends another number each time
    assert "more or fewer ranges than its angles announce" in told


@pytest.mark.parametrize("increment", [-0.1, 10.0, math.nan])
def test_an_impossible_time_increment_is_told_and_ignored(increment) -> None:
    notices = Notices()
    scan = sweep(message([1.0] * 3, time_increment=increment), notices=notices)
    assert scan.end_ns == scan.stamp_ns
    sweep(message([1.0] * 3, time_increment=-0.2), notices=notices)
    (told,) = notices.listed()
    assert "time_increment" in told


poses = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


@settings(max_examples=50)
@given(start=poses, motion=st.lists(poses, min_size=1, max_size=5))
def test_moved_rays_are_where_the_robot_was_when_it_cast_them(start, motion) -> None:
    rng = np.random.default_rng(1)
    steps = np.array(motion)
    rays = Rays(rng.normal(size=(len(steps), 3)), rng.normal(size=(len(steps), 3)))
    moved = moved_rays(rays, steps)
    at_start = transform_from_pose(start)
    for i, step in enumerate(steps):
        at_beam = transform_from_pose(compose(start, step))
        np.testing.assert_allclose(
            at_start[:3, :3] @ moved.origins[i] + at_start[:3, 3],
            at_beam[:3, :3] @ rays.origins[i] + at_beam[:3, 3],
            atol=1e-9,
        )
        np.testing.assert_allclose(
            at_start[:3, :3] @ moved.directions[i], at_beam[:3, :3] @ rays.directions[i], atol=1e-9
        )


def test_rays_are_computed_once_for_a_laser_that_stays_as_it_is() -> None:
    geometry, mounting = BeamGeometry(), np.eye(4)
    first = geometry.rays("laser", 10, -1.0, 0.1, mounting)
    assert geometry.rays("laser", 10, -1.0, 0.1, mounting) is first
    assert len(geometry.rays("laser", 11, -1.0, 0.1, mounting)) == 11
    other = geometry.rays("laser", 10, -1.0, 0.1, transform(np.eye(3), (1, 0, 0)))
    np.testing.assert_array_equal(other.origins[:, 0], 1)
