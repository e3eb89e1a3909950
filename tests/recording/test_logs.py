"""Every format gives back what was written, whole, and the same bytes each time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from objstate.errors import LogError, ResultError
from objstate.logs import open_messages
from objstate.recording.logs import ENDINGS, FORMATS, format_of, open_log_writer
from objstate.recording.ros import standard_types, to_cdr

START = 1_600_000_000_123_456_789
SCAN, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
TRANSFORMS = "tf2_msgs/msg/TFMessage"
BAGS = [name for name in FORMATS if name != "carmen"]
OWN_TYPE = "acme_msgs/msg/Bumper"
OWN_DEFINITION = (
    "std_msgs/Header header\nuint8 pressed\n"
    + "=" * 80
    + ("\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n")
)


def make(name: str, **fields: Any) -> Any:
    return standard_types().types[name](**fields)


def header(stamp: int, frame: str) -> Any:
    time = make("builtin_interfaces/msg/Time", sec=stamp // 10**9, nanosec=stamp % 10**9)
    return make("std_msgs/msg/Header", stamp=time, frame_id=frame)


def vector(x: float, y: float, z: float, kind: str = "Vector3") -> Any:
    return make(f"geometry_msgs/msg/{kind}", x=x, y=y, z=z)


def turn(yaw: float) -> Any:
    return make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=np.sin(yaw / 2), w=np.cos(yaw / 2))


def scan(stamp: int, frame: str = "front", beams: int = 181) -> Any:
    ranges = np.linspace(1.0, 5.0, beams).astype(np.float32)
    ranges[3], ranges[4] = np.inf, np.nan
    step = np.pi / 180
    return make(
        SCAN, header=header(stamp, frame), angle_min=-np.pi / 2,
        angle_max=-np.pi / 2 + (beams - 1) * step, angle_increment=step, time_increment=0.0,
        scan_time=0.1, range_min=0.1, range_max=8.0, ranges=ranges,
        intensities=np.zeros(0, np.float32),
    )  # fmt: skip


def odometry(stamp: int, x: float, yaw: float) -> Any:
    pose = make("geometry_msgs/msg/Pose", position=vector(x, 0.0, 0.0, "Point"),
                orientation=turn(yaw))  # fmt: skip
    zero = vector(0.0, 0.0, 0.0)
    twist = make("geometry_msgs/msg/Twist", linear=zero, angular=zero)
    return make(
        ODOMETRY, header=header(stamp, "odom"), child_frame_id="base_link",
        pose=make("geometry_msgs/msg/PoseWithCovariance", pose=pose, covariance=np.zeros(36)),
        twist=make("geometry_msgs/msg/TwistWithCovariance", twist=twist, covariance=np.zeros(36)),
    )  # fmt: skip


def mounts(stamp: int, **places: tuple[float, float, float]) -> Any:
    return make(
        TRANSFORMS,
        transforms=[
            make(
                "geometry_msgs/msg/TransformStamped", header=header(stamp, "base_link"),
                child_frame_id=frame,
                transform=make("geometry_msgs/msg/Transform", translation=vector(x, y, 0.3),
                               rotation=turn(yaw)),
            )
            for frame, (x, y, yaw) in places.items()
        ],
    )  # fmt: skip


def write_drive(path: Path, kind: str, frames: tuple[str, ...] = ("front", "rear")) -> list[str]:
    """A second of driving; scans halfway between the odometry."""
    with open_log_writer(path, kind) as log:
        places = {"front": (0.2, 0.0, 0.0), "rear": (-0.2, 0.0, np.pi), "side": (0.0, 0.3, 0.0)}
        log.write("/tf_static", TRANSFORMS, START, mounts(START, **{f: places[f] for f in frames}))
        for step in range(10):
            stamp = START + step * 10**8
            log.write("/odom", ODOMETRY, stamp, odometry(stamp, 0.1 * step, 0.02 * step))
            for frame in frames:
                stamp += 10**7
                log.write(f"/scan_{frame}", SCAN, stamp + 5, scan(stamp, frame))
    return log.warnings


@pytest.mark.parametrize("kind", BAGS)
def test_bags_give_back_every_message(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"log{ENDINGS[kind]}"
    assert write_drive(path, kind) == []
    messages = list(open_messages(path))
    assert len(messages) == 31
    assert [m.recorded_ns for m in messages] == sorted(m.recorded_ns for m in messages)
    third = [m for m in messages if m.topic == "/scan_rear"][2]
    expected = scan(START + 2 * 10**8 + 2 * 10**7, "rear")
    got = third.decode()
    assert third.recorded_ns == START + 2 * 10**8 + 2 * 10**7 + 5
    assert (got.header.stamp.sec, got.header.stamp.nanosec) == (
        expected.header.stamp.sec,
        expected.header.stamp.nanosec,
    )
    assert got.header.frame_id == "rear"
    np.testing.assert_array_equal(got.ranges, expected.ranges)


@pytest.mark.parametrize("kind", FORMATS)
def test_same_messages_give_same_bytes(tmp_path: Path, kind: str) -> None:
    contents = []
    for folder in ("a", "b"):
        path = tmp_path / folder / f"log{ENDINGS[kind]}"
        write_drive(path, kind)
        files = [path] if path.is_file() else sorted(path.iterdir())
        contents.append([(file.name, file.read_bytes()) for file in files])
    assert contents[0] == contents[1]


@pytest.mark.parametrize("kind", BAGS)
def test_own_types_pass_with_their_definition(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"log{ENDINGS[kind]}"
    cdr = to_cdr("std_msgs/msg/Header", header(START, "bumper")) + b"\x01"
    with open_log_writer(path, kind) as log:
        assert log.refusal(OWN_TYPE) is not None
        assert log.refusal(OWN_TYPE, OWN_DEFINITION) is None
        log.write("/bumper", OWN_TYPE, START, cdr, OWN_DEFINITION)
    (message,) = open_messages(path)
    assert message.decode().pressed == 1
    assert message.decode().header.frame_id == "bumper"


def test_carmen_holds_two_lasers_and_the_odometry_between(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    write_drive(path, "carmen")
    words = [line.split()[0] for line in path.read_text().splitlines()]
    assert words.count("FLASER") == words.count("RLASER") == 9  # the last ones lack odometry
    messages = list(open_messages(path))
    scans = [m.decode() for m in messages if m.topic == "/scan"]
    rear = [m.decode() for m in messages if m.topic == "/rear_scan"]
    assert len(scans) == len(rear) == 9
    assert scans[0].header.stamp.nanosec == (START + 10**7) % 10**9
    assert np.isposinf(scans[0].ranges[3])
    np.testing.assert_allclose(scans[0].ranges[5:], scan(START).ranges[5:], atol=1e-3)
    at_scan = [m.decode() for m in messages if m.topic == "/odom"]
    assert at_scan[0].pose.pose.position.x == pytest.approx(0.01, abs=1e-6)  # a tenth of the way
    places = {
        t.child_frame_id: t.transform.translation.x
        for m in messages if m.topic == "/tf_static" for t in m.decode().transforms
    }  # fmt: skip
    assert sorted(places.values()) == pytest.approx([-0.2, 0.2])


def test_carmen_names_what_it_leaves_out(tmp_path: Path) -> None:
    warnings = " ".join(write_drive(tmp_path / "drive.log", "carmen", ("front", "side")))
    assert "10 scans of 'side', which isn't on the robot's axis" in warnings
    assert "1 scans after the last odometry" in warnings
    with open_log_writer(tmp_path / "other.log") as log:
        assert log.refusal("geometry_msgs/msg/PoseArray") is not None


def test_carmen_turns_the_bearings_of_a_turned_laser(tmp_path: Path) -> None:
    path = tmp_path / "drive.log"
    with open_log_writer(path) as log:
        log.write("/tf_static", TRANSFORMS, START, mounts(START, laser=(0.1, 0.0, 0.5)))
        log.write("/odom", ODOMETRY, START, odometry(START, 0.0, 0.0))
        log.write("/scan", SCAN, START, scan(START, "laser", beams=90))
    (back,) = [m.decode() for m in open_messages(path) if m.topic == "/scan"]
    assert back.angle_min == pytest.approx(0.5 - np.pi / 2, abs=1e-6)
    assert len(back.ranges) == 90


@pytest.mark.parametrize("kind", ["bag", "carmen"])
def test_damaged_messages_are_errors_of_the_log(tmp_path: Path, kind: str) -> None:
    with (
        pytest.raises(LogError, match="LaserScan is damaged"),
        open_log_writer(tmp_path / "log", kind) as log,
    ):
        log.write("/scan", SCAN, START, to_cdr(SCAN, scan(START))[:40])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", BAGS)
def test_times_that_a_format_cannot_hold_are_errors_of_the_message(
    tmp_path: Path, kind: str
) -> None:
    with open_log_writer(tmp_path / f"log{ENDINGS[kind]}", kind) as log:
        for stamp in (-1, 2**64):
            with pytest.raises(LogError, match="none that the format can hold"):
                log.write("/scan", SCAN, stamp, scan(START))
        log.write("/scan", SCAN, START, scan(START))
    assert log.counts == {"/scan": 1}


def test_existing_logs_are_refused_unless_told(tmp_path: Path) -> None:
    path = tmp_path / "log.mcap"
    path.write_bytes(b"precious")
    with pytest.raises(ResultError, match="--overwrite"), open_log_writer(path):
        pass
    assert path.read_bytes() == b"precious"
    with open_log_writer(path, overwrite=True):
        pass
    assert list(open_messages(path)) == []
    (tmp_path / "folder").mkdir()
    with (
        pytest.raises(ResultError, match="not a result"),
        open_log_writer(tmp_path / "folder", overwrite=True),
    ):
        pass


def test_format_follows_the_ending_or_is_an_error() -> None:
    assert [format_of(p) for p in ("a.mcap", "a.bag", "a", "a.log")] == [
        "mcap", "bag", "rosbag2", "carmen",
    ]  # fmt: skip
    with pytest.raises(ResultError, match="mcap, bag"):
        format_of("drive.xyz")
    with pytest.raises(ResultError, match="choose of mcap"):
        format_of("drive", "parquet")
