"""Logs that are sent in chunks, or dropped at watched places."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from objstate.service.operations.operation import Operation
from objstate.service.problems import Problem
from objstate.service.requests import body_of
from objstate.service.tokens import Role, Token
from objstate.service.uploads import UploadPlan

if TYPE_CHECKING:
    from objstate.service.parts import Parts

OFFSET = "upload-offset"


async def begin_upload(parts: Parts, request: Request, token: Token) -> Response:
    plan = await body_of(request, UploadPlan)
    largest = parts.options.largest_log
    upload = await asyncio.to_thread(parts.uploads.begin, plan, token.id, largest)
    return JSONResponse(upload.words(), 201, {"Location": f"/v1/uploads/{upload.id}"})


async def get_upload(parts: Parts, request: Request, token: Token) -> Response:
    identity = request.path_params["id"]
    return JSONResponse((await asyncio.to_thread(parts.uploads.get, identity, token.id)).words())


async def append_upload(parts: Parts, request: Request, token: Token) -> Response:
    """The last chunk makes a drive of it, which is answered as ``send_drive`` does."""
    offset = request.headers.get(OFFSET, "")
    if not (offset.isdigit() and offset.isascii()):
        raise Problem(422, "The header Upload-Offset is missing.", "Say where the chunk begins.")
    identity = request.path_params["id"]
    upload = await parts.uploads.append(identity, token.id, int(offset), request.stream())
    if upload.offset < upload.size:
        return JSONResponse(upload.words())
    drive = await asyncio.to_thread(parts.uploads.finish, upload)
    await asyncio.to_thread(parts.queued, drive)
    return JSONResponse(drive.words(), 202, {"Location": f"/v1/drives/{drive.id}"})


async def delete_upload(parts: Parts, request: Request, token: Token) -> Response:
    upload = await asyncio.to_thread(parts.uploads.get, request.path_params["id"], token.id)
    await asyncio.to_thread(parts.uploads.delete, upload.id)
    return Response(status_code=204)


async def list_watched(parts: Parts, _: Request, __: Token) -> Response:
    return JSONResponse(await asyncio.to_thread(parts.watch.words))


UPLOAD = {"id": "8c1f0a77d2b34e10", "size": 73400320, "offset": 0}
OPERATIONS = (
    Operation(
        "POST",
        "/v1/uploads",
        "begin_upload",
        "Begin to send a log in chunks.",
        begin_upload,
        Role.TEACH,
        body=UploadPlan,
        status=201,
        example=UPLOAD,
    ),
    Operation(
        "GET",
        "/v1/uploads/{id}",
        "get_upload",
        "How much of it has come: where to go on after a broken connection.",
        get_upload,
        Role.TEACH,
        example=UPLOAD,
    ),
    Operation(
        "PATCH",
        "/v1/uploads/{id}",
        "append_upload",
        "Send a chunk, which begins at the header Upload-Offset. The last one queues the drive.",
        append_upload,
        Role.TEACH,
        takes_log=True,
        example=UPLOAD,
    ),
    Operation(
        "DELETE",
        "/v1/uploads/{id}",
        "delete_upload",
        "Give it up.",
        delete_upload,
        Role.TEACH,
        status=204,
    ),
    Operation(
        "GET",
        "/v1/watched",
        "list_watched",
        "The watched places, the logs that were found there, and why some were set aside.",
        list_watched,
    ),
)
