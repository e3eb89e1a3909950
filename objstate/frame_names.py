"""Names of the frames in logs, for reading and for writing them."""

from __future__ import annotations

from typing import Any


def frame_name(frame: str) -> str:
    """A frame's name without the slash that ROS 1 allowed in front."""
    return frame.lstrip("/")


def laser_name(topic: str, scan: Any) -> str:
    """The frame of a ``LaserScan``; its topic's name where it has none."""
    return frame_name(scan.header.frame_id) or frame_name(topic)
