"""Robots that send while they drive."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from objstate.service.live.records import Records, messages_of
from objstate.service.operations.operation import Operation
from objstate.service.requests import body_of
from objstate.service.tokens import Role, Token

if TYPE_CHECKING:
    from objstate.service.parts import Parts


async def list_robots(parts: Parts, _: Request, __: Token) -> Response:
    return JSONResponse({"robots": parts.robot_words()})


async def send_records(parts: Parts, request: Request, _: Token) -> Response:
    """Answered when the records are on disk."""
    body, robot = await body_of(request, Records), request.path_params["robot"]

    def take() -> dict[str, Any]:
        drive = parts.robots.take(robot, messages_of(body.records), keep=True)
        return {"robot": robot, "drive": drive.id, "taken": len(body.records)}

    return JSONResponse(await asyncio.to_thread(take), 202)


async def end_drive(parts: Parts, request: Request, _: Token) -> Response:
    drive = await asyncio.to_thread(parts.robots.finish, request.path_params["robot"])
    return JSONResponse({"drive": None if drive is None else drive.words()}, 202)


ROBOT = {
    "robot": "robot_1",
    "state": "estimating",
    "pose": [2.0, 0.5, 1.57],
    "lost": False,
    "warnings": ["Scan dropped: later than others (3 times)"],
}
OPERATIONS = (
    Operation(
        "GET",
        "/v1/robots",
        "list_robots",
        "The robots that are driving, and those that can't be reached.",
        list_robots,
        of_leader=True,
        example={"robots": [ROBOT]},
    ),
    Operation(
        "POST",
        "/v1/robots/{robot}/records",
        "send_records",
        "What a robot sensed since it last sent; its drive begins with the first.",
        send_records,
        Role.TEACH,
        body=Records,
        of_leader=True,
        status=202,
        example={"robot": "robot_1", "drive": "robot_1-1790000000000000000", "taken": 12},
    ),
    Operation(
        "POST",
        "/v1/robots/{robot}/end",
        "end_drive",
        "Its drive has ended: it is estimated as a whole, and teaches the world.",
        end_drive,
        Role.TEACH,
        of_leader=True,
        status=202,
    ),
)
