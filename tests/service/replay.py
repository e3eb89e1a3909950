"""A robot: Foxglove's SDK serves the messages of a log, in real time or faster.

python -m tests.service.replay LOG PORT [SPEED]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import foxglove
from foxglove import Channel, Schema
from foxglove.websocket import ChannelView, Client, ServerListener

from objstate.logs import Message, open_messages

LATCHED = ("/tf_static", "/initialpose")


class _Listener(ServerListener):
    """Begins with the first subscription, and repeats what is latched, as ROS does."""

    def __init__(self) -> None:
        self.subscribed = 0
        self.latched: dict[str, tuple[Channel, Message]] = {}

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        self.subscribed += 1
        if channel.topic in self.latched:
            own, message = self.latched[channel.topic]
            own.log(message.data, log_time=message.recorded_ns, sink_id=client.id)


def replay(log: Path, port: int, speed: float, shift_ns: int = 0) -> None:
    """Serve a log once, to whoever subscribes."""
    listener = _Listener()
    server = foxglove.start_server(name="robot", port=port, server_listener=listener)
    sys.stdout.write(f"{server.port}\n")
    sys.stdout.flush()
    messages = list(open_messages(log))
    channels = {}
    for message in messages:
        if message.topic not in channels:
            kind = message.message_type
            schema = Schema(name=kind.name, encoding="ros2msg", data=message.definition.encode())
            channels[message.topic] = Channel(message.topic, schema=schema, message_encoding="cdr")
        if message.topic in LATCHED and message.topic not in listener.latched:
            listener.latched[message.topic] = channels[message.topic], message
    while not listener.subscribed:
        time.sleep(0.01)
    time.sleep(0.5)
    begun_s, first_ns = time.monotonic(), messages[0].recorded_ns
    seen = set()
    for message in messages:
        due_s = (message.recorded_ns - first_ns) / 1e9 / speed
        time.sleep(max(0.0, due_s - (time.monotonic() - begun_s)))
        if message.topic in listener.latched and message.topic not in seen:
            seen.add(message.topic)
            continue  # the listener has it
        channels[message.topic].log(message.data, log_time=message.recorded_ns)
    time.sleep(1.0)
    server.stop()


if __name__ == "__main__":
    replay(Path(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3]) if sys.argv[3:] else 1.0)
