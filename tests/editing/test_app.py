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
from objstate.building.written import list_files
from objstate.editing.app import edit_app, serve
from objstate.editing.rows import Edits
from objstate.editing.saving import save
from objstate.editing.subject import subject_of

pytest.importorskip("starlette", reason="Starlette is not installed (pip install 'objstate[edit]')")

NOWHERE = np.zeros((0, 2))


def ask(
    app: Any,
    path: str,
    body: bytes | None = None,
    host: str = "127.0.0.1:9",
    token: str = "",
    revision: str = "",
) -> tuple[int, str]:
    """The status and the text of an answer."""
    sent: list[dict[str, Any]] = []

    async def receive() -> dict[str, Any]:
        return {"type": "http.request", "body": body or b"", "more_body": False}

    async def send(message: dict[str, Any]) -> None:
        sent.append(message)

    headers = [
        (b"host", host.encode()),
        (b"x-objstate-token", token.encode()),
        (b"x-objstate-revision", revision.encode()),
    ]
    scope = {
        "type": "http", "method": "GET" if body is None else "POST", "path": path, "headers": headers,
        "query_string": b"", "http_version": "1.1", "scheme": "http", "root_path": "",
        "server": ("127.0.0.1", 9), "client": ("127.0.0.1", 1),
    }  # fmt: skip
    asyncio.run(app(scope, receive, send))
    text = b"".join(message.get("body", b"") for message in sent[1:])
    return sent[0]["status"], text.decode()


def data_in(page: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', page)
    assert found
    data: dict[str, Any] = json.loads(found[1])
    return data


def loaded(app: Any) -> dict[str, Any]:
    """The data of the page."""
    status, page = ask(app, "/")
    assert status == 200
    return data_in(page)


def send(app: Any, data: dict[str, Any], body: bytes | None = None) -> tuple[int, dict[str, Any]]:
    """What the server answers to a page that saves its doors, or something else."""
    content = json.dumps({"doors": data["doors"]}).encode() if body is None else body
    status, text = ask(app, "/save", content, token=data["token"], revision=data["revision"])
    answer: dict[str, Any] = json.loads(text)
    return status, answer


def test_what_the_page_sends_is_saved(folder: Path) -> None:
    app = edit_app(subject_of(folder), NOWHERE)
    data = loaded(app)
    for x in (3.2, 3.3):
        data["doors"][0]["x"] = x
        status, answer = send(app, data)
        assert (status, answer["saved"]) == (200, str(folder / "room.urdf"))
        assert load_building(folder / "room.urdf")["left"].hinge == pytest.approx([x, 0])
        data["revision"] = answer["revision"]


def test_a_page_that_is_loaded_again_shows_what_was_saved(folder: Path) -> None:
    app = edit_app(subject_of(folder), NOWHERE)
    data = loaded(app)
    data["doors"][0] |= {"x": 3.2, "decision": "accepted"}
    send(app, data)
    again = loaded(app)
    assert again["doors"] == data["doors"]
    again["doors"][0]["y"] = 0.1
    assert send(app, again)[0] == 200
    assert load_building(folder / "room.urdf")["left"].hinge == pytest.approx([3.2, 0.1])


def test_a_page_that_shows_an_earlier_state_is_refused(folder: Path) -> None:
    app = edit_app(subject_of(folder), NOWHERE)
    first, second = loaded(app), loaded(app)
    first["doors"][0]["x"] = 3.2
    assert send(app, first)[0] == 200
    second["doors"][0]["x"] = 1.0
    status, answer = send(app, second)
    assert status == 409
    assert "reload" in answer["error"]
    assert load_building(folder / "room.urdf")["left"].hinge == pytest.approx([3.2, 0])


@pytest.mark.parametrize("out", [None, "out"])
def test_a_folder_that_another_process_changed_is_not_written(
    folder: Path, out: str | None
) -> None:
    target = None if out is None else folder.parent / out
    app = edit_app(subject_of(folder, target), NOWHERE)
    data = loaded(app)
    other = subject_of(folder, target)
    moved = other.rows[0].model_copy(update={"x": 2.2, "decision": "accepted"})
    save(other, Edits(doors=[moved]))
    data["doors"][0]["x"] = 3.2
    assert send(app, data)[0] == 409
    assert load_building(other.urdf)["left"].hinge == pytest.approx([2.2, 0])
    again = loaded(app)
    assert again["doors"][0]["x"] == 2.2
    assert send(app, again)[0] == 200


def test_a_folder_that_cannot_be_read_any_more_is_told(folder: Path) -> None:
    app = edit_app(subject_of(folder), NOWHERE)
    (folder / "decisions.json").write_text("no json")
    list_files(folder)
    status, text = ask(app, "/")
    assert status == 500
    assert "decisions.json can't be read" in text


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
    status, answer = send(app, loaded(app), body)
    assert status == 400
    assert told in answer["error"]
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
