"""``objstate next`` and ``objstate reproduce`` as they are typed."""

import json
from pathlib import Path

import pytest

from objstate.building import load_building
from objstate.world.store import open_store
from tests.cli.conftest import Run
from tests.cli.test_commands import ROOM

CORRIDOR = Path(__file__).parents[2] / "models/corridor/corridor.urdf"


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a building and a world in which nothing was seen yet."""
    folder = tmp_path_factory.mktemp("place")
    (folder / "room.urdf").write_text(ROOM)
    open_store(folder / "world.db", load_building(folder / "room.urdf"))
    return folder


def asked(place: Path, *more: object) -> list[object]:
    given = ["--world", place / "world.db", "--building", place / "room.urdf"]
    return ["next", *given, "--at", "1,0,90deg", *more]


def test_it_tells_where_to_look_and_why(place: Path, run: Run) -> None:
    done = run(*asked(place))
    assert done.code == 0, done.err
    assert "nats of office_door" in done.out
    assert "utility" in done.out


def test_plans_go_first(place: Path, run: Run) -> None:
    done = run(*asked(place, "--for", "pass office_door", "--json"))
    assert done.code == 0, done.err
    told = json.loads(done.out)
    assert told["tasks"][0]["why"] == "before: pass office_door"
    assert len(told["tasks"][0]["pose"]) == 3
    assert told["actions"][0]["utility"] >= told["actions"][-1]["utility"]


def test_a_plan_goes_ahead_of_what_is_more_useful(run: Run, tmp_path: Path) -> None:
    open_store(tmp_path / "world.db", load_building(CORRIDOR))
    given = ["--world", tmp_path / "world.db", "--building", CORRIDOR, "--at", "2,0,0", "--json"]
    best = json.loads(run("next", *given, "--top", 1).out)["actions"][0]["object"]
    other = "door_07" if best != "door_07" else "door_01"
    done = run("next", *given, "--top", 1, "--for", f"pass {other}")
    assert done.code == 0, done.err
    told = json.loads(done.out)
    assert [each["object"] for each in told["tasks"]] == [other, best]
    assert told["tasks"][0]["why"] == f"before: pass {other}"
    assert told["tasks"][0]["utility"] < told["tasks"][1]["utility"]
    assert told["actions"][0]["object"] == best


def test_sensors_are_told_apart(place: Path, run: Run) -> None:
    sensors = ["--sensor", "front:range=8,view=180", "--sensor", "back:range=1.5,beams=20"]
    done = run(*asked(place, *sensors, "--json", "--top", 50))
    assert {each["sensor"] for each in json.loads(done.out)["actions"]} == {"front", "back"}


def test_a_robot_that_stays_drives_nowhere(place: Path, run: Run) -> None:
    done = run(*asked(place, "--stay", "--json"))
    assert {each["distance"] for each in json.loads(done.out)["actions"]} <= {0.0}


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--for", "open office_door"], "is no plan; give one of pass, grab, go to, release"),
        (
            ["--for", "pass office_door", "--stay", "--sensor", "front:range=0.2"],
            "can look at 'office_door' from no place",
        ),
        (["--for", "pass gate"], "there is no such object; there are office_door"),
        (["--sensor", "front:zoom=3"], "is no sensor; give NAME:range=M"),
        (["--sensor", ":range=3"], "has no name"),
        (["--sensor", "front:range=-3"], "is no sensor"),
        (["--at", "90,0,0"], "away from the free floor"),
        (["--at", "1,0"], "--at '1,0' is not a pose"),
    ],
)
def test_what_is_wrong_is_said(place: Path, run: Run, more: list[str], said: str) -> None:
    done = run(*asked(place, *more))
    assert done.code != 0
    assert said in done.err


def test_settings_of_the_choice_come_from_a_file(place: Path, run: Run, tmp_path: Path) -> None:
    (tmp_path / "choice.yaml").write_text("choice: {gain_threshold: 1000}\n")
    done = run(*asked(place, "--config", tmp_path / "choice.yaml", "--json"))
    assert json.loads(done.out)["tasks"] == []


def test_the_paper_is_repeated(run: Run) -> None:
    done = run("reproduce", "elfring2014", "--runs", 2, "--alternative-runs", 0, "--processes", 2)
    assert done.code == 0, done.err
    assert "fixed path" in done.out
    assert "actions of the benchmark: 263" in done.out
