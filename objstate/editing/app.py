"""The page served on this machine, and its saving."""

from __future__ import annotations

import secrets
import socket
from collections.abc import Callable
from typing import TYPE_CHECKING

from pydantic import ValidationError

from objstate.editing.page import SavedState, edit_page
from objstate.editing.rows import Edits
from objstate.editing.session import Session, StaleError
from objstate.editing.subject import Subject
from objstate.errors import ObjstateError, SettingsError
from objstate.geometry import FloatArray

if TYPE_CHECKING:
    from starlette.applications import Starlette
    from starlette.requests import Request
    from starlette.responses import Response

LOOPBACK = "127.0.0.1"
NAMES = (LOOPBACK, "localhost")  # names of this machine; requests to others are attacks
LARGEST = 4 * 2**20  # bytes that the page may send
TOKEN, REVISION = "x-objstate-token", "x-objstate-revision"  # of a request to save


def edit_app(subject: Subject, points: FloatArray) -> Starlette:
    """An ASGI app: the page at ``/``, and ``POST /save``.

    It answers only requests for this machine by name, and saves only for a page that it served and
    that shows what is saved. Raises SettingsError where Starlette is missing.
    """
    try:
        from starlette.applications import Starlette
        from starlette.middleware import Middleware
        from starlette.middleware.trustedhost import TrustedHostMiddleware
        from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse
        from starlette.routing import Route
    except ImportError as error:
        raise _missing(error) from error
    token = secrets.token_urlsafe(24)
    session = Session(subject)

    async def show(_: Request) -> Response:
        try:
            saved, revision = session.current()
        except ObjstateError as error:
            return PlainTextResponse(str(error), 500)
        page = edit_page(saved, points, SavedState(token, revision))
        return HTMLResponse(page, headers={"Cache-Control": "no-store"})

    async def store(request: Request) -> Response:
        if not secrets.compare_digest(request.headers.get(TOKEN, ""), token):
            return JSONResponse({"error": "This page is of an earlier start; reload it."}, 403)
        content = await request.body()
        if len(content) > LARGEST:
            return JSONResponse({"error": "This is more than doors."}, 413)
        try:
            edits = Edits.model_validate_json(content)
            saved, revision = session.save(edits, request.headers.get(REVISION, ""))
        except StaleError as error:
            return JSONResponse({"error": str(error)}, 409)
        except ValidationError as error:
            told = "; ".join(f"{each['loc']}: {each['msg']}" for each in error.errors())
            return JSONResponse({"error": told}, 400)
        except ObjstateError as error:
            return JSONResponse({"error": str(error)}, 400)
        return JSONResponse({"saved": str(saved.urdf), "revision": revision})

    return Starlette(
        routes=[Route("/", show), Route("/save", store, methods=["POST"])],
        middleware=[Middleware(TrustedHostMiddleware, allowed_hosts=list(NAMES))],
    )


def serve(subject: Subject, points: FloatArray, port: int, on_ready: Callable[[str], None]) -> None:
    """Serve the page on loopback until interrupted.

    ``on_ready`` receives its address once connections to it are accepted. Port 0 takes a free one.
    Raises SettingsError where the port is taken, or the extra is missing.
    """
    try:
        import uvicorn
    except ImportError as error:
        raise _missing(error) from error
    app = edit_app(subject, points)
    listening = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    with listening:
        try:
            listening.bind((LOOPBACK, port))
            listening.listen()
        except (OSError, OverflowError) as error:
            raise SettingsError(f"Port {port} can't be used ({error}); give another.") from error
        on_ready(f"http://{LOOPBACK}:{listening.getsockname()[1]}/")
        config = uvicorn.Config(app, log_level="warning", access_log=False)
        uvicorn.Server(config).run(sockets=[listening])


def _missing(error: ImportError) -> SettingsError:
    return SettingsError(
        f"Serving the page needs Starlette and Uvicorn ({error}); pip install 'objstate[edit]', or "
        "write the page with --static."
    )
