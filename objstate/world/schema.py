"""The tables of a world, and how older ones are brought to the newest form."""

from __future__ import annotations

import operator
from collections.abc import Callable

from sqlalchemy import (
    BigInteger,
    Column,
    Connection,
    Dialect,
    ForeignKey,
    Integer,
    LargeBinary,
    MetaData,
    Table,
    Text,
    TypeDecorator,
    inspect,
    select,
    update,
)
from sqlalchemy.schema import CreateSchema

from objstate.errors import WorldError
from objstate.world.location import Location

METADATA = MetaData()


class Moment(TypeDecorator[int]):
    """Nanoseconds, of any integer type: SQLite keeps integers of NumPy as bytes, else."""

    impl = BigInteger
    cache_ok = True

    def process_bind_param(self, value: int | None, dialect: Dialect) -> int | None:
        return None if value is None else operator.index(value)


# One row: the building that the world is of, and the form of the tables.
WORLD = Table(
    "world",
    METADATA,
    Column("form", Integer, nullable=False),  # how many migrations have been made
    Column("building", Text, nullable=False),
    Column("building_digest", Text, nullable=False),
)
OBJECTS = Table(
    "world_object",
    METADATA,
    Column("name", Text, primary_key=True),
    Column("model", LargeBinary, nullable=False),  # codec.pack_object
)
DRIVES = Table(
    "drive",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("digest", Text, nullable=False, unique=True),  # what makes a log the same
    Column("begin_ns", Moment, nullable=False),
    Column("end_ns", Moment, nullable=False),
    Column("settings", Text, nullable=False),  # JSON
    Column("version", Text, nullable=False),  # of objstate
)
BELIEFS = Table(
    "belief",
    METADATA,
    Column("object", ForeignKey("world_object.name"), primary_key=True),
    Column("stamp_ns", Moment, primary_key=True),
    Column("drive", ForeignKey("drive.id"), primary_key=True),
    Column("last_observed_ns", Moment),
    Column("belief", LargeBinary, nullable=False),  # codec.pack_belief
)
# What a drive with a grid left of it, at its end.
FLOORS = Table(
    "drive_floor",
    METADATA,
    Column("drive", ForeignKey("drive.id"), primary_key=True),
    Column("stamp_ns", Moment, nullable=False),
    Column("forgotten_ns", Moment, nullable=False),  # from when on nothing of it is known
    Column("floor", LargeBinary, nullable=False),  # FloorMemory.pack
)
# What is known of each door's habits (habit_rows); it follows from the beliefs.
HABITS = Table(
    "habit",
    METADATA,
    Column("object", ForeignKey("world_object.name"), primary_key=True),
    Column("calendar", Text, nullable=False),  # by which they were learnt, JSON
    Column("site", LargeBinary, nullable=False),  # habit_rows.pack_site
)

# What drives told together of each door's hinge and closed bearing, beside the building's.
STATICS = Table(
    "door_static",
    METADATA,
    Column("object", ForeignKey("world_object.name"), primary_key=True),
    Column("drives", Integer, nullable=False),
    Column("evidence", LargeBinary, nullable=False),  # DoorEvidence.packed
)
# What a drive told of walls and lasers, of the latest drives.
SURVEYS = Table(
    "drive_survey",
    METADATA,
    Column("drive", ForeignKey("drive.id"), primary_key=True),
    Column("survey", LargeBinary, nullable=False),  # KeptSurvey.packed
)


def _first(connection: Connection) -> None:
    METADATA.create_all(connection, [WORLD, OBJECTS, DRIVES, BELIEFS])


def _second(connection: Connection) -> None:
    METADATA.create_all(connection, [FLOORS])


def _habits(connection: Connection) -> None:
    METADATA.create_all(connection, [HABITS])


def _statics(connection: Connection) -> None:
    METADATA.create_all(connection, [STATICS])


def _surveys(connection: Connection) -> None:
    METADATA.create_all(connection, [SURVEYS])


MIGRATIONS: tuple[Callable[[Connection], None], ...] = (
    _first,
    _second,
    _habits,
    _statics,
    _surveys,
)  # in order; only ever appended


def form_of(connection: Connection, location: Location) -> int:
    """The number of migrations of the tables; 0 where there are none.

    Raises WorldError for a newer world, and for a database of another program.
    """
    tables = inspect(connection).get_table_names(schema=location.schema)
    if WORLD.name not in tables:
        if location.file is not None and tables:
            raise WorldError(
                f"{location} is a database, but no world: it has the tables "
                f"{', '.join(sorted(tables))}; give another path."
            )
        return 0
    form = int(connection.execute(select(WORLD.c.form)).scalar_one())
    if form > len(MIGRATIONS):
        raise WorldError(
            f"The world {location} was written by a newer objstate (form {form}; this one knows "
            f"up to {len(MIGRATIONS)}); update objstate."
        )
    return form


def migrate(connection: Connection, form: int, location: Location) -> None:
    """Bring tables from a form to the newest, inside the caller's transaction."""
    if form == 0 and location.schema is not None:
        connection.execute(CreateSchema(location.schema, if_not_exists=True))
    for step in MIGRATIONS[form:]:
        step(connection)
    if form:
        connection.execute(update(WORLD).values(form=len(MIGRATIONS)))
