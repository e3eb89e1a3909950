"""A first pass over a log: its lasers, and what tf has about them.

Recorders deliver ``/tf_static`` some time after the first scans, and mountings on ``/tf`` come at
any time. So the first seconds are read before any record is returned. Where a laser has not spoken
by then, the log is read on until it does, unless its index says that it never will, and where a
mounting is still missing, tf is read on until it is found. So what a user has to supply is known
before the log is worked on.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from objstate.errors import LogError
from objstate.frame_names import frame_name
from objstate.logs.frames import BASE, FrameTree, Mountings
from objstate.logs.messages import Container, Message, header_ns
from objstate.logs.ordering import Beginnings
from objstate.logs.roles import Roles, preferred
from objstate.logs.span import stamp_at

# ns of recording; by then every sensor has spoken
SURVEY_NS = 5_000_000_000
# the same of a drive that goes on, whose records wait for it
LIVE_SURVEY_NS = 1_000_000_000


@dataclass
class Survey:
    """The content of a log's beginning."""

    laser_frames: dict[str, str] = field(default_factory=dict)  # by topic
    later_frames: dict[str, str] = field(default_factory=dict)  # of lasers that speak later
    is_sorted: bool = True  # whether no topic begins after later messages of others
    first_ns: int = 0  # when the first message was recorded
    odometry_child: str | None = None  # the robot's frame in the odometry
    delay_ns: int | None = None  # by which recording times are ahead of header times

    def is_after(self, recorded_ns: int, end: float | None) -> bool:
        """Whether a message was recorded after ``end``, as users give it."""
        delay_ns = self.delay_ns or 0
        return end is not None and (
            recorded_ns > stamp_at(end, self.first_ns - delay_ns) + delay_ns
        )

    def duplicates(self) -> dict[str, str]:
        """Topics with the same scans as another, by the one to use: processed copies."""
        same: dict[str, list[str]] = {}
        for topic, frame in self.laser_frames.items():
            same.setdefault(frame, []).append(topic)
        return {
            topic: preferred(topics)
            for topics in same.values()
            for topic in topics
            if topic != preferred(topics)
        }


def survey(
    messages: Container,
    roles: Roles,
    mountings: Mountings,
    end: float | None,
    *,
    goes_on: bool,
) -> Survey:
    """Read the log's beginning, and on until each awaited topic has spoken.

    A drive that ``goes_on`` isn't read on. Transforms of the beginning go into the tree of
    ``mountings``. Lasers that first speak after ``end``, as users give it, are left out.
    """
    found, beginnings, in_beginning = Survey(), Beginnings(messages.awaited(roles.telling)), True
    for message in messages.messages(roles.telling):
        now_ns, is_first = message.recorded_ns, beginnings.note(message)
        found.first_ns = found.first_ns or now_ns
        found.is_sorted = goes_on or beginnings.is_sorted  # a drive that goes on is as it comes
        span_ns = LIVE_SURVEY_NS if goes_on else SURVEY_NS
        in_beginning = in_beginning and now_ns - found.first_ns <= span_ns
        if in_beginning:
            _note(found, message, roles, mountings)
        elif goes_on:
            break
        elif (
            is_first
            and message.topic in roles.lasers
            and not found.is_after(now_ns, end)
            and (scan := _decoded(message, roles)) is not None
        ):
            found.later_frames[message.topic] = mountings.laser(message.topic, scan)
        if not found.is_sorted or not (in_beginning or beginnings.silent):
            break
    return found


def _note(found: Survey, message: Message, roles: Roles, mountings: Mountings) -> None:
    if message.topic in roles.tf:
        _grow(mountings.tree, message, roles)
        return
    if (decoded := _decoded(message, roles)) is None:
        return
    if found.delay_ns is None and (stamp_ns := header_ns(decoded)):
        found.delay_ns = message.recorded_ns - stamp_ns
    if message.topic in roles.lasers:
        found.laser_frames.setdefault(message.topic, mountings.laser(message.topic, decoded))
    elif message.topic == roles.odometry and found.odometry_child is None:
        found.odometry_child = frame_name(decoded.child_frame_id) or BASE


def read_tf_until(
    is_enough: Callable[[], bool], messages: Container, roles: Roles, tree: FrameTree
) -> None:
    """Read tf, from the log's beginning to its end, until there is enough."""
    if is_enough():
        return
    for message in messages.messages(roles.tf):
        _grow(tree, message, roles)
        if is_enough():
            return


def _grow(tree: FrameTree, message: Message, roles: Roles) -> None:
    decoded = _decoded(message, roles)
    for stamped in decoded.transforms if decoded is not None else ():
        tree.update(stamped)


def _decoded(message: Message, roles: Roles) -> Any | None:
    """None where the message is damaged, which is reported when it is read in its turn."""
    try:
        return roles.decoded(message)
    except LogError:
        return None
