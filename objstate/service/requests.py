"""What every request passes: who asks, how often, from which page; and its body."""

from __future__ import annotations

import asyncio
import math
import time
from typing import TypeVar

from pydantic import BaseModel, ValidationError
from starlette.requests import Request

from objstate.service.moments import parse_moment
from objstate.service.problems import Problem
from objstate.service.tokens import Role, Token, Tokens

Body = TypeVar("Body", bound=BaseModel)

LARGEST_BODY = 4 * 2**20  # bytes of a question
BURST_S = 1.0  # of requests that may come at once
GUESSES_PER_S = 5.0  # requests of one address without a token that is in use
TRUTHS = {"true": True, "1": True, "false": False, "0": False}
MOST_WANTED = 100_000  # of things that are listed
MOST_COUNTED = 10_000  # tokens and addresses whose requests are counted


class Gate:
    """Lets requests in, by their tokens."""

    def __init__(self, tokens: Tokens, requests_per_s: float) -> None:
        self._tokens, self._rate = tokens, requests_per_s
        self._left: dict[str, tuple[float, float]] = {}  # by who asks: requests left, at a time

    async def admit(self, request: Request, role: Role) -> Token:
        """The token of a request that may do what a role may. Raises Problem."""
        _check_origin(request)
        scheme, _, secret = request.headers.get("authorization", "").partition(" ")
        token = await self._token(secret.strip()) if scheme.lower() == "bearer" else None
        if token is None:
            where = request.client.host if request.client is not None else ""
            self._count(f"address {where}", "An address without a token", GUESSES_PER_S)
            raise Problem(
                401,
                "The request has no token that is in use.",
                "Send 'Authorization: Bearer TOKEN'; `objstate serve token make` makes one.",
                {"WWW-Authenticate": "Bearer"},
            )
        if not token.role.allows(role):
            detail = f"The token '{token.name}' has the role {token.role.value}."
            raise Problem(403, detail, f"Use one with the role {role.value}.")
        self._count(token.id, f"The token '{token.name}'", self._rate)
        return token

    async def _token(self, secret: str) -> Token | None:
        known = self._tokens.remembered(secret)
        return known[1] if known else await asyncio.to_thread(self._tokens.of, secret)

    def _count(self, who: str, told: str, rate: float) -> None:
        """Let one more request pass, as a bucket of tokens does. Raises Problem."""
        if len(self._left) > MOST_COUNTED:
            self._left.clear()
        now, most = time.monotonic(), max(rate * BURST_S, 1.0)
        left, since = self._left.get(who, (most, now))
        left = min(left + (now - since) * rate, most)
        if left < 1.0:
            wait = (1.0 - left) / rate
            detail = f"{told} has asked more than {rate:g} times a second."
            headers = {"Retry-After": str(math.ceil(wait))}
            raise Problem(429, detail, f"Wait {wait:.3f} s.", headers)
        self._left[who] = left - 1.0, now


def _check_origin(request: Request) -> None:
    """A page of somebody else may not send what a browser here would. Raises Problem."""
    origin = request.headers.get("origin")
    if origin is None:
        return
    if origin.partition("://")[2] != request.headers.get("host"):
        raise Problem(403, f"A page of {origin} may not ask.", "Ask from the service's own page.")


async def body_of(request: Request, model: type[Body]) -> Body:
    """The body of a question. Raises Problem."""
    content = bytearray()
    async for chunk in request.stream():
        content += chunk
        if len(content) > LARGEST_BODY:
            raise Problem(413, f"The body has more than {LARGEST_BODY} bytes.", "Ask for less.")
    try:
        return model.model_validate_json(bytes(content))
    except ValidationError as error:
        told = "; ".join(_where(each["loc"]) + each["msg"] for each in error.errors())
        raise Problem(422, told, "See /openapi.json.") from error


def moment_of(request: Request) -> int | None:
    """The moment that a request asks for; None for now. Raises Problem."""
    text = request.query_params.get("at")
    return None if text is None or text == "now" else parse_moment(text)


def text_of(request: Request, name: str) -> str:
    """What a request has to say. Raises Problem."""
    text = request.query_params.get(name)
    if not text:
        raise Problem(422, f"The query has no '{name}'.", "See /openapi.json.")
    return text


def truth_of(request: Request, name: str) -> bool:
    """Whether a request says so. Raises Problem."""
    text = request.query_params.get(name, "false").lower()
    if text not in TRUTHS:
        raise Problem(422, f"{name}={text} is neither true nor false.", "Give true or false.")
    return TRUTHS[text]


def number_of(request: Request, name: str, otherwise: float | None = None) -> float:
    """A length in m that a request gives. Raises Problem."""
    text = request.query_params.get(name)
    if text is None:
        if otherwise is None:
            raise Problem(422, f"The query has no '{name}'.", f"Add {name}=0.6, in m.")
        return otherwise
    try:
        value = float(text)
    except ValueError as error:
        raise Problem(422, f"{name}={text} is no number.", "Give metres.") from error
    if not 0.0 <= value < float("inf"):
        raise Problem(422, f"{name}={text} is no length.", "Give metres, 0 or more.")
    return value


def whole_number_of(request: Request, name: str, otherwise: int) -> int:
    """A number of things that a request wants at most. Raises Problem."""
    text = request.query_params.get(name)
    if text is None:
        return otherwise
    if not (text.isascii() and text.isdigit() and 1 <= int(text) <= MOST_WANTED):
        raise Problem(422, f"{name}={text} is none.", f"Give 1 to {MOST_WANTED}.")
    return int(text)


def check_query(request: Request, known: set[str]) -> None:
    """Raises Problem for a parameter that nothing asks for."""
    unknown = set(request.query_params) - known
    if unknown:
        names = ", ".join(sorted(known)) or "none"
        raise Problem(422, f"Unknown: {', '.join(sorted(unknown))}.", f"Known here: {names}.")


def _where(place: tuple[int | str, ...]) -> str:
    return ".".join(map(str, place)) + ": " if place else ""
