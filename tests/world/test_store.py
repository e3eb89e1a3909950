"""A world in a database: what was added comes back, whole or not at all, on both databases."""

import getpass
import secrets
import sqlite3
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from sqlalchemy import Executable, create_engine, text
from sqlalchemy.engine import make_url

from objstate.building.model import Building
from objstate.config import Dynamics, ObjectRule, Settings
from objstate.errors import QueryError, WorldError
from objstate.objects import ObjectBelief
from objstate.world import World
from objstate.world.database import Database
from objstate.world.location import parse_location
from objstate.world.store import DriveEntry, open_store
from tests.rooms import door, enclosure
from tests.world.conftest import reachable_server
from tests.world.examples import BUILDING, HOUR, OBJECTS, SECOND, at_angle, desk_at

MONDAY = DriveEntry("monday", 1 * HOUR, 2 * HOUR)
TUESDAY = DriveEntry("tuesday", 25 * HOUR, 26 * HOUR)
ON_MONDAY = (at_angle(0.2, 1 * HOUR), at_angle(0.3, 2 * HOUR), desk_at(3.2, 2 * HOUR))
ON_TUESDAY = (at_angle(1.2, 25 * HOUR), desk_at(2.5, 26 * HOUR))


def same(world: World, other: World, stamps: Iterator[int] | range) -> bool:
    return all(
        np.array_equal(a[name].weights.log, b[name].weights.log)
        and np.array_equal(a[name].states, b[name].states)
        for a, b in ((world.at(stamp), other.at(stamp)) for stamp in stamps)
        for name in OBJECTS
    )


def test_a_world_remembers_from_one_opening_to_the_next(place: str) -> None:
    assert open_store(place, BUILDING).add(MONDAY, ON_MONDAY)
    world = open_store(place).load()
    assert set(world.objects) == {"door", "desk"}
    assert [b.stamp_ns for b in world.history("door")] == [1 * HOUR, 2 * HOUR]
    assert world.at()["door"].mean[0] == pytest.approx(0.3, abs=0.01)
    assert world.at()["desk"].mean[0] == pytest.approx(3.2, abs=0.01)
    assert world.at()["desk"].last_observed_ns == 2 * HOUR
    again = open_store(place).load()
    assert same(world, again, range(0, 4 * HOUR, HOUR))


def test_the_same_drive_again_changes_nothing(place: str) -> None:
    store = open_store(place, BUILDING)
    assert store.add(MONDAY, ON_MONDAY)
    before = store.load()
    assert not store.add(replace(MONDAY, settings=Settings()), [at_angle(1.5, 2 * HOUR)])
    assert same(before, store.load(), range(0, 4 * HOUR, HOUR // 2))
    assert len(store.drives()) == 1


def test_drives_may_come_in_any_order(place: str, tmp_path: Path) -> None:
    forth, back = open_store(tmp_path / "forth.db", BUILDING), open_store(place, BUILDING)
    for store, drives in ((forth, (0, 1)), (back, (1, 0))):
        for k in drives:
            assert store.add((MONDAY, TUESDAY)[k], (ON_MONDAY, ON_TUESDAY)[k])
    worlds = (
        replace(store.load(), habits=None, pieces=None) for store in (forth, back)
    )  # which take turns
    assert same(*worlds, range(0, 30 * HOUR, HOUR))
    assert [drive.digest for drive in back.drives()] == ["monday", "tuesday"]
    assert back.load().at(25 * HOUR)["door"].mean[0] == pytest.approx(1.2, abs=0.01)


def test_moments_may_be_integers_of_any_type(place: str, tmp_path: Path) -> None:
    store, plain = open_store(place, BUILDING), open_store(tmp_path / "plain.db", BUILDING)
    at: Any = np.array([1, 2, 24, 25], dtype=np.int64) * HOUR
    began, ended, since, until = at
    seen = replace(at_angle(0.3, 0), stamp_ns=ended, last_observed_ns=ended)
    store.add(DriveEntry("monday", began, ended), [seen])
    plain.add(MONDAY, [at_angle(0.3, 2 * HOUR)])
    for each in (store, plain):
        each.add(TUESDAY, ON_TUESDAY)
    assert store.drives() == plain.drives()
    assert same(store.load(), plain.load(), range(0, 30 * HOUR, HOUR))
    part, same_part = (each.load(since_ns=since, until_ns=until) for each in (store, plain))
    assert same(part, same_part, range(24 * HOUR, 30 * HOUR, HOUR))


@pytest.mark.parametrize("stamp", [1.5, np.nan, "now", 10**30])
def test_a_moment_to_load_from_that_is_none_is_refused(place: str, stamp: Any) -> None:
    store = open_store(place, BUILDING)
    for part in ({"since_ns": stamp}, {"until_ns": stamp}):
        with pytest.raises(QueryError, match="stamps are in nanoseconds"):
            store.load(**part)


def test_a_part_of_the_history_answers_alike_where_it_reaches(place: str) -> None:
    store = open_store(place, BUILDING)
    store.add(MONDAY, ON_MONDAY)
    store.add(TUESDAY, ON_TUESDAY)
    whole, late = store.load(), store.load(since_ns=24 * HOUR)
    assert [len(late.history(name)) for name in ("door", "desk")] == [2, 2]
    assert same(whole, late, range(24 * HOUR, 30 * HOUR, HOUR))
    then = store.load(since_ns=25 * HOUR, until_ns=25 * HOUR)
    assert [b.stamp_ns for b in then.history("door")] == [25 * HOUR]
    assert [b.stamp_ns for b in then.history("desk")] == [2 * HOUR]
    before = store.load(since_ns=25 * HOUR, until_ns=25 * HOUR, without="tuesday")
    assert [b.stamp_ns for b in before.history("door")] == [2 * HOUR]


def test_a_moment_before_what_was_loaded_is_refused(place: str) -> None:
    store = open_store(place, BUILDING)
    store.add(MONDAY, ON_MONDAY)
    store.add(TUESDAY, ON_TUESDAY)
    part = store.load(since_ns=25 * HOUR)
    assert part.at(25 * HOUR)["door"].stamp_ns == 25 * HOUR
    for asked in (part, part.newest()):
        with pytest.raises(QueryError, match="load it with that as since_ns"):
            asked.at(2 * HOUR)
        with pytest.raises(QueryError, match="load it with that as since_ns"):
            asked.belief("door", 2 * HOUR)
    assert store.then(part, 2 * HOUR, ["door"]).at(2 * HOUR)["door"].stamp_ns == 2 * HOUR


def test_a_world_of_another_building_is_refused(place: str) -> None:
    open_store(place, BUILDING).add(MONDAY, ON_MONDAY)
    wider = Building("annexe", enclosure(12.0, 8.0), OBJECTS)
    stiffer = Building(
        "office", BUILDING.walls, OBJECTS | {"door": door("door", 0, 0, limits=(0, 1))}
    )
    for other in (wider, stiffer):
        with pytest.raises(WorldError, match="is of the building 'office'"):
            open_store(place, other)
    assert len(open_store(place, BUILDING).drives()) == 1


def test_the_dynamics_are_those_of_the_latest_drive(place: str) -> None:
    still = Settings(objects=(ObjectRule(match="*", dynamics=Dynamics(moves_per_hour=0)),))
    store = open_store(place, BUILDING)
    store.add(replace(TUESDAY, settings=still), ON_TUESDAY)
    store.add(MONDAY, ON_MONDAY)
    later = 38 * HOUR
    assert store.load().at(later)["door"].std[0] < 0.2
    assert store.load(Settings()).at(later)["door"].std[0] > 0.4


def test_a_drive_that_fails_half_way_leaves_nothing(place: str) -> None:
    def breaking() -> Iterator[ObjectBelief]:
        for second in range(250):
            yield at_angle(0.5, second * SECOND)
        raise RuntimeError("power cut")

    store = open_store(place, BUILDING)
    with pytest.raises(RuntimeError, match="power cut"):
        store.add(MONDAY, breaking())
    assert store.drives() == []
    assert store.load().latest_ns is None
    assert store.add(MONDAY, ON_MONDAY)


def test_readers_see_the_last_whole_world_while_a_writer_is_busy(place: str) -> None:
    store = open_store(place, BUILDING)
    store.add(MONDAY, ON_MONDAY)
    seen = []

    def watched() -> Iterator[Executable]:
        seen.append(open_store(place).load().latest_ns)  # all rows have been written
        yield from ()

    beliefs = [at_angle(0.5, 25 * HOUR + second * SECOND) for second in range(120)]
    store.add(TUESDAY, beliefs, also=watched())
    assert seen == [2 * HOUR]
    assert store.load().latest_ns == 25 * HOUR + 119 * SECOND


def test_a_writer_that_has_to_wait_too_long_is_told(place: str) -> None:
    store = open_store(place, BUILDING)
    with Database(parse_location(place)).writing():
        impatient = open_store(place, wait_s=0.1)
        with pytest.raises(WorldError, match="Another process has been writing"):
            impatient.add(MONDAY, ON_MONDAY)
    assert store.add(MONDAY, ON_MONDAY)


def test_a_role_that_may_only_read_a_world_is_told_before_it_learns() -> None:
    url, names = make_url(reachable_server()), [f"objstate_{secrets.token_hex(6)}" for _ in "ab"]
    schema, role = names
    place = url.update_query_dict({"schema": schema}).render_as_string(hide_password=False)
    reader = url.set(username=role, password=None).update_query_dict({"schema": schema})
    engine = create_engine(parse_location(str(url)).url, isolation_level="AUTOCOMMIT")
    with engine.connect() as server:
        try:
            open_store(place, BUILDING).check_writable()
            server.execute(text(f'CREATE ROLE "{role}" LOGIN'))
            server.execute(text(f'GRANT USAGE ON SCHEMA "{schema}" TO "{role}"'))
            server.execute(text(f'GRANT SELECT ON ALL TABLES IN SCHEMA "{schema}" TO "{role}"'))
            store = open_store(reader.render_as_string(), BUILDING)
            assert store.drives() == []
            with pytest.raises(WorldError, match=r"may not write it .*; grant it SELECT, INSERT"):
                store.check_writable()
        finally:
            server.execute(text(f'DROP SCHEMA IF EXISTS "{schema}" CASCADE'))
            server.execute(text(f'DROP ROLE IF EXISTS "{role}"'))


def test_a_damaged_belief_is_named(tmp_path: Path) -> None:
    place = tmp_path / "world.db"
    open_store(place, BUILDING).add(MONDAY, ON_MONDAY)
    with sqlite3.connect(place) as connection:
        connection.execute("UPDATE belief SET belief = x'00' WHERE object = 'door'")
    with pytest.raises(WorldError, match="belief of 'door' at 3600000000000 ns is damaged"):
        open_store(place).load()


def test_a_world_of_a_newer_objstate_is_refused(tmp_path: Path) -> None:
    place = tmp_path / "world.db"
    open_store(place, BUILDING)
    with sqlite3.connect(place) as connection:
        connection.execute("UPDATE world SET form = 99")
    with pytest.raises(WorldError, match="newer objstate"):
        open_store(place)


def test_what_is_no_world_is_refused_and_left_alone(tmp_path: Path) -> None:
    text, other = tmp_path / "notes.txt", tmp_path / "other.db"
    text.write_text("nothing of the kind, " * 100)
    with sqlite3.connect(other) as connection:
        connection.execute("CREATE TABLE contacts (name TEXT)")
    for place, reason in ((text, "no world"), (other, "has the tables contacts")):
        before = place.read_bytes()
        for building in (None, BUILDING):
            with pytest.raises(WorldError, match=reason):
                open_store(place, building)
        assert place.read_bytes() == before
    with pytest.raises(WorldError, match=r"no world at .*; make one with"):
        open_store(tmp_path / "missing.db")
    assert not (tmp_path / "missing.db").exists()


def test_the_parameters_of_a_url_are_those_of_libpq_or_refused() -> None:
    url = reachable_server()
    for more in ("sslmode=disable", "sslmode=prefer", "application_name=test"):
        with Database(parse_location(f"{url}?{more}")).reading():
            pass
    with (
        pytest.raises(WorldError, match="refuses SSL"),
        Database(parse_location(f"{url}?sslmode=require")).reading(),
    ):
        pass
    assert parse_location("postgresql:///root?schema=x").url.username == getpass.getuser()
    shown = "postgresql://me@h/db?schema=s&sslmode=verify-full&sslrootcert=ca.pem"
    assert str(parse_location(shown)) == shown
    for wrong, said in (
        ("sslmod=disable", "unknown parameter 'sslmod'; known are schema, sslmode"),
        ("sslmode=on", "unknown sslmode 'on'; give one of disable"),
        ("schema=a&schema=b", "more than one schema"),
        ("sslrootcert=ca.pem", "only with sslmode=verify-ca or verify-full; add"),
        ("sslmode=require&sslrootcert=ca.pem", "only with sslmode=verify-ca or verify-full; add"),
    ):
        with pytest.raises(WorldError, match=said):
            parse_location(f"{url}?{wrong}")
    with pytest.raises(WorldError, match="check sslrootcert"):
        Database(parse_location(f"{url}?sslmode=verify-full&sslrootcert=/missing.pem"))


def test_another_driver_gets_its_url_without_the_schema() -> None:
    place = parse_location(
        "postgresql+psycopg://me@h/db?schema=s&sslmode=require&connect_timeout=3"
    )
    assert place.url.query == {"sslmode": "require", "connect_timeout": "3"}
    assert (place.schema, place.sslmode) == ("s", None)
    assert str(place) == "postgresql://me@h/db?connect_timeout=3&schema=s&sslmode=require"


def test_an_unknown_database_is_told_in_words() -> None:
    url = make_url(reachable_server()).set(database="nothing_here")
    with pytest.raises(WorldError, match=r"no database 'nothing_here'; make it with createdb"):
        open_store(url.render_as_string(hide_password=False), BUILDING)


def test_a_place_that_cannot_be_reached_is_told_without_the_password() -> None:
    with pytest.raises(WorldError, match=r"no server answers there \(.+\); check host") as caught:
        open_store("postgresql://me:secret@127.0.0.1:9/nowhere", BUILDING)
    assert "secret" not in str(caught.value)
    for wrong in ("mysql://host/db", "postgresql://host", "http://host/world.db"):
        with pytest.raises(WorldError, match="give a file, or postgresql://"):
            open_store(wrong)


@pytest.mark.parametrize("given", [5, b"world.db"])
def test_what_names_no_place_is_refused_and_makes_no_file(
    given: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(TypeError, match="names no place of a world; give the path of a file"):
        open_store(given, BUILDING)
    assert list(tmp_path.iterdir()) == []


def test_a_building_that_is_not_loaded_is_refused(tmp_path: Path) -> None:
    path: Any = "office.urdf"
    with pytest.raises(TypeError, match=r"is no Building; give .*load_building"):
        open_store(tmp_path / "world.db", path)
