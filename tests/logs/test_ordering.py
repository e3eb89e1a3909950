"""Time order over a window, and scans placed in the odometry."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.logs.notices import Notices
from objstate.logs.odometry import Track, place_in_odometry
from objstate.logs.ordering import Arrival, in_time_order
from objstate.logs.scans import Sweep
from objstate.records import InitialPose, Odometry, Rays, Scan

MS = 1_000_000


def odometry(ms: float, x: float = 0.0) -> Odometry:
    return Odometry(round(ms * MS), np.array([x, 0.0, 0.0]))


def sweep(ms: float, beams: int = 3, interval_ms: float = 0.0) -> Sweep:
    rays = Rays(np.zeros((beams, 3)), np.tile([1.0, 0.0, 0.0], (beams, 1)))
    return Sweep(round(ms * MS), "laser", np.ones(beams), rays, 0.1, 10.0, interval_ms * MS)


def ordered(items, recorded_ms, notices=None):
    arrivals = [Arrival(i, round(r * MS)) for i, r in zip(items, recorded_ms, strict=True)]
    return list(in_time_order(arrivals, notices or Notices()))


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(0, 5000), st.integers(0, 900)), max_size=60))
def test_delays_within_the_window_are_undone(stamps_and_delays) -> None:
    by_recording = sorted(stamps_and_delays, key=sum)
    notices = Notices()
    out = ordered(
        [odometry(stamp) for stamp, _ in by_recording],
        [stamp + delay for stamp, delay in by_recording],
        notices,
    )
    assert [item.stamp_ns for item in out] == sorted(s * MS for s, _ in by_recording)
    assert notices.listed() == []


def test_what_comes_too_late_is_dropped_and_told() -> None:
    notices = Notices()
    out = ordered(
        [odometry(0), odometry(3000), odometry(6000), odometry(100)], [0, 3000, 6000, 6100], notices
    )
    assert [item.stamp_ns // MS for item in out] == [0, 3000, 6000]
    assert sum(notices.dropped.values()) == 1


def test_a_clock_that_was_set_back_is_told_of_once_with_when_and_by_how_much() -> None:
    times = [*range(100_000, 110_000, 500), *range(20_000, 30_000, 500)]
    notices = Notices()
    out = ordered([odometry(t) for t in times], range(0, 20_000, 500), notices)
    assert len(out) == 20
    (dropped, jump) = notices.listed()
    assert jump.startswith("Stamps jump back by 88 s when 8 s of the log have passed")
    assert dropped.startswith("Odometry dropped: more than 1 s behind")


def test_a_few_wrong_stamps_are_no_clock_that_was_set_back() -> None:
    times = [*range(100_000, 110_000, 100)]
    wrong = [3, 4, *times[30:60], 5, *times[60:]]
    notices = Notices()
    out = ordered(
        [odometry(t) for t in [*times[:30], *wrong]], [100 * i for i in range(103)], notices
    )
    assert [item.stamp_ns // MS for item in out] == times
    (dropped,) = notices.listed()
    assert dropped.endswith("(3 times)")


def test_one_stamp_in_the_far_future_holds_nothing_up_and_loses_nothing() -> None:
    times = [0, 100, 10**9, 200, *range(300, 5000, 100)]
    recorded = [0, 100, 150, 200, *range(300, 5000, 100)]
    notices = Notices()
    out = ordered([odometry(t) for t in times], recorded, notices)
    assert [item.stamp_ns // MS for item in out] == sorted(times)
    assert notices.listed() == []


def test_at_one_stamp_beliefs_come_first_then_odometry_then_scans() -> None:
    belief = InitialPose(0, np.zeros(3), np.eye(3))
    for order in ([0, 1, 2], [2, 1, 0], [1, 2, 0]):
        items = [belief, odometry(0), sweep(0)]
        out = ordered([items[i] for i in order], [0, 0, 0])
        assert [type(item) for item in out] == [InitialPose, Odometry, Sweep]


def placed(*items):
    notices = Notices()
    return list(place_in_odometry(items, notices)), notices


def test_a_scans_pose_is_interpolated_between_its_neighbours() -> None:
    records, notices = placed(odometry(0, 1.0), sweep(25), odometry(100, 1.4))
    assert [type(r) for r in records] == [Odometry, Scan, Odometry]
    np.testing.assert_allclose(records[1].odometry, [1.1, 0, 0])
    assert notices.listed() == []


def test_each_beam_has_its_own_time() -> None:
    records, _ = placed(
        odometry(0, 0.0), sweep(0, beams=3, interval_ms=50), odometry(50, 0.5), odometry(100, 0.5)
    )
    scan = next(r for r in records if isinstance(r, Scan))
    np.testing.assert_allclose(scan.rays.origins[:, 0], [0.0, 0.5, 0.5])
    assert [r.stamp_ns for r in records] == sorted(r.stamp_ns for r in records)


def test_after_the_last_odometry_the_velocity_is_kept_and_told() -> None:
    records, notices = placed(*(odometry(t, t / 1000) for t in range(0, 1001, 50)), sweep(1200))
    np.testing.assert_allclose(records[-1].odometry, [1.2, 0, 0])
    assert "velocity" in notices.listed()[0]


def test_a_velocity_is_not_taken_from_two_stamps_that_nearly_coincide() -> None:
    records, _ = placed(odometry(0, 0.0), odometry(1000, 1.0), odometry(1000.4, 1.1), sweep(1100))
    assert records[-1].odometry[0] < 1.3


def test_scans_without_odometry_are_dropped_and_told() -> None:
    records, notices = placed(sweep(0), odometry(500), odometry(600), sweep(5000))
    assert [type(r) for r in records] == [Odometry, Odometry]
    assert sum(notices.dropped.values()) == 2


def test_a_scan_does_not_wait_for_odometry_for_ever() -> None:
    items = iter(
        [
            odometry(0),
            sweep(100),
            *(InitialPose(t * MS, np.zeros(3), np.eye(3)) for t in (500, 2100)),
        ]
    )
    out = place_in_odometry(items, Notices())
    kinds = [type(next(out)) for _ in range(3)]
    assert kinds == [Odometry, Scan, InitialPose]


def test_odometry_with_gaps_of_up_to_two_seconds_is_interpolated() -> None:
    items = [odometry(0, 0.0), odometry(100, 0.0), odometry(2100, 1.0)]
    items += [sweep(t, beams=2, interval_ms=50) for t in range(100, 2050, 100)]
    records, notices = placed(*sorted(items, key=lambda item: item.stamp_ns))
    scans = [r for r in records if isinstance(r, Scan)]
    np.testing.assert_allclose([s.odometry[0] for s in scans], np.arange(20) / 20, atol=1e-12)
    assert notices.listed() == []


def test_in_a_longer_gap_the_velocity_is_kept_for_a_second() -> None:
    ends = (*range(0, 1001, 50), *range(5000, 6001, 50))
    items = [*(odometry(t, t / 1000) for t in ends), *(sweep(t + 1) for t in range(0, 6000, 100))]
    records, notices = placed(*sorted(items, key=lambda item: item.stamp_ns))
    scans = {r.stamp_ns / 1e9: r.odometry[0] for r in records if isinstance(r, Scan)}
    np.testing.assert_allclose(list(scans.values()), list(scans))
    assert not any(2 < t < 3.9 for t in scans)
    assert len([t for t in scans if 1.1 < t < 2]) == 9
    assert len(notices.listed()) == 2


def test_odometry_that_jumps_is_told_and_repeats_are_left_out() -> None:
    moves = odometry(1000), odometry(1000), odometry(1050, 0.1), odometry(1100, 9.0)
    records, notices = placed(*moves, odometry(1150))
    assert len(records) == 4
    assert notices.listed() == [
        "Odometry jumps farther than a robot can move, first when 0.1 s of the log have passed, by "
        "8.90 m and 0° in 0.05 s (2 times)"
    ]


@settings(max_examples=50)
@given(st.lists(st.integers(1, 200), min_size=2, max_size=20), st.floats(0, 2))
def test_forgetting_changes_nothing_for_later_times(steps, share) -> None:
    stamps = np.cumsum(steps)
    whole, short = Track(), Track()
    for stamp in stamps:
        for track in (whole, short):
            track.append(odometry(float(stamp), float(stamp % 7)))
    time = round((stamps[0] + share * (stamps[-1] - stamps[0])) * MS)
    short.forget_before(time)
    times = np.array([time, int(stamps[-1]) * MS, int(stamps[-1] + 50) * MS])
    np.testing.assert_allclose(short.poses_at(times), whole.poses_at(times))
    np.testing.assert_array_equal([whole.pose_at(t) for t in times], whole.poses_at(times))
