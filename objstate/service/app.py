"""The ASGI app: routes of the operations, and what watches over them."""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from objstate.errors import ObjstateError, OutageError, QueryError, WorldError
from objstate.outages import outage_of
from objstate.service.forwarding import Forwarding
from objstate.service.metrics import MEDIA
from objstate.service.openapi import document
from objstate.service.operations import OPERATIONS, Operation
from objstate.service.page import service_page
from objstate.service.parts import Parts
from objstate.service.problems import Problem
from objstate.service.requests import check_query

LEADS_AFTER_S = 1.0  # without a leader
REFRESHED_EVERY_S = 1.0  # others may teach the world as well
HEADERS = {
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
}

logger = logging.getLogger(__name__)

Handler = Callable[[Request], Awaitable[Response]]


def service_app(parts: Parts) -> Starlette:
    """The app of a service."""
    described = document()

    async def health(_: Request) -> Response:
        return JSONResponse({"status": "alive"})

    async def ready(_: Request) -> Response:
        await asyncio.to_thread(parts.events.last)
        return JSONResponse({"status": "ready", "revision": parts.believed.now.revision})

    async def metrics(_: Request) -> Response:
        return Response(parts.metrics.text(await asyncio.to_thread(parts.gauges)), media_type=MEDIA)

    async def openapi(_: Request) -> Response:
        return JSONResponse(described)

    async def page(_: Request) -> Response:
        headers = {"Content-Security-Policy": "frame-ancestors 'none'", "Cache-Control": "no-cache"}
        return HTMLResponse(service_page(), headers=headers)

    @asynccontextmanager
    async def life(_: Starlette) -> AsyncIterator[None]:
        parts.events.listen_on(asyncio.get_running_loop())
        if parts.leadership.taken():
            await asyncio.to_thread(parts.lead)
        tasks = [asyncio.create_task(_lead(parts, app)), asyncio.create_task(_watch(parts))]
        yield
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await asyncio.to_thread(parts.end)

    forwarding = Forwarding(parts.leadership)
    routes = [
        Route(
            each.path,
            _watched(parts, each.path, _of(parts, each, forwarding)),
            methods=[each.method],
        )
        for each in OPERATIONS
    ]
    for path, handler in (
        ("/", page),
        ("/health", health),
        ("/ready", ready),
        ("/metrics", metrics),
        ("/openapi.json", openapi),
    ):
        routes.append(Route(path, _watched(parts, path, handler)))
    app = Starlette(routes=routes, lifespan=life, exception_handlers={HTTPException: _unknown})
    return app


async def _lead(parts: Parts, app: Starlette) -> None:
    """Estimate and follow robots, as soon as no other process of the service does."""
    if not parts.leadership.is_ours:
        while not parts.leadership.taken():
            await asyncio.sleep(LEADS_AFTER_S)
        await asyncio.to_thread(parts.lead)
    parts.leadership.socket.unlink(missing_ok=True)
    config = uvicorn.Config(
        app, uds=str(parts.leadership.socket), lifespan="off", log_level="warning", access_log=False
    )
    working = [each.run() for each in parts.links]
    await asyncio.gather(_Inner(config).serve(), parts.robots.watch(), *working)


class _Inner(uvicorn.Server):
    """A second server in the same process, which leaves signals to the first."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        yield


def _of(parts: Parts, operation: Operation, forwarding: Forwarding) -> Handler:
    async def answer(request: Request) -> Response:
        if operation.of_leader and not parts.leadership.is_ours:
            return await forwarding.answer(request)
        token = await parts.gate.admit(request, operation.role)
        check_query(request, {each.name for each in operation.query})
        await parts.follow()
        return await operation.answer(parts, request, token)

    return answer


def _watched(parts: Parts, route: str, handler: Handler) -> Handler:
    """A handler whose errors become problem documents, and whose answers are counted."""

    async def answer(request: Request) -> Response:
        identity, began = secrets.token_hex(8), time.perf_counter()
        try:
            response = await handler(request)
        except Problem as problem:
            response = problem.response(request.url.path)
        except ClientDisconnect:
            response = Response(status_code=400)
        except QueryError as error:
            response = Problem(422, str(error), "See /openapi.json.").response(request.url.path)
        except WorldError as error:
            response = Problem(503, str(error), "Try again.").response(request.url.path)
        except OutageError as error:
            response = _bug_or_outage(error, identity, request, route)
        except ObjstateError as error:
            response = Problem(422, str(error), "See /openapi.json.").response(request.url.path)
        except Exception as error:
            response = _bug_or_outage(error, identity, request, route)
        for name, value in (HEADERS | {"X-Request-ID": identity}).items():
            response.headers.setdefault(name, value)
        seconds = time.perf_counter() - began
        parts.metrics.note(request.method, route, response.status_code, seconds)
        logger.info(
            "%s %s %s %d %.1f ms",
            identity,
            request.method,
            request.url.path,
            response.status_code,
            1000.0 * seconds,
        )
        return response

    return answer


def _bug_or_outage(error: Exception, identity: str, request: Request, route: str) -> JSONResponse:
    outage = error if isinstance(error, OutageError) else outage_of(error)
    if outage is not None:
        logger.error("request %s: %s", identity, outage)
        return Problem(503, str(outage), "Try again later.").response(request.url.path)
    logger.error("request %s of %s %s", identity, request.method, route, exc_info=error)
    detail = f"A bug in objstate; the service's log has it under {identity}."
    return Problem(500, detail, "Please report it.").response(request.url.path)


async def _watch(parts: Parts) -> None:
    """Follow what others teach the world."""
    while True:
        await asyncio.sleep(REFRESHED_EVERY_S)
        try:
            await asyncio.to_thread(parts.refresh)
            await asyncio.to_thread(parts.events.follow)
            if not parts.leadership.is_ours:
                await asyncio.to_thread(parts.believed.follow_live)
        except ObjstateError as error:
            logger.warning("the world can't be read: %s", error)


async def _unknown(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    cure = "See /openapi.json."
    headers = dict(error.headers or {})
    told = Problem(error.status_code, f"{request.method} {request.url.path}: {error.detail}", cure)
    response = told.response(request.url.path)
    response.headers.update(HEADERS | headers)
    return response
