"""``objstate world`` and ``estimate --world`` as a user types them."""

import json
from pathlib import Path

import pytest

from objstate.cli import main
from objstate.world.store import DriveEntry, open_store
from tests.cli.test_commands import ROOM, SCENE, words
from tests.world.examples import BUILDING, HOUR, at_angle

START_NS = 1_600_000_000 * 10**9


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a building, a drive through it, and the world that has learnt from it."""
    folder = tmp_path_factory.mktemp("world")
    (folder / "room.urdf").write_text(ROOM)
    (folder / "room.scene.yaml").write_text(SCENE)
    assert main(["simulate", str(folder / "room.scene.yaml"), "--out", str(folder / "log")]) == 0
    return folder


@pytest.fixture(scope="module")
def world(drive: Path) -> Path:
    place = drive / "world.db"
    arguments = ["--building", drive / "room.urdf", "--out", drive / "taught", "--world", place]
    assert main([str(each) for each in ["estimate", drive / "log" / "log.mcap", *arguments]]) == 0
    return place


def test_estimate_says_what_a_world_knew_and_learnt(run, drive: Path, world: Path) -> None:
    again = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "again", "--world", world,
    )  # fmt: skip
    assert again.code == 0
    assert "knew 0 objects when the log began; it has this log already" in again.out
    told = json.loads((drive / "again" / "run.json").read_text())["world"]
    assert told == {
        "location": str(world), "known": 0, "added": 0, "had_the_log": True,
        "unreliable": False, "hung": 0,
        "contradicts": False, "surveyed": 0,
    }  # fmt: skip
    first = json.loads((drive / "taught" / "run.json").read_text())["world"]
    assert first["added"] > 0


def test_show_tells_what_was_last_believed(run, world: Path) -> None:
    outcome = run("world", "show", world)
    assert outcome.code == 0
    assert f"{world}: building 'room', 1 drive\n" in outcome.out
    name, state, _, angle, lower, _, upper, day, _ = words(outcome.out, "office_door")
    assert (name, state, day) == ("office_door", "angle", "2020-09-13")
    assert float(lower) <= float(angle) <= float(upper)
    assert float(angle) == pytest.approx(34.4, abs=5)  # 0.6 rad


def test_show_tells_drives_from_reports_and_what_was_never_taught(run, tmp_path: Path) -> None:
    place = tmp_path / "world.db"
    store = open_store(place, BUILDING)
    assert "Nothing was learnt yet: the priors" in run("world", "show", place).out
    for digest in ("log", "evidence:1", "evidence:2"):
        store.add(DriveEntry(digest, 0, HOUR), [at_angle(0.3, HOUR)])
    told = run("world", "show", place).out
    assert "1 drive, 2 reports\n" in told
    assert "At 3600.0 s" in told


def test_programs_are_told_the_same(run, world: Path) -> None:
    shown = json.loads(run("world", "show", world, "--json").out)
    (door,) = shown["objects"]
    assert shown["building"] == "room"
    assert door["state"]["angle"]["mean"] == pytest.approx(0.6, abs=0.1)
    assert 0.0 < door["clear_width"]["lower"] <= door["clear_width"]["upper"] <= 0.9
    assert door["stamp_ns"] == shown["stamp_ns"] >= START_NS


def test_another_time_is_answered_by_what_was_known_or_by_prediction(run, world: Path) -> None:
    def told(when: str) -> dict[str, float]:
        outcome = run("world", "at", world, when, "--json")
        assert outcome.code == 0
        return json.loads(outcome.out)["objects"][0]["state"]["angle"]

    seen = told("2020-09-13T12:27:00")
    early, late = told("1599999999.5"), told("now")
    assert early["std"] > 0.4  # nothing was known yet
    assert late["std"] > 3 * seen["std"]  # and nothing is for sure years later
    assert told("2020-09-13T14:27:00+02:00") == seen


def test_a_time_that_is_none_is_refused(run, world: Path) -> None:
    for when in ("yesterday", "2020-13-01", "nan"):
        outcome = run("world", "at", world, when)
        assert outcome.code == 1
        assert f"'{when}' is not a time; give 'now'" in outcome.err


def test_history_tells_what_was_learnt_of_one_object(run, world: Path) -> None:
    learnt = json.loads(run("world", "history", world, "office_door", "--json").out)
    stamps = [each["stamp_ns"] for each in learnt]
    assert stamps == sorted(stamps)
    table = run("world", "history", world, "office_door").out
    assert table.count("angle (deg)") == len(stamps)
    unknown = run("world", "history", world, "garage")
    assert unknown.code == 1
    assert "its objects: office_door" in unknown.err


def test_export_writes_all_once(run, world: Path, tmp_path: Path) -> None:
    file = tmp_path / "world.json"
    assert run("world", "export", world, "--out", file, "--samples").code == 0
    written = json.loads(file.read_text())
    (belief, *_) = written["objects"]["office_door"]
    assert sum(belief["weights"]) == pytest.approx(1.0)
    assert len(belief["states"]) == len(belief["weights"])
    assert len(written["drives"]) == 1
    again = run("world", "export", world, "--out", file)
    assert again.code == 1
    assert "--overwrite" in again.err
    assert json.loads(run("world", "export", world).out)["building"] == "room"


def test_a_world_of_another_building_is_refused_before_the_work(
    run, drive: Path, world: Path
) -> None:
    other = drive / "wider.urdf"
    other.write_text(ROOM.replace("0 2 1", "0 2.1 1"))
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", other, "--out", drive / "refused",
        "--world", world,
    )  # fmt: skip
    assert outcome.code == 1
    assert "is of the building 'room'" in outcome.err
    assert not (drive / "refused").exists()


def test_where_there_is_no_world_the_cure_is_told(run, tmp_path: Path) -> None:
    for command in (["show"], ["at"], ["history"], ["export"]):
        more = {"at": ["now"], "history": ["door"]}.get(command[0], [])
        outcome = run("world", *command, tmp_path / "none.db", *more)
        assert outcome.code == 1
        assert "objstate estimate ... --world" in outcome.err
    assert list(tmp_path.iterdir()) == []
