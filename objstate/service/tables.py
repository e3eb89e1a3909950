"""What a service keeps in its world's database, beside the world."""

from __future__ import annotations

from sqlalchemy import BigInteger, Column, Float, Integer, MetaData, Table, Text

from objstate.world.database import Database

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
)
EVENTS = Table(
    "service_event",
    METADATA,
    Column("id", Integer, primary_key=True),  # ascending
    Column("kind", Text, nullable=False),
    Column("stamp_ns", BigInteger, nullable=False),
    Column("data", Text, nullable=False),  # JSON
)
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


def make_tables(database: Database) -> None:
    """Make the tables that aren't there yet. Raises WorldError."""
    with database.writing() as connection:
        METADATA.create_all(connection)
