"""What becomes of the messages of a drive: frames, odometry, beliefs, and what can't be used."""

import math
from itertools import pairwise

import numpy as np
import pytest

from objstate.errors import LogError
from objstate.geometry import rotation_from_rpy, transform
from objstate.logs import inspect_log, open_log
from objstate.records import GaussianRobotBelief, InitialPose, Odometry, RobotBelief, Scan


def read(drive, tmp_path, **options):
    log = open_log(drive.mcap(tmp_path / "log.mcap"), **options)
    return list(log), log


def of(kind, records):
    return [record for record in records if isinstance(record, kind)]


@pytest.mark.parametrize("kind", ["mcap", "bag1", "bag2"])
def test_the_share_read_grows_within_a_chunk(drive, tmp_path, kind):
    drive.straight(40.0)
    whole = {} if kind == "bag2" else {"chunk_size": 2**26}  # one chunk for all
    log = open_log(getattr(drive, kind)(tmp_path / "drive.log", **whole))
    shares = [log.share for _ in log]
    assert shares == sorted(shares)
    assert max(b - a for a, b in pairwise([0.0, *shares])) < 0.15


def test_a_mounting_through_several_frames_and_leading_slashes(drive, tmp_path) -> None:
    drive.tf(0, "/base_link", "/mast", (0.1, 0, 0.5), yaw=math.pi / 2)
    drive.tf(0, "mast", "laser", (0.2, 0, 0.1), roll=math.pi)
    drive.odometry(0).scan(0, (1.0,), frame="/laser", angle_min=0.0).odometry(1)
    records, _ = read(drive, tmp_path)
    scan = of(Scan, records)[0]
    assert scan.laser == "laser"
    np.testing.assert_allclose(scan.rays.origins[0], [0.1, 0.2, 0.6], atol=1e-12)
    np.testing.assert_allclose(scan.rays.directions[0], [0, 1, 0], atol=1e-12)


def test_a_mounting_that_comes_after_the_first_scans_serves_them_too(drive, tmp_path) -> None:
    for step in range(300):
        drive.odometry(step / 10).scan(step / 10)
    drive.tf(29.95, "base_link", "laser", (0.3, 0, 0))
    records, _ = read(drive, tmp_path)
    scans = of(Scan, records)
    assert len(scans) == 300
    assert all(scan.rays.origins[0, 0] == 0.3 for scan in scans)


def test_a_laser_that_first_speaks_late_finds_its_mounting(drive, tmp_path) -> None:
    drive.straight(12.0).scan(11.0, frame="rear", topic="/rear").odometry(12.1)
    drive.tf(12.1, "base_link", "rear", (-0.3, 0, 0), yaw=math.pi)
    records, _ = read(drive, tmp_path)
    (rear,) = [scan for scan in of(Scan, records) if scan.laser == "rear"]
    np.testing.assert_allclose(rear.rays.origins[0], [-0.3, 0, 0])


def test_an_unknown_mounting_names_the_frame_and_the_cure(drive, tmp_path) -> None:
    drive.odometry(0).scan(0, frame="sick").odometry(1)
    with pytest.raises(LogError, match="--mount sick=x,y,z,roll,pitch,yaw"):
        read(drive, tmp_path)


def test_a_late_laser_without_a_mounting_is_told_before_the_first_record(
    drive, tmp_path, start_ns
) -> None:
    drive.straight(10.0).scan(10.0, frame="rear", topic="/rear")
    path = drive.mcap(tmp_path / "log.mcap")
    with pytest.raises(LogError, match="--mount rear="):
        next(iter(open_log(path)))
    assert of(Scan, open_log(path, end=8.0))
    assert of(Scan, open_log(path, end=start_ns / 1e9 + 8.0))


def test_a_laser_without_a_mounting_that_shares_a_topic_is_left_out_and_told(
    drive, tmp_path
) -> None:
    drive.straight(10.0).scan(10.0, frame="rear")
    records, log = read(drive, tmp_path)
    assert {scan.laser for scan in of(Scan, records)} == {"laser"}
    (warning,) = log.warnings
    assert warning.startswith("Scan dropped: The log has no mounting of the laser 'rear'")
    assert "--mount rear=" in warning
    assert log.counts[warning] == 1


def test_lasers_whose_scans_have_no_frame_are_called_by_their_topics(drive, tmp_path) -> None:
    drive.straight().scan(3.0, topic="/front", frame="").scan(3.0, topic="/robot/rear", frame="")
    with pytest.raises(LogError, match=r"no frame_id.*--mount front=x,y,z,roll,pitch,yaw"):
        read(drive, tmp_path)
    mounts = {"front": np.eye(4), "/robot/rear": np.eye(4)}
    records, log = read(drive, tmp_path, mounts=mounts)
    assert {scan.laser for scan in of(Scan, records)} == {"laser", "front", "robot/rear"}
    assert "A scan on /front has no frame_id: its laser is called 'front'" in log.warnings
    inspected = inspect_log(tmp_path / "log.mcap", mounts)
    assert [laser.frame for laser in inspected.lasers] == ["front", "laser", "robot/rear"]


def test_given_mounts_supply_and_override(drive, tmp_path) -> None:
    drive.straight()
    mount = transform(rotation_from_rpy(0, 0, 0), (9, 8, 7))
    records, _ = read(drive, tmp_path, mounts={"/laser": mount})
    np.testing.assert_array_equal(of(Scan, records)[0].rays.origins[0], [9, 8, 7])
    with pytest.raises(LogError, match="rigid"):
        read(drive, tmp_path, mounts={"laser": 2 * np.eye(4)})


def test_a_laser_in_base_link_itself_needs_no_mounting(drive, tmp_path) -> None:
    drive.odometry(0).scan(0, frame="base_link").odometry(1)
    records, _ = read(drive, tmp_path)
    np.testing.assert_array_equal(of(Scan, records)[0].rays.origins, 0)


@pytest.mark.parametrize("robot", ["", "robot1/"])
@pytest.mark.parametrize("child", ["base_footprint", "base_link"])
def test_odometry_of_base_footprint_is_carried_to_base_link(drive, tmp_path, robot, child) -> None:
    drive.tf(0, f"{robot}base_footprint", f"{robot}base_link", (0.1, 0, 0.05))
    drive.tf(0, f"{robot}base_link", f"{robot}laser", (0.2, 0, 0.3))
    x, y = (1.0, 2.0) if child == "base_footprint" else (1.0, 2.1)
    for t in (0, 1):
        drive.odometry(t, x, y, math.pi / 2, child=robot + child)
    records, _ = read(drive.scan(0.5, frame=f"{robot}laser"), tmp_path)
    np.testing.assert_allclose(of(Odometry, records)[0].pose, [1.0, 2.1, math.pi / 2])
    np.testing.assert_allclose(of(Scan, records)[0].rays.origins[0], [0.2, 0, 0.35])


@pytest.mark.parametrize(("speed", "moves"), [(1.0, False), (1.0, True), (0.05, False)])
def test_odometry_of_velocities_alone_is_told(drive, tmp_path, speed, moves) -> None:
    for step in range(101):
        t = step / 20
        drive.odometry(t, x=t if moves else 0.0, speed=speed).scan(t, frame="base_link")
    _, log = read(drive, tmp_path)
    told = any("poses of /odom stay the same" in warning for warning in log.warnings)
    assert told == (speed == 1.0 and not moves)


def test_a_robot_that_stands_for_an_hour_has_poses(drive, tmp_path) -> None:
    for second in range(3600):
        drive.odometry(second, speed=0.001).scan(second, frame="base_link")
    _, log = read(drive, tmp_path)
    assert log.warnings == []


@pytest.mark.parametrize("robot", ["", "robot1/"])
def test_odometry_comes_from_tf_where_there_is_no_topic(drive, tmp_path, robot) -> None:
    odom, footprint, base, laser = (
        robot + name for name in ("odom", "base_footprint", "base_link", "laser")
    )
    drive.tf(0, footprint, base, (0.1, 0, 0.0))
    drive.tf(0, base, laser)
    for step in range(21):
        drive.tf(step / 20, odom, footprint, (step / 20, 0, 0), topic="/tf")
        drive.tf(step / 20, "map", odom, (5, 5, 0), topic="/tf")
        drive.tf(step / 20 + 0.01, odom, "tag", (5, 5, 0), topic="/tf")
    drive.scan(0.525, frame=laser, recorded=1.0)
    records, log = read(drive, tmp_path)
    assert log.counts == {"Odometry": 21, "Scan": 1}
    np.testing.assert_allclose(of(Scan, records)[0].odometry, [0.625, 0, 0])


def add_robot(drive, name, frames, tf, *, y) -> None:
    """A robot that drives along x at some y, with odometry in tf alone."""
    for t in (0, 1, 2):
        drive.tf(t, f"{frames}base_link", f"{frames}laser", (0.2, 0, 0.3), topic=f"{tf}_static")
        drive.tf(t, "map", f"{frames}odom", topic=tf)
        drive.tf(t, f"{frames}odom", f"{frames}base_link", (t, y, 0), topic=tf)
        drive.scan(t, topic=f"/{name}/scan", frame=f"{frames}laser")


@pytest.mark.parametrize(
    ("prefixed", "told"), [(True, "'r2/laser' is not on the robot"), (False, r"\(r1/, r2/\)")]
)
def test_of_several_robots_one_is_read_that_is_chosen(drive, tmp_path, prefixed, told) -> None:
    for name, y in (("r1", 0.0), ("r2", 5.0)):
        frames, tf = (f"{name}/", "/tf") if prefixed else ("", f"/{name}/tf")
        add_robot(drive, name, frames, tf, y=y)
    drive.messages.sort(key=lambda message: message[2])
    with pytest.raises(LogError, match=told):
        read(drive, tmp_path)
    for name, y in (("r1", 0.0), ("r2", 5.0)):
        records, log = read(drive, tmp_path, topics=[f"/{name}/scan"])
        assert log.counts == {"Odometry": 3, "Scan": 3}
        np.testing.assert_allclose(of(Scan, records)[-1].odometry, [2, y, 0])
        np.testing.assert_allclose(of(Scan, records)[-1].rays.origins[0], [0.2, 0, 0.3])


def test_a_robot_in_a_namespace_is_read_with_all_of_its_tf(drive, tmp_path) -> None:
    add_robot(drive, "r1/front", "", "/r1/tf", y=0.0)
    records, _ = read(drive, tmp_path)
    np.testing.assert_allclose(of(Scan, records)[-1].odometry, [2, 0, 0])
    add_robot(drive, "scanner", "", "/r1/tf", y=0.0)
    records, _ = read(drive, tmp_path, topics=["/scanner/scan"])
    np.testing.assert_allclose(of(Scan, records)[-1].odometry, [2, 0, 0])


def test_without_any_odometry_the_error_says_so(drive, new_drive, tmp_path) -> None:
    with pytest.raises(LogError, match="No topic holds odometry"):
        read(drive.scan(0), tmp_path)
    only_mounting = new_drive().tf(0, "base_link", "laser").scan(0)
    with pytest.raises(LogError, match="no frame 'odom'"):
        read(only_mounting, tmp_path)


def test_without_scans_the_error_lists_what_there_is(drive, tmp_path) -> None:
    with pytest.raises(LogError, match=r"No topic holds laser scans.*/odom \(nav_msgs"):
        read(drive.odometry(0), tmp_path)


def test_without_scans_the_error_says_what_makes_them_of_a_point_cloud(drive, tmp_path) -> None:
    with pytest.raises(LogError, match=r"Play /echoes \(.*\) into the ROS package laser_proc"):
        read(drive.odometry(0).echoes(0), tmp_path)


def test_a_log_of_other_encodings_is_refused_with_their_names(drive, tmp_path) -> None:
    path = drive.mcap(tmp_path / "log.mcap", extra_json=True)
    for read_log in (open_log, inspect_log):
        with pytest.raises(LogError, match=r"log.mcap holds no ROS messages: .* encoded as json"):
            read_log(path)


def test_a_part_of_other_encodings_is_skipped_beside_one_of_messages(new_drive, tmp_path) -> None:
    log = new_drive().straight().mcap(tmp_path / "log.mcap")
    other = new_drive().mcap(tmp_path / "other.mcap", extra_json=True)
    assert len(list(open_log([other, log]))) == len(list(open_log(log)))
    assert inspect_log([log, other]).topics == inspect_log(log).topics


def test_a_log_whose_scans_are_all_useless_is_an_error(drive, tmp_path) -> None:
    drive.scan(0, frame="base_link").odometry(5)
    with pytest.raises(LogError, match="before any odometry"):
        read(drive, tmp_path)


def test_chosen_topics_are_checked_and_obeyed(drive, tmp_path) -> None:
    drive.straight().scan(2.9, topic="/other", frame="base_link").odometry(3.1, topic="/wheels")
    with pytest.raises(LogError, match=r"no topic '/scam'.*Usable topics"):
        read(drive, tmp_path, topics=["/scam"])
    with pytest.raises(LogError, match="chooses hold no laser scans; add /other or /scan"):
        read(drive, tmp_path, topics=["/odom"])
    with pytest.raises(LogError, match="chooses hold no odometry; add /odom or /wheels"):
        read(drive, tmp_path, topics=["/other"])
    records, _ = read(drive, tmp_path, topics=["/other", "/odom"])
    assert {scan.laser for scan in of(Scan, records)} == {"base_link"}


def test_a_topic_that_is_given_without_a_list_is_named_whole(drive, tmp_path) -> None:
    drive.straight()
    with pytest.raises(LogError, match=r"as the text '/scan'; give a list, as \['/scan'\]"):
        read(drive, tmp_path, topics="/scan")


def test_a_topic_of_no_use_is_refused(drive, tmp_path) -> None:
    kind = "std_msgs/msg/String"
    from rosbags.typesys import Stores, get_typestore

    text = get_typestore(Stores.ROS2_HUMBLE).types[kind](data="hello")
    with pytest.raises(LogError, match="is of type std_msgs/msg/String"):
        read(drive.straight().add("/chat", kind, 1.0, text), tmp_path, topics=["/chat"])


def test_a_processed_copy_of_a_laser_is_left_out(drive, tmp_path) -> None:
    for step in range(10):
        drive.odometry(step / 10).scan(step / 10, frame="base_link")
        drive.scan(step / 10, frame="base_link", topic="/scan_filtered")
    records, log = read(drive, tmp_path)
    assert len(of(Scan, records)) == 10
    assert any("/scan_filtered comes from the same laser" in w for w in log.warnings)


def test_two_lasers_are_both_read(drive, tmp_path) -> None:
    drive.tf(0, "base_link", "rear", (-0.2, 0, 0), yaw=math.pi)
    drive.straight()
    for step in range(10):
        drive.scan(2.5 + step / 20, topic="/rear", frame="rear", recorded=3.0)
    records, _ = read(drive, tmp_path)
    assert {scan.laser for scan in of(Scan, records)} == {"laser", "rear"}


def test_zero_header_times_fall_back_to_the_recording_times(drive, tmp_path, start_ns) -> None:
    drive.odometry(0).scan(None, frame="base_link", recorded=0.5).odometry(1)
    records, log = read(drive, tmp_path)
    assert of(Scan, records)[0].stamp_ns == start_ns + 500_000_000
    assert any("message on /scan has no header time:" in warning for warning in log.warnings)


@pytest.mark.parametrize("without", ["/initialpose", "/scan", "/odom"])
def test_messages_without_a_time_among_those_of_a_simulated_clock_have_its_time(
    new_drive, tmp_path, start_ns, without
) -> None:
    simulated, timeless = -start_ns * 1e-9, new_drive()
    timeless.pose_with_covariance(None, 0, 0, 0, topic="/initialpose", recorded=0.0)
    for step in range(9):
        t = step / 4
        is_left_out = {topic: topic == without and step < 2 for topic in ("/scan", "/odom")}
        timeless.odometry(None if is_left_out["/odom"] else simulated + 1 + t, x=t, recorded=t)
        stamp = None if is_left_out["/scan"] else simulated + 1 + t
        timeless.scan(stamp, frame="base_link", recorded=t)
    records, _ = read(timeless, tmp_path)
    stamps = {kind: [r.stamp_ns for r in of(kind, records)] for kind in (Odometry, Scan)}
    expected = [(1 + step / 4) * 1e9 for step in range(9)]
    assert records[0].stamp_ns == pytest.approx(1e9, abs=1e4)
    assert stamps[Odometry] == pytest.approx(expected, abs=1e4)
    assert stamps[Scan] == pytest.approx(expected, abs=1e4)


def test_a_clock_that_is_set_anew_is_told(drive, tmp_path) -> None:
    drive.straight(2.0)
    for step in range(20):
        drive.odometry(100 + step / 20, recorded=2 + step / 20)
    _, log = read(drive, tmp_path)
    assert any("Header times of /odom jump" in warning for warning in log.warnings)


@pytest.mark.parametrize(("ahead", "told"), [(30, "30.0 s ahead of"), (-5, "5.0 s behind")])
@pytest.mark.parametrize("in_tf", [False, True])
def test_a_laser_whose_clock_is_not_that_of_the_odometry_is_told(
    drive, tmp_path, start_ns, ahead, told, in_tf
) -> None:
    for step in range(400):
        t = step / 10
        if in_tf:
            drive.tf(t, "odom", "base_link", (t, 0, 0), topic="/tf")
        else:
            drive.odometry(t, x=t)
        drive.scan(t + ahead, frame="base_link", recorded=t)
    _, log = read(drive, tmp_path)
    odometry = "/tf" if in_tf else "/odom"
    (told_of,) = [warning for warning in log.warnings if "Synchronize the clocks" in warning]
    assert f"header times of /scan are {told} those of {odometry}" in told_of
    assert f"--clock-offset base_link={ahead}.00" in told_of
    records, corrected = read(drive, tmp_path, clock_offsets={"base_link": ahead})
    assert corrected.warnings == []
    scans = of(Scan, records)
    assert len(scans) == 400
    since_s = [(scan.stamp_ns - start_ns) / 1e9 for scan in scans]
    assert [scan.odometry[0] for scan in scans] == pytest.approx(since_s, abs=1e-6)


def test_a_clock_offset_that_the_recording_times_contradict_is_told(drive, tmp_path) -> None:
    drive.straight()
    told = r"of /scan, set back by -30 s, are 30\.0 s ahead of those of /odom.*laser=0\.00"
    with pytest.raises(LogError, match=told):
        read(drive, tmp_path, clock_offsets={"laser": -30.0})


def test_a_laser_half_a_second_late_has_the_clock_of_the_odometry(drive, tmp_path) -> None:
    for step in range(20):
        t = step / 10
        drive.odometry(t, x=t).scan(t, frame="base_link", recorded=t + 0.5)
    _, log = read(drive, tmp_path)
    assert not log.warnings


def test_start_and_end_count_from_the_start_or_are_calendar_times(
    drive, tmp_path, start_ns
) -> None:
    drive.straight(10.0)
    for offset in (0.0, start_ns * 1e-9):
        records, log = read(drive, tmp_path, start=2.0 + offset, end=4.0 + offset)
        stamps = np.array([record.stamp_ns for record in records]) - start_ns
        assert stamps.min() == 2e9
        assert stamps.max() == 4e9
        assert len(of(Scan, records)) == 11
        assert log.counts == {"Odometry": 41, "Scan": 11}
    with pytest.raises(LogError, match="between the start and the end"):
        read(drive, tmp_path, start=100.0)


@pytest.mark.parametrize("limit", ["start", "end"])
@pytest.mark.parametrize("seconds", [math.nan, math.inf, -5.0, "5", 1_700_000_000 * 10**9])
def test_a_start_or_end_that_is_no_number_of_seconds_is_refused(
    limit, seconds, drive, tmp_path
) -> None:
    with pytest.raises(LogError, match=f"The {limit} of what is read is .*; give seconds from the"):
        open_log(drive.straight().mcap(tmp_path / "log.mcap"), **{limit: seconds})


def test_an_end_before_the_start_is_refused(drive, tmp_path, start_ns) -> None:
    path = drive.straight(10.0).mcap(tmp_path / "log.mcap")
    with pytest.raises(LogError, match=r"The end, 2 s, is before the start, 5 s; exchange them"):
        open_log(path, start=5.0, end=2.0)
    calendar = start_ns * 1e-9
    assert len(list(open_log(path, start=calendar + 8.0, end=9.0))) == 27  # 21 of odometry


@pytest.mark.parametrize("option", ["mounts", "clock_offsets"])
@pytest.mark.parametrize("given", [[0.1], "laser=0.1", 0.1])
def test_what_is_not_given_by_frame_is_refused(option, given, drive, tmp_path) -> None:
    path = drive.straight().mcap(tmp_path / "log.mcap")
    with pytest.raises(TypeError, match=rf"{option} is a .*; give a dict of lasers' frames"):
        open_log(path, **{option: given})


@pytest.mark.parametrize("ahead", [math.nan, "0.1", None])
def test_a_clock_offset_that_is_no_number_is_refused(ahead, drive, tmp_path) -> None:
    path = drive.straight().mcap(tmp_path / "log.mcap")
    with pytest.raises(LogError, match=r"'laser' can't be set back by .*; give a finite number"):
        open_log(path, clock_offsets={"laser": ahead})


@pytest.mark.parametrize("given", [5, [5]])
def test_what_is_no_path_of_a_log_is_refused(given) -> None:
    with pytest.raises(TypeError, match="A int is no path of a log; give one, or a list"):
        open_log(given)


def test_beliefs_of_every_kind(drive, tmp_path) -> None:
    samples = [(1.0, 2.0, 0.5), (3.0, 4.0, -0.5)]
    drive.straight()
    drive.pose_with_covariance(0.0, 1.0, 2.0, 0.5, topic="/initialpose")
    drive.pose_with_covariance(1.0, 1.0, 2.0, 0.5, topic="/amcl_pose", recorded=1.4)
    drive.pose_array(2.0, samples)
    drive.particle_cloud(2.5, samples, [1.0, 3.0])
    drive.messages.sort(key=lambda message: message[2])
    records, log = read(drive, tmp_path)
    assert isinstance(records[0], InitialPose)
    np.testing.assert_allclose(records[0].mean, [1.0, 2.0, 0.5])
    covariance = [[0.25, 0.05, 0.0], [0.05, 0.25, 0.0], [0.0, 0.0, 0.07]]
    np.testing.assert_array_equal(records[0].covariance, covariance)
    (gaussian,) = of(GaussianRobotBelief, records)
    np.testing.assert_allclose(gaussian.mean, [1.0, 2.0, 0.5])
    equal, weighted = of(RobotBelief, records)
    np.testing.assert_allclose(equal.poses, samples)
    np.testing.assert_allclose(equal.weights, [0.5, 0.5])
    np.testing.assert_allclose(weighted.weights, [0.25, 0.75])
    assert log.counts["InitialPose"] == 1


@pytest.mark.parametrize("variances", [(0.0, 0.0, 0.0), (0.25, 0.25, 0.0)])
def test_a_variance_of_zero_means_that_the_error_is_unknown(drive, tmp_path, variances) -> None:
    drive.pose_with_covariance(0.0, 1.0, 2.0, 0.5, topic="/initialpose", variances=variances)
    records, log = read(drive.straight(), tmp_path)
    (start,) = of(InitialPose, records)
    assert start.covariance is None
    assert any("/initialpose has a variance of 0" in warning for warning in log.warnings)


def test_a_covariance_that_is_none_is_dropped_and_told(drive, tmp_path) -> None:
    drive.pose_with_covariance(0.0, 1.0, 2.0, 0.5, topic="/initialpose", variances=(-1.0, 1.0, 1.0))
    records, log = read(drive.straight(), tmp_path)
    assert not of(InitialPose, records)
    assert any("not positive semidefinite" in warning for warning in log.warnings)


def test_a_belief_in_another_frame_is_not_used_and_told(drive, tmp_path) -> None:
    drive.straight().pose_with_covariance(1.0, 0, 0, 0, topic="/ekf", frame="odom")
    records, log = read(drive, tmp_path)
    assert not of(GaussianRobotBelief, records)
    assert log.counts["Belief on /ekf dropped: it is in the frame 'odom', not 'map'"] == 1


def test_of_several_pose_arrays_only_clouds_are_beliefs(drive, tmp_path) -> None:
    drive.straight().pose_array(3.0, [(0, 0, 0)]).pose_array(3.0, [(9, 9, 9)], topic="/waypoints")
    records, _ = read(drive, tmp_path)
    (belief,) = of(RobotBelief, records)
    np.testing.assert_array_equal(belief.poses, [[0, 0, 0]])


def test_useless_poses_are_dropped_and_told(drive, tmp_path) -> None:
    drive.straight().odometry(3.05, x=math.nan).pose_array(3.0, [])
    _, log = read(drive, tmp_path)
    assert log.counts["Odometry"] == 61
    assert sum("dropped" in warning for warning in log.warnings) == 2


def test_messages_that_are_recorded_twice_count_once(new_drive, tmp_path) -> None:
    once = new_drive().straight()
    twice = new_drive()
    twice.messages = [message for message in once.messages for _ in range(2)]
    records, log = read(twice, tmp_path)
    assert len(of(Scan, records)) == len(of(Scan, read(once, tmp_path)[0]))
    assert log.warnings == ["Scan dropped: a second one of the same stamp (16 times)"]


def test_reading_twice_gives_the_same(drive, tmp_path) -> None:
    log = open_log(drive.straight().mcap(tmp_path / "log.mcap"))
    assert [r.stamp_ns for r in log] == [r.stamp_ns for r in log]
    assert log.counts == {"Odometry": 61, "Scan": 16}


def test_messages_that_cannot_be_decoded_are_dropped_and_told_once(drive, tmp_path) -> None:
    drive.straight()
    cdr = drive.cdr
    drive.cdr = lambda: [
        (topic, kind, ns, data[:40] if topic == "/scan" and ns % 10**9 else data)
        for topic, kind, ns, data in cdr()
    ]
    records, log = read(drive, tmp_path)
    assert len(of(Scan, records)) == 4
    (warning,) = log.warnings
    assert "Message on /scan dropped" in warning
    assert "(12 times)" in warning
