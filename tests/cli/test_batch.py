"""Many logs, as a user types it: batch, evaluate, statistics."""

import json
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path

import polars as pl
import pytest

from objstate.cli import main
from objstate.cli.batch import mostly_lost
from tests.cli.conftest import Outcome
from tests.cli.test_commands import ROOM, SCENE

LOGS = 3


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a building, drives with truths, and one batch of them."""
    folder = tmp_path_factory.mktemp("many")
    (folder / "room.urdf").write_text(ROOM)
    (folder / "room.scene.yaml").write_text(SCENE)
    for seed in range(LOGS):
        out = folder / "drives" / f"day_{seed}"
        scene = str(folder / "room.scene.yaml")
        assert main(["simulate", scene, "--out", str(out), "--seed", str(seed)]) == 0
    told = ["--truth", str(folder / "drives"), "--workers", "1", "--quiet"]
    assert main([*command(folder, "all"), *told]) == 0
    return folder


def command(home: Path, out: str) -> list[str]:
    drives, building = str(home / "drives"), str(home / "room.urdf")
    return ["batch", drives, "--building", building, "--out", str(home / out)]


@pytest.fixture(scope="module")
def other(home: Path) -> Outcome:
    """What another batch of the drives said, which is in the folder ``other``."""
    with redirect_stdout(StringIO()) as out, redirect_stderr(StringIO()) as err:
        code = main([*command(home, "other"), "--seed", "5", "--workers", "2"])
    return Outcome(code, out.getvalue(), err.getvalue())


def test_a_batch_says_how_far_it_is_and_how_it_ended(run, home: Path, other: Outcome) -> None:
    assert other.code == 0
    assert f"{LOGS} logs: {LOGS} done." in other.out
    assert f"{LOGS}/{LOGS} day_" in other.err
    assert "0:00:00 left" in other.err
    again = run(*command(home, "other"), "--seed", 5)
    assert again.code == 0
    assert f"0 logs to run, {LOGS} are done." in again.err


def test_logs_in_which_the_robot_was_mostly_lost_are_named() -> None:
    rows = {"log": ["a", "b", "c"], "lost_seconds": [1.0, 9.1, None], "log_seconds": [10.0] * 3}
    assert mostly_lost(pl.DataFrame(rows)) == pytest.approx({"b": 0.91})


def test_a_log_that_fails_sets_the_exit_code_and_is_named(run, home: Path, tmp_path: Path) -> None:
    (tmp_path / "empty.bag").touch()
    arguments = (tmp_path, "--building", home / "room.urdf", "--out", tmp_path / "out")
    outcome = run("batch", *arguments)
    assert outcome.code == 1
    assert "empty: failed. " in outcome.out
    assert "is empty" in outcome.out
    again = run("batch", *arguments)
    assert again.code == 1
    assert "--retry-failed" in again.err


def test_a_batch_is_estimated_with_the_mountings_that_were_learnt(
    run, home: Path, tmp_path: Path
) -> None:
    (log,) = (home / "drives" / "day_0").glob("log.*")
    mount = {"x": 0.2, "y": 0.0, "z": 0.3, "roll_deg": 0.0, "pitch_deg": 0.0, "yaw_deg": 0.5}
    lasers = {"laser": {"mount": mount, "clock_offset": 0.002}}
    (tmp_path / "calibration.yaml").write_text(json.dumps({"lasers": lasers}))
    told = ("--calibration", tmp_path / "calibration.yaml", "--out", tmp_path / "out")
    outcome = run("batch", log, "--building", home / "room.urdf", *told, "--workers", "1")
    assert outcome.code == 0
    (words,) = (tmp_path / "out" / "logs").glob("*/run.json")
    options = json.loads(words.read_text())["options"]
    assert list(options["mounts"]) == ["laser"]
    assert options["clock_offsets"] == {"laser": 0.002}


def test_a_batch_is_evaluated_by_its_own_truths(run, home: Path) -> None:
    file = home / "errors.json"
    outcome = run("evaluate", home / "all", "--json", file, "--quiet")
    assert outcome.code == 0
    for title in ("By object", "By distance (m)", "By incidence (deg)", "By beams", "Calibration"):
        assert title in outcome.out
    figures = json.loads(file.read_text())
    printed = run("evaluate", home / "all", "--json", "-", "--quiet")
    assert (printed.code, json.loads(printed.out)) == (0, figures)
    assert figures["logs"] == LOGS
    assert figures["overall"][0]["final"]["count"] == LOGS
    assert {group["condition"] for group in figures["groups"]} >= {"class", "beams"}


@pytest.mark.usefixtures("other")
def test_a_batch_is_held_against_another(run, home: Path) -> None:
    outcome = run("evaluate", home / "all", "--against", home / "other", "--quiet")
    assert outcome.code == 0
    assert f"Paired differences over {LOGS} logs" in outcome.out
    assert "absolute error (deg)" in outcome.out


def test_one_result_is_held_against_another(run, home: Path) -> None:
    one, other = (home / name / "logs" / "day_0" for name in ("all", "all"))
    truth = home / "drives" / "day_0" / "truth.csv"
    outcome = run("evaluate", one, "--truth", truth, "--against", other, "--quiet")
    assert outcome.code == 0
    assert "-inf to inf" in outcome.out


def test_results_of_different_logs_are_not_compared(run, home: Path) -> None:
    one, other = (home / "all" / "logs" / name for name in ("day_0", "day_1"))
    truth = home / "drives" / "day_0" / "truth.csv"
    outcome = run("evaluate", one, "--truth", truth, "--against", other, "--quiet")
    assert outcome.code == 1
    assert "compare results of the same logs" in outcome.err


def test_a_result_and_a_batch_are_not_compared(run, home: Path) -> None:
    truth = home / "drives" / "day_0" / "truth.csv"
    one = ("evaluate", home / "all" / "logs" / "day_0", "--truth", truth)
    outcome = run(*one, "--against", home / "all", "--quiet")
    assert outcome.code == 1
    assert "no result of a log with one of the same names" in outcome.err


def test_one_result_needs_a_truth(run, home: Path) -> None:
    outcome = run("evaluate", home / "all" / "logs" / "day_0")
    assert outcome.code == 1
    assert "--truth CSV" in outcome.err


def test_door_statistics_are_printed_and_written(run, home: Path) -> None:
    file = home / "doors.json"
    outcome = run("statistics", home / "all", "--timezone", "Europe/Berlin", "--json", file)
    assert outcome.code == 0
    assert "office_door" in outcome.out
    (door,) = json.loads(file.read_text())
    printed = run("statistics", home / "all", "--timezone", "Europe/Berlin", "--json", "-")
    assert (printed.code, json.loads(printed.out)) == (0, [door])
    assert door["share_open"]["lower"] < door["share_open"]["upper"]
    assert door["by_hour"][0]["key"] == 14  # the simulated logs begin at 12:26 UTC, in September


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--timezone", "Mars/Olympus"), "--timezone 'Mars/Olympus'"),
        (("--open-above", "wide"), "--open-above 'wide'"),
    ],
)
def test_statistics_name_what_they_do_not_understand(run, home: Path, arguments, words) -> None:
    outcome = run("statistics", home / "all", *arguments)
    assert outcome.code == 1
    assert words in outcome.err


def test_a_folder_that_is_no_batch_is_named(run, tmp_path: Path) -> None:
    outcome = run("statistics", tmp_path)
    assert outcome.code == 1
    assert "objstate batch" in outcome.err
    assert run("evaluate", tmp_path).code == 1
