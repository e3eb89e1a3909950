"""``objstate next`` and ``objstate reproduce`` as they are typed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.config import Dynamics, ObjectRule, Settings
from objstate.geometry import wrap
from objstate.grid import Layout
from objstate.objects import filter_for
from objstate.particles import Weights
from objstate.recording.grids import GRID_MAP, write_map
from objstate.world.floor import FloorMemory
from objstate.world.store import DriveEntry, open_store
from tests.cli.conftest import Run
from tests.cli.test_commands import ROOM

HOUR = 3600 * 10**9
RESTLESS = Settings(objects=(ObjectRule(match="*", dynamics=Dynamics(moves_per_hour=2.0)),))
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
    assert told["tasks"][0]["why"].startswith("before: pass office_door, clear with probability 0.")
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
    assert told["tasks"][0]["why"].startswith(f"before: pass {other}, clear with probability 0.")
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
            "can see 'office_door' from no place",
        ),
        (["--for", "pass gate"], "there is no such object; there are office_door"),
        (["--sensor", "front:zoom=3"], "is no sensor; give NAME:range=M"),
        (["--sensor", ":range=3"], "has no name"),
        (["--sensor", "front:range=-3"], "must be finite and above 0"),
        (["--sensor", "front:beams=1000000000"], "give from 1 to 100000"),
        (["--sensor", "front:view=500"], "a field of view of 500 degrees; give at most 360"),
        (["--head", "head:view=500"], "a field of view of 500 degrees; give at most 360"),
        (["--doing", "clean"], "--doing has no effect without --task"),
        (["--grid", "missing.yaml"], "--grid has no effect without --head"),
        (["--way", "1,0"], "--way has no effect without --head"),
        (["--position-std", "0.1"], "--position-std has no effect without --head"),
        (["--head", "head", "--stay"], "--stay has no effect with --head"),
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
    told = json.loads(done.out)
    assert (told["tasks"], told["next_worthwhile_in_s"]) == ([], None)
    said = run(*asked(place, "--config", tmp_path / "choice.yaml")).out
    assert "Nothing is worth a look: the largest gain is" in said
    assert "Within a day that stays so." in said


def seen(place: Path, folder: Path, angle: float) -> Path:
    """A world in which the door was just seen at an angle."""
    building = load_building(place / "room.urdf")
    store = open_store(folder / "seen.db", building)
    door = filter_for(building["office_door"], Settings()).prior(np.random.default_rng(0))
    weights = np.exp(-0.5 * ((door.states[:, 0] - angle) / 0.02) ** 2) + 1e-300
    at = replace(door.with_weights(Weights.of(weights)), stamp_ns=HOUR, last_observed_ns=HOUR)
    store.add(DriveEntry("a" * 64, 0, HOUR, RESTLESS), [at])
    return folder / "seen.db"


def test_a_width_decides_whether_a_robot_passes(place: Path, run: Run, tmp_path: Path) -> None:
    """Open by 0.6 rad, the door leaves more than 0.3 and less than 0.7 m."""
    given = ["--building", place / "room.urdf", "--at", "1,0,90deg", "--for", "pass office_door"]
    asked_of = ["next", "--world", seen(place, tmp_path, 0.6), *given]
    assert "a robot 0.30 m wide passes, probability 1.00" in run(*asked_of, "--width", "0.3").out
    assert "a robot 0.70 m wide doesn't pass" in run(*asked_of, "--width", "0.7").out


def test_a_door_that_was_just_seen_is_looked_at_when_that_is_worth_it_again(
    place: Path, run: Run, tmp_path: Path
) -> None:
    given = ["--building", place / "room.urdf", "--at", "1,0,90deg"]
    asked_of = ["next", "--world", seen(place, tmp_path, 0.0), *given]
    said = run(*asked_of, "--for", "pass office_door").out
    assert (
        "pass office_door: needs no look; a robot 0.50 m wide doesn't pass, probability 1.00"
        in said
    )
    assert "0.60 m wide" in run(*asked_of, "--for", "pass office_door", "--width", "0.6").out
    assert "The next look is worth it in about" in said
    assert "0 s ago" in said
    wait = json.loads(run(*asked_of, "--json").out)["next_worthwhile_in_s"]
    assert 60.0 <= wait <= 86400.0
    rate = RESTLESS.for_object("office_door", "door").dynamics.moves_per_hour
    for factor, is_idle in ((0.8, True), (1.2, False)):
        when = f"{3600 + factor * wait:.0f}"
        told = json.loads(run(*asked_of, "--when", when, "--json").out)
        assert (told["tasks"] == []) == is_idle
        assert told["actions"][0]["p_moved_since"] == pytest.approx(
            1.0 - np.exp(-rate * factor * wait / 3600.0), abs=1e-3
        )


def test_a_task_asks_for_what_it_allows_too_little_of(
    place: Path, run: Run, tmp_path: Path
) -> None:
    (tmp_path / "tasks.yaml").write_text(
        "tasks:\n  - {name: rest}\n  - {name: pass, objects: [{match: office_door, angle: 0.01}]}\n"
    )
    given = [
        "--building",
        place / "room.urdf",
        "--at",
        "1,0,90deg",
        "--task",
        tmp_path / "tasks.yaml",
    ]
    asked_of = ["next", "--world", seen(place, tmp_path, 0.0), *given]
    assert "'rest' asks for no look within 24 h" in run(*asked_of).out
    told = json.loads(run(*asked_of, "--doing", "pass", "--json").out)
    (due,) = told["due"]
    assert (due["object"], due["coordinate"], told["tasks"]) == ("office_door", "angle", [])
    later = f"{due['due_ns'] / 1e9 + 1.0:.0f}"
    (task,) = json.loads(run(*asked_of, "--doing", "pass", "--when", later, "--json").out)["tasks"]
    assert task["why"].startswith("variance of angle 0.01")
    assert (
        "There is no task 'sleep'; there are rest, pass" in run(*asked_of, "--doing", "sleep").err
    )


def test_a_world_of_another_building_is_refused(place: Path, run: Run, tmp_path: Path) -> None:
    (tmp_path / "other.urdf").write_text(ROOM.replace("office_door", "gate"))
    given = ["--world", place / "world.db", "--building", tmp_path / "other.urdf", "--at", "1,0,0"]
    done = run("next", *given)
    assert done.code != 0
    assert "walls, objects or limits differ" in done.err


def test_a_laser_at_the_back_looks_the_other_way(place: Path, run: Run) -> None:
    sensors = ["--sensor", "front:view=60", "--sensor", "rear:view=60,x=-0.2,yaw=180"]
    actions = json.loads(run(*asked(place, *sensors, "--json", "--top", 50)).out)["actions"]
    yaw = {each["sensor"]: each["pose"] for each in actions}
    assert yaw["front"][:2] == yaw["rear"][:2]
    assert abs(wrap(yaw["front"][2] - yaw["rear"][2])) == pytest.approx(np.pi)


def test_the_paper_is_repeated(run: Run) -> None:
    few = ("--runs", 2, "--alternative-runs", 0, "--step", 2.0, "--processes", 1)
    done = run("reproduce", "elfring2014", *few)
    assert done.code == 0, done.err
    assert "fixed path" in done.out
    assert "actions of the benchmark: 263" in done.out


def test_a_head_counts_what_a_drive_saw_after_its_last_look_at_an_object(
    place: Path, run: Run, tmp_path: Path
) -> None:
    layout = Layout.around(np.array([[-3.0, -3.0], [7.0, 5.0]]), 0.05)
    free, sure = np.zeros(layout.shape, np.uint8), np.full(layout.shape, 255, np.uint8)
    seen = FloorMemory(layout, HOUR, 1000.0, free, sure)
    building = load_building(place / "room.urdf")
    belief = filter_for(building["office_door"], Settings()).prior(np.random.default_rng(0))
    store = open_store(tmp_path / "world.db", building)
    store.add(DriveEntry("drive", 0, HOUR), [replace(belief, stamp_ns=HOUR - 10**9)], seen)
    head = ["--head", "head:view=60,range=5", "--json"]

    def most_of_the_floor(folder: Path) -> float:
        done = run(*asked(folder, "--building", place / "room.urdf", *head))
        return max(each["parts"].get("floor", 0.0) for each in json.loads(done.out)["gazes"])

    assert most_of_the_floor(tmp_path) < 0.1 * most_of_the_floor(place)


def test_a_head_is_told_where_to_turn(place: Path, run: Run, tmp_path: Path) -> None:
    head = "head:view=60,turn=120,range=5"
    done = run(*asked(place, "--head", head, "--json"))
    assert done.code == 0, done.err
    gazes = json.loads(done.out)["gazes"]
    assert [each["rate"] for each in gazes] == sorted((g["rate"] for g in gazes), reverse=True)
    assert all(abs(each["pan"]) <= 2.1 for each in gazes)
    assert "floor" in run(*asked(place, "--head", head)).out
    layout = Layout.around(np.array([[-3.0, -3.0], [7.0, 5.0]]), 0.05)
    values = np.zeros(layout.shape, np.float32)
    values[:, 140:] = 0.5  # all is known but what lies right of x = 4 m
    write_map(tmp_path, values, layout.resolution, layout.origin)
    done = run(*asked(place, "--head", head, "--grid", tmp_path / GRID_MAP, "--json"))
    floors = {each["heading"]: each["parts"]["floor"] for each in json.loads(done.out)["gazes"]}
    right = [
        bits for heading, bits in floors.items() if abs(heading) < 0.5
    ]  # the robot looks along y
    left = [bits for heading, bits in floors.items() if heading > 2.0]
    assert min(right) > 1.5 * max(left)
    back = run(*asked(place, "--head", head, "--way", "0.5,-3", "--json"))
    assert json.loads(back.out)["gazes"][0] != gazes[0]
    for way in ("3", "3,0;x,1", "3,0,1", "inf,0"):
        done = run(*asked(place, "--head", head, "--way", way))
        assert done.code == 1
        assert "is no way" in done.err
    write_map(
        tmp_path, values, layout.resolution, layout.origin + np.array([50.0, 0.0, 0.0]), "far"
    )
    done = run(*asked(place, "--head", head, "--grid", tmp_path / "far.yaml"))
    assert done.code == 1
    assert "not on the map" in done.err
    done = run(*asked(place, "--head", head, "--grid", tmp_path / "none.yaml"))
    assert done.code == 1
    assert "check the path" in done.err
    done = run(*asked(place, "--head", "head:veiw=60"))
    assert done.code == 1
    assert "is no head" in done.err
