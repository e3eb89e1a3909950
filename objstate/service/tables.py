"""What a service keeps in its world's database, beside the world."""

from __future__ import annotations

import time
from collections.abc import Callable

from sqlalchemy import (
    BigInteger,
    Column,
    Connection,
    Float,
    Insert,
    Integer,
    LargeBinary,
    MetaData,
    ScalarSelect,
    Table,
    Text,
    func,
    insert,
    inspect,
    select,
    text,
    update,
)

from objstate.errors import WorldError
from objstate.world.database import Database
from objstate.world.schema import DRIVES as WORLD_DRIVES

METADATA = MetaData()

TOKENS = Table(
    "service_token",
    METADATA,
    Column("id", Text, primary_key=True),  # what people name it by
    Column("digest", Text, nullable=False, unique=True),  # SHA-256; the token itself isn't kept
    Column("name", Text, nullable=False),
    Column("role", Text, nullable=False),
    Column("made_ns", BigInteger, nullable=False),
    Column("revoked_ns", BigInteger),
)
DRIVES = Table(
    "service_drive",
    METADATA,
    Column("id", Text, primary_key=True),  # of the log's content
    Column("number", Integer, nullable=False),  # in the order of arrival
    Column("digest", Text, nullable=False),  # SHA-256 of the log
    Column("size", BigInteger, nullable=False),  # bytes
    Column("file", Text, nullable=False),  # its name in the data folder
    Column("state", Text, nullable=False),
    Column("attempts", Integer, nullable=False, default=0),
    Column("reason", Text),  # why it failed
    Column("received_ns", BigInteger, nullable=False),
    Column("ended_ns", BigInteger),
    Column("summary", Text),  # JSON, of a drive that is done
    Column("deleted_by", Text),
    Column("robot", Text),  # that sent it while it drove
)
UPLOADS = Table(
    "service_upload",
    METADATA,
    Column("id", Text, primary_key=True),
    Column("token", Text, nullable=False),  # its id
    Column("size", BigInteger, nullable=False),  # bytes
    Column("digest", Text),  # SHA-256, if stated
    Column("begun_ns", BigInteger, nullable=False),
)
# What drives that go on have learnt, for the other processes of the service.
LIVE = Table(
    "service_live",
    METADATA,
    Column("object", Text, primary_key=True),
    Column("drive", Text, nullable=False),
    Column("stamp_ns", BigInteger, nullable=False),
    Column("last_observed_ns", BigInteger),
    Column("belief", LargeBinary, nullable=False),  # as the world's
)
# Logs found at watched places.
TAKEN = Table(
    "service_taken",
    METADATA,
    Column("address", Text, primary_key=True),
    Column("size", BigInteger, primary_key=True),
    Column("drive", Text),  # its id; none where it was set aside
    Column("reason", Text),  # why it was set aside
    Column("taken_ns", BigInteger, nullable=False),
)
EVENTS = Table(
    "service_event",
    METADATA,
    Column("id", Integer, primary_key=True),  # ascending
    Column("kind", Text, nullable=False),
    Column("stamp_ns", BigInteger, nullable=False),
    Column("data", Text, nullable=False),  # JSON
)
# One row: up to which of the world's drives events have told.
TOLD = Table("service_told", METADATA, Column("drive", Integer, nullable=False))
EVIDENCE = Table(
    "service_evidence",
    METADATA,
    Column("id", Text, primary_key=True),
    Column("object", Text, nullable=False),
    Column("stamp_ns", BigInteger, nullable=False),
    Column("source", Text, nullable=False),
    Column("lower", Float, nullable=False),  # the reported region
    Column("upper", Float, nullable=False),
    Column("reliability", Float, nullable=False),
    Column("token", Text, nullable=False),
)


# What was deleted, by whom.
DELETIONS = Table(
    "service_deletion",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("stamp_ns", BigInteger, nullable=False),
    Column("token", Text, nullable=False),  # its id
    Column("what", Text, nullable=False),  # drive or history
    Column("name", Text, nullable=False),  # of the drive or the object
    Column("beliefs", Integer, nullable=False),
)
# One row: where the drives lie.
FOLDER = Table(
    "service_folder",
    METADATA,
    Column("identity", Text, nullable=False),  # as a file in the folder has it
    Column("path", Text, nullable=False),  # on the machine that served last
)
# One row: the form of the tables.
FORM = Table("service_form", METADATA, Column("form", Integer, nullable=False))


def deletion(token: str, what: str, name: str, beliefs: int | ScalarSelect[int] = 0) -> Insert:
    """The statement that puts a deletion on record."""
    row = {"token": token, "what": what, "name": name, "beliefs": beliefs}
    return insert(DELETIONS).values(stamp_ns=time.time_ns(), **row)


def _first(connection: Connection, _: str | None) -> None:
    tables = [FORM, TOKENS, DRIVES, EVENTS, EVIDENCE, DELETIONS]
    METADATA.create_all(connection, tables)
    connection.execute(insert(FORM).values(form=0))


def _robots_and_uploads(connection: Connection, schema: str | None) -> None:
    METADATA.create_all(connection, [UPLOADS, TAKEN, LIVE])
    if "robot" not in {
        column["name"] for column in inspect(connection).get_columns(DRIVES.name, schema)
    }:
        connection.execute(text(f"ALTER TABLE {DRIVES.name} ADD COLUMN robot TEXT"))


def _told(connection: Connection, _: str | None) -> None:
    METADATA.create_all(connection, [TOLD])
    taught = connection.execute(select(func.max(WORLD_DRIVES.c.id))).scalar()
    connection.execute(insert(TOLD).values(drive=taught or 0))  # what was before isn't told


def _folder(connection: Connection, _: str | None) -> None:
    METADATA.create_all(connection, [FOLDER])


# in order; only ever appended
MIGRATIONS: tuple[Callable[[Connection, str | None], None], ...] = (
    _first,
    _robots_and_uploads,
    _told,
    _folder,
)


def make_tables(database: Database) -> None:
    """Make the tables, or bring older ones to the newest form. Raises WorldError."""
    with database.writing() as connection:
        there = inspect(connection).has_table(FORM.name, schema=database.location.schema)
        form = int(connection.execute(select(FORM.c.form)).scalar_one()) if there else 0
        if form > len(MIGRATIONS):
            raise WorldError(
                f"A newer objstate has served the world {database.location}; update objstate."
            )
        for step in MIGRATIONS[form:]:
            step(connection, database.location.schema)
        connection.execute(update(FORM).values(form=len(MIGRATIONS)))
