"""Where a world is kept: in a file, or in a PostgreSQL database."""

from __future__ import annotations

import getpass
from dataclasses import dataclass
from pathlib import Path

from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError

from objstate.errors import WorldError

FORMS = "a file, or postgresql://USER:PASSWORD@HOST/DATABASE?schema=NAME"
PG8000 = "postgresql+pg8000"
DRIVERS = {"postgresql": PG8000, "postgres": PG8000}  # if none is named
SCHEMA = "schema"  # the parameter of a URL that no driver knows
OF_LOCATION = (SCHEMA, "sslmode", "sslrootcert")  # those that pg8000 doesn't know
OF_PG8000 = ("application_name", "unix_sock")  # and those that it does
VERIFYING = ("verify-ca", "verify-full")
SSL_MODES = ("disable", "allow", "prefer", "require", *VERIFYING)  # as of libpq


@dataclass(frozen=True)
class Location:
    """A world's place, understood. As text it is what people write, without the password."""

    url: URL
    schema: str | None = None  # of PostgreSQL: several worlds may share a database
    sslmode: str | None = None  # for pg8000, of ``SSL_MODES``; by default prefer, as of libpq
    sslrootcert: str | None = None  # for pg8000: a file of certificates to verify the server by

    @property
    def file(self) -> Path | None:
        """The file of a world that is one."""
        return Path(str(self.url.database)) if self.url.get_backend_name() == "sqlite" else None

    def __str__(self) -> str:
        if self.file is not None:
            return str(self.file)
        query = {name: value for name in OF_LOCATION if (value := getattr(self, name)) is not None}
        shown = self.url.set(drivername="postgresql").update_query_dict(query)
        return shown.render_as_string(hide_password=True)


def parse_location(text: str | Path) -> Location:
    """The place that a path or a URL names.

    Raises WorldError for a text that is neither, TypeError for what is no text.
    """
    if not isinstance(text, str | Path):
        raise TypeError(
            f"A {type(text).__name__} names no place of a world; give the path of a file, or a URL."
        )
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
    return _of_pg8000(url) if url.drivername == PG8000 else _of_another_driver(url)


def _of_pg8000(url: URL) -> Location:
    """The place that a URL for pg8000 names. Raises WorldError."""
    known = (*OF_LOCATION, *OF_PG8000)
    for name in url.query:
        if name not in known:
            raise WorldError(
                f"The world's URL has the unknown parameter '{name}'; known are {', '.join(known)}."
            )
    told = {name: _value(url, name) for name in url.query}
    _check_tls(told.get("sslmode"), told.get("sslrootcert"))
    if url.username is None:
        url = url.set(username=_user(url))
    return Location(url.difference_update_query(OF_LOCATION), *map(told.get, OF_LOCATION))


def _check_tls(mode: str | None, certificates: str | None) -> None:
    """Raises WorldError for an unknown sslmode, and for certificates that nothing is verified by."""
    if mode is not None and mode not in SSL_MODES:
        raise WorldError(
            f"The world's URL has the unknown sslmode '{mode}'; give one of {', '.join(SSL_MODES)}."
        )
    if certificates is not None and mode not in VERIFYING:
        raise WorldError(
            "The world's URL has an sslrootcert, by which the server is verified only with "
            f"sslmode={' or '.join(VERIFYING)}; add one of them, or leave sslrootcert out."
        )


def _of_another_driver(url: URL) -> Location:
    """The place that a URL names for a driver that understands all but the schema."""
    return Location(url.difference_update_query([SCHEMA]), _value(url, SCHEMA))


def _value(url: URL, name: str) -> str | None:
    """A parameter of a URL. Raises WorldError where it is given twice."""
    value = url.query.get(name)
    if isinstance(value, tuple):
        raise WorldError(f"The world's URL names more than one {name}; give one.")
    return value


def _user(url: URL) -> str:
    """The user of the operating system, the default as of libpq. Raises WorldError."""
    try:
        return getpass.getuser()
    except (KeyError, OSError) as error:  # the user has no name here, as in some containers
        raise WorldError(
            f"The world '{url.render_as_string(hide_password=True)}' names no user; give {FORMS}."
        ) from error
