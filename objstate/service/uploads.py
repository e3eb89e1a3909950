"""Uploads in chunks, which go on where a broken connection left them."""

from __future__ import annotations

import asyncio
import os
import secrets
import time
from collections.abc import AsyncIterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, Field
from sqlalchemy import delete, insert, select

from objstate.outputs import make_folder, remove_file
from objstate.service.drives import TOO_LARGE, Drive, Drives
from objstate.service.problems import Problem
from objstate.service.tables import UPLOADS
from objstate.world.database import Database

KEPT_NS = 7 * 24 * 3600 * 10**9  # ns, after which an upload that wasn't finished is removed
MOST_UPLOADS = 100  # of one token, unfinished


class UploadPlan(BaseModel):
    """A log that is about to be sent."""

    model_config = ConfigDict(extra="forbid")

    size: int = Field(gt=0, description="bytes of the whole log")
    sha256: str | None = Field(None, pattern="^[0-9a-fA-F]{64}$", description="of the whole log")


@dataclass(frozen=True)
class Upload:
    """A log of which a part has come."""

    id: str
    size: int
    digest: str | None
    offset: int  # bytes that are on disk

    def words(self) -> dict[str, Any]:
        """The upload as JSON has it."""
        return {"id": self.id, "size": self.size, "offset": self.offset}


class Uploads:
    """The unfinished uploads; each belongs to the token that began it."""

    def __init__(self, database: Database, folder: Path, drives: Drives) -> None:
        self._database, self._folder, self._drives = database, folder, drives
        self._busy: set[str] = set()
        make_folder(folder)
        self._sweep()

    def begin(self, plan: UploadPlan, token: str, largest: int) -> Upload:
        """Begin an upload. Raises Problem."""
        if plan.size > largest:
            raise Problem(413, f"The log has more than {largest} bytes.", TOO_LARGE)
        identity, c = secrets.token_hex(8), UPLOADS.c
        row = {"id": identity, "token": token, "size": plan.size, "digest": plan.sha256}
        with self._database.writing() as connection:
            own = connection.execute(select(c.id).where(c.token == token)).all()
            if len(own) >= MOST_UPLOADS:
                detail = f"{MOST_UPLOADS} uploads of this token are unfinished."
                raise Problem(429, detail, "Finish them, or delete some.")
            connection.execute(insert(UPLOADS).values(begun_ns=time.time_ns(), **row))
        self._path(identity).touch()
        return Upload(identity, plan.size, plan.sha256, 0)

    def get(self, identity: str, token: str) -> Upload:
        """How far an upload is. Raises Problem for one that isn't this token's."""
        c = UPLOADS.c
        query = select(c.size, c.digest).where(c.id == identity, c.token == token)
        with self._database.reading() as connection:
            row = connection.execute(query).one_or_none()
        if row is None or not self._path(identity).is_file():
            raise Problem(404, f"There is no upload '{identity}'.", "Begin one: POST /v1/uploads.")
        return Upload(identity, row.size, row.digest, self._path(identity).stat().st_size)

    async def append(
        self, identity: str, token: str, offset: int, content: AsyncIterator[bytes]
    ) -> Upload:
        """Add a chunk, which begins at ``offset``; what came of a broken one stays. Raises Problem."""
        upload = await asyncio.to_thread(self.get, identity, token)
        if identity in self._busy or offset != upload.offset:
            detail = f"The upload goes on at {upload.offset}, not at {offset}."
            raise Problem(409, detail, "Ask GET /v1/uploads/{id} for its offset.")
        self._busy.add(identity)
        try:
            with self._path(identity).open("ab") as file:
                async for some in content:
                    offset += len(some)
                    if offset > upload.size:
                        detail = f"The upload has {upload.size} bytes, and this is more."
                        raise Problem(413, detail, "Begin a new one with its right size.")
                    file.write(some)
                file.flush()
                await asyncio.to_thread(os.fsync, file.fileno())
        finally:
            self._busy.discard(identity)
        return await asyncio.to_thread(self.get, identity, token)

    def finish(self, upload: Upload) -> Drive:
        """Queue a log that is whole. Raises Problem where it isn't what was announced."""
        try:
            return self._drives.adopt(self._path(upload.id), upload.digest)
        finally:
            self.delete(upload.id)

    def delete(self, identity: str) -> None:
        """Remove an upload and what came of it."""
        with self._database.writing() as connection:
            connection.execute(delete(UPLOADS).where(UPLOADS.c.id == identity))
        remove_file(self._path(identity))

    def _path(self, identity: str) -> Path:
        return self._folder / identity

    def _sweep(self) -> None:
        """Remove what nobody goes on with."""
        old = select(UPLOADS.c.id).where(UPLOADS.c.begun_ns < time.time_ns() - KEPT_NS)
        with self._database.reading() as connection:
            ids = connection.execute(old).scalars().all()
        for identity in ids:
            self.delete(identity)
