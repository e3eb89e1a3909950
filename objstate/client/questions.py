"""What can be asked of a service: one function an endpoint, shared by both clients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any, Generic, TypeVar
from urllib.parse import quote

from pydantic import BaseModel

from objstate.client.answers import (
    Believed,
    Blockage,
    DoorModes,
    Drive,
    Edges,
    History,
    Objects,
    Passage,
    Robot,
)
from objstate.errors import SettingsError

Answered = TypeVar("Answered")
Model = TypeVar("Model", bound=BaseModel)
Moment = int | datetime | None  # ns since 1970, or a time with its zone; None: now
Path = Sequence[tuple[float, float]]  # m

EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


@dataclass(frozen=True)
class Question(Generic[Answered]):
    """A request, and how its answer is read."""

    method: str
    path: str
    read: Callable[[Any], Answered]
    params: Mapping[str, Any] = field(default_factory=dict)
    body: Any = None


def objects(at: Moment) -> Question[Objects]:
    return _get("/v1/objects", Objects, at=moment_ns(at))


def object_(name: str, at: Moment, samples: bool) -> Question[Believed]:
    asked = {"at": moment_ns(at), "samples": "true" if samples else None}
    return _get(f"/v1/objects/{_part(name)}", Believed, **asked)


def history(name: str, most: int | None) -> Question[History]:
    return _get(f"/v1/objects/{_part(name)}/history", History, most=most)


def passage(name: str, width: float, length: float, at: Moment) -> Question[Passage]:
    asked = {"width": width, "length": length, "at": moment_ns(at)}
    return _get(f"/v1/objects/{_part(name)}/passage", Passage, **asked)


def blocked(
    path: Path, radius: float, at: Moment, arrivals: Sequence[Moment] | None
) -> Question[Blockage]:
    when = None if arrivals is None else [moment_ns(each) for each in arrivals]
    body = {"path": path, "radius": radius, "at": moment_ns(at), "arrivals": when}
    return _post("/v1/blocked", Blockage, body)


def edges(
    paths: Mapping[int, Path], radius: float, detour_cost: float, close_from: float, at: Moment
) -> Question[Edges]:
    body = {
        "edges": [{"edgeid": edge, "path": path} for edge, path in paths.items()],
        "radius": radius,
        "detour_cost": detour_cost,
        "close_from": close_from,
        "at": moment_ns(at),
    }
    return _post("/v1/edges", Edges, body)


def doors(width: float, length: float, at: Moment) -> Question[DoorModes]:
    return _get("/v1/doors", DoorModes, width=width, length=length, at=moment_ns(at))


def evidence(
    name: str,
    source: str,
    state: str | None,
    region: tuple[float, float] | None,
    reliability: float,
    at: Moment,
    identity: str | None,
) -> Question[Believed]:
    body = {
        "source": source,
        "state": state,
        "region": region,
        "reliability": reliability,
        "stamp_ns": moment_ns(at),
        "id": identity,
    }
    return _post(f"/v1/objects/{_part(name)}/evidence", Believed, body)


def drive(identity: str) -> Question[Drive]:
    return _get(f"/v1/drives/{_part(identity)}", Drive)


def drives() -> Question[tuple[Drive, ...]]:
    def read(words: Any) -> tuple[Drive, ...]:
        return tuple(Drive.model_validate(each) for each in words["drives"])

    return Question("GET", "/v1/drives", read)


def delete_drive(identity: str) -> Question[None]:
    return Question("DELETE", f"/v1/drives/{_part(identity)}", lambda _: None)


def robots() -> Question[tuple[Robot, ...]]:
    def read(words: Any) -> tuple[Robot, ...]:
        return tuple(Robot.model_validate(each) for each in words["robots"])

    return Question("GET", "/v1/robots", read)


def records(robot: str, sensed: Sequence[Mapping[str, Any]]) -> Question[str]:
    path, body = f"/v1/robots/{_part(robot)}/records", {"records": list(sensed)}
    return Question("POST", path, lambda words: str(words["drive"]), body=body)


def end_drive(robot: str) -> Question[Drive | None]:
    def read(words: Any) -> Drive | None:
        return None if words["drive"] is None else Drive.model_validate(words["drive"])

    return Question("POST", f"/v1/robots/{_part(robot)}/end", read)


def moment_ns(at: Moment) -> int | None:
    """Nanoseconds since 1970. Raises SettingsError for a time without a zone."""
    if not isinstance(at, datetime):
        return at
    if at.tzinfo is None:
        raise SettingsError(f"The time {at} has no zone; give it one, as in tzinfo=timezone.utc.")
    return (at - EPOCH) // timedelta(microseconds=1) * 1000


def _get(path: str, model: type[Model], **params: Any) -> Question[Model]:
    given = {name: value for name, value in params.items() if value is not None}
    return Question("GET", path, model.model_validate, given)


def _post(path: str, model: type[Model], body: Mapping[str, Any]) -> Question[Model]:
    given = {name: value for name, value in body.items() if value is not None}
    return Question("POST", path, model.model_validate, body=given)


def _part(name: str) -> str:
    """A name as one part of a path."""
    return quote(name, safe="")
