"""Exit codes and messages: 0 fine, 1 the user's error, 70 a bug, 130 Ctrl-C."""

import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
COMMANDS = ["estimate", "inspect", "evaluate", "simulate", "convert"]


def test_version(run) -> None:
    assert run("--version").out == f"objstate {version('objstate')}\n"


def test_alone_it_shows_its_commands(run) -> None:
    outcome = run()
    assert outcome.code == 0
    assert all(command in outcome.out for command in [*COMMANDS, "building", "world"])


WORLD_COMMANDS = [["world", name] for name in ("show", "at", "history", "export")]


@pytest.mark.parametrize(
    "command", [[name] for name in COMMANDS] + [["building", "from-map"], *WORLD_COMMANDS]
)
def test_the_help_of_every_command_has_an_example(run, command: list[str]) -> None:
    outcome = run(*command, "--help")
    assert outcome.code == 0
    assert f"  objstate {' '.join(command)} " in outcome.out


def test_a_mistyped_command_names_the_nearest(run) -> None:
    outcome = run("evalute")
    assert (outcome.code, outcome.out) == (1, "")
    assert "evaluate" in outcome.err


def test_a_mistyped_option_names_the_nearest(run) -> None:
    outcome = run("evaluate", "out", "--trth", "truth.csv")
    assert outcome.code == 1
    assert outcome.err.startswith("error: No such option: --trth")
    assert "--truth" in outcome.err
    assert "Try 'objstate evaluate --help'" in outcome.err


def test_an_option_without_its_value_names_the_commands_help(run) -> None:
    assert "Try 'objstate statistics --help'" in run("statistics", "out", "--json").err
    assert "Try 'objstate world show --help'" in run("world", "show", "a.db", "--config").err


def test_a_missing_argument_is_the_users_error(run) -> None:
    outcome = run("convert", "only.mcap")
    assert outcome.code == 1
    assert "OUT" in outcome.err


@pytest.mark.parametrize(
    "arguments",
    [
        ["inspect", "{missing}"],
        ["convert", "{missing}", "{new}"],
        ["evaluate", "{missing}", "--truth", "{missing}"],
        ["simulate", "{missing}", "--out", "{new}"],
        ["building", "from-map", "{missing}", "--out", "{new}"],
        ["estimate", "{missing}", "--building", "{missing}", "--out", "{new}"],
        ["inspect", "{folder}"],
        ["convert", "{folder}", "{new}"],
        ["simulate", "{folder}", "--out", "{new}"],
        ["building", "from-map", "{folder}", "--out", "{new}"],
        ["estimate", "{folder}", "--building", "{folder}", "--out", "{new}"],
    ],
)
def test_a_path_that_cannot_be_used_is_named_without_a_traceback(
    run, tmp_path: Path, arguments: list[str]
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    places = {"missing": tmp_path / "missing.x", "new": tmp_path / "new.mcap", "folder": folder}
    outcome = run(*(argument.format(**places) for argument in arguments))
    assert outcome.code == 1
    assert outcome.err.startswith("error: ")
    assert str(tmp_path) in outcome.err
    assert "Traceback" not in outcome.err
    assert not places["new"].exists()


def test_ctrl_c_is_130(run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("objstate.logs.inspect_log", interrupted)
    outcome = run("inspect", "x.mcap")
    assert (outcome.code, outcome.out, outcome.err) == (130, "", "interrupted\n")


def test_too_much_for_the_memory_is_no_bug(run, monkeypatch: pytest.MonkeyPatch) -> None:
    def greedy(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr("objstate.logs.inspect_log", greedy)
    outcome = run("inspect", "x.mcap")
    assert outcome.code == 1
    assert "fewer samples" in outcome.err


def test_a_system_error_is_told_with_its_path_and_cure(
    run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object, **__: object) -> None:
        raise OSError(28, "No space left on device", "out/part")

    monkeypatch.setattr("objstate.logs.inspect_log", full)
    outcome = run("inspect", "x.mcap")
    assert outcome.code == 1
    assert outcome.err.startswith("error: out/part: No space left on device; free some space")


def test_a_bug_shows_where_it_is(run, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("it broke")

    monkeypatch.setattr("objstate.logs.inspect_log", broken)
    outcome = run("inspect", "x.mcap")
    assert outcome.code == 70
    assert "Traceback" in outcome.err
    assert "bug in objstate" in outcome.err


@pytest.mark.parametrize("started", [(str(ROOT / "cli.py"),), ("-m", "objstate")])
def test_the_command_line_starts_from_a_checkout_and_as_a_module(started: tuple[str, ...]) -> None:
    command = [sys.executable, *started, "--version"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert done.stdout.startswith("objstate ")


def test_a_reader_that_leaves_early_is_no_error() -> None:
    process = subprocess.Popen(
        [sys.executable, str(ROOT / "cli.py")], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.close()
    _, err = process.communicate()
    assert (process.returncode, err) == (0, b"")
