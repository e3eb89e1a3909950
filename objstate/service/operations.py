"""The operations of the service, one by one: the routes and the OpenAPI document follow from them."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel
from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse

from objstate.service.drives import Drive
from objstate.service.evidence import Report
from objstate.service.problems import Problem
from objstate.service.questions import EdgesQuestion, PathQuestion
from objstate.service.requests import body_of, check_query, moment_of, number_of
from objstate.service.tokens import Role, Token
from objstate.world.words import belief_words

if TYPE_CHECKING:
    from objstate.service.parts import Parts

Answer = Callable[["Parts", Request, Token], Awaitable[Response]]

AT = "at"
QUERY = {
    AT: ("string", "a moment: RFC 3339, or ns since 1970; default: now"),
    "width": ("number", "m, of the robot"),
    "length": ("number", "m, of the robot; default: 0, as long as it is wide"),
    "samples": ("boolean", "the states and weights of the whole posterior"),
}


@dataclass(frozen=True)
class Operation:
    """One thing that can be asked for."""

    method: str
    path: str
    name: str
    summary: str
    answer: Answer
    role: Role = Role.READ
    query: tuple[str, ...] = ()
    body: type[BaseModel] | None = None
    takes_log: bool = False
    status: int = 200
    media: str = "application/json"
    example: Mapping[str, Any] = field(default_factory=dict)


async def send_drive(parts: Parts, request: Request, _: Token) -> Response:
    """The log is the body; its SHA-256 may come along."""
    largest = parts.options.largest_log
    told = request.headers.get("content-length", "")
    if told.isdigit() and int(told) > largest:
        raise Problem(413, f"The log has more than {largest} bytes.", "Split it.")
    drive = await parts.drives.receive(request.stream(), largest, request.headers.get("x-sha256"))
    parts.processing.wake()
    await asyncio.to_thread(parts.note_drive, drive)
    return JSONResponse(_words(parts, drive), 202, {"Location": f"/v1/drives/{drive.id}"})


async def list_drives(parts: Parts, _: Request, __: Token) -> Response:
    drives = await asyncio.to_thread(parts.drives.all)
    return JSONResponse({"drives": [_words(parts, drive) for drive in drives]})


async def get_drive(parts: Parts, request: Request, _: Token) -> Response:
    drive = await asyncio.to_thread(parts.drives.get, request.path_params["id"])
    return JSONResponse(_words(parts, drive))


async def delete_drive(parts: Parts, request: Request, token: Token) -> Response:
    drive = await asyncio.to_thread(parts.drives.delete, request.path_params["id"], token.id)
    await asyncio.to_thread(parts.events.add, ("deleted", {"id": drive.id}))
    return Response(status_code=204)


async def list_objects(parts: Parts, request: Request, _: Token) -> Response:
    when = moment_of(request)
    return await _versioned(
        request,
        parts.questions.revision_of(None, when),
        lambda: asyncio.to_thread(parts.questions.objects, when),
    )


async def get_object(parts: Parts, request: Request, _: Token) -> Response:
    name, when = request.path_params["name"], moment_of(request)
    samples = request.query_params.get("samples") in ("1", "true")
    return await _versioned(
        request,
        parts.questions.revision_of(name, when),
        lambda: asyncio.to_thread(parts.questions.object, name, when, samples),
    )


async def get_history(parts: Parts, request: Request, _: Token) -> Response:
    name = request.path_params["name"]
    return await _versioned(
        request,
        parts.questions.revision_of(name, 0),
        lambda: asyncio.to_thread(parts.questions.history, name),
    )


async def get_passage(parts: Parts, request: Request, _: Token) -> Response:
    name, when = request.path_params["name"], moment_of(request)
    width, length = number_of(request, "width"), number_of(request, "length", 0.0)

    async def ask() -> dict[str, Any]:
        if when is not None and when < parts.believed.now.latest_ns:
            return await asyncio.to_thread(parts.questions.passage, name, width, length, when)
        return parts.questions.passage(name, width, length, when)  # some 50 us

    return await _versioned(request, parts.questions.revision_of(name, when), ask)


async def ask_blocked(parts: Parts, request: Request, _: Token) -> Response:
    asked = await body_of(request, PathQuestion)
    return JSONResponse(await asyncio.to_thread(parts.questions.blocked, asked))


async def ask_edges(parts: Parts, request: Request, _: Token) -> Response:
    asked = await body_of(request, EdgesQuestion)
    return JSONResponse(await asyncio.to_thread(parts.questions.edges, asked))


async def get_doors(parts: Parts, request: Request, _: Token) -> Response:
    width, length = number_of(request, "width", 0.6), number_of(request, "length", 0.0)
    when = moment_of(request)
    return JSONResponse(await asyncio.to_thread(parts.questions.modes, width, length, when))


async def send_evidence(parts: Parts, request: Request, token: Token) -> Response:
    report, name = await body_of(request, Report), request.path_params["name"]
    belief = await asyncio.to_thread(parts.desk.take, name, report, token.id)
    return JSONResponse(belief_words(belief), 201)


async def stream(parts: Parts, request: Request, _: Token) -> Response:
    told = request.headers.get("last-event-id")
    if told is not None and not told.isdigit():
        raise Problem(422, f"Last-Event-ID {told} is no event's number.", "Send what came as id.")

    async def events() -> AsyncIterator[str]:
        parts.listeners += 1
        try:
            async for text in parts.events.stream(None if told is None else int(told)):
                yield text
        finally:
            parts.listeners -= 1

    headers = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
    return StreamingResponse(events(), media_type="text/event-stream", headers=headers)


async def _versioned(
    request: Request, revision: str, ask: Callable[[], Awaitable[dict[str, Any]]]
) -> Response:
    """An answer with its revision; nothing where the asker knows it already."""
    tag = f'"{revision}"'
    headers = {"ETag": tag, "Cache-Control": "no-cache"}
    if tag in request.headers.get("if-none-match", ""):
        return Response(status_code=304, headers=headers)
    return JSONResponse(await ask(), headers=headers)


def _words(parts: Parts, drive: Drive) -> dict[str, Any]:
    return drive.words(parts.processing.progress(drive.id))


DRIVE = {"id": "41b1e0b1d5a6c3f2", "state": "running", "progress": 0.4}
DOOR = {"object": "door_07", "state": {"angle": {"mean": 1.52, "std": 0.01}}}
PATH = {"path": [[0.0, 0.0], [4.0, 0.0]], "radius": 0.3}
OPERATIONS = (
    Operation(
        "POST",
        "/v1/drives",
        "send_drive",
        "Send a recorded drive: the log is the body. Header X-SHA256 is checked if given.",
        send_drive,
        Role.TEACH,
        takes_log=True,
        status=202,
        example=DRIVE | {"state": "waiting", "progress": 0.0},
    ),
    Operation("GET", "/v1/drives", "list_drives", "All drives.", list_drives),
    Operation(
        "GET", "/v1/drives/{id}", "get_drive", "What became of it.", get_drive, example=DRIVE
    ),
    Operation(
        "DELETE",
        "/v1/drives/{id}",
        "delete_drive",
        "Delete its log; what it taught stays in the world.",
        delete_drive,
        Role.ADMIN,
        status=204,
    ),
    Operation(
        "GET", "/v1/objects", "list_objects", "What is believed of all.", list_objects, query=(AT,)
    ),
    Operation(
        "GET",
        "/v1/objects/{name}",
        "get_object",
        "What is believed of one object.",
        get_object,
        query=(AT, "samples"),
        example=DOOR,
    ),
    Operation(
        "GET",
        "/v1/objects/{name}/history",
        "get_history",
        "What was learnt of it, in time order.",
        get_history,
    ),
    Operation(
        "GET",
        "/v1/objects/{name}/passage",
        "get_passage",
        "How probably a robot passes a door.",
        get_passage,
        query=("width", "length", AT),
        example={"object": "door_07", "width": 0.6, "length": 0.9, "probability": 0.97},
    ),
    Operation(
        "POST",
        "/v1/objects/{name}/evidence",
        "send_evidence",
        "Report the state of a door: a contact sensor, an access system, a person.",
        send_evidence,
        Role.TEACH,
        body=Report,
        status=201,
        example=DOOR,
    ),
    Operation(
        "POST",
        "/v1/blocked",
        "ask_blocked",
        "How probably something movable is in a robot's way.",
        ask_blocked,
        body=PathQuestion,
        example={"probability": 0.2, "blockers": [{"object": "door_07", "probability": 0.2}]},
    ),
    Operation(
        "POST",
        "/v1/edges",
        "ask_edges",
        "Costs of a route graph's edges, as Nav2's DynamicEdges takes them.",
        ask_edges,
        body=EdgesQuestion,
    ),
    Operation(
        "GET",
        "/v1/doors",
        "get_doors",
        "All doors by the numbers of Open-RMF's DoorMode.",
        get_doors,
        query=("width", "length", AT),
    ),
    Operation(
        "GET",
        "/v1/stream",
        "stream",
        "What happens, as Server-Sent Events; resumed by Last-Event-ID.",
        stream,
        media="text/event-stream",
    ),
)


def query_known(operation: Operation, request: Request) -> None:
    """Raises Problem for a parameter that the operation doesn't have."""
    check_query(request, set(operation.query))
