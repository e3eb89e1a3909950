"""Putting what was recorded into the order in which it happened, over a small window."""

from __future__ import annotations

import heapq
from collections.abc import Collection, Iterable, Iterator, Mapping
from itertools import count
from operator import attrgetter
from typing import NamedTuple

from objstate.logs.definitions import MessageType
from objstate.logs.messages import Container, Message
from objstate.logs.notices import Notices
from objstate.logs.scans import Sweep
from objstate.records import GaussianRobotBelief, InitialPose, Odometry, RobotBelief

# ns; recorders and transports delay a message against others by less than this
WINDOW_NS = 1_000_000_000

SET_BACK_NS = 60 * 1_000_000_000  # ns; what is farther behind was stamped by another time
SET_BACK_ITEMS = 10  # so many in a row; fewer have stamps that are wrong by themselves

UNSORTED = "The log is not sorted by time: it is read topic by topic, and slower"

# items; what is held back where recording times don't advance
MOST_HELD = 10_000

Item = Odometry | Sweep | InitialPose | RobotBelief | GaussianRobotBelief

# At one stamp, what is believed comes before what moved, and that before what was seen.
RANKS: dict[type, int] = {
    InitialPose: 0,
    RobotBelief: 0,
    GaussianRobotBelief: 0,
    Odometry: 1,
    Sweep: 2,
}


class Beginnings:
    """How the topics of a log begin: by this it is seen whether the log is sorted by time."""

    def __init__(self, topics: Collection[str]) -> None:
        self.silent = set(topics)  # which haven't spoken yet
        self.is_sorted = True  # whether no topic began after later messages of others
        self._before_ns = 0  # when the message before was recorded

    def note(self, message: Message) -> bool:
        """Take the next message; whether it is the first of its topic."""
        is_first = message.topic in self.silent
        self.silent.discard(message.topic)
        self.is_sorted &= not is_first or message.recorded_ns >= self._before_ns - WINDOW_NS
        self._before_ns = message.recorded_ns
        return is_first


class TopicByTopic:
    """A log whose topics were written one after the other, in recorded order.

    It is read once for each topic at the same time, so that memory stays flat. What the first of
    these readings notes is noted.
    """

    def __init__(self, messages: Container, notices: Notices) -> None:
        self._messages, self._notices = messages, notices
        self._share = 0.0

    @property
    def share(self) -> float:
        """How much of it the latest iteration has read of the topic that is ahead, 0..1."""
        return self._share

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic."""
        return self._messages.topics()

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """Those of some topics to wait for when looking ahead."""
        return self._messages.awaited(topics)

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Its messages in recorded order, all or those of some topics."""
        self._share = 0.0
        wanted = self.topics() if topics is None else topics
        first, *others = [self._messages.messages([topic]) for topic in wanted] or [iter(())]
        each = [first, *(self._notices.muting(other) for other in others)]
        for message in heapq.merge(*each, key=attrgetter("recorded_ns")):
            self._share = max(self._share, self._messages.share)
            yield message


def in_recorded_order(messages: Container, notices: Notices) -> Container:
    """A log in recorded order: with a notice, where its topics were written one after the other."""
    with notices.muted():
        beginnings = Beginnings(messages.awaited(messages.topics()))
        for message in messages.messages():
            beginnings.note(message)
            if not (beginnings.is_sorted and beginnings.silent):
                break
    if beginnings.is_sorted:
        return messages
    notices.add(UNSORTED)
    return TopicByTopic(messages, notices)


class Arrival(NamedTuple):
    """Something that happened at ``item.stamp_ns``, with the time at which it was recorded."""

    item: Item
    recorded_ns: int


def in_time_order(
    arrivals: Iterable[Arrival], notices: Notices, window_ns: int = WINDOW_NS
) -> Iterator[Item]:
    """The items by stamp. Each waits for ``window_ns`` of recording time before it leaves.

    A stamp far in the future does not hold others up; what arrives after later items
    have left is dropped with a notice.
    """
    held: list[tuple[int, int, int, Arrival]] = []
    number = count()
    now_ns = left_ns = -(2**63)
    first_ns: int | None = None
    late, back_ns = 0, 0  # number of late ones in a row, and by how much the first is behind
    for arrival in arrivals:
        item = arrival.item
        first_ns = item.stamp_ns if first_ns is None else first_ns
        if item.stamp_ns < left_ns:
            late += 1
            if late == 1:
                back_ns = left_ns - item.stamp_ns
            if late == SET_BACK_ITEMS and back_ns > SET_BACK_NS:
                notices.add(
                    f"Stamps jump back by {back_ns / 1e9:.0f} s when {(left_ns - first_ns) / 1e9:.0f}"
                    " s of the log have passed, as where a clock was set; the rest is dropped. Record"
                    " the two parts as logs of their own"
                )
            notices.drop(
                type(item).__name__.replace("Sweep", "Scan"),
                f"more than {window_ns / 1e9:g} s behind others in the log; do all clocks agree, and "
                "are its messages sorted by time?",
            )
            continue
        late = 0
        now_ns = max(now_ns, arrival.recorded_ns)
        heapq.heappush(held, (item.stamp_ns, RANKS[type(item)], next(number), arrival))
        while now_ns - held[0][3].recorded_ns >= window_ns or len(held) > MOST_HELD:
            left_ns, _, _, first = heapq.heappop(held)
            yield first.item
            if not held:
                break
    while held:
        yield heapq.heappop(held)[3].item
