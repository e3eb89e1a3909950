"""Logs in chunks, and logs that are dropped at watched places."""

from __future__ import annotations

import hashlib
import shutil
import time
from pathlib import Path

from objstate.logs import open_messages
from objstate.recording.logs import open_log_writer
from tests.service.conftest import PATIENCE_S, Serve, Service


def begin(service: Service, content: bytes, digest: str | None = None) -> str:
    plan = {"size": len(content)} | ({} if digest is None else {"sha256": digest})
    begun = service.ask("/v1/uploads", plan)
    assert begun.status == 201
    return str(begun.json["id"])


def test_an_upload_goes_on_after_a_kill(serve: Serve, hall: tuple[Path, Path]) -> None:
    content = hall[1].read_bytes()
    service, third = serve(), len(content) // 3
    identity = begin(service, content, hashlib.sha256(content).hexdigest())
    path = f"/v1/uploads/{identity}"
    chunk = service.ask(path, content[:third], method="PATCH", headers={"Upload-Offset": "0"})
    assert chunk.json["offset"] == third
    service.kill()

    service = serve()
    assert service.ask(path).json == {"id": identity, "size": len(content), "offset": third}
    wrong = service.ask(path, content, method="PATCH", headers={"Upload-Offset": "0"})
    assert wrong.status == 409
    headers = {"Upload-Offset": str(third)}
    rest = service.ask(path, content[third:], method="PATCH", headers=headers)
    assert rest.status == 202
    assert service.until(rest.json["id"], "done", "failed")["state"] == "done"
    assert service.ask(path).status == 404


def test_an_upload_that_isnt_what_was_announced_is_refused(blank: Service) -> None:
    drives = len(blank.ask("/v1/drives").json["drives"])
    path = f"/v1/uploads/{begin(blank, b'abc', 'ab' * 32)}"
    wrong = blank.ask(path, b"abc", method="PATCH", headers={"Upload-Offset": "0"})
    assert (wrong.status, blank.ask(path).status) == (400, 404)
    path = f"/v1/uploads/{begin(blank, b'abc')}"
    assert blank.ask(path, b"abcd", method="PATCH", headers={"Upload-Offset": "0"}).status == 413
    assert blank.ask(path, b"abc", method="PATCH").status == 422
    assert blank.ask(path, method="DELETE").status == 204
    assert blank.ask("/v1/uploads", {"size": 10**15}).status == 413
    assert len(blank.ask("/v1/drives").json["drives"]) == drives


def test_logs_dropped_in_a_watched_folder_are_taken_once(
    serve: Serve, tmp_path: Path, hall: tuple[Path, Path]
) -> None:
    place = tmp_path / "dropped"
    place.mkdir()
    service = serve(None, "--watch", str(place))
    shutil.copyfile(hall[1], place / "one.mcap")
    (place / "two.mcap").write_bytes(b"nothing of a log")
    with open_log_writer(place / "three", "rosbag2") as bag:
        for message in open_messages(hall[1]):
            bag.write(message.topic, message.type, message.recorded_ns, message.cdr())
    deadline = time.monotonic() + PATIENCE_S
    drives = []
    while len(drives) < 2 and time.monotonic() < deadline:
        time.sleep(0.2)
        drives = service.ask("/v1/drives").json["drives"]
    for drive in drives:
        assert service.until(drive["id"], "done", "failed")["state"] == "done"
    time.sleep(6.0)  # another look
    told = service.ask("/v1/watched").json
    (aside,) = [each for each in told["taken"] if each["reason"]]
    assert aside["address"].endswith("two.mcap")
    assert [each["drive"] for each in told["taken"]].count(None) == 1
    assert len(service.ask("/v1/drives").json["drives"]) == 2
