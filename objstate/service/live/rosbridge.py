"""A robot that speaks rosbridge's protocol, of ROS 1 or 2, in JSON: we are its client.

https://github.com/RobotWebTools/rosbridge_suite/blob/ros2/ROSBRIDGE_PROTOCOL.md
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import AsyncIterator, Mapping
from typing import Any

import numpy as np

from objstate.logs import Message
from objstate.logs.definitions import USED_TYPES, MessageType
from objstate.recording.ros import standard_types

LARGEST_FRAME = 64 * 2**20  # bytes
ASKED_EVERY_S = 10.0  # whether there are new topics
TOPICS = json.dumps({"op": "call_service", "service": "/rosapi/topics", "id": "topics"})
ROS1_TIMES = {"sec": "secs", "nanosec": "nsecs"}


async def rosbridge_messages(address: str) -> AsyncIterator[list[Message]]:
    """Messages of the topics that records are made from, as they come.

    Raises OSError or websockets' errors where the connection breaks.
    """
    from websockets.asyncio.client import connect

    async with connect(address, max_size=LARGEST_FRAME) as connection:
        types: dict[str, str] = {}  # of the topics subscribed to, as rosbridge names them
        asked_s = -math.inf
        await connection.send(TOPICS)
        async for frame in connection:
            told = json.loads(frame)
            if told.get("op") == "service_response" and told.get("id") == "topics":
                asked_s = time.monotonic()
                for topic, kind in _useful(told.get("values") or {}).items():
                    if topic not in types:
                        types[topic] = kind
                        wanted = {"op": "subscribe", "topic": topic, "type": kind}
                        await connection.send(json.dumps(wanted))
            elif told.get("op") == "publish" and told.get("topic") in types:
                topic = told["topic"]
                name = ros2_name(types[topic])
                yield [Message(topic, MessageType(name), time.time_ns(), cdr_of(name, told["msg"]))]
            if time.monotonic() - asked_s > ASKED_EVERY_S:
                asked_s = time.monotonic()
                await connection.send(TOPICS)


def ros2_name(kind: str) -> str:
    """``sensor_msgs/LaserScan`` as ROS 2 names it."""
    package, _, short = kind.partition("/")
    name = kind if short.startswith("msg/") else f"{package}/msg/{short}"
    return "tf2_msgs/msg/TFMessage" if name == "tf/msg/tfMessage" else name


def cdr_of(name: str, content: Mapping[str, Any]) -> bytes:
    """A message of a standard type in JSON, as bytes. Raises ValueError where it is none."""
    store = standard_types()
    try:
        return bytes(store.serialize_cdr(_made(store, name, content), name, little_endian=True))
    except (KeyError, TypeError, AttributeError, OverflowError) as error:
        raise ValueError(f"a message of {name} doesn't have its fields ({error!r})") from error


def _useful(values: Mapping[str, Any]) -> dict[str, str]:
    pairs = zip(values.get("topics", ()), values.get("types", ()), strict=False)
    return {topic: kind for topic, kind in pairs if ros2_name(kind) in USED_TYPES}


def _made(store: Any, name: str, content: Mapping[str, Any]) -> Any:
    """A message object of JSON; null is a number that is none, as rosbridge writes inf and nan."""
    fields = {}
    for field, (node, what) in store.fielddefs[name][1]:
        value = content.get(field, content.get(ROS1_TIMES.get(field, field)))
        fields[field] = _value(store, int(node), what, value)
    return store.types[name](**fields)


BASE, NAME, ARRAY, SEQUENCE = 1, 2, 3, 4  # kinds of fields in rosbags' type stores


def _value(store: Any, node: int, what: Any, value: Any) -> Any:
    if node == NAME:
        return _made(store, what, value or {})
    if node == BASE:
        return _plain(what[0], value)
    (inner, told), _ = what
    if int(inner) == NAME:
        return [_made(store, told, each) for each in value or ()]
    if told[0] == "string":
        return [str(each) for each in value or ()]
    numbers = [math.nan if each is None else each for each in value or ()]
    return np.array(numbers, dtype=told[0])


def _plain(kind: str, value: Any) -> Any:
    if kind == "string":
        return str(value or "")
    if kind.startswith("float"):
        return math.nan if value is None else float(value)
    return value or 0
