"""Transactions on either database: readers see one moment, writers come one by one."""

from __future__ import annotations

import sqlite3
import ssl
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from zlib import crc32

from sqlalchemy import Connection, Engine, create_engine, event, text
from sqlalchemy.exc import DBAPIError, NoSuchModuleError
from sqlalchemy.pool import NullPool

from objstate.errors import WorldError
from objstate.world.location import Location

WAIT_S = 30  # s to wait for another writer before an error
SWITCH_AGAIN_S = 0.01  # between attempts to switch a new file to write-ahead
LOCK_CLASS = crc32(b"objstate") >> 1  # of PostgreSQL's advisory locks: which program's it is
BUSY = ("database is locked", "lock timeout", "55P03")  # how either database says so
READ_ONLY = "readonly database"  # how SQLite says so
NO_DATABASE, DENIED = "3D000", "42501"  # how PostgreSQL says so
NO_WORLD = ("file is not a database", "malformed")


class Database:
    """A world's database. Nothing is opened before the first transaction."""

    def __init__(self, location: Location, wait_s: float = WAIT_S) -> None:
        self.location = location
        self._wait_s = wait_s
        try:
            self._engine = _sqlite(location, wait_s) if location.file else _postgresql(location)
        except (NoSuchModuleError, ImportError) as error:
            raise WorldError(f"The world {location} needs a driver: {error}.") from error

    @contextmanager
    def reading(self) -> Iterator[Connection]:
        """A transaction that sees one moment of the world, and hinders no writer. Raises WorldError."""
        with self._told(), self._engine.connect() as connection:
            if not self.location.file:
                connection.execution_options(
                    isolation_level="REPEATABLE READ", postgresql_readonly=True
                )
            with connection.begin():
                yield connection

    @contextmanager
    def writing(self) -> Iterator[Connection]:
        """An exclusive write transaction, which is committed whole or not at all.

        Raises WorldError where another writer doesn't finish.
        """
        with self._told(), self._engine.connect() as connection:
            connection.execution_options(objstate_writes=True)
            with connection.begin():
                if not self.location.file:
                    self._lock(connection)
                yield connection

    def write_ahead(self) -> None:
        """Let readers and a writer of a new file work side by side (WAL). Raises WorldError.

        SQLite waits for locks, but not for this one, which two processes may want at once.
        """
        if not self.location.file:
            return
        deadline = time.monotonic() + self._wait_s
        with self._told(), self._engine.connect() as connection:
            driver: Any = connection.connection.driver_connection
            while driver.execute("PRAGMA journal_mode").fetchone() != ("wal",):
                try:
                    driver.execute("PRAGMA journal_mode = WAL")
                except sqlite3.OperationalError as error:
                    if time.monotonic() > deadline:
                        raise self._in_words(str(error)) from error
                    time.sleep(SWITCH_AGAIN_S)

    def _lock(self, connection: Connection) -> None:
        """Wait for other writers of the same schema; the lock ends with the transaction."""
        lock = crc32((self.location.schema or "").encode()) >> 1
        wait = f"SET LOCAL lock_timeout = {int(1000 * self._wait_s)}"
        connection.execute(text(wait))
        connection.execute(text(f"SELECT pg_advisory_xact_lock({LOCK_CLASS}, {lock})"))

    @contextmanager
    def _told(self) -> Iterator[None]:
        """Turn what a driver raises into words."""
        try:
            yield
        except DBAPIError as error:
            raise self._in_words(_reason(error.orig)) from error
        except OSError as error:  # pg8000 lets a broken connection through
            raise self._in_words(str(error)) from error

    def _in_words(self, reason: str) -> WorldError:
        if any(word in reason for word in BUSY):
            return WorldError(
                f"Another process has been writing the world {self.location} for more than "
                f"{self._wait_s:g} s; nothing was changed. Try again when it has finished."
            )
        if any(word in reason for word in NO_WORLD):
            return WorldError(f"{self.location} is no world: {reason}; give another path.")
        if READ_ONLY in reason:
            return WorldError(
                f"The world {self.location}, or its folder, is read-only, and SQLite writes beside "
                "it even to read it; copy it into a folder that can be written."
            )
        if DENIED in reason:
            return WorldError(
                f"The role of the world {self.location} may not write it ({reason}); grant it "
                "SELECT, INSERT, UPDATE and DELETE on its tables, or give another role."
            )
        if NO_DATABASE in reason:
            return WorldError(
                f"The server of the world {self.location} has no database "
                f"'{self.location.url.database}'; make it with createdb, or give another."
            )
        return WorldError(f"Can't use the world {self.location}: {reason}")


def _reason(error: BaseException | None) -> str:
    """What a driver says: of PostgreSQL's error fields the message and the code."""
    if error is not None and isinstance(error.__cause__, OSError):  # pg8000 hides why
        why = error.__cause__.strerror or error.__cause__
        return f"no server answers there ({why}); check host and port, and that it runs."
    told = error.args[0] if error is not None and error.args else None
    return f"{told['M']} ({told['C']})" if isinstance(told, dict) else str(error)


def _sqlite(location: Location, wait_s: float) -> Engine:
    engine = create_engine(location.url, poolclass=NullPool, connect_args={"timeout": wait_s})

    @event.listens_for(engine, "connect")
    def _prepare(connection: Any, record: object) -> None:
        connection.isolation_level = None  # transactions begin where SQLAlchemy says, not sqlite3
        connection.execute("PRAGMA foreign_keys = ON")

    @event.listens_for(engine, "begin")
    def _begin(connection: Connection) -> None:
        writes = connection.get_execution_options().get("objstate_writes")
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _postgresql(location: Location) -> Engine:
    schemas: dict[str | None, str | None] = {None: location.schema}
    return create_engine(
        location.url,
        poolclass=NullPool,
        connect_args={} if location.sslmode is None else {"ssl_context": _ssl_context(location)},
        execution_options={"schema_translate_map": schemas},
    )


def _ssl_context(location: Location) -> ssl.SSLContext | bool | None:
    """pg8000's word for an sslmode. Raises WorldError where the certificates can't be read."""
    if location.sslmode in ("allow", "prefer"):
        return None
    if location.sslmode in ("disable", "require"):
        return location.sslmode == "require"
    try:
        context = ssl.create_default_context(cafile=location.sslrootcert)
    except OSError as error:
        raise WorldError(
            f"Can't read the certificates of the world {location}: {error}; check sslrootcert."
        ) from error
    context.check_hostname = location.sslmode == "verify-full"
    return context
