"""A world's drives lie in one folder, and a folder has those of one world."""

from pathlib import Path

import pytest
from sqlalchemy import insert

from objstate.errors import SettingsError
from objstate.service.folder import IDENTITY, claim
from objstate.service.options import data_folder
from objstate.service.tables import DRIVES, make_tables
from objstate.world.database import Database
from objstate.world.location import parse_location
from objstate.world.store import open_store
from tests.service.conftest import BUILDING


@pytest.fixture
def database(place: str, tmp_path: Path) -> Database:
    return opened(place, tmp_path)


def opened(place: str, folder: Path) -> Database:
    """The database of a world that is made where there is none."""
    from objstate import load_building

    urdf = folder / "hall.urdf"
    urdf.write_text(BUILDING)
    open_store(place, load_building(urdf))
    database = Database(parse_location(place))
    make_tables(database)
    return database


def take_a_drive(database: Database, folder: Path) -> None:
    """As a service does that receives a log."""
    row = {"id": "a", "number": 1, "digest": "a", "size": 1, "file": "a.mcap", "state": "waiting"}
    (folder / "logs").mkdir()
    with database.writing() as connection:
        connection.execute(insert(DRIVES).values(received_ns=1, **row))


def test_a_second_folder_is_refused_with_the_place_of_the_first(
    database: Database, tmp_path: Path
) -> None:
    claim(database, tmp_path / "a")
    take_a_drive(database, tmp_path / "a")
    claim(database, tmp_path / "a")
    with pytest.raises(SettingsError, match=f"lie in {tmp_path / 'a'}, not in {tmp_path / 'b'}"):
        claim(database, tmp_path / "b")
    (tmp_path / "a").rename(tmp_path / "c")
    claim(database, tmp_path / "c")  # it was moved


def test_a_folder_that_is_lost_may_be_replaced(database: Database, tmp_path: Path) -> None:
    claim(database, tmp_path / "a")
    take_a_drive(database, tmp_path / "a")
    claim(database, tmp_path / "b", is_new=True)
    claim(database, tmp_path / "b")
    with pytest.raises(SettingsError, match=str(tmp_path / "b")):
        claim(database, tmp_path / "a")


def test_the_folder_of_another_world_is_refused(database: Database, tmp_path: Path) -> None:
    claim(database, tmp_path / "a")
    other = opened(str(tmp_path / "other.db"), tmp_path)
    with pytest.raises(SettingsError, match=r"has the drives of the world .*; give another --data"):
        claim(other, tmp_path / "a")


def test_a_start_that_was_cut_off_is_taken_up(database: Database, tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    (tmp_path / "a" / IDENTITY).write_text(f"1234\n{database.location}\n")
    claim(database, tmp_path / "a")
    claim(database, tmp_path / "a")


def test_worlds_on_a_server_have_folders_of_their_own() -> None:
    server = "postgresql://robot@db.local/robots"
    folders = {data_folder(f"{server}?schema={name}") for name in ("office", "hotel")}
    assert folders == {Path("robots.office.data"), Path("robots.hotel.data")}
    assert data_folder("out/world.db") == Path("out/world.db.data")
