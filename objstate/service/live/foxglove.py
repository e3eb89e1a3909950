"""A robot that speaks Foxglove's WebSocket protocol, as foxglove_bridge does: we are its client.

https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md
"""

from __future__ import annotations

import json
import struct
from collections.abc import AsyncIterator, Mapping
from typing import Any

from objstate.logs import Message
from objstate.logs.definitions import CDR, IDL, MSG, ROS1, USED_TYPES, MessageType

PROTOCOLS = ("foxglove.sdk.v1", "foxglove.websocket.v1")
MESSAGE_DATA = 0x01  # opcode of a binary frame
HEAD = struct.Struct("<BIQ")  # opcode, subscription, time in ns
LARGEST_FRAME = 64 * 2**20  # bytes
LANGUAGES = {"ros2msg": MSG, "ros1msg": MSG, "ros2idl": IDL, "": MSG}


async def foxglove_messages(address: str) -> AsyncIterator[list[Message]]:
    """Messages of the topics that records are made from, as they come.

    Raises OSError or websockets' errors where the connection breaks.
    """
    from websockets.asyncio.client import connect
    from websockets.typing import Subprotocol

    protocols = [Subprotocol(each) for each in PROTOCOLS]
    async with connect(address, subprotocols=protocols, max_size=LARGEST_FRAME) as connection:
        known: dict[int, tuple[str, MessageType]] = {}  # by subscription
        async for frame in connection:
            if isinstance(frame, bytes):
                message = _message(frame, known)
                if message is not None:
                    yield [message]
            elif (asked := _wanted(json.loads(frame), known)) is not None:
                await connection.send(json.dumps(asked))


def _wanted(told: Mapping[str, Any], known: dict[int, tuple[str, MessageType]]) -> Any:
    """What to answer to a server's words: subscriptions to the channels of use."""
    if told.get("op") != "advertise":
        return None
    subscriptions = []
    for channel in told.get("channels", ()):
        kind = _type_of(channel)
        if kind is not None:
            known[channel["id"]] = channel["topic"], kind
            subscriptions.append({"id": channel["id"], "channelId": channel["id"]})
    return {"op": "subscribe", "subscriptions": subscriptions} if subscriptions else None


def _type_of(channel: Mapping[str, Any]) -> MessageType | None:
    """The type of a channel's messages, if records are made from them."""
    package, _, short = str(channel.get("schemaName", "")).partition("/")
    name = f"{package}/{short}" if short.startswith("msg/") else f"{package}/msg/{short}"
    wire = channel.get("encoding")
    language = LANGUAGES.get(channel.get("schemaEncoding") or "")
    if name not in USED_TYPES or wire not in (CDR, ROS1) or language is None:
        return None
    return MessageType(name, wire, channel.get("schema") or "", language)


def _message(frame: bytes, known: Mapping[int, tuple[str, MessageType]]) -> Message | None:
    if len(frame) < HEAD.size:
        return None
    opcode, subscription, stamp_ns = HEAD.unpack_from(frame)
    if opcode != MESSAGE_DATA or subscription not in known:
        return None
    topic, kind = known[subscription]
    return Message(topic, kind, stamp_ns, frame[HEAD.size :])
