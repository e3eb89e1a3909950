"""A service of several processes: all answer alike, and one takes over when another dies."""

from __future__ import annotations

import json
import os
import signal
import sqlite3
import time
import urllib.error
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from tests.service.conftest import PATIENCE_S, Serve, Service
from tests.service.test_live import records_of, until


def workers_of(service: Service) -> list[int]:
    """The processes that answer."""
    told = Path(f"/proc/{service._process.pid}/task/{service._process.pid}/children").read_text()
    return [int(each) for each in told.split()]


def kill_leader(service: Service) -> None:
    for worker in workers_of(service):
        if (service.folder / "data").exists() and _leads(worker, service.folder / "data"):
            os.kill(worker, signal.SIGKILL)


def asked_often(service: Service, path: str) -> list[Any]:
    return [service.ask(path).json for _ in range(12)]


def test_all_processes_know_what_robots_learn_and_survive_the_leader(
    serve: Serve, hall: tuple[Path, Path]
) -> None:
    service = serve(None, "--workers", "3")
    records = records_of(hall[1])
    step = -(-len(records) // 8)
    for first in range(0, len(records), step):
        some = {"records": records[first : first + step]}
        sent = service.ask("/v1/robots/r1/records", some)
        assert sent.status == 202
        time.sleep(0.4)
    until(service, "/v1/objects/door", lambda told: told["last_observed_ns"] is not None)
    time.sleep(2.5)  # for the others to follow
    seen = {told["last_observed_ns"] for told in asked_often(service, "/v1/objects/door")}
    assert len(seen) == 1
    robots = {told["robots"][0]["drive"] for told in asked_often(service, "/v1/robots")}
    assert robots == {sent.json["drive"]}

    kill_leader(service)
    deadline = time.monotonic() + PATIENCE_S
    drives: list[dict[str, object]] = []
    while not drives and time.monotonic() < deadline:
        time.sleep(0.2)
        drives = service.ask("/v1/drives").json["drives"]
    (drive,) = drives
    assert drive["robot"] == "r1"
    assert service.until(str(drive["id"]), "done", "failed")["state"] == "done"


def test_no_answer_is_older_than_what_was_acknowledged(serve: Serve) -> None:
    service = serve(None, "--workers", "3")
    for number in range(6):
        learnt = reported(service, ("open", "closed")[number % 2])
        told = asked_often(service, "/v1/objects/door")
        assert {each["last_observed_ns"] for each in told} == {learnt}
    service.ask("/v1/objects/door/history", method="DELETE")
    assert {each["last_observed_ns"] for each in asked_often(service, "/v1/objects/door")} == {None}


def test_each_belief_is_told_once_whoever_was_taught_and_whoever_leads(serve: Serve) -> None:
    service = serve(None, "--workers", "3")
    before = [reported(service, state) for state in ("open", "closed") * 3]
    assert told_of(service) == before
    kill_leader(service)
    after = [reported(service, state) for state in ("open", "closed") * 3]
    time.sleep(2.5)  # in which each process looks, and another one leads
    assert told_of(service) == before + after


def reported(service: Service, state: str) -> int:
    """When the door was looked at last, after a report of its state."""
    report = {"source": "contact", "state": state, "reliability": 0.9}
    learnt: int = service.ask("/v1/objects/door/evidence", report).json["last_observed_ns"]
    return learnt


def told_of(service: Service) -> list[int]:
    """When the door was looked at, by all events of beliefs, in order."""
    query = "SELECT data FROM service_event WHERE kind = 'belief' ORDER BY id"
    with closing(sqlite3.connect(service.folder / "world.db")) as connection:
        return [json.loads(data)["last_observed_ns"] for (data,) in connection.execute(query)]


def test_workers_end_when_their_parent_is_killed(serve: Serve) -> None:
    service = serve(None, "--workers", "2")
    assert service.ask("/health").status == 200
    workers = workers_of(service)
    os.kill(service._process.pid, signal.SIGKILL)
    deadline = time.monotonic() + 10.0
    while any(_runs(worker) for worker in workers) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not any(_runs(worker) for worker in workers)
    with pytest.raises(urllib.error.URLError):
        service.ask("/health")


def _runs(process: int) -> bool:
    """Whether a process goes on; one that nobody waited for (Z) doesn't."""
    try:
        status = Path(f"/proc/{process}/stat").read_text()
    except FileNotFoundError:
        return False
    return status.rpartition(")")[2].split()[0] != "Z"


def _leads(process: int, data: Path) -> bool:
    """Whether a process has the lock."""
    files = Path(f"/proc/{process}/fd")
    found = (each for each in files.iterdir() if each.exists())
    return any(each.resolve() == (data / "leader.lock").resolve() for each in found)
