"""``objstate world habits | when``, as typed."""

import json
from pathlib import Path

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
