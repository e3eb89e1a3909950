"""What people type as option values."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from objstate.cli.parsing import check_span, parse_mounts, parse_pose, parse_time, split_topics
from objstate.errors import SettingsError
from objstate.geometry import rpy_from_rotation

numbers = st.floats(-100, 100)


@given(x=numbers, y=numbers, yaw=st.floats(-3, 3))
def test_a_pose_round_trips(x: float, y: float, yaw: float) -> None:
    np.testing.assert_array_equal(parse_pose(f"{x},{y},{yaw}"), [x, y, yaw])


def test_a_yaw_may_be_given_in_degrees() -> None:
    np.testing.assert_allclose(parse_pose(" 1, -2.5, -90deg"), [1, -2.5, -np.pi / 2])


@pytest.mark.parametrize(
    "text", ["", "1,2", "1,2,3,4", "1,2,north", "1,2,nan", "1,inf,0", "1deg,2,3"]
)
def test_a_pose_that_is_none_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(SettingsError, match=r"--initial-pose .* give X,Y,YAW"):
        parse_pose(text)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: parse_pose("1,2,90"), "90 rad is more than a whole turn.*write 90deg"),
        (lambda: parse_pose("1,2,-180"), "write -180deg"),
        (lambda: parse_mounts(["laser=0,0,0.3,0,0,180"]), "write 180deg"),
        (lambda: parse_mounts(["laser=250,0,0.3,0,0,0"]), "millimetres are meant, write 0.25"),
        (lambda: check_span(1.6e18, None), "--from .* nanoseconds are meant, write 1600000000"),
        (lambda: check_span(None, 1.6e12), "--to .* milliseconds are meant, write 1600000000"),
        (lambda: parse_time("1600000000000000000"), "nanoseconds are meant, write 1600000000"),
    ],
)
def test_another_unit_than_can_be_meant_is_refused_and_told(
    call: Callable[[], object], message: str
) -> None:
    with pytest.raises(SettingsError, match=message):
        call()


def test_a_mounting_is_a_transform_by_frame() -> None:
    mounts = parse_mounts(["front=0.25,0,0.3,180deg,0,0.5", "rear=0,0,0,0,0,0"])
    assert set(mounts) == {"front", "rear"}
    np.testing.assert_allclose(mounts["front"][:3, 3], [0.25, 0, 0.3])
    np.testing.assert_allclose(
        np.abs(rpy_from_rotation(mounts["front"][:3, :3])), [np.pi, 0, 0.5], atol=1e-12
    )
    np.testing.assert_array_equal(mounts["rear"], np.eye(4))


@pytest.mark.parametrize("text", ["front", "=0,0,0,0,0,0", "front=0,0,0", "front=0,0,0,a,0,0"])
def test_a_mounting_that_is_none_is_refused_with_the_form(text: str) -> None:
    with pytest.raises(SettingsError, match=r"--mount .* give FRAME=x,y,z,roll,pitch,yaw"):
        parse_mounts([text])


@pytest.mark.parametrize(
    ("start", "end"),
    [(None, None), (0.0, None), (None, -1.0), (3.0, 4.0), (5.0, 1.6e9), (1.6e9, 1.6e9 + 1)],
)
def test_a_span_may_be_open_and_on_two_clocks(start: float | None, end: float | None) -> None:
    check_span(start, end)


@pytest.mark.parametrize(
    ("start", "end", "message"),
    [
        (4.0, 3.0, "--from 4 must come before --to 3"),
        (4.0, 4.0, "--from 4 must come before --to 4"),
        (1.6e9 + 1, 1.6e9, "--from 1600000001 must come before --to 1600000000"),
        (np.nan, None, "--from nan must be a finite number"),
        (None, np.inf, "--to inf must be a finite number"),
    ],
)
def test_a_span_that_holds_nothing_is_refused(
    start: float | None, end: float | None, message: str
) -> None:
    with pytest.raises(SettingsError, match=message):
        check_span(start, end)


def test_topics_may_be_repeated_or_separated_by_commas() -> None:
    assert split_topics(["/scan,/odom", " /tf "]) == ["/scan", "/odom", "/tf"]
    assert split_topics([]) is None


@pytest.mark.parametrize(
    ("text", "stamp_ns"),
    [
        ("0", 0),
        ("1600000000.123456789", 1_600_000_000_123_456_789),
        ("2020-09-13T12:26:40", 1_600_000_000 * 10**9),
        ("2020-09-13 14:26:40+02:00", 1_600_000_000 * 10**9),
        ("2020-09-13", 1_599_955_200 * 10**9),
    ],
)
def test_times_are_exact_and_in_utc(text: str, stamp_ns: int) -> None:
    assert parse_time(text) == stamp_ns
