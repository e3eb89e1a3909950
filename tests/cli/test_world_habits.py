"""``objstate world habits | when``, as typed."""

import json
from pathlib import Path

from objstate.config import CalendarSettings, Settings
from objstate.world.store import open_store
from tests.cli.conftest import Run
from tests.world.examples import BUILDING
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


def test_the_season_of_the_last_look_is_told(tmp_path: Path, run: Run) -> None:
    words = {"timezone": "Europe/Berlin", "warm": {"from": "11-01", "to": "03-31"}}
    seasons = Settings(calendar=CalendarSettings.model_validate(words))
    store = taught(open_store(tmp_path / "world.db", BUILDING), range(2), seasons)
    told = json.loads(run("world", "habits", store.location, "--json").out)
    assert told["season"] == "warm"
    assert told["calendar"] == {**words, "holidays": []}
    assert "of the warm season, that of the last look" in run("world", "habits", store.location).out
    assert json.loads(run("world", "export", store.location).out)["season"] == "warm"
