"""One message of a log, whatever the container it came from."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any, NamedTuple, Protocol

from objstate.errors import LogError
from objstate.logs.definitions import MessageType


class OtherEncodingsError(LogError):
    """A file holds channels, and none of them ROS messages."""


class Message(NamedTuple):
    """A recorded message, still in bytes."""

    topic: str
    message_type: MessageType
    recorded_ns: int  # when the recorder got it
    data: bytes  # as message_type.wire serializes it

    @property
    def type(self) -> str:
        """ROS 2 style name, e.g. ``sensor_msgs/msg/LaserScan``."""
        return self.message_type.name

    @property
    def definition(self) -> str:
        """ROS 2 ``.msg`` text with dependencies, as MCAP's ``ros2msg`` schema has it."""
        return self.message_type.definition

    def cdr(self) -> bytes:
        """The message as ROS 2 CDR bytes. Raises LogError where they are damaged."""
        return self.message_type.cdr(self.data)

    def decode(self) -> Any:
        """The message as an object with its fields. Raises LogError where it is damaged."""
        return self.message_type.decode(self.data)


def header_ns(message: Any) -> int:
    """The stamp in a decoded message's header; 0 where there is none."""
    stamp = message.header.stamp
    return int(stamp.sec * 10**9 + stamp.nanosec)


class Container(Protocol):
    """One recorded file, or folder, of some format."""

    @property
    def share(self) -> float:
        """How much of it the latest iteration has read, 0..1."""
        ...

    def topics(self) -> Mapping[str, MessageType]:
        """Message types by topic."""
        ...

    def awaited(self, topics: Collection[str]) -> Collection[str]:
        """Those of some topics to wait for when looking ahead, as all that may hold messages."""
        ...

    def messages(self, topics: Collection[str] | None = None) -> Iterator[Message]:
        """Its messages in recorded order, all or those of some topics; memory stays flat."""
        ...
