"""Drives that came in: stored, queued, and what became of them."""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
import secrets
import time
from collections.abc import AsyncIterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, func, insert, select, update

from objstate.outputs import flush_folder, make_folder, remove_file, remove_folder
from objstate.service.problems import Problem
from objstate.service.tables import DRIVES, deletion
from objstate.world.database import Database

WAITING, RUNNING, DONE, FAILED, DELETED = "waiting", "running", "done", "failed", "deleted"
AGAIN = (DELETED, FAILED)  # states in which a drive is queued anew when its log is sent again
IDENTITY = 16  # letters of a drive's digest that name it
MOST_ATTEMPTS = 3  # of a drive whose process dies
ABANDONED_S = 3600.0  # after which an upload that grew no more belongs to nobody
BLOCK = 2**20  # bytes of an upload that are written at once
SUFFIXES = {  # by the first bytes
    b"\x89MCAP0": ".mcap",
    b"#ROSBAG V": ".bag",
    b"SQLite format 3": ".db3",
    b"PK\x03\x04": ".zip",
    b"\x1f\x8b": ".log.gz",
}
COLUMNS = (
    "id",
    "state",
    "size",
    "attempts",
    "reason",
    "received_ns",
    "ended_ns",
    "summary",
    "robot",
)


@dataclass(frozen=True)
class Drive:
    """A drive and what became of it."""

    id: str
    state: str
    size: int  # bytes of its log
    attempts: int
    reason: str | None  # why it failed
    received_ns: int
    ended_ns: int | None
    summary: Mapping[str, Any] | None  # of one that has a result
    robot: str | None  # that sent it while it drove
    file: str

    def words(self, progress: float | None = None) -> dict[str, Any]:
        """The drive as JSON has it."""
        out = {name: getattr(self, name) for name in COLUMNS}
        return out | {"progress": {DONE: 1.0, RUNNING: progress or 0.0}.get(self.state, 0.0)}


class Drives:
    """The drives of a service, in its database and its data folder."""

    def __init__(self, database: Database, folder: Path) -> None:
        self._database, self._folder = database, folder
        for part in ("incoming", "logs", "results"):
            make_folder(folder / part)
        self._sweep()

    def log(self, drive: Drive) -> Path:
        """Where a drive's log lies."""
        return self._folder / "logs" / drive.file

    def result(self, drive: Drive) -> Path:
        """Where its result lies, or will."""
        return self._folder / "results" / drive.id

    async def receive(
        self, content: AsyncIterator[bytes], largest: int, digest: str | None
    ) -> Drive:
        """Store a log as it comes in, and queue it once: a log of the same content is the same drive.

        One that failed is queued anew, since the building or the settings may have changed.

        Raises Problem for a log that is empty, too large or not of the ``digest`` stated.
        """
        partial = self.place()
        hashed, size, head, block = hashlib.sha256(), 0, b"", bytearray()
        try:
            with partial.open("wb") as file:

                def keep(some: bytes) -> None:
                    hashed.update(some)
                    file.write(some)

                async for chunk in content:
                    size += len(chunk)
                    if size > largest:
                        raise Problem(413, f"The log has more than {largest} bytes.", TOO_LARGE)
                    head = head if len(head) >= 64 else head + chunk[:64]
                    block += chunk
                    if len(block) >= BLOCK:
                        await asyncio.to_thread(keep, bytes(block))
                        block.clear()
                keep(bytes(block))
                file.flush()
                await asyncio.to_thread(os.fsync, file.fileno())
            _check(size, hashed.hexdigest(), digest)
            return await asyncio.to_thread(
                self._queue, partial, hashed.hexdigest(), size, _suffix(head)
            )
        finally:
            partial.unlink(missing_ok=True)

    def adopt(self, file: Path, digest: str | None = None, robot: str | None = None) -> Drive:
        """Queue a log that lies in the data folder, which is moved. Raises Problem as ``receive``."""
        with file.open("rb") as reading:
            head = reading.read(64)
            reading.seek(0)
            found = hashlib.file_digest(reading, "sha256").hexdigest()
            os.fsync(reading.fileno())
        size = file.stat().st_size
        _check(size, found, digest)
        return self._queue(file, found, size, _suffix(head), robot)

    def place(self) -> Path:
        """A path in the data folder for a log that comes in."""
        return self._folder / "incoming" / secrets.token_hex(16)

    def _sweep(self) -> None:
        """Remove uploads that broke off when an earlier service was killed."""
        for partial in (self._folder / "incoming").iterdir():
            if time.time() - partial.stat().st_mtime > ABANDONED_S:
                partial.unlink(missing_ok=True)

    def _queue(
        self, partial: Path, digest: str, size: int, suffix: str, robot: str | None = None
    ) -> Drive:
        identity, file = digest[:IDENTITY], digest + suffix
        with self._database.writing() as connection:
            known = _one(connection, identity)
            if known is not None and known.state not in AGAIN:
                return known
            partial.replace(self._folder / "logs" / file)
            flush_folder(self._folder / "logs")
            fresh = {"state": WAITING, "attempts": 0, "reason": None, "received_ns": time.time_ns()}
            fresh |= {"ended_ns": None, "summary": None, "deleted_by": None, "robot": robot}
            number = 1 + (connection.execute(select(func.max(DRIVES.c.number))).scalar() or 0)
            if known is None:
                row = {"id": identity, "digest": digest, "size": size, "file": file}
                connection.execute(insert(DRIVES).values(number=number, **row, **fresh))
            else:
                change = update(DRIVES).where(DRIVES.c.id == identity)
                connection.execute(change.values(number=number, **fresh))
            made = _one(connection, identity)
        assert made is not None
        return made

    def get(self, identity: str) -> Drive:
        """A drive. Raises Problem for an unknown one."""
        with self._database.reading() as connection:
            found = _one(connection, identity)
        if found is None or found.state == DELETED:
            raise Problem(404, f"There is no drive '{identity}'.", "See GET /v1/drives.")
        return found

    def all(self) -> list[Drive]:
        """All drives, in the order in which they came."""
        c = DRIVES.c
        with self._database.reading() as connection:
            rows = connection.execute(
                select(c.id).where(c.state != DELETED).order_by(c.number)
            ).scalars()
            found = [_one(connection, identity) for identity in rows.all()]
        return [drive for drive in found if drive is not None]

    def next(self) -> Drive | None:
        """Take the first drive that waits; None where none does."""
        c = DRIVES.c
        with self._database.writing() as connection:
            query = select(c.id).where(c.state == WAITING).order_by(c.number).limit(1)
            identity = connection.execute(query).scalar()
            if identity is None:
                return None
            change = update(DRIVES).where(c.id == identity)
            connection.execute(change.values(state=RUNNING, attempts=c.attempts + 1))
            return _one(connection, identity)

    def put_back(self) -> None:
        """Let drives wait again that were running when the service ended; that attempt doesn't count."""
        c = DRIVES.c
        with self._database.writing() as connection:
            change = update(DRIVES).where(c.state == RUNNING)
            connection.execute(change.values(state=WAITING, attempts=c.attempts - 1))

    def again(self, drive: Drive, reason: str, *, counts: bool) -> None:
        """Let a drive wait again; an attempt counts where the log may be the cause."""
        c = DRIVES.c
        with self._database.writing() as connection:
            change = update(DRIVES).where(c.id == drive.id, c.state == RUNNING)
            attempts = c.attempts if counts else c.attempts - 1
            connection.execute(change.values(state=WAITING, attempts=attempts, reason=reason))

    def end(self, drive: Drive, state: str, **known: Any) -> None:
        """Say what became of a drive."""
        with self._database.writing() as connection:
            change = update(DRIVES).where(DRIVES.c.id == drive.id, DRIVES.c.state == RUNNING)
            connection.execute(change.values(state=state, ended_ns=time.time_ns(), **known))

    def delete(self, identity: str, token: str) -> Drive:
        """Forget a drive's log and result; on record stays who asked. Raises Problem."""
        drive = self.get(identity)
        if drive.state == RUNNING:
            raise Problem(409, f"The drive '{identity}' is being estimated.", "Ask again later.")
        with self._database.writing() as connection:
            change = update(DRIVES).where(DRIVES.c.id == identity)
            connection.execute(change.values(state=DELETED, deleted_by=token))
            connection.execute(deletion(token, "drive", identity))
        remove_file(self.log(drive))
        remove_folder(self.result(drive))
        return drive


TOO_LARGE = "Split it, or let the operator raise --largest-log."


def _check(size: int, found: str, digest: str | None) -> None:
    """Raises Problem for a log that is empty, or not of the digest stated."""
    if size == 0:
        raise Problem(400, "The log is empty.", "Send the log as the body.")
    if digest is not None and digest.lower() != found:
        raise Problem(400, f"The log's SHA-256 is {found}, not {digest}.", "Send it again.")


def _suffix(head: bytes) -> str:
    return next((end for magic, end in SUFFIXES.items() if head.startswith(magic)), ".log")


def _one(connection: Connection, identity: str) -> Drive | None:
    columns = [DRIVES.c[name] for name in (*COLUMNS, "file")]
    row = connection.execute(select(*columns).where(DRIVES.c.id == identity)).one_or_none()
    if row is None:
        return None
    told = row._mapping
    summary = None if told["summary"] is None else json.loads(told["summary"])
    return Drive(**{**told, "summary": summary})
