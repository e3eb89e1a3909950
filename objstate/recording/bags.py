"""Logs as MCAP files, ROS 1 bags and ROS 2 bags."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from objstate.errors import LogError
from objstate.recording.ros import is_defined, ros1_bytes, ros1_types, ros2_types

if TYPE_CHECKING:
    from mcap.writer import Writer as McapWriter
    from rosbags.interfaces import Connection, Qos
    from rosbags.rosbag1 import Writer as Bag1Writer
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Bag2Writer

LIBRARY = "objstate"
LATCHED = frozenset({"/tf_static", "/map", "/robot_description"})  # latched topics
FOREVER = (9223372036, 854775807)  # s and ns: how rmw writes "no limit"
LATCHED_QOS = """\
- history: 1
  depth: 1
  reliability: 1
  durability: 1
  deadline: {sec: 9223372036, nsec: 854775807}
  lifespan: {sec: 9223372036, nsec: 854775807}
  liveliness: 1
  liveliness_lease_duration: {sec: 9223372036, nsec: 854775807}
  avoid_ros_namespace_conventions: false
"""  # what _latched_quality says, as MCAP channels carry it
LAST_NS = 2**32 * 10**9 - 1  # what a ROS 1 time holds: 32 bits of seconds
LAST_MCAP_NS, LAST_ROS2_NS = 2**64 - 1, 2**63 - 1


def undefined(type_name: str, definition: str | None) -> str | None:
    """Why a bag can't hold messages of a type, or None if it can."""
    if is_defined(type_name, definition):
        return None
    return "its definition is neither in the log nor a standard one"


def _check_time(recorded_ns: int, last_ns: int) -> None:
    """Raises LogError for a recording time that the format can't hold."""
    if not 0 <= recorded_ns <= last_ns:
        raise LogError(f"its time, {recorded_ns} ns, is none that the format can hold")


class McapLog:
    """Writes CDR messages with ros2msg schemas into one MCAP file."""

    def __init__(self, writer: McapWriter) -> None:
        self._writer = writer
        self._schemas: dict[str, int] = {}
        self._channels: dict[tuple[str, str], int] = {}
        self.counts: Counter[str] = Counter()
        self.warnings: list[str] = []

    refusal = staticmethod(undefined)

    def write(
        self, topic: str, type_name: str, recorded_ns: int, cdr: bytes, definition: str | None
    ) -> None:
        _check_time(recorded_ns, LAST_MCAP_NS)
        channel = self._channels.get((topic, type_name))
        if channel is None:
            channel = self._add_channel(topic, type_name, definition)
        self._writer.add_message(channel, recorded_ns, cdr, publish_time=recorded_ns)
        self.counts[topic] += 1

    def _add_channel(self, topic: str, type_name: str, definition: str | None) -> int:
        if type_name not in self._schemas:
            text, _ = ros2_types(type_name, definition).generate_msgdef(type_name, ros_version=2)
            self._schemas[type_name] = self._writer.register_schema(
                type_name, "ros2msg", text.encode()
            )
        quality = {"offered_qos_profiles": LATCHED_QOS} if topic in LATCHED else {}
        channel = self._writer.register_channel(topic, "cdr", self._schemas[type_name], quality)
        self._channels[topic, type_name] = channel
        return channel


class Bag1Log:
    """Writes messages in the encoding of ROS 1 into one bag file."""

    def __init__(self, bag: Bag1Writer) -> None:
        self._bag = bag
        self._connections: dict[tuple[str, str], Connection] = {}
        self.counts: Counter[str] = Counter()
        self.warnings: list[str] = []

    refusal = staticmethod(undefined)

    def write(
        self, topic: str, type_name: str, recorded_ns: int, cdr: bytes, definition: str | None
    ) -> None:
        _check_time(recorded_ns, LAST_NS)
        connection = self._connections.get((topic, type_name))
        if connection is None:
            connection = self._add_connection(topic, type_name, definition)
        self._bag.write(connection, recorded_ns, ros1_bytes(type_name, definition, cdr))
        self.counts[topic] += 1

    def _add_connection(self, topic: str, type_name: str, definition: str | None) -> Connection:
        connection = self._bag.add_connection(
            topic,
            type_name,
            typestore=ros1_types(type_name, definition),
            callerid=f"/{LIBRARY}",
            latching=int(topic in LATCHED),
        )
        self._connections[topic, type_name] = connection
        return connection


class Bag2Log:
    """Writes CDR messages into the folder of a ROS 2 bag."""

    def __init__(self, bag: Bag2Writer) -> None:
        self._bag = bag
        self._connections: dict[tuple[str, str], Connection] = {}
        self.counts: Counter[str] = Counter()
        self.warnings: list[str] = []

    refusal = staticmethod(undefined)

    def write(
        self, topic: str, type_name: str, recorded_ns: int, cdr: bytes, definition: str | None
    ) -> None:
        _check_time(recorded_ns, LAST_ROS2_NS)
        connection = self._connections.get((topic, type_name))
        if connection is None:
            connection = self._add_connection(topic, type_name, definition)
        self._bag.write(connection, recorded_ns, cdr)
        self.counts[topic] += 1

    def _add_connection(self, topic: str, type_name: str, definition: str | None) -> Connection:
        connection = self._bag.add_connection(
            topic,
            type_name,
            typestore=ros2_types(type_name, definition),
            offered_qos_profiles=[_latched_quality()] if topic in LATCHED else [],
        )
        self._connections[topic, type_name] = connection
        return connection


@contextmanager
def write_mcap(path: Path) -> Iterator[McapLog]:
    """One MCAP file in chunks compressed by zstd."""
    from mcap.writer import Writer

    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2", library=LIBRARY)
        yield McapLog(writer)
        writer.finish()  # type: ignore[no-untyped-call]


@contextmanager
def write_rosbag1(path: Path) -> Iterator[Bag1Log]:
    """One ROS 1 bag, compressed by lz4."""
    from rosbags.rosbag1 import Writer

    bag = Writer(path)
    bag.set_compression(Writer.CompressionFormat.LZ4)
    with bag:
        yield Bag1Log(bag)


@contextmanager
def write_rosbag2(path: Path) -> Iterator[Bag2Log]:
    """The folder of a ROS 2 bag, its messages in SQLite."""
    from rosbags.rosbag2 import StoragePlugin

    with _rosbag2(path, StoragePlugin.SQLITE3) as log:
        yield log


@contextmanager
def write_rosbag2_mcap(path: Path) -> Iterator[Bag2Log]:
    """The folder of a ROS 2 bag, its messages in MCAP."""
    from rosbags.rosbag2 import StoragePlugin

    with _rosbag2(path, StoragePlugin.MCAP) as log:
        yield log


@contextmanager
def _rosbag2(path: Path, storage: StoragePlugin) -> Iterator[Bag2Log]:
    from rosbags.rosbag2 import Writer

    with Writer(path, version=9, storage_plugin=storage) as bag:
        yield Bag2Log(bag)


def _latched_quality() -> Qos:
    """The quality of service under which a late subscriber still gets the last message."""
    from rosbags.interfaces import (
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    forever = QosTime(*FOREVER)
    return Qos(
        history=QosHistory.KEEP_LAST,
        depth=1,
        reliability=QosReliability.RELIABLE,
        durability=QosDurability.TRANSIENT_LOCAL,
        deadline=forever,
        lifespan=forever,
        liveliness=QosLiveliness.AUTOMATIC,
        liveliness_lease_duration=forever,
        avoid_ros_namespace_conventions=False,
    )
