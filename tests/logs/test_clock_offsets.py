"""Lasers whose clocks run ahead of the odometry's."""

from pathlib import Path

import numpy as np
import pytest

from objstate.errors import LogError
from objstate.logs import open_log
from objstate.records import Scan

LOG = Path(__file__).parents[2] / "logs" / "corridor.mcap"
AHEAD = 0.05


def scans(**options: object) -> list[Scan]:
    return [each for each in open_log(LOG, end=3.0, **options) if isinstance(each, Scan)]


def test_scans_are_put_back_and_placed_in_the_odometry_of_then() -> None:
    plain = {each.stamp_ns: each for each in scans() if each.laser == "front"}
    moved = [each for each in scans(clock_offsets={"front": AHEAD}) if each.laser == "front"]
    shifts = []
    for scan in moved[1:]:
        before = plain[scan.stamp_ns + round(AHEAD * 1e9)]
        np.testing.assert_array_equal(scan.ranges, before.ranges)
        shifts.append(before.odometry[0] - scan.odometry[0])
    assert max(shifts) == pytest.approx(0.7 * AHEAD, rel=0.3)  # the robot drives 0.7 m/s


def test_a_frame_may_be_named_with_the_slash_of_ros_1() -> None:
    plain, slashed = (
        [each.stamp_ns for each in scans(clock_offsets={frame: AHEAD})]
        for frame in ("front", "/front")
    )
    assert slashed == plain


def test_other_lasers_stay_as_they_are() -> None:
    plain, moved = (
        [each.stamp_ns for each in scans(**options) if each.laser == "rear"]
        for options in ({}, {"clock_offsets": {"front": AHEAD}})
    )
    assert plain == moved


def test_records_stay_in_time_order() -> None:
    stamps = [each.stamp_ns for each in scans(clock_offsets={"front": 0.3, "rear": -0.2})]
    assert stamps == sorted(stamps)


@pytest.mark.parametrize("ahead", [float("nan"), float("inf")])
def test_an_offset_that_is_no_number_is_refused(ahead: float) -> None:
    with pytest.raises(LogError, match=r"'front'.*give a finite number"):
        open_log(LOG, clock_offsets={"front": ahead})


def test_the_mountings_read_are_known() -> None:
    log = open_log(LOG, end=1.0)
    list(log)
    assert log.mountings["front"][0, 3] == pytest.approx(0.22)
