"""What a service answers, as typed values: SI units, radians, nanoseconds since 1970.

Keys that a newer service adds are kept as attributes, so that an older client goes on working.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import BaseModel, ConfigDict

ENDED = frozenset({"done", "failed", "deleted"})  # states in which a drive stays


class Answer(BaseModel):
    """What all answers share."""

    model_config = ConfigDict(extra="allow", frozen=True)


class Interval(Answer):
    """A mean with its central 90 % interval."""

    mean: float
    lower: float
    upper: float
    std: float | None = None
    median: float | None = None  # of states; None from a service of an earlier version


class Believed(Answer):
    """What is believed of one object at a moment."""

    object: str
    kind: str  # hinged, sliding or planar
    stamp_ns: int | None
    last_observed_ns: int | None  # None: never observed
    state: Mapping[str, Interval]  # by coordinate: angle, offset, or x, y, yaw
    attributes: Mapping[str, Mapping[str, float]] = {}
    clear_width: Interval | None = None  # m, of doors
    presence: float | None = None  # that it is there; of a door, that beams meet its leaf
    footprint: tuple[tuple[float, float], ...] | None = None  # m, of furniture
    states: tuple[tuple[float, ...], ...] | None = None  # of the whole posterior, if asked for
    weights: tuple[float, ...] | None = None
    predicted: bool | None = None  # not observed at that very moment
    revision: str | None = None
    at_ns: int | None = None


class Objects(Answer):
    """What is believed of all objects at a moment."""

    revision: str
    at_ns: int
    objects: tuple[Believed, ...]

    def __getitem__(self, name: str) -> Believed:
        """One of them. Raises KeyError."""
        for each in self.objects:
            if each.object == name:
                return each
        raise KeyError(name)


class History(Answer):
    """What was learnt of an object, in time order."""

    object: str
    history: tuple[Believed, ...]


class Passage(Answer):
    """How probably a robot passes a door."""

    object: str
    width: float  # m
    length: float  # m
    probability: float
    clear_width: Interval  # m
    last_observed_ns: int | None
    revision: str
    at_ns: int


class Blocker(Answer):
    """An object that may be in the way."""

    object: str
    probability: float


class Blockage(Answer):
    """How probably something movable is in the way, the most probable first."""

    probability: float
    blockers: tuple[Blocker, ...]


class EdgeCost(Answer):
    """What an edge costs, as ``nav2_msgs/msg/EdgeCost``."""

    edgeid: int
    cost: float


class Edges(Answer):
    """The request of Nav2's ``nav2_msgs/srv/DynamicEdges``."""

    closed_edges: tuple[int, ...]
    opened_edges: tuple[int, ...]
    adjust_edges: tuple[EdgeCost, ...]


class DoorMode(Answer):
    """A value of ``rmf_door_msgs/msg/DoorMode``, and what it is called."""

    value: int
    name: str


class DoorModes(Answer):
    """The modes of all doors by name."""

    doors: Mapping[str, DoorMode]


class Drive(Answer):
    """A drive that was sent, and what became of it."""

    id: str
    state: str  # waiting, running, done, failed
    progress: float = 0.0  # 0..1
    reason: str | None = None  # why it failed
    summary: Mapping[str, Any] | None = None  # of one that has a result

    @property
    def has_ended(self) -> bool:
        """Whether nothing more comes of it."""
        return self.state in ENDED


class Robot(Answer):
    """A robot that drives, or that the service connects to."""

    robot: str
    state: str | None = None  # of the estimation of its drive
    drive: str | None = None  # that goes on
    pose: tuple[float, float, float] | None = None  # x m, y m, yaw rad
    lost: bool = False
    warnings: tuple[str, ...] = ()  # of its drive so far
    connection: str | None = None  # of a robot that the service connects to


class Event(Answer):
    """Something that happened, from the stream."""

    id: str  # to resume after; of what isn't kept, as robots' poses, that of the last before it
    kind: str  # drive, belief, deleted, lost, found, robot, state
    data: Any
