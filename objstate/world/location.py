"""Where a world is kept: in a file, or in a PostgreSQL database."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from objstate.errors import WorldError

FORMS = "a file, or postgresql://USER:PASSWORD@HOST/DATABASE?schema=NAME"
DRIVERS = {"postgresql": "postgresql+pg8000", "postgres": "postgresql+pg8000"}  # if none is named


@dataclass(frozen=True)
class Location:
    """A world's place, understood. As text it is what people write, without the password."""

    url: URL
    schema: str | None = None  # of PostgreSQL: several worlds may share a database

    @property
    def file(self) -> Path | None:
        """The file of a world that is one."""
        return Path(str(self.url.database)) if self.url.get_backend_name() == "sqlite" else None

    def __str__(self) -> str:
        if self.file is not None:
            return str(self.file)
        query = {} if self.schema is None else {"schema": self.schema}
        shown = self.url.set(drivername="postgresql").update_query_dict(query)
        return shown.render_as_string(hide_password=True)


def parse_location(text: str | Path) -> Location:
    """The place that a path or a URL names. Raises WorldError for what is neither."""
    if "://" not in str(text):
        return Location(URL.create("sqlite", database=str(text)))
    try:
        url = make_url(str(text))
    except (ArgumentError, ValueError) as error:
        raise WorldError(
            f"The world '{text}' is no URL that can be understood; give {FORMS}."
        ) from error
    url = url.set(drivername=DRIVERS.get(url.drivername, url.drivername))
    if url.get_backend_name() != "postgresql" or not url.database:
        raise WorldError(
            f"The world '{url.render_as_string(hide_password=True)}' is in no database that "
            f"objstate knows; give {FORMS}."
        )
    schema = url.query.get("schema")
    if isinstance(schema, tuple):
        raise WorldError("The world's URL names more than one schema; give one.")
    return Location(url.difference_update_query(["schema"]), schema)
