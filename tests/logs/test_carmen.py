"""CARMEN's conventions: beams, times, mountings, no return."""

import gzip
import math
from pathlib import Path

import numpy as np
import pytest

from objstate.errors import LogError
from objstate.logs import open_log, open_messages
from objstate.logs.carmen import LASER_HEIGHT
from objstate.records import Odometry, Scan


def laser_line(
    keyword: str, count: int, t: float, laser=(0, 0, 0), robot=(0, 0, 0), far=1.0
) -> str:
    numbers = [*laser, *robot]
    ranges = " ".join([str(far)] * count)
    return f"{keyword} {count} {ranges} {' '.join(map(str, numbers))} {t:.6f} host {t + 0.2:.6f}\n"


def write(path: Path, *lines: str) -> Path:
    path.write_text("# a comment\n" + "".join(lines))
    return path


def scans(path: Path) -> list[Scan]:
    return [record for record in open_log(path) if isinstance(record, Scan)]


def bearings_deg(scan: Scan) -> np.ndarray:
    return np.degrees(np.arctan2(scan.rays.directions[:, 1], scan.rays.directions[:, 0]))


@pytest.mark.parametrize(
    ("count", "step", "last"),
    [(180, 1.0, 89.0), (181, 1.0, 90.0), (360, 0.5, 89.5), (361, 0.5, 90)],
)
def test_beams_cover_the_half_circle(count, step, last, tmp_path) -> None:
    (scan,) = scans(write(tmp_path / "a.log", laser_line("FLASER", count, 5.0)))
    bearings = bearings_deg(scan)
    np.testing.assert_allclose(bearings[[0, -1]], [-90.0, last], atol=1e-4)
    np.testing.assert_allclose(np.diff(bearings), step, atol=1e-4)


def test_the_rear_laser_looks_back_from_its_offset(tmp_path) -> None:
    path = write(
        tmp_path / "a.log",
        "PARAM robot_frontlaser_offset 0.3 0 host 0\n",
        "PARAM robot_rearlaser_offset -0.2 0 host 0\n",
        laser_line("FLASER", 180, 5.0, laser=(0.3, 0, 0)),
        laser_line("RLASER", 180, 5.1, laser=(-0.2, 0, math.pi)),
    )
    front, rear = scans(path)
    np.testing.assert_allclose(front.rays.origins[0], [0.3, 0, LASER_HEIGHT], atol=1e-9)
    np.testing.assert_allclose(rear.rays.origins[0], [-0.2, 0, LASER_HEIGHT], atol=1e-9)
    np.testing.assert_allclose(rear.rays.directions[90], [-1, 0, 0], atol=1e-6)


def test_without_parameters_the_line_tells_the_offset(tmp_path) -> None:
    robot, laser = (1.0, 1.0, math.pi / 2), (1.0, 1.25, math.pi / 2)
    path = write(tmp_path / "a.log", laser_line("FLASER", 180, 5.0, laser=laser, robot=robot))
    (scan,) = scans(path)
    np.testing.assert_allclose(scan.rays.origins[0], [0.25, 0, LASER_HEIGHT], atol=1e-9)


def test_where_both_poses_are_one_the_laser_is_the_centre(tmp_path) -> None:
    path = write(
        tmp_path / "a.log",
        "PARAM robot_frontlaser_offset 0.3 0 host 0\n",
        laser_line("FLASER", 180, 5.0, laser=(2, 1, 0), robot=(2, 1, 0)),
    )
    (scan,) = scans(path)
    np.testing.assert_array_equal(scan.rays.origins[0], [0, 0, LASER_HEIGHT])


@pytest.mark.parametrize(("reading", "is_return"), [(80.98, True), (80.99, False), (81.91, False)])
def test_readings_from_the_lasers_maximum_on_are_no_return(reading, is_return, tmp_path) -> None:
    path = write(
        tmp_path / "a.log",
        "PARAM robot_front_laser_max 80.99 0 host 0\n",
        laser_line("FLASER", 180, 5.0, far=reading),
    )
    (scan,) = scans(path)
    assert np.isfinite(scan.ranges).all() == is_return
    assert np.isinf(scan.ranges).all() != is_return


def test_the_first_of_the_two_times_is_the_stamp_to_the_microsecond(tmp_path) -> None:
    line = laser_line("FLASER", 180, 5.0).replace(
        "5.000000 host 5.200000", "1071078718.462310 h 0.2"
    )
    (scan,) = scans(write(tmp_path / "a.log", line))
    assert scan.stamp_ns == 1071078718462310000


def test_odometry_is_the_pose_in_the_laser_lines(tmp_path) -> None:
    path = write(
        tmp_path / "a.log",
        "ODOM 9 9 9 0 0 0 4.9 host 4.9\n",
        laser_line("FLASER", 180, 5.0, laser=(1, 2, 0.5), robot=(1, 2, 0.5)),
    )
    odometry = [record for record in open_log(path) if isinstance(record, Odometry)]
    np.testing.assert_allclose([record.pose for record in odometry], [[1, 2, 0.5]])
    assert [m.topic for m in open_messages(path)].count("/wheel_odom") == 1


def test_robotlaser_lines_say_their_own_angles(tmp_path) -> None:
    line = (
        "ROBOTLASER1 0 -0.5 1.0 0.25 30.0 0.01 0 5 1 2 31 4 5 0 "
        "0.2 0 0 0 0 0 0.5 0.1 0.3 0.3 1e6 7.5 host 7.6\n"
    )
    (scan,) = scans(write(tmp_path / "a.log", line))
    np.testing.assert_allclose(
        bearings_deg(scan), np.degrees([-0.5, -0.25, 0, 0.25, 0.5]), atol=1e-4
    )
    np.testing.assert_array_equal(scan.ranges, [1, 2, np.inf, 4, 5])
    assert scan.range_max == 30.0
    assert scan.stamp_ns == 7_500_000_000
    np.testing.assert_allclose(scan.rays.origins[0], [0.2, 0, LASER_HEIGHT], atol=1e-9)


def test_damaged_lines_are_left_out_and_told(tmp_path) -> None:
    path = write(
        tmp_path / "a.log",
        laser_line("FLASER", 180, 5.0),
        "FLASER 180 1 2 3\n",
        "FLASER\n",
        "FLASER many 1 2\n",
        "ODOM x\n",
        laser_line("FLASER", 180, 6.0),
    )
    log = open_log(path)
    assert sum(isinstance(record, Scan) for record in log) == 2
    assert sum("damaged" in warning for warning in log.warnings) == 2


def test_gzipped_or_not_is_the_same(tmp_path) -> None:
    plain = write(tmp_path / "a.log", *(laser_line("FLASER", 180, 5.0 + i) for i in range(5)))
    packed = tmp_path / "b"
    packed.write_bytes(gzip.compress(plain.read_bytes()))
    assert list(open_messages(plain)) == list(open_messages(packed))


RAW = "0 -1.57 3.14 0.785 80.0 0.01 0 5 1 2 3 4 5 0 {t} host {t}\n"


def test_raw_lasers_without_the_robots_pose_are_told_with_the_cure(tmp_path) -> None:
    lines = (f"RAWLASER1 {RAW.format(t=t)}ODOM 0 0 0 0 0 0 {t} host {t}\n" for t in (5.0, 6.0))
    log = open_log(write(tmp_path / "a.log", *lines))
    with pytest.raises(LogError, match=r"RAWLASER1 lines are left out.*log the ROBOTLASER1"):
        list(log)


def test_raw_lasers_beside_lines_with_the_pose_say_the_same_and_are_skipped(tmp_path) -> None:
    lines = (f"RAWLASER1 {RAW.format(t=t)}{laser_line('FLASER', 5, t)}" for t in (5.0, 6.0))
    log = open_log(write(tmp_path / "a.log", *lines))
    assert sum(isinstance(record, Scan) for record in log) == 2
    assert log.warnings == []


@pytest.mark.parametrize("keyword", ["RAWLASER3", "ROBOTLASER3", "LASER4"])
def test_lasers_beyond_the_second_are_told(keyword, tmp_path) -> None:
    path = write(tmp_path / "a.log", f"{keyword} {RAW.format(t=5.0)}", laser_line("FLASER", 5, 5.0))
    log = open_log(path)
    assert sum(isinstance(record, Scan) for record in log) == 1
    (told,) = log.warnings
    assert f"{keyword} lines are left out: of CARMEN's lasers, only the front" in told
