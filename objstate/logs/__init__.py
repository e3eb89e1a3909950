"""Recorded logs in, records out: MCAP, rosbag1, rosbag2, CARMEN."""

from objstate.logs.containers import Messages, open_messages
from objstate.logs.messages import Message

__all__ = ["Message", "Messages", "open_messages"]
