"""Errors as problem documents: RFC 9457."""

from __future__ import annotations

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from starlette.responses import JSONResponse

MEDIA = "application/problem+json"


class Problem(Exception):  # noqa: N818 - it is the document
    """What a request can't have: what, where and the cure."""

    def __init__(
        self, status: int, detail: str, cure: str, headers: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(detail)
        self.status, self.detail, self.cure = status, detail, cure
        self.headers = dict(headers or {})

    def document(self, where: str) -> dict[str, Any]:
        """The document for a request of a path."""
        return {
            "type": "about:blank",
            "title": HTTPStatus(self.status).phrase,
            "status": self.status,
            "detail": self.detail,
            "cure": self.cure,
            "instance": where,
        }

    def response(self, where: str) -> JSONResponse:
        """The answer to a request of a path."""
        return JSONResponse(self.document(where), self.status, self.headers, media_type=MEDIA)
