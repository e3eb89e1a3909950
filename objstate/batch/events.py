"""What is told of a batch while it runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from objstate.recording.batches import Outcome


@dataclass(frozen=True)
class Began:
    """A worker took up a log."""

    name: str


@dataclass(frozen=True)
class Progressed:
    """A log got further."""

    name: str
    share: float  # of the log, 0..1
    log_seconds: float


@dataclass(frozen=True)
class Ended:
    """A log's run ended, one way or the other."""

    outcome: Outcome


@dataclass(frozen=True)
class Waiting:
    """No log can be run for the time being."""

    reason: str


@dataclass(frozen=True)
class Connected:
    """A cluster takes the batch."""

    dashboard: str  # the URL of its page


Event = Began | Progressed | Ended | Waiting | Connected
OnEvent = Callable[[Event], None]
