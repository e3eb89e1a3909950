"""What an operation is: the routes and the OpenAPI document follow from it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from pydantic import BaseModel
from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from objstate.service.tokens import Role, Token

if TYPE_CHECKING:
    from objstate.service.parts import Parts

Answer = Callable[["Parts", Request, Token], Awaitable[Response]]


@dataclass(frozen=True)
class Query:
    """A parameter of the query."""

    name: str
    kind: str  # of JSON Schema: string, number, integer, boolean
    words: str
    is_required: bool = False


@dataclass(frozen=True)
class Operation:
    """One thing that can be asked for."""

    method: str
    path: str
    name: str
    summary: str
    answer: Answer
    role: Role = Role.READ
    query: tuple[Query, ...] = ()
    body: type[BaseModel] | None = None
    takes_log: bool = False
    of_leader: bool = False  # of several processes only the leader can answer
    status: int = 200
    media: str = "application/json"
    example: Mapping[str, Any] = field(default_factory=dict)


AT = Query("at", "string", "a moment: RFC 3339, or ns since 1970; default: now")
WIDTH = Query("width", "number", "m, of the robot", is_required=True)
LENGTH = Query("length", "number", "m, of the robot; default: 0, a disc")


async def versioned(
    request: Request, revision: str, ask: Callable[[], Awaitable[dict[str, Any]]]
) -> Response:
    """An answer with its revision; nothing where the asker knows it already."""
    tag = f'"{revision}"'
    headers = {"ETag": tag, "Cache-Control": "no-cache"}
    known = request.headers.get("if-none-match", "").replace("W/", "").split(",")
    if tag in (each.strip() for each in known):
        return Response(status_code=304, headers=headers)
    return JSONResponse(await ask(), headers=headers)
