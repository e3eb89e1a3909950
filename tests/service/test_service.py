"""The service as robots, planners and strangers meet it."""

from __future__ import annotations

import hashlib
import json
import re
import sqlite3
import time
import urllib.request
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path

import pytest

from objstate.cli import main
from tests.service.conftest import ROOT, Serve, Service


def test_a_drive_teaches_the_world_and_planners_ask(taught: Service) -> None:
    (drive,) = taught.ask("/v1/drives").json["drives"]
    assert drive["state"] == "done"
    assert drive["progress"] == 1.0
    assert drive["summary"]["objects"] == ["door"]
    door = taught.ask("/v1/objects/door").json
    assert door["last_observed_ns"] is not None
    assert taught.ask("/v1/objects").json["objects"][0]["object"] == "door"
    passage = taught.ask("/v1/objects/door/passage?width=0.6&length=0.9").json
    assert 0.0 <= passage["probability"] <= 1.0
    assert len(taught.ask("/v1/objects/door/history").json["history"]) > 0


def test_the_same_log_is_the_same_drive(taught: Service, hall: tuple[Path, Path]) -> None:
    content = hall[1].read_bytes()
    sent = taught.ask("/v1/drives", content)
    assert sent.status == 202
    assert sent.json["state"] == "done"
    assert sent.json["id"] == hashlib.sha256(content).hexdigest()[:16]
    assert len(taught.ask("/v1/drives").json["drives"]) == 1


def test_a_moment_before_the_drive_is_answered_with_the_prior(taught: Service) -> None:
    early = taught.ask("/v1/objects/door?at=1990-01-01T00:00:00Z").json
    assert early["last_observed_ns"] is None
    same = taught.ask(f"/v1/objects/door?at={early['at_ns']}").json
    assert same["state"] == early["state"]


def test_an_unchanged_answer_costs_nothing(taught: Service) -> None:
    for path in ("/v1/objects", "/v1/objects/door", "/v1/objects/door/passage?width=0.6"):
        tag = taught.ask(path).headers["ETag"]
        again = taught.ask(path, headers={"If-None-Match": tag})
        assert (again.status, again.content) == (304, b"")


@pytest.mark.parametrize(
    ("path", "body", "status"),
    [
        ("/v1/objects/nothing", None, 404),
        ("/v1/nothing", None, 404),
        ("/v1/drives/0123456789abcdef", None, 404),
        ("/v1/objects/door?at=yesterday", None, 422),
        ("/v1/objects/door?at=99999999999999999999", None, 422),
        ("/v1/objects/door?at=1600000115", None, 422),
        ("/v1/objects?at=-1", None, 422),
        ("/v1/next?pose=1,0,0&at=1600000115", None, 422),
        ("/v1/objects/door/passage?width=0.6&at=1600000115", None, 422),
        ("/v1/objects/door/passage?width=60", None, 422),
        ("/v1/doors?width=60", None, 422),
        ("/v1/objects/door/passage", None, 422),
        (
            "/v1/edges",
            {"edges": [{"edgeid": 70000, "path": [[0, 0], [1, 0]]}], "radius": 1, "detour_cost": 1},
            422,
        ),
        ("/v1/objects/door/passage?width=nan", None, 422),
        ("/v1/objects/door/passage?width=0.6&height=2", None, 422),
        ("/v1/blocked", {"path": [[0, 0], [1, 0]]}, 422),
        ("/v1/blocked", {"path": [[0, 0], [1, 0]], "radius": 0.3, "arrivals": [1]}, 422),
        ("/v1/blocked", {"path": [[0, 0], [1, 0]], "radius": 0.3, "arrivals": [2, 1]}, 422),
        ("/v1/objects/door/evidence", {"source": "x"}, 422),
        ("/v1/objects/door/evidence", {"source": "x", "state": "ajar"}, 422),
        ("/v1/objects/door/evidence", {"source": "x", "region": [2.0, 3.0]}, 422),
        (
            "/v1/objects/door/evidence",
            {"source": "x", "state": "open", "stamp_ns": time.time_ns() + 3600 * 10**9},
            422,
        ),
        (
            "/v1/objects/door/evidence",
            {"source": "x", "state": "open", "stamp_ns": 1600000115},
            422,
        ),
        ("/v1/drives", b"", 400),
    ],
)
def test_a_wrong_request_gets_a_problem_document(
    taught: Service, path: str, body: object, status: int
) -> None:
    answer = taught.ask(path, body, method="POST" if path == "/v1/drives" else None)
    assert answer.status == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert {"type", "title", "status", "detail", "cure"} <= set(answer.json)
    assert answer.json["status"] == status


def test_a_path_may_have_one_arrival_for_each_point(taught: Service) -> None:
    path = [[2.4, -1.0], [2.4, 1.2], [5.0, 1.2]]
    at_once = taught.ask("/v1/blocked", {"path": path, "radius": 0.3}).json
    now = time.time_ns()
    timed = {"path": path, "radius": 0.3, "arrivals": [now, now + 10**9, now + 2 * 10**9]}
    answer = taught.ask("/v1/blocked", timed).json
    assert [each["object"] for each in answer["blockers"]] == ["door"]
    assert answer["probability"] == pytest.approx(at_once["probability"], abs=0.05)


def test_edges_and_doors_speak_the_words_of_nav2_and_rmf(taught: Service) -> None:
    edges = [{"edgeid": 7, "path": [[2.4, -1.0], [2.4, 1.2]]}]
    told = taught.ask("/v1/edges", {"edges": edges, "radius": 0.3, "detour_cost": 10.0}).json
    assert [cost["edgeid"] for cost in told["adjust_edges"]] == [7]
    assert set(taught.ask("/v1/doors?width=0.6").json["doors"]) == {"door"}


def test_who_may_what(blank: Service, hall: tuple[Path, Path]) -> None:
    service, world = blank, str(blank.folder / "world.db")
    assert service.ask("/v1/objects", token="nonsense").status == 401
    secrets = {}
    for role in ("read", "teach"):
        secrets[role] = _tokens("make", role, "--role", role, "--world", world).strip()
    assert service.ask("/v1/objects", token=secrets["read"]).status == 200
    assert service.ask("/v1/drives", b"x", token=secrets["read"]).status == 403
    drive = service.ask("/v1/drives", hall[1].read_bytes(), token=secrets["teach"]).json["id"]
    path = f"/v1/drives/{drive}"
    service.until(drive, "done")
    assert service.ask(path, method="DELETE", token=secrets["teach"]).status == 403
    assert service.ask(path, method="DELETE").status == 204
    assert service.ask(path).status == 404
    listed = json.loads(_tokens("list", "--world", world, "--json"))
    assert [token["role"] for token in listed] == ["admin", "read", "teach"]
    assert not any(secret in json.dumps(listed) for secret in secrets.values())
    _tokens("revoke", listed[1]["id"], "--world", world)
    time.sleep(1.1)
    assert service.ask("/v1/objects", token=secrets["read"]).status == 401


def test_a_page_of_somebody_else_may_not_ask(taught: Service) -> None:
    assert taught.ask("/v1/objects", headers={"Origin": "https://else.example"}).status == 403
    assert taught.ask("/v1/objects", headers={"Origin": taught.address}).status == 200


def test_a_damaged_log_fails_with_its_reason_and_the_next_goes_on(
    blank: Service, hall: tuple[Path, Path]
) -> None:
    damaged = blank.ask("/v1/drives", b"\x89MCAP0\r\n" + bytes(100)).json["id"]
    good = blank.ask("/v1/drives", hall[1].read_bytes()).json["id"]
    assert blank.until(damaged, "failed")["reason"]
    assert blank.until(good, "done", "failed")["state"] == "done"


def test_a_drive_whose_result_is_not_reliable_fails_and_teaches_nothing(serve: Serve) -> None:
    service = serve()
    sent = service.ask("/v1/drives", (ROOT / "logs" / "corridor.mcap").read_bytes())
    drive = service.until(sent.json["id"], "done", "failed")
    assert drive["state"] == "failed"
    assert drive["reason"] == " ".join(drive["summary"]["failures"])
    assert "is it a log of this building" in drive["reason"]
    assert service.ask("/v1/objects/door/history").json["history"] == []


def test_no_acknowledged_drive_is_lost_by_a_kill(
    place: str, serve: Serve, hall: tuple[Path, Path]
) -> None:  # the place is asked for first, so that it goes last, when no service writes into it
    first = serve(place)
    drive = first.ask("/v1/drives", hall[1].read_bytes()).json["id"]
    token = first.token
    first.kill()
    second = serve(place)
    assert second.token == token
    assert second.until(drive, "done", "failed")["state"] == "done"
    assert second.ask("/v1/objects/door").json["last_observed_ns"] is not None


def test_a_stated_digest_and_the_largest_size_are_checked(
    serve: Serve, hall: tuple[Path, Path]
) -> None:
    service = serve(None, "--largest-log", "0.00001")
    assert service.ask("/v1/drives", hall[1].read_bytes()).status == 413
    wrong = service.ask("/v1/drives", b"x" * 100, headers={"X-SHA256": "0" * 64})
    assert wrong.status == 400
    assert not any((service.folder / "data" / "incoming").iterdir())


def test_evidence_changes_the_belief_and_the_stream_tells_it(serve: Serve) -> None:
    service = serve()
    before = service.ask("/v1/objects/door/passage?width=0.6")
    report = {"source": "contact sensor", "state": "closed", "reliability": 0.999}
    assert service.ask("/v1/objects/door/evidence", report).status == 201
    after = service.ask("/v1/objects/door/passage?width=0.6")
    assert after.json["probability"] < before.json["probability"]
    assert after.headers["ETag"] != before.headers["ETag"]
    told = _events(service, "0", 1)
    assert told[0]["event"] == "belief"
    assert json.loads(told[0]["data"])["object"] == "door"
    service.ask("/v1/objects/door/evidence", report | {"state": "open"})
    resumed = _events(service, told[0]["id"], 1)
    assert int(resumed[0]["id"]) == int(told[0]["id"]) + 1


def test_more_requests_than_allowed_are_asked_to_wait(serve: Serve) -> None:
    service = serve(None, "--rate", "2")
    answers = [service.ask("/v1/objects/door").status for _ in range(6)]
    assert answers[0] == 200
    assert 429 in answers


def test_guessing_tokens_is_slow(taught: Service) -> None:
    answers = {taught.ask("/v1/objects", token=f"guess {k}").status for k in range(20)}
    assert answers == {401, 429}
    assert taught.ask("/v1/objects").status == 200


def test_the_document_names_every_operation_and_health_needs_no_token(taught: Service) -> None:
    document = taught.ask("/openapi.json").json
    assert document["openapi"].startswith("3.1")
    told = {(m.upper(), p) for p, each in document["paths"].items() for m in each}
    assert ("GET", "/v1/objects/{name}/passage") in told
    assert ("POST", "/v1/drives") in told
    for path in ("/health", "/ready", "/metrics"):
        with urllib.request.urlopen(taught.address + path, timeout=10) as answer:
            assert answer.status == 200


def _tokens(*arguments: str) -> str:
    """What ``objstate serve token`` prints."""
    with redirect_stdout(StringIO()) as out:
        assert main(["serve", "token", *arguments]) == 0
    return out.getvalue()


def _events(service: Service, after: str, count: int) -> list[dict[str, str]]:
    """The next events of the stream after one."""
    headers = {"Authorization": f"Bearer {service.token}", "Last-Event-ID": after}
    request = urllib.request.Request(service.address + "/v1/stream", headers=headers)
    events: list[dict[str, str]] = []
    with urllib.request.urlopen(request, timeout=20) as answer:
        block: dict[str, str] = {}
        for line in answer:
            key, _, value = line.decode().rstrip("\n").partition(": ")
            if key in ("id", "event", "data"):
                block[key] = value
            elif not key and "data" in block:
                events.append(block)
                block = {}
                if len(events) == count:
                    return events
    return events


def test_what_to_look_at_next(taught: Service) -> None:
    told = taught.ask("/v1/next?pose=1.0,0,0deg&plan=pass%20door").json
    assert {action["object"] for action in told["actions"]} <= {"door"}
    assert all(action["gain"] >= 0.0 for action in told["actions"])
    assert told["width"] == 0.5
    assert taught.ask("/v1/next?pose=1.0,0,0deg&width=0.7").json["width"] == 0.7
    for wrong in (
        "",
        "?pose=1,0,0&width=-1",
        "?pose=here",
        "?pose=1,0,0&plan=pass%20nothing",
        "?pose=1,0,0&stay=perhaps",
    ):
        assert taught.ask(f"/v1/next{wrong}").status == 422


def test_an_admin_forgets_an_object_and_that_stays_on_record(serve: Serve, tmp_path: Path) -> None:
    service = serve()
    report = {"source": "contact sensor", "state": "closed", "stamp_ns": 10**18}
    service.ask("/v1/objects/door/evidence", report)
    world = str(tmp_path / "world.db")
    teacher = _tokens("make", "robot", "--role", "teach", "--world", world).strip()
    path = "/v1/objects/door/history"
    assert service.ask(path, method="DELETE", token=teacher).status == 403
    assert len(service.ask(path).json["history"]) == 1
    assert service.ask(path, method="DELETE").status == 204
    assert service.ask(path).json["history"] == []
    assert service.ask("/v1/objects/door").json["last_observed_ns"] is None
    with sqlite3.connect(world) as connection:
        rows = connection.execute("SELECT what, name, beliefs FROM service_deletion").fetchall()
    assert rows == [("history", "door", 1)]


def test_figures_for_prometheus(taught: Service) -> None:
    taught.ask("/v1/objects/door")
    text = taught.ask("/metrics").content.decode()
    route = 'method="GET",route="/v1/objects/{name}"'
    assert re.search(rf'objstate_requests_total{{{re.escape(route)},status="200"}} \d+', text)
    assert "objstate_drives_done 1.0" in text
    assert re.search(r"objstate_scans_total [1-9]", text)
