"""The OpenAPI 3.1 document, made of the operations."""

from __future__ import annotations

import re
from importlib.metadata import version
from typing import Any

from objstate.service.operations import OPERATIONS, Operation, Query
from objstate.service.problems import MEDIA

REFERENCES = "#/components/schemas/{model}"
PROBLEMS = {
    400: "The request is wrong.",
    401: "No token.",
    403: "The token's role isn't enough.",
    404: "There is no such thing.",
    409: "Not now.",
    413: "Too large.",
    422: "A value is wrong.",
    429: "Too many requests.",
}


def document() -> dict[str, Any]:
    """What the service offers, for programs."""
    schemas: dict[str, Any] = {"Problem": _problem()}
    paths: dict[str, dict[str, Any]] = {}
    for operation in OPERATIONS:
        paths.setdefault(operation.path, {})[operation.method.lower()] = _told(operation, schemas)
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "objstate",
            "version": version("objstate"),
            "description": "Which doors are open, how far, how sure are we?",
        },
        "security": [{"token": []}],
        "paths": paths,
        "components": {
            "securitySchemes": {"token": {"type": "http", "scheme": "bearer"}},
            "schemas": schemas,
        },
    }


def _told(operation: Operation, schemas: dict[str, Any]) -> dict[str, Any]:
    names = re.findall(r"{(\w+)}", operation.path)
    parameters: list[dict[str, Any]] = [
        {"name": name, "in": "path", "required": True, "schema": {"type": "string"}}
        for name in names
    ]
    parameters += [_parameter(each) for each in operation.query]
    out: dict[str, Any] = {
        "operationId": operation.name,
        "summary": operation.summary,
        "description": f"Needs a token with the role {operation.role.value}.",
        "parameters": parameters,
        "responses": _responses(operation),
    }
    if operation.takes_log:
        content = {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}}
        out["requestBody"] = {"required": True, "content": content}
    if operation.body is not None:
        model = operation.body.model_json_schema(ref_template=REFERENCES)
        schemas.update(model.pop("$defs", {}))
        schemas[operation.body.__name__] = model
        reference = {"$ref": REFERENCES.format(model=operation.body.__name__)}
        out["requestBody"] = {
            "required": True,
            "content": {"application/json": {"schema": reference}},
        }
    return out


def _parameter(query: Query) -> dict[str, Any]:
    schema: dict[str, Any] = {"type": query.kind}
    if query.kind == "number":
        schema["minimum"] = 0
    told = {"name": query.name, "in": "query", "required": query.is_required, "schema": schema}
    return told | {"description": query.words}


def _responses(operation: Operation) -> dict[str, Any]:
    done: dict[str, Any] = {"description": "Done."}
    if operation.status != 204:
        media: dict[str, Any] = {"schema": {"type": "object"}}
        if operation.media != "application/json":
            media = {"schema": {"type": "string"}}
        if operation.example:
            media["example"] = dict(operation.example)
        done["content"] = {operation.media: media}
    reference = {"schema": {"$ref": REFERENCES.format(model="Problem")}}
    wrong = {
        str(status): {"description": words, "content": {MEDIA: reference}}
        for status, words in PROBLEMS.items()
    }
    return {str(operation.status): done} | wrong


def _problem() -> dict[str, Any]:
    texts = {key: {"type": "string"} for key in ("type", "title", "detail", "cure", "instance")}
    return {
        "type": "object",
        "description": "RFC 9457: what, where and the cure.",
        "properties": texts | {"status": {"type": "integer"}},
        "required": ["type", "title", "status", "detail"],
    }
