"""The records of a drive that goes on, from messages as they arrive."""

from __future__ import annotations

import threading
from bisect import insort
from collections import deque
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import count
from operator import itemgetter

from objstate.errors import LogError
from objstate.geometry import FloatArray
from objstate.logs.definitions import MessageType
from objstate.logs.log import Log
from objstate.logs.messages import Message
from objstate.logs.notices import Notices
from objstate.logs.odometry import WAIT_NS, Track, extends, placed
from objstate.logs.ordering import RANKS, Arrival
from objstate.logs.scans import Sweep
from objstate.records import Odometry, Record

OTHERS_NS = 30_000_000  # ns for which a scan waits for earlier ones of other lasers
# ns for which odometry waits for earlier scans: a turn of a lidar takes up to 200 ms
HELD_NS = 300_000_000
BACKWARDS_NS = 2_000_000_000  # ns for which all stamps are old before the clock counts as set back

Entry = tuple[int, int, int, Arrival]  # stamp, rank, number


class LiveMessages:
    """Messages of one drive, put in by one thread and read by another; reading waits for more.

    Until ``release`` is called, all are kept, so that they can be read several times.
    """

    def __init__(self, types: Mapping[str, MessageType]) -> None:
        self._types = dict(types)
        self._kept: deque[Message] = deque()
        self._first = 0  # number of the first message that is kept
        self._places: dict[int, int] = {}  # by reader: number of its next message
        self._readers = count()
        self._is_released = self._is_closed = False
        self._changed = threading.Condition()

    @property
    def share(self) -> float:
        """Nobody knows how long the drive will be."""
        return 0.0

    def topics(self) -> Mapping[str, MessageType]:
        return self._types

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """All of some topics."""
        return topics

    def put(self, message: Message) -> None:
        """Add a message."""
        with self._changed:
            self._kept.append(message)
            self._changed.notify_all()

    def close(self) -> None:
        """No more will come."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()

    def release(self) -> None:
        """Keep only what isn't read yet, from now on."""
        self._is_released = True

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """The messages that are kept, and all that come until ``close``."""
        reader = next(self._readers)
        self._places[reader] = self._first
        try:
            while (message := self._next(reader)) is not None:
                if topics is None or message.topic in topics:
                    yield message
        finally:
            del self._places[reader]

    def _next(self, reader: int) -> Message | None:
        with self._changed:
            while (at := self._places[reader] - self._first) >= len(self._kept):
                if self._is_closed:
                    return None
                self._changed.wait()
            message = self._kept[at]
            self._places[reader] += 1
            while self._is_released and self._first < min(self._places.values()):
                self._kept.popleft()
                self._first += 1
            return message


class ClockSetBackError(LogError):
    """All stamps are old: a drive can't go on, and another may begin."""


def open_live(
    messages: LiveMessages,
    topics: Collection[str] | None = None,
    mounts: Mapping[str, FloatArray] | None = None,
    clock_offsets: Mapping[str, float] | None = None,
) -> Log:
    """The records of a drive that goes on, each as early as the order allows.

    A scan is returned as soon as odometry at or after its last beam is there. Raises LogError as
    ``open_log`` does; its records raise it where a clock was set back.
    """

    def ordered(arrivals: Iterable[Arrival], notices: Notices) -> Iterator[Record]:
        messages.release()
        return in_live_order(arrivals, notices)

    offsets = clock_offsets or {}
    span, notices = (None, None), Notices()
    return Log(messages, topics, mounts or {}, offsets, span, notices, ordered, goes_on=True)


def in_live_order(arrivals: Iterable[Arrival], notices: Notices) -> Iterator[Record]:
    """Records by stamp, without waiting longer than needed.

    A scan, stamped at its first beam, arrives after odometry that is stamped later. So odometry is
    known at once for the scans' sake, but is returned only after the scans that precede it.
    """
    track, held, number = Track(), list[Entry](), count()
    latest: dict[str, int] = {}  # stamp of each laser's last scan
    left_ns = now_ns = in_order_ns = -(2**63)
    for arrival in arrivals:
        item = arrival.item
        is_back = now_ns - arrival.recorded_ns > BACKWARDS_NS  # the recorder has the robot's clock
        now_ns = max(now_ns, arrival.recorded_ns)
        if item.stamp_ns < left_ns:
            if is_back or now_ns - in_order_ns > BACKWARDS_NS:
                back_s = (left_ns - item.stamp_ns) / 1e9
                raise ClockSetBackError(f"The robot's clock was set back by {back_s:.1f} s.")
            notices.drop(type(item).__name__.replace("Sweep", "Scan"), "later than others")
            continue
        in_order_ns = now_ns
        if isinstance(item, Odometry) and not extends(track, item, notices):
            continue
        if isinstance(item, Sweep):
            latest[item.laser] = item.stamp_ns
        insort(
            held, (item.stamp_ns, RANKS[type(item)], next(number), arrival), key=itemgetter(0, 1, 2)
        )
        while released := _released(held, track, latest, now_ns):
            left_ns = held[released - 1][0]
            for entry in held[:released]:
                yield from placed(entry[3].item, track, notices)
            del held[:released]
    for _, _, _, last in held:
        yield from placed(last.item, track, notices)


def _released(held: list[Entry], track: Track, latest: Mapping[str, int], now_ns: int) -> int:
    """How many of what is held, in time order, may leave."""
    for index, (stamp_ns, _, _, arrival) in enumerate(held):
        if isinstance(arrival.item, Sweep):
            waited_ns = now_ns - arrival.recorded_ns
            is_placed = track.last_ns is not None and track.last_ns >= arrival.item.end_ns
            others = min(latest.values()) >= stamp_ns or waited_ns >= OTHERS_NS
            return index + 1 if (is_placed and others) or waited_ns > WAIT_NS else 0
    waiting = (i for i, each in enumerate(held) if now_ns - each[3].recorded_ns < HELD_NS)
    return next(waiting, len(held))
