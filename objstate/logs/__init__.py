"""Recorded logs in, records out: MCAP, rosbag1, rosbag2, CARMEN."""

from objstate.logs.containers import Messages, is_log, open_messages
from objstate.logs.inspection import LaserSummary, LogSummary, TopicSummary, inspect_log
from objstate.logs.log import Log, open_log
from objstate.logs.messages import Message

__all__ = [
    "LaserSummary",
    "Log",
    "LogSummary",
    "Message",
    "Messages",
    "TopicSummary",
    "inspect_log",
    "is_log",
    "open_log",
    "open_messages",
]
