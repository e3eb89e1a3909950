"""Worlds in both kinds of database; PostgreSQL where one can be reached."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import create_engine, text
from sqlalchemy.exc import DBAPIError

from objstate.world.database import Database
from objstate.world.location import parse_location

VARIABLE = "OBJSTATE_TEST_DATABASE_URL"


@pytest.fixture(params=["sqlite", "postgresql"])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    """Where a new world may be made: a path, or a URL with a schema that nobody else has."""
    if request.param == "sqlite":
        yield str(tmp_path / "world.db")
        return
    schema = f"objstate_test_{secrets.token_hex(6)}"
    url = f"{reachable_server()}?schema={schema}"
    yield url
    # The server may still be at what a killed writer told it last: that comes first.
    with Database(parse_location(url), wait_s=5).writing() as connection:
        connection.execute(text(f'DROP SCHEMA IF EXISTS "{schema}" CASCADE'))


def reachable_server() -> str:
    """The PostgreSQL of the environment; skips the test where there is none."""
    url = os.environ.get(VARIABLE)
    if url is None:
        pytest.skip(f"{VARIABLE} names no PostgreSQL to test with")
    try:
        with create_engine(parse_location(url).url).connect():
            return url
    except (DBAPIError, OSError) as error:
        pytest.skip(f"no PostgreSQL answers at {VARIABLE}: {error}")
