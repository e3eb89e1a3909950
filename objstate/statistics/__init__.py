"""Statistics of doors over many logs: how often open, for how long, how often moved."""

from objstate.statistics.doors import DoorStatistics, door_statistics
from objstate.statistics.looks import OpenAbove
from objstate.statistics.shares import Share
from objstate.statistics.two_state import Interval

__all__ = ["DoorStatistics", "Interval", "OpenAbove", "Share", "door_statistics"]
