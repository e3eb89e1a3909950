"""What is read straight from the bytes is what the type store says, or nothing."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from objstate.errors import LogError
from objstate.logs.definitions import CDR, IDL, MSG, ROS1, MessageType
from objstate.logs.standard import READERS
from tests.logs.conftest import ROS1 as ROS1_TYPES
from tests.logs.conftest import ROS2 as ROS2_TYPES
from tests.logs.conftest import Drive

KINDS = sorted(READERS.keys() - {"tf/msg/tfMessage"})  # that one is of ROS 1 alone
WIRES = (CDR, ROS1)


def drive() -> Drive:
    """One message of each kind; names of different lengths, so that numbers are not aligned as they come."""
    made = Drive()
    for name in ("a", "base", "laser_link"):
        made.scan(1.25, (1.0, np.inf, np.nan, 0.5, 3.0), frame=name, intensities=np.ones(3, "f4"))
        made.odometry(2.5, 1.0, -2.0, 0.3, child=name)
        made.tf(0.5, "map", name, (0.1, 0.2, 0.3), 1.0, 0.5)
        made.pose_with_covariance(3.0, 1.0, 2.0, 3.0, topic="/initialpose", frame=name)
    return made


def messages(kind: str, wire: str) -> list[bytes]:
    made = drive()
    return [data for _, k, _, data in (made.cdr() if wire == CDR else made.ros1()) if k == kind]


def message_type(kind: str, wire: str) -> MessageType:
    store, version = (ROS2_TYPES, 2) if wire == CDR else (ROS1_TYPES, 1)
    return MessageType(kind, wire, store.generate_msgdef(kind, ros_version=version)[0])


def assert_same(read: Any, decoded: Any) -> None:
    if isinstance(read, tuple):
        for name in read._fields:
            assert_same(getattr(read, name), getattr(decoded, name))
    elif isinstance(read, list):
        for one, other in zip(read, decoded, strict=True):
            assert_same(one, other)
    else:
        np.testing.assert_array_equal(read, decoded)
        assert getattr(read, "dtype", type(read)) == getattr(decoded, "dtype", type(decoded))


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_read_is_what_the_type_store_says(kind: str, wire: str) -> None:
    known = message_type(kind, wire)
    for data in messages(kind, wire):
        read = known.read(data)
        assert isinstance(read, tuple)
        assert_same(read, known.decode(data))


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("kind", KINDS)
def test_what_is_cut_off_or_too_long_is_damaged(kind: str, wire: str) -> None:
    known = message_type(kind, wire)
    whole = messages(kind, wire)[-1]
    for damaged in (*(whole[:end] for end in range(len(whole))), whole + bytes(8)):
        with pytest.raises(LogError, match="damaged"):
            known.read(damaged)


@pytest.mark.parametrize("wire", WIRES)
@pytest.mark.parametrize("kind", KINDS)
def test_bytes_that_are_flipped_are_read_as_the_type_store_reads_them(kind: str, wire: str) -> None:
    known, rng = message_type(kind, wire), np.random.default_rng(5)
    for data in messages(kind, wire):
        for place in rng.integers(0, len(data), 50):
            flipped = bytearray(data)
            flipped[place] ^= 1 << int(rng.integers(8))
            assert_read_alike(known, bytes(flipped))


def assert_read_alike(known: MessageType, data: bytes) -> None:
    try:
        decoded = known.decode(data)
    except LogError:
        with pytest.raises(LogError):
            known.read(data)
    else:
        read = known.read(data)
        if isinstance(read, tuple):  # else the type store has read it
            assert_same(read, decoded)


def test_a_log_that_defines_a_type_in_its_own_way_is_believed() -> None:
    kind = "sensor_msgs/msg/LaserScan"
    (data, *_), standard = messages(kind, CDR), message_type(kind, CDR)
    swapped = standard.text.replace("angle_max", "x").replace("angle_min", "angle_max")
    own = MessageType(kind, CDR, swapped.replace("float32 x", "float32 angle_min"))
    assert own.read(data).angle_min == standard.read(data).angle_max


ODOMETRY = """
std_msgs/Header header
string child_frame_id   # the robot
geometry_msgs/PoseWithCovariance pose

geometry_msgs/TwistWithCovariance twist
"""


@pytest.mark.parametrize(
    ("text", "language", "more", "is_standard"),
    [
        ("", MSG, 0, True),
        (ODOMETRY, MSG, 0, True),
        ("uint8 A=1 # one\n" + ODOMETRY, MSG, 0, True),
        (ODOMETRY + "float64 more", MSG, 8, False),
        ("", IDL, 0, False),
    ],
)
def test_only_what_is_laid_out_as_ros_does_is_read_straight(
    text: str, language: str, more: int, is_standard: bool
) -> None:
    known = MessageType("nav_msgs/msg/Odometry", CDR, text, language)
    read = known.read(messages(known.name, CDR)[0] + bytes(more))
    assert isinstance(read, tuple) == is_standard
    assert read.pose.pose.position.y == -2.0
