"""The order of what arrives while a robot drives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.logs import Log
from objstate.logs.definitions import LASER_SCAN, MessageType
from objstate.logs.live import ClockSetBackError, LiveMessages, in_live_order, open_live
from objstate.logs.messages import Message
from objstate.logs.notices import Notices
from objstate.logs.ordering import Arrival
from objstate.logs.scans import Sweep
from objstate.records import Odometry, Rays, Scan

MS = 1_000_000
RAYS = Rays(np.zeros((1, 3)), np.array([[1.0, 0.0, 0.0]]))


def odometry(t: int, late: int = 0) -> Arrival:
    return Arrival(Odometry(t * MS, np.array([t / 1000.0, 0.0, 0.0])), (t + late) * MS)


def sweep(t: int, late: int, laser: str = "front") -> Arrival:
    found = Sweep(t * MS, laser, np.ones(1), RAYS, 0.0, 10.0, 0.0)
    return Arrival(found, (t + late) * MS)


def records(arrivals: list[Arrival]) -> tuple[list[object], Notices]:
    notices = Notices()
    ordered = sorted(arrivals, key=lambda each: each.recorded_ns)
    return list(in_live_order(ordered, notices)), notices


@settings(deadline=None)
@given(st.lists(st.integers(0, 145), min_size=10, max_size=10))  # of a laser in order
def test_no_scan_is_lost_or_out_of_order_however_late_it_is(late: list[int]) -> None:
    drive = [odometry(t) for t in range(0, 2000, 50)]
    scans = [sweep(100 + 150 * k, delay) for k, delay in enumerate(late)]
    found, notices = records([*drive, *scans])
    stamps = [each.stamp_ns for each in found]  # type: ignore[attr-defined]
    assert stamps == sorted(stamps)
    assert sum(isinstance(each, Scan) for each in found) == len(scans)
    assert sum(isinstance(each, Odometry) for each in found) == len(drive)
    assert not notices.dropped


def test_a_scan_leaves_with_the_first_odometry_after_it() -> None:
    left: list[int] = []
    notices, seen = Notices(), []

    def arriving() -> object:
        for each in (odometry(0), odometry(50), sweep(60, 30), odometry(100), odometry(150)):
            left.append(sum(isinstance(record, Scan) for record in seen))
            yield each

    for record in in_live_order(arriving(), notices):  # type: ignore[arg-type]
        seen.append(record)
    assert left == [0, 0, 0, 0, 1]


def test_a_clock_that_is_set_back_ends_a_drive() -> None:
    later = [odometry(t) for t in range(10_000, 11_000, 50)]
    scans = [sweep(t, 5) for t in range(10_000, 11_000, 100)]
    forward = sorted([*later, *scans], key=lambda each: each.recorded_ns)
    with pytest.raises(ClockSetBackError, match="set back by"):
        list(in_live_order([*forward, odometry(100), odometry(150)], Notices()))
    still = [Arrival(odometry(100 + t).item, (11_000 + t) * MS) for t in range(0, 4000, 50)]
    with pytest.raises(ClockSetBackError):
        list(in_live_order([*forward, *still], Notices()))


def test_messages_are_read_again_until_released() -> None:
    kind = MessageType(LASER_SCAN)
    live = LiveMessages({"/scan": kind})
    for k in range(4):
        live.put(Message("/scan", kind, k, b""))
    first = live.messages()
    assert [next(first).recorded_ns for _ in range(2)] == [0, 1]
    again = live.messages()
    assert next(again).recorded_ns == 0
    again.close()
    live.release()
    assert next(first).recorded_ns == 2
    assert next(live.messages()).recorded_ns >= 2
    live.close()
    assert [each.recorded_ns for each in first] == [3]


def live(drive) -> Log:
    """A live drive that has ended."""
    cdr = drive.cdr()
    types = {topic: MessageType(kind) for topic, kind, _, _ in cdr}
    messages = LiveMessages(types)
    for topic, _, recorded_ns, data in cdr:
        messages.put(Message(topic, types[topic], recorded_ns, data))
    messages.close()
    return open_live(messages)


@pytest.mark.parametrize("before", [36, 60])  # 0.9 and 1.5 s
def test_a_topic_that_comes_late_does_not_make_a_drive_wait_for_each_topic(
    drive, new_drive, before: int
) -> None:
    late = new_drive().tf(-0.5, "base_link", "laser", (0.2, 0.0, 0.3)).messages
    for step in range(40):
        drive.odometry(step / 20).scan(step / 20)
    log = live(new_drive([*drive.messages[:before], *late, *drive.messages[before:]]))
    assert sum(isinstance(record, Scan) for record in log) == 40
    assert log.warnings == []


@pytest.mark.parametrize("spoken", [0.5, 3.0])
def test_a_laser_without_a_mounting_holds_up_and_ends_no_drive(drive, spoken: float) -> None:
    drive.straight(3.0).scan(spoken, frame="rear", topic="/rear")
    drive.messages.sort(key=lambda each: each[2])
    log = live(drive)
    assert {record.laser for record in log if isinstance(record, Scan)} == {"laser"}
    assert any("no mounting of the laser 'rear'" in warning for warning in log.warnings)
