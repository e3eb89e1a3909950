"""``objstate world habits | when``, as typed."""

import json
from datetime import UTC, datetime
from pathlib import Path

from objstate.config import CalendarSettings, Settings
from objstate.world.store import DriveEntry, open_store
from tests.cli.conftest import Run
from tests.world.examples import BUILDING, HOUR, at_angle
from tests.world.test_habits import taught


def test_habits_and_times_are_told(tmp_path: Path, run: Run) -> None:
    store = taught(open_store(tmp_path / "world.db", BUILDING), range(7))
    done = run("world", "habits", store.location, "--door", "door", "--fit")
    assert done.code == 0, done.err
    assert "working" in done.out
    asked = ("world", "when", store.location, "door:60", "--from", "2026-01-12T07:00")
    done = run(*asked)
    assert done.code == 0, done.err
    assert "Set off at Mon" in done.out
    told = json.loads(run(*asked, "--json").out)
    assert told["doors"]["door"]["spans"]
    assert run("world", "when", store.location, "door:soon").code != 0
    assert "has no object" in run("world", "habits", store.location, "--door", "gate").err


def test_a_door_that_was_looked_at_once_is_told(tmp_path: Path, run: Run) -> None:
    place, never = tmp_path / "world.db", "nobody looked at it"
    store = open_store(place, BUILDING)
    assert never in run("world", "habits", place, "--object", "door").err
    store.add(DriveEntry("one", 0, HOUR), [at_angle(0.3, HOUR)])
    said = run("world", "habits", place, "--object", "door").err
    assert "it was looked at once; two looks are needed" in said
    assert never in run("world", "habits", place, "--object", "desk").err
    assert (
        "Looked at once, of the two looks that are needed: door."
        in run("world", "habits", place).out
    )
    assert json.loads(run("world", "habits", place, "--json").out)["looked_at_once"] == ["door"]


def test_seconds_on_the_way_that_are_none_are_refused(tmp_path: Path, run: Run) -> None:
    open_store(tmp_path / "world.db", BUILDING)
    for seconds in ("-5", "nan", "1e9"):
        done = run("world", "when", tmp_path / "world.db", f"door:{seconds}")
        assert done.code == 1
        assert "'door' can't be reached" in done.err


def test_times_are_read_and_shown_by_the_clock_of_the_settings(tmp_path: Path, run: Run) -> None:
    berlin = Settings(calendar=CalendarSettings(timezone="Europe/Berlin"))
    place = tmp_path / "world.db"
    stamp_ns = int(datetime(2026, 7, 1, 12, tzinfo=UTC).timestamp()) * 10**9
    entry = DriveEntry("one", stamp_ns, stamp_ns, berlin)
    open_store(place, BUILDING).add(entry, [at_angle(0.3, stamp_ns)])
    for command in (["show", place], ["at", place, "2026-07-01T14:00"], ["history", place, "door"]):
        told = run("world", *command).out
        assert "2026-07-01 14:00:00" in told
        assert "Europe/Berlin" in told
    at, off = (
        json.loads(run("world", "at", place, when, "--json").out)["stamp_ns"]
        for when in ("2026-07-01T14:00", "2026-07-01T12:00+00:00")
    )
    assert at == off == stamp_ns
    told = run("world", "when", place, "door", "--from", "2026-07-01T14:00", "--json").out
    assert json.loads(told)["begin_ns"] == stamp_ns


def test_the_season_of_the_last_look_is_told(tmp_path: Path, run: Run) -> None:
    words = {"timezone": "Europe/Berlin", "warm": {"from": "11-01", "to": "03-31"}}
    seasons = Settings(calendar=CalendarSettings.model_validate(words))
    store = taught(open_store(tmp_path / "world.db", BUILDING), range(2), seasons)
    told = json.loads(run("world", "habits", store.location, "--json").out)
    assert told["season"] == "warm"
    assert told["calendar"] == {**words, "holidays": []}
    assert "of the warm season, that of the last look" in run("world", "habits", store.location).out
    assert json.loads(run("world", "export", store.location).out)["season"] == "warm"
