"""What is the same for all live drives, and when a drive ends."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from objstate.run.options import RunOptions

Protocol = Literal["foxglove", "rosbridge"]


@dataclass(frozen=True)
class RobotAddress:
    """Where a robot can be reached."""

    robot: str
    protocol: Protocol
    address: str  # ws:// or wss://


@dataclass(frozen=True)
class LiveContext:
    """What the process of a live drive needs."""

    building: Path
    world: str
    options: RunOptions
    memory_limit: int  # bytes
    scenes: bool  # whether it sends a scene for Foxglove


@dataclass(frozen=True)
class LiveLimits:
    """When a drive is safe on disk, and when it ends."""

    checkpoint_s: float = 5.0  # between two times at which all is brought to disk
    silent_s: float = 60.0  # without a message, after which a drive has ended
    longest_s: float = 3600.0  # of a drive, after which a new one begins
