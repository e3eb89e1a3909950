"""What happens, as it happens."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from objstate.service.operations.operation import Operation
from objstate.service.problems import Problem
from objstate.service.tokens import Token

if TYPE_CHECKING:
    from objstate.service.parts import Parts


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


OPERATIONS = (
    Operation(
        "GET",
        "/v1/stream",
        "stream",
        "What happens, as Server-Sent Events; resumed by Last-Event-ID.",
        stream,
        of_leader=True,
        media="text/event-stream",
    ),
)
