"""Of dense and fast lasers, as much is taken as tells something new; in the end, all beams are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.config import ScanSettings
from objstate.errors import LogError
from objstate.estimator.thinning import Thinning
from objstate.lazy import altered
from objstate.records import NANOSECONDS, Rays, Scan
from tests.rooms import fan, scan_of

FULL = 2.0 * np.pi


def scans_at(seconds: list[float], rays: Rays, laser: str = "laser") -> list[Scan]:
    """Scans at some times; each of their beams reads a range of its own."""
    ranges = 1.0 + np.arange(len(rays)) / len(rays)
    return [scan_of(ranges, rays, round(each * NANOSECONDS), laser) for each in seconds]


def bearings(rays: Rays) -> np.ndarray:
    return np.degrees(np.unwrap(np.arctan2(rays.directions[:, 1], rays.directions[:, 0])))


@settings(max_examples=50)
@given(st.integers(20, 1500), st.floats(0.0, 3.0))
def test_beams_lie_no_farther_apart_than_they_may_and_all_are_taken_in_turn(
    count: int, spacing: float
) -> None:
    rays = fan(count)
    thinned = Thinning(ScanSettings(beam_spacing_deg=spacing, least_gap_s=0.0))
    own, taken = 180.0 / (count - 1), set()
    for scan in scans_at(np.arange(count).tolist(), rays)[: count // 2]:
        out = thinned(scan)
        assert out is not None
        assert len(out.ranges) == len(out.rays)
        apart = np.diff(bearings(out.rays))
        assert apart.max(initial=0.0) <= max(own, spacing) * 1.002
        assert len(apart) == 0 or apart.min() + own > spacing * 0.998 or own >= spacing
        taken |= set(out.ranges.tolist())
    assert taken == set(scan.ranges.tolist())


def test_beams_that_lie_as_they_may_are_all_taken() -> None:
    (scan,) = scans_at([0.0], fan(180, np.radians(179.0)))
    assert Thinning(ScanSettings())(scan) is scan


@pytest.mark.parametrize(
    ("rate", "taken"), [(5.0, 50), (10.0, 100), (12.5, 125), (25.0, 125), (40.0, 100)]
)
def test_scans_that_follow_too_soon_are_passed_over(rate: float, taken: int) -> None:
    thinned, rays = Thinning(ScanSettings()), fan(90)
    seconds = (np.arange(10 * rate) / rate).tolist()
    assert sum(thinned(scan) is not None for scan in scans_at(seconds, rays)) == taken


def test_each_laser_has_its_own_pace() -> None:
    thinned, rays = Thinning(ScanSettings()), fan(90)
    front, rear = scans_at([0.0], rays, "front"), scans_at([0.01, 0.02], rays, "rear")
    assert [thinned(scan) is not None for scan in (*front, *rear)] == [True, True, False]


def test_scans_whose_rays_differ_are_thinned_alike() -> None:
    thinned = Thinning(ScanSettings(beam_spacing_deg=1.0))
    for k in range(4):
        (scan,) = scans_at([float(k)], fan(721, FULL, towards=0.1 * k))
        out = thinned(scan)
        assert out is not None
        np.testing.assert_array_equal(out.ranges, scan.ranges[(k + 1) % 2 :: 2])
        np.testing.assert_array_equal(out.rays.directions, scan.rays.directions[(k + 1) % 2 :: 2])


def test_a_scan_that_says_nothing_is_left_out() -> None:
    thinned, ((scan,), (empty,)) = (
        Thinning(ScanSettings()),
        (scans_at([0.0], fan(n)) for n in (9, 0)),
    )
    assert thinned(empty) is None
    assert thinned(altered(scan, ranges=np.full(9, np.nan))) is None
    assert thinned(scan) is not None  # and doesn't count


def test_scans_come_in_time_order() -> None:
    thinned = Thinning(ScanSettings())
    late, early = scans_at([1.0, 0.0], fan(9))
    thinned(late)
    with pytest.raises(LogError, match="time order"):
        thinned(early)


@pytest.mark.parametrize("count", [1, 2])
def test_scans_of_next_to_no_beams_stay_as_they_are(count: int) -> None:
    (scan,) = scans_at([0.0], fan(count))
    assert Thinning(ScanSettings())(scan) is scan
