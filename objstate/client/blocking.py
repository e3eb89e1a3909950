"""The client that waits for its answers."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any

import httpx

from objstate.client import questions, transport
from objstate.client.answers import (
    Believed,
    Blockage,
    DoorModes,
    Drive,
    Edges,
    Event,
    History,
    Objects,
    Passage,
    Robot,
)
from objstate.client.questions import Answered, Moment, Question
from objstate.client.streams import Assembly
from objstate.errors import OutageError, ServiceError

POLLED_EVERY_S = 0.5  # a drive that is waited for


class Client:
    """A service, seen from a program. Threads may share one; ``with`` closes its connections.

    Every method raises ServiceError where the service refuses, and OutageError where it doesn't
    answer. Moments are nanoseconds since 1970 or ``datetime`` with a zone; None is now.
    """

    def __init__(
        self, url: str, token: str | Path, *, timeout_s: float = transport.TIMEOUT_S
    ) -> None:
        """``token`` is the secret itself, or the path of the file that holds it. Raises SettingsError."""
        self._http = httpx.Client(**transport.options(url, token, timeout_s))

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close its connections."""
        self._http.close()

    def objects(self, at: Moment = None) -> Objects:
        """What is believed of all objects at a moment."""
        return self._ask(questions.objects(at))

    def object(self, name: str, at: Moment = None, *, samples: bool = False) -> Believed:
        """What is believed of one object; with ``samples`` the whole posterior."""
        return self._ask(questions.object_(name, at, samples))

    def history(self, name: str, most: int | None = None) -> History:
        """What was learnt of an object, in time order; the newest so many, by default 200."""
        return self._ask(questions.history(name, most))

    def passage(self, name: str, width: float, length: float = 0.0, at: Moment = None) -> Passage:
        """How probably a robot of a width and a length, m, passes a door."""
        return self._ask(questions.passage(name, width, length, at))

    def blocked(
        self,
        path: questions.Path,
        radius: float,
        at: Moment = None,
        *,
        arrivals: Sequence[Moment] | None = None,
    ) -> Blockage:
        """How probably a round robot meets something movable; ``arrivals`` one for each point."""
        return self._ask(questions.blocked(path, radius, at, arrivals))

    def edges(
        self,
        paths: Mapping[int, questions.Path],
        radius: float,
        detour_cost: float,
        *,
        close_from: float = 0.9,
        at: Moment = None,
    ) -> Edges:
        """What a route graph's edges cost, by their numbers, as Nav2's ``DynamicEdges`` takes it."""
        return self._ask(questions.edges(paths, radius, detour_cost, close_from, at))

    def doors(self, width: float, length: float = 0.0, at: Moment = None) -> DoorModes:
        """All doors by the numbers of Open-RMF's ``DoorMode``."""
        return self._ask(questions.doors(width, length, at))

    def report(
        self,
        name: str,
        source: str,
        state: str | None = None,
        *,
        region: tuple[float, float] | None = None,
        reliability: float = 0.99,
        at: Moment = None,
        identity: str | None = None,
    ) -> Believed:
        """Evidence of a door: ``open`` or ``closed``, or a region, rad or m; the belief with it.

        A report of the same ``identity`` again changes nothing.
        """
        return self._ask(questions.evidence(name, source, state, region, reliability, at, identity))

    def drives(self) -> tuple[Drive, ...]:
        """All drives, in the order in which they came."""
        return self._ask(questions.drives())

    def drive(self, identity: str) -> Drive:
        """What became of a drive."""
        return self._ask(questions.drive(identity))

    def delete_drive(self, identity: str) -> None:
        """Delete a drive's log; what it taught stays in the world."""
        self._ask(questions.delete_drive(identity))

    def robots(self) -> tuple[Robot, ...]:
        """The robots that drive, and those that the service connects to."""
        return self._ask(questions.robots())

    def send_records(self, robot: str, sensed: Sequence[Mapping[str, Any]]) -> str:
        """What a robot sensed since it last sent, as JSON values; the id of its drive.

        It is on the service's disk when this returns.
        """
        return self._ask(questions.records(robot, sensed))

    def end_drive(self, robot: str) -> Drive | None:
        """End a robot's drive, which is estimated as a whole; None where it can't be."""
        return self._ask(questions.end_drive(robot))

    def send(self, log: str | Path) -> Drive:
        """Send a log, or a bag's folder; the same log again is the same drive. Raises LogError."""
        with transport.one_file(log) as (file, digest), file.open("rb") as content:
            try:
                response = self._http.post(
                    "/v1/drives", content=content, headers={transport.DIGEST: digest}
                )
            except httpx.TransportError as error:
                raise transport.unreachable(error, self._http.base_url) from error
        transport.check(response)
        return Drive.model_validate(response.json())

    def wait(self, identity: str, timeout_s: float = 3600.0) -> Drive:
        """A drive when nothing more comes of it, or when the time is over; restarts are waited for."""
        deadline = time.monotonic() + timeout_s
        while True:
            try:
                found = self.drive(identity)
                if found.has_ended or time.monotonic() >= deadline:
                    return found
            except OutageError:
                if time.monotonic() >= deadline:
                    raise
            time.sleep(POLLED_EVERY_S)

    def stream(self, after: str | None = None) -> Iterator[Event]:
        """What happens, from now on or after an event; a broken stream is resumed without a gap."""
        assembly = Assembly(after)
        while True:
            try:
                yield from self._streamed(assembly)
            except httpx.TransportError:
                pass
            except ServiceError as error:
                if error.status not in transport.PASSING:
                    raise
            time.sleep(transport.PAUSE_S)

    def _streamed(self, assembly: Assembly) -> Iterator[Event]:
        assembly.begin()
        headers = {} if assembly.last is None else {transport.RESUME: assembly.last}
        with self._http.stream(
            "GET", "/v1/stream", headers=headers, timeout=transport.SILENCE_S
        ) as response:
            if not response.is_success:
                response.read()
            transport.check(response)
            for line in response.iter_lines():
                if (event := assembly.feed(line)) is not None:
                    yield event

    def _ask(self, question: Question[Answered]) -> Answered:
        try:
            response = self._http.request(**transport.arguments(question))
        except httpx.TransportError as error:
            raise transport.unreachable(error, self._http.base_url) from error
        return transport.answer_of(response, question)
