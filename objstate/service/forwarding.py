"""Requests that only the leader can answer, handed on to it by the other processes."""

from __future__ import annotations

from collections.abc import AsyncIterator
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import Response, StreamingResponse

from objstate.service.leading import Leadership
from objstate.service.problems import Problem

if TYPE_CHECKING:
    import httpx

HOST = "http://leader"
BETWEEN_TWO = ("connection", "transfer-encoding", "keep-alive", "upgrade")
PASSED_ON = ("content-type", "location", "retry-after", "cache-control", "x-accel-buffering")


class Forwarding:
    """Asks the leader, over a socket in the data folder."""

    def __init__(self, leadership: Leadership) -> None:
        self._leadership = leadership
        self._client: httpx.AsyncClient | None = None

    async def answer(self, request: Request) -> Response:
        """The leader's answer. Raises Problem while nobody leads."""
        import httpx

        if self._client is None:
            transport = httpx.AsyncHTTPTransport(uds=str(self._leadership.socket))
            self._client = httpx.AsyncClient(transport=transport, base_url=HOST, timeout=None)
        url = httpx.URL(path=request.url.path, query=request.url.query.encode())
        wanted = {k: v for k, v in request.headers.items() if k not in BETWEEN_TWO}
        asked = self._client.build_request(
            request.method, url, headers=wanted, content=request.stream()
        )
        try:
            told = await self._client.send(asked, stream=True)
        except httpx.TransportError as error:
            detail = "The process that follows robots is starting."
            raise Problem(503, detail, "Try again in a second.", {"Retry-After": "1"}) from error
        headers = {name: told.headers[name] for name in PASSED_ON if name in told.headers}

        async def content() -> AsyncIterator[bytes]:
            try:
                async for some in told.aiter_raw():
                    yield some
            finally:
                await told.aclose()

        return StreamingResponse(content(), told.status_code, headers)
