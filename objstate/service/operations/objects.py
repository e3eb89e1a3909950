"""Objects: what is believed of them, and what is reported of them."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING, Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response

from objstate.service.evidence import Report
from objstate.service.operations.operation import AT, LENGTH, WIDTH, Operation, Query, versioned
from objstate.service.requests import body_of, moment_of, number_of, truth_of, whole_number_of
from objstate.service.tokens import Role, Token
from objstate.world.words import belief_words

if TYPE_CHECKING:
    from objstate.service.parts import Parts


async def list_objects(parts: Parts, request: Request, _: Token) -> Response:
    when = moment_of(request)
    return await versioned(
        request,
        parts.questions.revision_of(None, when),
        lambda: asyncio.to_thread(parts.questions.objects, when),
    )


async def get_object(parts: Parts, request: Request, _: Token) -> Response:
    name, when = request.path_params["name"], moment_of(request)
    samples = truth_of(request, SAMPLES.name)
    return await versioned(
        request,
        parts.questions.revision_of(name, when),
        lambda: asyncio.to_thread(parts.questions.object, name, when, samples),
    )


async def get_history(parts: Parts, request: Request, _: Token) -> Response:
    name = request.path_params["name"]
    most = whole_number_of(request, MOST.name, USUAL_HISTORY)
    return await versioned(
        request,
        parts.questions.revision_of(name, 0),
        lambda: asyncio.to_thread(parts.questions.history, name, most),
    )


async def get_passage(parts: Parts, request: Request, _: Token) -> Response:
    name, when = request.path_params["name"], moment_of(request)
    width, length = number_of(request, "width"), number_of(request, "length", 0.0)

    async def ask() -> dict[str, Any]:
        if when is not None and when < parts.believed.now.latest_ns:
            return await asyncio.to_thread(parts.questions.passage, name, width, length, when)
        return parts.questions.passage(name, width, length, when)  # some 50 us

    return await versioned(request, parts.questions.revision_of(name, when), ask)


async def send_evidence(parts: Parts, request: Request, token: Token) -> Response:
    report, name = await body_of(request, Report), request.path_params["name"]
    belief = await asyncio.to_thread(parts.desk.take, name, report, token.id)
    return JSONResponse(belief_words(belief), 201)


async def list_evidence(parts: Parts, request: Request, _: Token) -> Response:
    name = request.path_params["name"]
    return JSONResponse(await asyncio.to_thread(parts.desk.reports, name))


async def get_plan(parts: Parts, _: Request, __: Token) -> Response:
    return JSONResponse(await asyncio.to_thread(parts.plan))


async def delete_history(parts: Parts, request: Request, token: Token) -> Response:
    await asyncio.to_thread(parts.forget, request.path_params["name"], token.id)
    return Response(status_code=204)


SAMPLES = Query("samples", "boolean", "the states and weights of the whole posterior")
USUAL_HISTORY = 200
MOST = Query("most", "integer", f"the newest so many moments; default: {USUAL_HISTORY}")
DOOR = {"object": "door_07", "state": {"angle": {"mean": 1.52, "std": 0.01, "median": 1.52}}}
OPERATIONS = (
    Operation(
        "GET",
        "/v1/plan",
        "get_plan",
        "The building from above as SVG, and how states move what is on it.",
        get_plan,
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
        query=(AT, SAMPLES),
        example=DOOR,
    ),
    Operation(
        "GET",
        "/v1/objects/{name}/history",
        "get_history",
        "What was learnt of it, in time order.",
        get_history,
        query=(MOST,),
    ),
    Operation(
        "DELETE",
        "/v1/objects/{name}/history",
        "delete_history",
        "Forget all that was learnt of it; that, and who asked, stays on record.",
        delete_history,
        Role.ADMIN,
        status=204,
    ),
    Operation(
        "GET",
        "/v1/objects/{name}/passage",
        "get_passage",
        "How probably a robot passes a door.",
        get_passage,
        query=(WIDTH, LENGTH, AT),
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
        "GET",
        "/v1/objects/{name}/evidence",
        "list_evidence",
        "What was reported of it, with its sources, in the order of its stamps.",
        list_evidence,
    ),
)
