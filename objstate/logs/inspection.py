"""What is in a log, and what is wrong with it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np

from objstate.errors import LogError
from objstate.frame_names import frame_name, laser_name
from objstate.geometry import FloatArray, rpy_from_rotation
from objstate.logs.containers import Messages, Paths, as_paths
from objstate.logs.definitions import LASER_SCAN, ODOMETRY, TF
from objstate.logs.frames import BASE, FrameTree, Mountings, odometry_root
from objstate.logs.log import open_log
from objstate.logs.messages import Message, header_ns
from objstate.logs.notices import Notices
from objstate.logs.roles import odometry_topic
from objstate.logs.scans import clean_ranges, without_return

# s; a larger difference of header and recording times is reported: the clocks differ
LARGEST_OFFSET = 1.0
# s; a longer silence of a laser or the odometry is reported
LONGEST_SILENCE = 2.0
# ns; what was recorded within less came at once, as latched messages do, and has no rate
LEAST_SPAN_NS = 1_000_000


@dataclass(frozen=True)
class TopicSummary:
    """One topic."""

    name: str
    type: str
    count: int
    rate_hz: float | None  # messages a second from its first to its last; None: all at one time


@dataclass(frozen=True)
class LaserSummary:
    """One laser, by its frame."""

    frame: str
    topics: tuple[str, ...]
    xyz: tuple[float, float, float] | None  # m in base_link, above the floor; None: not known
    rpy_deg: tuple[float, float, float] | None
    beams: tuple[int, ...]  # numbers of beams that occur
    angle_min_deg: float
    angle_max_deg: float
    range_min: float  # m
    range_max: float  # m
    returns: float  # share of beams with a return
    no_returns: float  # share with nothing up to range_max
    discarded: float  # share that says nothing


@dataclass(frozen=True)
class LogSummary:
    """What ``objstate inspect`` shows of a log."""

    paths: tuple[str, ...]
    start_ns: int  # first recording time
    end_ns: int  # last recording time
    topics: tuple[TopicSummary, ...]
    frames: tuple[str, ...]
    odometry: str | None  # where odometry comes from
    lasers: tuple[LaserSummary, ...]
    records: Mapping[str, int]  # by class name, and what was dropped and why
    problems: tuple[str, ...]

    @property
    def duration_s(self) -> float:
        """From the first to the last message, s."""
        return (self.end_ns - self.start_ns) * 1e-9


def inspect_log(paths: Paths, mounts: Mapping[str, FloatArray] | None = None) -> LogSummary:
    """Read a log through and report its content and problems.

    Raises LogError only for a file that is no log.
    """
    survey = _Survey()
    notices = Notices()
    messages = Messages(as_paths(paths), None, notices)
    for message in messages:
        survey.note(message)
    if survey.first_ns is None:
        messages.topics()  # may tell why
        names = ", ".join(map(str, as_paths(paths)))
        raise LogError(f"{names} holds no messages; record it again.{notices.sentences()}")
    records, problems = _read_through(paths, mounts or {})
    found = [*messages.warnings, *survey.problems(), *problems]
    return LogSummary(
        paths=tuple(str(path) for path in as_paths(paths)),
        start_ns=survey.first_ns,
        end_ns=survey.last_ns,
        topics=survey.topics(),
        frames=tuple(sorted({*survey.tree.frames, *survey.lasers})),
        odometry=survey.odometry(),
        lasers=survey.laser_summaries(mounts or {}),
        records=records,
        problems=tuple(dict.fromkeys(found)),
    )


def _read_through(
    paths: Paths, mounts: Mapping[str, FloatArray]
) -> tuple[Mapping[str, int], list[str]]:
    """What the records are, and what reading them found wrong."""
    try:
        log = open_log(paths, mounts=mounts)
    except LogError as error:
        return {}, [str(error)]
    try:
        for _ in log:
            pass
    except LogError as error:
        return log.counts, [*log.warnings, str(error)]
    return log.counts, log.warnings


@dataclass
class _Clock:
    """Stamps of one topic as they come."""

    count: int = 0
    last_ns: int = 0
    offset_sum: float = 0.0  # s, recording minus header
    without_stamp: int = 0
    backward: int = 0
    farthest_back: float = 0.0  # s
    silences: int = 0
    longest_silence: float = 0.0  # s

    def note(self, stamp_ns: int, recorded_ns: int) -> None:
        if stamp_ns == 0:
            self.without_stamp += 1
            return
        if self.count:
            step = (stamp_ns - self.last_ns) * 1e-9
            self.backward += step < 0
            self.farthest_back = max(self.farthest_back, -step)
            self.silences += step > LONGEST_SILENCE
            self.longest_silence = max(self.longest_silence, step)
        self.count += 1
        self.last_ns = stamp_ns
        self.offset_sum += (recorded_ns - stamp_ns) * 1e-9

    def problems(self, topic: str) -> list[str]:
        found = []
        if self.without_stamp:
            found.append(f"{topic}: {self.without_stamp} messages have no header time")
        if self.backward:
            found.append(
                f"{topic}: {self.backward} messages out of order, by up to "
                f"{self.farthest_back:.3f} s"
            )
        if self.silences:
            found.append(
                f"{topic}: gaps of more than {LONGEST_SILENCE:g} s: {self.silences}, the longest "
                f"{self.longest_silence:.1f} s"
            )
        offset = self.offset_sum / self.count if self.count else 0.0
        if abs(offset) > LARGEST_OFFSET:
            found.append(
                f"{topic}: header times are {offset:.1f} s off the recording times on average"
            )
        return found


@dataclass
class _Laser:
    """Scans of one laser as they come."""

    first: Any
    topics: dict[str, None] = field(default_factory=dict)
    beams: Counter[int] = field(default_factory=Counter)
    returns: int = 0
    no_returns: int = 0

    def note(self, topic: str, scan: Any) -> None:
        ranges, _, _ = clean_ranges(scan, self.first.header.frame_id, Notices())
        self.topics[topic] = None
        self.beams[len(ranges)] += 1
        self.returns += int(np.isfinite(ranges).sum())
        self.no_returns += int(np.isinf(ranges).sum())

    def summary(self, frame: str, mounting: FloatArray | None) -> LaserSummary:
        total = max(sum(beams * scans for beams, scans in self.beams.items()), 1)
        return LaserSummary(
            frame=frame,
            topics=tuple(self.topics),
            xyz=None if mounting is None else _triple(mounting[:3, 3]),
            rpy_deg=None
            if mounting is None
            else _triple(np.degrees(rpy_from_rotation(mounting[:3, :3]))),
            beams=tuple(sorted(self.beams)),
            angle_min_deg=float(np.degrees(self.first.angle_min)),
            angle_max_deg=float(np.degrees(self.first.angle_max)),
            range_min=float(self.first.range_min),
            range_max=float(self.first.range_max),
            returns=self.returns / total,
            no_returns=self.no_returns / total,
            discarded=1 - (self.returns + self.no_returns) / total,
        )


class _Survey:
    """The messages' properties, one after the other."""

    def __init__(self) -> None:
        self.first_ns: int | None = None
        self.last_ns = 0
        self.tree = FrameTree()
        self.lasers: dict[str, _Laser] = {}
        self._types: dict[str, str] = {}
        self._spans: dict[str, tuple[int, int, int]] = {}  # count, earliest, latest
        self._clocks: dict[str, _Clock] = {}
        self._children: dict[str, str] = {}  # the robot's frame in odometry, by topic

    def note(self, message: Message) -> None:
        recorded_ns = message.recorded_ns
        self.first_ns = recorded_ns if self.first_ns is None else min(self.first_ns, recorded_ns)
        self.last_ns = max(self.last_ns, recorded_ns)
        self._types[message.topic] = message.type
        count, first, last = self._spans.get(message.topic, (0, recorded_ns, recorded_ns))
        span = min(first, recorded_ns), max(last, recorded_ns)
        self._spans[message.topic] = count + 1, *span
        if message.type in (LASER_SCAN, ODOMETRY, *TF):
            try:
                self._note_content(message, message.decode())
            except LogError:
                return  # reading the records reports it

    def _note_content(self, message: Message, decoded: Any) -> None:
        if message.type in TF:
            for stamped in decoded.transforms:
                self.tree.update(stamped)
            return
        clock = self._clocks.setdefault(message.topic, _Clock())
        clock.note(header_ns(decoded), message.recorded_ns)
        if message.type == ODOMETRY:
            self._children[message.topic] = frame_name(decoded.child_frame_id) or BASE
        else:
            frame = laser_name(message.topic, decoded)
            self.lasers.setdefault(frame, _Laser(decoded)).note(message.topic, decoded)

    def topics(self) -> tuple[TopicSummary, ...]:
        return tuple(
            TopicSummary(topic, self._types[topic], count, _rate(count, last - first))
            for topic, (count, first, last) in sorted(self._spans.items())
        )

    def odometry(self) -> str | None:
        topics = [topic for topic, name in self._types.items() if name == ODOMETRY]
        if topics:
            return odometry_topic(topics, Notices())
        edge = odometry_root(self.tree, self.lasers)
        return f"tf from {edge[0]} to {edge[1]}" if edge else None

    def laser_summaries(self, mounts: Mapping[str, FloatArray]) -> tuple[LaserSummary, ...]:
        mountings = Mountings(self.tree, mounts, Notices())
        return tuple(
            laser.summary(frame, self._mounting(mountings, frame))
            for frame, laser in sorted(self.lasers.items())
        )

    def _mounting(self, mountings: Mountings, frame: str) -> FloatArray | None:
        edge = odometry_root(self.tree, self.lasers)
        child = self._children.get(self.odometry() or "", edge[1] if edge else BASE)
        try:
            return mountings.mounting(frame, mountings.base(child))
        except LogError:
            return None  # reading the records reports it

    def problems(self) -> list[str]:
        of_clocks = (clock.problems(topic) for topic, clock in sorted(self._clocks.items()))
        return [*chain.from_iterable(of_clocks)] + [
            without_return(frame, laser.first.range_min, laser.first.range_max)
            for frame, laser in sorted(self.lasers.items())
            if not laser.returns
        ]


def _rate(count: int, span_ns: int) -> float | None:
    """Messages a second over a span; None where the recorder gave all of them one time."""
    return (count - 1) * 1e9 / span_ns if span_ns >= LEAST_SPAN_NS else None


def _triple(numbers: FloatArray) -> tuple[float, float, float]:
    x, y, z = (float(number) + 0.0 for number in numbers)  # no minus zero
    return x, y, z
