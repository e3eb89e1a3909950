"""Drives: sending, following and deleting them."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response

from objstate.run import SCENE
from objstate.service.drives import Drive
from objstate.service.operations.operation import Operation
from objstate.service.problems import Problem
from objstate.service.tokens import Role, Token

if TYPE_CHECKING:
    from objstate.service.parts import Parts


async def send_drive(parts: Parts, request: Request, _: Token) -> Response:
    """The log is the body; its SHA-256 may come along."""
    largest = parts.options.largest_log
    told = request.headers.get("content-length", "")
    if told.isdigit() and int(told) > largest:
        raise Problem(413, f"The log has more than {largest} bytes.", "Split it.")
    drive = await parts.drives.receive(request.stream(), largest, request.headers.get("x-sha256"))
    await asyncio.to_thread(parts.queued, drive)
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


async def get_scene(parts: Parts, request: Request, _: Token) -> Response:
    drive = await asyncio.to_thread(parts.drives.get, request.path_params["id"])
    scene = parts.drives.result(drive) / SCENE
    if not scene.is_file():
        detail = f"The drive '{drive.id}' has no scene."
        raise Problem(404, detail, "A service with --scenes records one for drives sent to it.")
    return FileResponse(scene, media_type=MCAP, filename=f"{drive.id}.mcap")


def _words(parts: Parts, drive: Drive) -> dict[str, Any]:
    return drive.words(parts.processing.progress(drive.id))


MCAP = "application/vnd.mcap"
DRIVE = {"id": "41b1e0b1d5a6c3f2", "state": "running", "progress": 0.4}
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
        "GET",
        "/v1/drives/{id}/scene",
        "get_scene",
        "The drive as a scene for Foxglove and RViz, MCAP; of a service with --scenes.",
        get_scene,
        media=MCAP,
    ),
    Operation(
        "DELETE",
        "/v1/drives/{id}",
        "delete_drive",
        "Delete its log and result; what it taught stays in the world.",
        delete_drive,
        Role.ADMIN,
        status=204,
    ),
)
