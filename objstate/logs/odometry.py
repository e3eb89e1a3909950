"""The robot's odometry over time, and scans placed in it."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import deque
from collections.abc import Iterable, Iterator

import numpy as np

from objstate.geometry import FloatArray, IntArray, interpolate_pose, wrapped
from objstate.logs.notices import Notices
from objstate.logs.ordering import Item
from objstate.logs.scans import Sweep
from objstate.records import Odometry, Record, Scan

# ns; a scan farther than this from all odometry is dropped. So odometry is carried on for as long
# without news, and interpolated over gaps of twice that length
WAIT_NS = 1_000_000_000

# ns; stretch over which the last velocity is taken, since close stamps give a poor one
VELOCITY_NS = 100_000_000

# m/s and rad/s; no robot in a building is faster, so odometry that is has jumped
FASTEST = 5.0
FASTEST_TURN = 12.0
# m and rad; a smaller step between two close stamps is not reported as a jump
SMALLEST_JUMP = 0.2

# m; velocities that lead so far while poses stay the same are of a driver that fills in no poses
FARTHEST_STANDING = 2.0
# m/s; a smaller velocity is noise of a robot that stands, and leads nowhere however long it lasts
SLOWEST = 0.02


class Standing:
    """How far the velocities of odometry have led since its pose last changed."""

    def __init__(self, topic: str, notices: Notices) -> None:
        self._topic, self._notices = topic, notices
        self._last: Odometry | None = None
        self._led_m = 0.0

    def note(self, odometry: Odometry, speed: float) -> None:
        """Take odometry with its speed, m/s; tell where only its velocities can be right."""
        last, self._last = self._last, odometry
        if last is None or not np.array_equal(last.pose, odometry.pose):
            self._led_m = 0.0
            return
        if speed >= SLOWEST:
            self._led_m += speed * min(max(odometry.stamp_ns - last.stamp_ns, 0), WAIT_NS) * 1e-9
        if self._led_m > FARTHEST_STANDING:
            self._led_m = 0.0
            self._notices.add(
                f"The poses of {self._topic} stay the same while its velocities lead "
                f"{FARTHEST_STANDING:g} m away, and only poses are used: record odometry that has "
                "poses, or choose it with --topics"
            )


class Track:
    """The latest stretch of odometry."""

    def __init__(self) -> None:
        self._stamps: list[int] = []
        self._poses: list[FloatArray] = []
        self._begin_ns: int | None = None  # stamp of the first of all
        self._first_jump = ""  # in words

    @property
    def first_ns(self) -> int | None:
        """The oldest stamp that is kept."""
        return self._stamps[0] if self._stamps else None

    @property
    def last_ns(self) -> int | None:
        """The latest stamp."""
        return self._stamps[-1] if self._stamps else None

    @property
    def last_pose(self) -> FloatArray:
        """The latest pose (3,)."""
        return self._poses[-1]

    def append(self, odometry: Odometry) -> None:
        """Take odometry with a later stamp than all before."""
        self._begin_ns = odometry.stamp_ns if self._begin_ns is None else self._begin_ns
        self._stamps.append(odometry.stamp_ns)
        self._poses.append(odometry.pose)

    def jump_to(self, odometry: Odometry) -> str:
        """What is told where odometry jumps from the latest to this: when it did so first."""
        if not self._first_jump:
            assert self._begin_ns is not None
            x, y, yaw = (odometry.pose - self.last_pose).tolist()
            self._first_jump = (
                "Odometry jumps farther than a robot can move, first when "
                f"{(odometry.stamp_ns - self._begin_ns) / 1e9:.1f} s of the log have passed, by "
                f"{math.hypot(x, y):.2f} m and {math.degrees(abs(wrapped(yaw))):.0f}° in "
                f"{(odometry.stamp_ns - self._stamps[-1]) / 1e9:.2f} s"
            )
        return self._first_jump

    def forget_before(self, stamp_ns: int) -> None:
        """Keep only what is needed for times from ``stamp_ns`` on."""
        needed_ns = min(stamp_ns, self._stamps[-1]) - VELOCITY_NS
        needed_from = max(bisect_right(self._stamps, needed_ns) - 1, 0)
        del self._stamps[:needed_from], self._poses[:needed_from]

    def pose_at(self, time_ns: int) -> FloatArray:
        """The pose (3,) at one time, without the cost of arrays; else as ``poses_at``."""
        stamps, poses = self._stamps, self._poses
        if len(stamps) == 1:
            return poses[0]
        start = min(max(bisect_right(stamps, time_ns) - 1, 0), len(stamps) - 2)
        end = start + 1
        if time_ns > stamps[-1]:
            start = max(bisect_right(stamps, stamps[-1] - VELOCITY_NS) - 1, 0)
        share = (time_ns - stamps[start]) / (stamps[end] - stamps[start])
        return interpolate_pose(poses[start], poses[end], share)

    def poses_at(self, times_ns: IntArray) -> FloatArray:
        """Poses (n, 3) at ``times_ns`` (n,): interpolated, or carried on at the last velocity."""
        if len(self._stamps) == 1:
            return np.repeat(self._poses[0][None], len(times_ns), axis=0)
        origin = self._stamps[0]
        stamps, poses = np.array(self._stamps) - origin, np.array(self._poses)
        times = times_ns - origin
        start = np.clip(np.searchsorted(stamps, times, side="right") - 1, 0, len(stamps) - 2)
        end = start + 1
        is_beyond = times > stamps[-1]
        if is_beyond.any():
            early = np.searchsorted(stamps, stamps[-1] - VELOCITY_NS, side="right") - 1
            start[is_beyond] = max(early, 0)
        share = (times - stamps[start]) / (stamps[end] - stamps[start])
        return interpolate_pose(poses[start], poses[end], share)


def place_in_odometry(items: Iterable[Item], notices: Notices) -> Iterator[Record]:
    """Records in time order: each scan waits for odometry at or after its last beam.

    In a gap of up to two seconds it is interpolated; in a longer one, and after the last odometry,
    it is carried on. A scan before any odometry, or without any within a second, is dropped with a
    notice.
    """
    track = Track()
    held: deque[Item] = deque()
    for item in items:
        if isinstance(item, Odometry) and not extends(track, item, notices):
            continue
        if not held and not isinstance(item, Sweep):
            yield item
            continue
        held.append(item)
        while held and _is_ready(held[0], track, now_ns=item.stamp_ns):
            yield from placed(held.popleft(), track, notices)
    for item in held:
        yield from placed(item, track, notices)


def extends(track: Track, odometry: Odometry, notices: Notices) -> bool:
    """Take odometry into the track; not where its stamp is there already."""
    if track.last_ns is None:
        track.append(odometry)
        return True
    elapsed = (odometry.stamp_ns - track.last_ns) * 1e-9
    if elapsed <= 0:
        if not np.array_equal(odometry.pose, track.last_pose):
            notices.drop("Odometry", "a second one of the same stamp")
        return False
    x, y, yaw = (odometry.pose - track.last_pose).tolist()
    distance, turn = math.hypot(x, y), abs(wrapped(yaw))
    if (distance > max(SMALLEST_JUMP, FASTEST * elapsed)) or (
        turn > max(SMALLEST_JUMP, FASTEST_TURN * elapsed)
    ):
        notices.add(track.jump_to(odometry))
    track.append(odometry)
    return True


def _is_ready(item: Item, track: Track, now_ns: int) -> bool:
    if not isinstance(item, Sweep):
        return True
    known_to = track.last_ns
    if known_to is None or known_to >= item.end_ns:
        return True
    return now_ns - max(item.end_ns, known_to + WAIT_NS) > WAIT_NS


def placed(item: Item, track: Track, notices: Notices) -> Iterator[Record]:
    """The record of an item; a scan by odometry, if there is any near it."""
    if not isinstance(item, Sweep):
        yield item
        return
    scan = _scan(item, track, notices)
    if scan is not None:
        yield scan
        track.forget_before(item.stamp_ns)


def _scan(sweep: Sweep, track: Track, notices: Notices) -> Scan | None:
    if track.first_ns is None or track.last_ns is None or track.first_ns > sweep.stamp_ns:
        notices.drop("Scan", "before any odometry")
        return None
    if sweep.end_ns - track.last_ns > WAIT_NS:
        notices.drop("Scan", f"no odometry within {WAIT_NS / 1e9:g} s")
        return None
    if sweep.end_ns > track.last_ns:
        notices.add("Scan after the last odometry: its pose is carried on at the last velocity")
    if sweep.beam_interval_ns == 0:
        return sweep.scan(track.pose_at(sweep.stamp_ns))
    return sweep.swept(track.poses_at(sweep.beam_times_ns()))
