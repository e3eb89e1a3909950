"""What planners ask: blocked paths, edges of route graphs, doors, and what to look at next."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from objstate.maintenance.triggers import ROBOT_WIDTH
from objstate.service.operations.operation import AT, LENGTH, Operation, Query
from objstate.service.questions import EdgesQuestion, PathQuestion
from objstate.service.requests import body_of, moment_of, number_of, text_of, truth_of
from objstate.service.tokens import Token

if TYPE_CHECKING:
    from objstate.service.parts import Parts


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


async def get_next(parts: Parts, request: Request, _: Token) -> Response:
    pose, when = text_of(request, POSE.name), moment_of(request)
    plans, stay = request.query_params.getlist(PLAN.name), truth_of(request, STAY.name)
    width = number_of(request, DRIVING_WIDTH.name, ROBOT_WIDTH)
    told = await asyncio.to_thread(parts.advice.next, pose, when, plans, stay, width)
    return JSONResponse(told)


POSE = Query(
    "pose",
    "string",
    "where the robot is: X,Y,YAW in m and rad, or YAW as 90deg",
    is_required=True,
)
PLAN = Query("plan", "string", "what is about to be done, as 'pass door_07'; repeatable")
STAY = Query("stay", "boolean", "only what can be seen without driving")
DRIVING_WIDTH = Query("width", "number", f"m, of the robot; default: {ROBOT_WIDTH}")
PASSED_WIDTH = Query("width", "number", "m, of the robot; default: 0.6")
OPERATIONS = (
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
        query=(PASSED_WIDTH, LENGTH, AT),
    ),
    Operation(
        "GET",
        "/v1/next",
        "get_next",
        "What to look at next, from where, and why.",
        get_next,
        query=(POSE, PLAN, DRIVING_WIDTH, STAY, AT),
    ),
)
