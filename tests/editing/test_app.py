"""The server answers this machine alone, and saves only for the page that it served."""

from __future__ import annotations

import asyncio
import json
import re
import socket
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from objstate.building import load_building
from objstate.editing.app import edit_app, serve
from objstate.editing.subject import subject_of

pytest.importorskip("starlette", reason="Starlette is not installed (pip install 'objstate[edit]')")

NOWHERE = np.zeros((0, 2))


def ask(
    app: Any, path: str, body: bytes | None = None, host: str = "127.0.0.1:9", token: str = ""
) -> tuple[int, str]:
    """The status and the text of an answer."""
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": body or b"", "more_body": False}

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    headers = [(b"host", host.encode()), (b"x-objstate-token", token.encode())]
    scope = {
        "type": "http", "method": "GET" if body is None else "POST", "path": path, "headers": headers,
        "query_string": b"", "http_version": "1.1", "scheme": "http", "root_path": "",
        "server": ("127.0.0.1", 9), "client": ("127.0.0.1", 1),
    }  # fmt: skip
    asyncio.run(app(scope, receive, send))
    text = b"".join(message.get("body", b"") for message in sent[1:])
    return sent[0]["status"], text.decode()


def token_in(page: str) -> str:
    found = re.search(r'"token":"([^"]+)"', page)
    assert found
    return found[1]


def doors_in(page: str) -> list[dict[str, Any]]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page)
    assert found
    doors: list[dict[str, Any]] = json.loads(found[1])["doors"]
    return doors


def test_what_the_page_sends_is_saved(folder: Path) -> None:
    app = edit_app(subject_of(folder), NOWHERE)
    status, page = ask(app, "/")
    assert status == 200
    doors = doors_in(page)
    doors[0]["x"] = 3.2
    body = json.dumps({"doors": doors}).encode()
    assert ask(app, "/save", body, token=token_in(page))[0] == 200
    assert load_building(folder / "room.urdf")["left"].hinge == pytest.approx([3.2, 0])


def test_other_names_of_this_machine_and_other_pages_are_refused(folder: Path) -> None:
    app = edit_app(subject_of(folder), NOWHERE)
    before = (folder / "room.urdf").read_bytes()
    body = b'{"doors": []}'
    assert ask(app, "/", host="rebound.example")[0] == 400
    assert ask(app, "/save", body)[0] == 403
    assert ask(app, "/save", body, token="guessed")[0] == 403
    assert (folder / "room.urdf").read_bytes() == before


@pytest.mark.parametrize(
    ("body", "told"),
    [
        (b'{"doors": [{"name": "x"}]}', "Field required"),
        (b"no json", "Invalid JSON"),
        (
            b'{"doors": [{"name": "desk", "x": 1, "y": 1, "bearing": 0, "width": 1, "upper": 90, "sense": 1}]}',
            "is furniture already",
        ),
    ],
)
def test_what_cannot_be_saved_is_told(folder: Path, body: bytes, told: str) -> None:
    app = edit_app(subject_of(folder), NOWHERE)
    token = token_in(ask(app, "/")[1])
    status, text = ask(app, "/save", body, token=token)
    assert status == 400
    assert told in json.loads(text)["error"]
    assert not (folder / "doors.csv").exists()


class ConnectedError(Exception):
    """Ends the server."""


def test_the_address_accepts_connections_once_it_is_told(folder: Path) -> None:
    pytest.importorskip("uvicorn", reason="Uvicorn is not installed")

    def connect(address: str) -> None:
        port = int(address.strip("/").rpartition(":")[2])
        socket.create_connection(("127.0.0.1", port)).close()
        raise ConnectedError

    with pytest.raises(ConnectedError):
        serve(subject_of(folder), NOWHERE, 0, connect)
