"""A service that is killed under load, again and again, and what it still knows in the end."""

from __future__ import annotations

import os
import random
import signal
import threading
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

from service_setup import ROOT, Running, short_drive, start
from sqlalchemy import select

from objstate.client import Client, Drive
from objstate.errors import OutageError
from objstate.service.tables import EVENTS
from objstate.service.tokens import Role, Tokens
from objstate.world.database import Database
from objstate.world.location import parse_location

DRIVE_S = 1.0  # of the sample log
PAUSE_S = 4.0  # between two kills, in the mean
OF_WORKER = 0.3  # share of kills that hit the process that reads a log
BETWEEN_S = 0.3  # two reports


@dataclass
class Acknowledged:
    """What the service has said it has."""

    drives: set[str] = field(default_factory=set)
    evidence: set[int] = field(default_factory=set)  # by stamp
    tokens: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Outcome:
    """What was killed, what was acknowledged, and what of it was lost."""

    kills: int
    of_workers: int
    drives: int
    evidence: int
    tokens: int
    lost_drives: int
    unfinished_drives: int
    lost_evidence: int
    lost_tokens: int
    events: int
    gaps: int  # events that a listener, resumed after each kill, didn't hear, or heard twice


def killed_under_load(folder: Path, kills: int) -> Outcome:
    """Send drives, evidence and make tokens while the service is killed so many times."""
    urdf, rng = ROOT / "models/corridor/corridor.urdf", random.Random(0)
    service = start(urdf, folder)
    told, heard, ended = Acknowledged(), list[int](), threading.Event()
    threads = [
        threading.Thread(target=each, daemon=True)
        for each in (
            lambda: _send_drives(service, folder, told, ended),
            lambda: _report(service, told, ended),
            lambda: _listen(service, heard),
        )
    ]
    for thread in threads:
        thread.start()
    of_workers = 0
    for _ in range(kills):
        time.sleep(rng.expovariate(1.0 / PAUSE_S))
        workers = _children(service.process.pid)
        if workers and rng.random() < OF_WORKER:
            with suppress(ProcessLookupError):
                os.kill(rng.choice(workers), signal.SIGKILL)
            of_workers += 1
            continue
        told.tokens.append(_tokens(folder).make("planner", Role.READ)[1])
        service.kill()
        service.process = start(urdf, folder, service.port).process
    ended.set()
    for thread in threads[:2]:
        thread.join(60.0)
    with Client(service.url, service.token) as client:
        drives = [client.wait(each, 600.0) for each in told.drives if _is_known(client, each)]
        kept = {each.stamp_ns for each in client.history("door_07", 100_000).history}
    time.sleep(5.0)
    lost_tokens = sum(_tokens(folder).of(secret) is None for secret in told.tokens)
    with Database(parse_location(folder / "world.db")).reading() as connection:
        events = list(connection.execute(select(EVENTS.c.id).order_by(EVENTS.c.id)).scalars())
    missing = len(set(events) - set(heard)) + len(heard) - len(set(heard))
    service.kill()
    return Outcome(
        kills - of_workers,
        of_workers,
        len(told.drives),
        len(told.evidence),
        len(told.tokens),
        len(told.drives) - len(drives),
        sum(drive.state != "done" for drive in drives),
        len(told.evidence - kept),
        lost_tokens,
        len(events),
        missing,
    )


def _send_drives(
    service: Running, folder: Path, told: Acknowledged, ended: threading.Event
) -> None:
    number = 0
    while not ended.wait(PAUSE_S):
        number += 1
        log = folder / "drive.mcap"
        short_drive(ROOT / "logs/corridor.mcap", log, DRIVE_S, number)
        with suppress(OutageError), Client(service.url, service.token) as client:
            sent: Drive = client.send(log)
            told.drives.add(sent.id)


def _report(service: Running, told: Acknowledged, ended: threading.Event) -> None:
    with Client(service.url, service.token) as client:
        while not ended.wait(BETWEEN_S):
            stamp_ns = time.time_ns()
            with suppress(OutageError):
                client.report("door_07", "contact sensor", "open", reliability=0.6, at=stamp_ns)
                told.evidence.add(stamp_ns)


def _listen(service: Running, heard: list[int]) -> None:
    for event in Client(service.url, service.token).stream("0"):
        heard.append(int(event.id))


def _is_known(client: Client, identity: str) -> bool:
    return identity in {drive.id for drive in client.drives()}


def _tokens(folder: Path) -> Tokens:
    return Tokens(Database(parse_location(folder / "world.db")))


def _children(pid: int) -> list[int]:
    listed = Path(f"/proc/{pid}/task/{pid}/children")
    found = [
        int(child)
        for task in listed.parent.parent.iterdir()
        for child in (task / "children").read_text().split()
    ]
    return sorted(found)
