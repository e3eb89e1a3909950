"""Inspecting a log tells what is in it and names what is wrong."""

import math

import numpy as np
import pytest

from objstate.errors import LogError
from objstate.logs import inspect_log, open_log


def test_a_sound_log_has_no_problems(drive, tmp_path) -> None:
    summary = inspect_log(drive.straight().mcap(tmp_path / "a.mcap"))
    assert summary.problems == ()
    assert summary.duration_s == pytest.approx(3.0)
    rates = {topic.name: (topic.count, topic.rate_hz) for topic in summary.topics}
    assert rates["/odom"] == (61, pytest.approx(20.0))
    assert rates["/scan"] == (16, pytest.approx(5.0))
    assert summary.odometry == "/odom"
    assert summary.frames == ("base_link", "laser")
    (laser,) = summary.lasers
    assert laser.xyz == pytest.approx((0.2, 0.0, 0.3))
    assert laser.rpy_deg == pytest.approx((0.0, 0.0, 0.0))
    assert laser.beams == (3,)
    assert (laser.returns, laser.no_returns, laser.discarded) == (1.0, 0.0, 0.0)


def test_shares_of_returns(drive, tmp_path) -> None:
    drive.odometry(0).scan(0, (1.0, math.inf, math.nan, 0.0), frame="base_link").odometry(1)
    (laser,) = inspect_log(drive.mcap(tmp_path / "a.mcap")).lasers
    assert (laser.returns, laser.no_returns, laser.discarded) == (0.25, 0.25, 0.5)


def test_ranges_in_millimetres_are_named(drive, tmp_path) -> None:
    drive.odometry(0).scan(0, (1000.0, 2000.0), frame="base_link", range_max=8000.0).odometry(1)
    log = open_log(drive.mcap(tmp_path / "a.mcap"))
    list(log)
    (problem,) = inspect_log(tmp_path / "a.mcap").problems
    assert "base_link reads up to 8000 m, which looks like millimetres" in problem
    assert log.warnings == [problem]


@pytest.mark.parametrize("ranges", [(1000.0, 2000.0), (0.0, math.nan), (math.inf, 10.0)])
def test_a_laser_without_any_return_is_named(drive, tmp_path, ranges) -> None:
    drive.odometry(0).scan(0, ranges, frame="base_link").odometry(1)
    (problem,) = inspect_log(drive.mcap(tmp_path / "a.mcap")).problems
    assert "'base_link' has no return in any scan" in problem


def test_an_endless_range_is_not_taken_for_millimetres(drive, tmp_path) -> None:
    drive.odometry(0).scan(0, frame="base_link", range_max=math.inf).odometry(1)
    (problem,) = inspect_log(drive.mcap(tmp_path / "a.mcap")).problems
    assert "no usable range_max (inf)" in problem


def test_a_log_that_cannot_be_used_is_still_inspected(drive, tmp_path) -> None:
    summary = inspect_log(drive.odometry(0).scan(0, frame="sick").mcap(tmp_path / "a.mcap"))
    (laser,) = summary.lasers
    assert laser.xyz is None
    assert any("--mount sick=" in problem for problem in summary.problems)
    mounted = inspect_log(tmp_path / "a.mcap", mounts={"sick": np.eye(4)})
    assert mounted.lasers[0].xyz == (0.0, 0.0, 0.0)


def test_what_is_wrong_is_named(drive, tmp_path) -> None:
    drive.tf(0, "base_link", "laser")
    for step in range(20):
        drive.odometry(step / 10, recorded=10 + step / 10)
    drive.scan(0.5, recorded=10.6).scan(0.4, recorded=10.7)
    drive.scan(0.6, (1.0,) * 9, recorded=10.8, angle_increment=1.0).scan(3.0, recorded=13)
    summary = inspect_log(drive.mcap(tmp_path / "a.mcap"))
    problems = "\n".join(summary.problems)
    assert "/scan: 1 messages out of order, by up to 0.100 s" in problems
    assert "/odom: header times are 10.0 s off the recording times" in problems
    assert "/scan: gaps of more than 2 s: 1, the longest 2.4 s" in problems
    assert "laser sent more or fewer ranges than its angles announce" in problems


def test_damage_is_a_problem(drive, tmp_path) -> None:
    path = drive.straight().mcap(tmp_path / "a.mcap")
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert any("cut off" in problem for problem in inspect_log(path).problems)


def test_an_empty_log_is_refused(new_drive, tmp_path) -> None:
    with pytest.raises(LogError, match="holds no messages"):
        inspect_log(new_drive().mcap(tmp_path / "a.mcap"))


def test_a_log_that_ends_before_its_first_message_is_said_to_be_cut_off(drive, tmp_path) -> None:
    path = drive.straight().mcap(tmp_path / "a.mcap")
    path.write_bytes(path.read_bytes()[:50])
    for read in (inspect_log, open_log):
        with pytest.raises(LogError, match=r"holds no messages; .* a\.mcap is cut off after"):
            read(path)


def test_a_robots_name_in_front_of_its_frames_doesnt_hide_its_lasers(drive, tmp_path) -> None:
    drive.tf(0, "robot1/base_link", "robot1/laser", (0.2, 0, 0.3))
    for step in range(21):
        drive.tf(step / 20, "robot1/odom", "robot1/base_link", (step / 20, 0, 0), topic="/tf")
    drive.scan(0.5, frame="robot1/laser")
    summary = inspect_log(drive.mcap(tmp_path / "log.mcap"))
    assert summary.odometry == "tf from robot1/odom to robot1/base_link"
    assert summary.lasers[0].xyz == pytest.approx((0.2, 0, 0.3))


def test_lasers_are_shown_on_the_robot_whose_odometry_is_used(drive, tmp_path) -> None:
    for robot in ("robot1", "robot2"):
        drive.tf(0, "map", f"{robot}/odom").tf(0, f"{robot}/odom", f"{robot}/base_link")
        drive.tf(0, f"{robot}/base_link", f"{robot}/laser", (0.2, 0, 0.3))
        drive.odometry(0, topic=f"/{robot}/odom", child=f"{robot}/base_link")
        drive.scan(0, topic=f"/{robot}/scan", frame=f"{robot}/laser")
    summary = inspect_log(drive.mcap(tmp_path / "log.mcap"))
    assert summary.odometry == "/robot1/odom"
    mountings = {laser.frame: laser.xyz for laser in summary.lasers}
    assert mountings == {"robot1/laser": pytest.approx((0.2, 0, 0.3)), "robot2/laser": None}
    assert any("'robot2/laser' is not on the robot" in problem for problem in summary.problems)


def test_angles_in_degrees_are_named(drive, tmp_path) -> None:
    drive.odometry(0).scan(
        0, frame="base_link", angle_min=-90.0, angle_max=90.0, angle_increment=90
    )
    log = open_log(drive.odometry(1).mcap(tmp_path / "a.mcap"))
    list(log)
    (problem,) = inspect_log(tmp_path / "a.mcap").problems
    assert "The beams of base_link span 180 rad, which looks like degrees" in problem
    assert log.warnings == [problem]
