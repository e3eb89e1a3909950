"""Occupancy maps that a log holds, as SLAM and map servers publish them."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from objstate.errors import LogError
from objstate.geometry import FloatArray, pose_from_transform, rotation_from_quaternion, transform
from objstate.logs.containers import Paths, as_paths, open_messages

OCCUPANCY_GRID = "nav_msgs/msg/OccupancyGrid"
USUAL_TOPIC = "/map"


@dataclass(frozen=True, eq=False)
class RecordedMap:
    """A map as a message has it."""

    topic: str
    percent: np.ndarray[Any, np.dtype[np.int8]] = field(
        repr=False
    )  # (rows, columns) from the lower left; -1: unknown
    resolution: float  # m
    origin: FloatArray  # (3,) pose of the lower left corner


def read_recorded_map(paths: Paths, topic: str | None = None) -> RecordedMap:
    """The last map of a log, which of a map that grows is the most complete.

    ``topic`` is ``/map``, or the only one with maps, where it isn't given. Raises LogError.
    """
    messages = open_messages(paths)
    named = ", ".join(map(str, as_paths(paths)))
    held = [name for name, kind in messages.topics().items() if kind.name == OCCUPANCY_GRID]
    chosen = _topic(held, topic, named)
    last = None
    for message in messages.messages([chosen]):
        last = message
    if last is None:
        raise LogError(f"{named} holds no message on '{chosen}'; take a map from map_saver.")
    return _read(last.decode(), chosen, named)


def _topic(held: Collection[str], asked: str | None, named: str) -> str:
    if asked is not None and asked not in held:
        raise LogError(f"{named} has no map on '{asked}'; it has {', '.join(held) or 'none'}.")
    if not held:
        raise LogError(
            f"{named} is a log without a map (nav_msgs/OccupancyGrid); give one that holds {USUAL_TOPIC}, or "
            "the .yaml file that map_saver writes."
        )
    if asked is None and len(held) > 1 and USUAL_TOPIC not in held:
        raise LogError(f"{named} has several maps, {', '.join(held)}; choose one with --topic.")
    return asked or (USUAL_TOPIC if USUAL_TOPIC in held else next(iter(held)))


def _read(message: Any, topic: str, named: str) -> RecordedMap:
    info, at = message.info, message.info.origin
    percent = np.asarray(message.data, dtype=np.int8)
    place = [at.position.x, at.position.y, at.position.z]
    turn = [at.orientation.x, at.orientation.y, at.orientation.z, at.orientation.w]
    try:
        rotation = rotation_from_quaternion(*turn) if any(turn) else np.eye(3)
        origin = pose_from_transform(transform(rotation, place))
        grid = percent.reshape(info.height, info.width)
    except ValueError as error:
        raise LogError(f"The map on '{topic}' in {named} is damaged ({error}).") from error
    if not (np.isfinite(origin).all() and np.isfinite(info.resolution) and info.resolution > 0):
        raise LogError(
            f"The map on '{topic}' in {named} has cells of {info.resolution:g} m at {origin}; take "
            "another map."
        )
    return RecordedMap(topic, grid, float(info.resolution), origin)
