"""Text from outside is printed as it is, and can't command the terminal."""

from __future__ import annotations

import io
import json
import logging
from pathlib import Path

import pytest
from rich.progress import Progress, TextColumn

from objstate.cli.console import print_table, print_text
from objstate.cli.plain import plain, plain_line
from objstate.cli.plain_console import PlainConsole, PlainFormatter
from objstate.cli.tables import new_table, significant
from objstate.errors import LogError
from tests.logs.conftest import Drive

HOSTILE = "/[/red]a[bold]:smile:\x1b[2J\x07\u202e{0}"
SHOWN = r"/[/red]a[bold]:smile:\x1b[2J\x07\u202e{0}"


def test_names_are_shown_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    table = new_table(HOSTILE, (HOSTILE,), (HOSTILE,))
    table.add_row(HOSTILE, HOSTILE)
    print_table(table)
    print_text(HOSTILE)
    out = capsys.readouterr().out
    assert out.count(SHOWN) == 6
    assert "\x1b" not in out


def test_half_a_character_of_a_file_name_is_shown(capsys: pytest.CaptureFixture[str]) -> None:
    print_text("a\udcff.mcap")
    assert capsys.readouterr().out == "a\\udcff.mcap\n"


def test_what_the_terminal_has_no_characters_for_is_written_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    terminal = io.TextIOWrapper(io.BytesIO(), encoding="ascii")
    monkeypatch.setattr("sys.stdout", terminal)
    print_text("Tür")
    terminal.flush()
    assert terminal.buffer.getvalue() == b"T\\xfcr\n"  # type: ignore[attr-defined]


def test_sentences_keep_their_lines_and_bars_have_one() -> None:
    assert plain("a\nb\tc\r") == "a\nb\tc\\r"
    assert plain_line("a\nb") == "a\\nb"


def test_bars_and_log_lines_take_names_as_they_are() -> None:
    file = io.StringIO()
    console = PlainConsole(file, 200)
    with Progress(TextColumn("{task.description}", markup=False), console=console) as bars:
        bars.add_task(plain_line(HOSTILE), total=1.0)
        bars.console.print(HOSTILE)
    assert file.getvalue().count(SHOWN) >= 2
    record = logging.LogRecord("a", logging.INFO, "a", 1, "%s", (HOSTILE,), None)
    assert PlainFormatter("%(message)s").format(record) == SHOWN


def test_inspect_shows_a_log_with_names_that_look_like_markup(run, tmp_path: Path) -> None:
    drive = Drive().tf(0.0, "base_link", HOSTILE)
    for step in range(3):
        drive.odometry(0.1 * step, topic="/o[/red]").scan(0.1 * step, topic=HOSTILE, frame=HOSTILE)
    path = drive.mcap(tmp_path / "[red]a.mcap")
    shown = run("inspect", path)
    assert shown.code == 0
    assert shown.out.count(SHOWN[1:]) >= 4  # topic, frame in two tables, frames
    assert "[red]a.mcap" in shown.out
    assert "\x1b" not in shown.out
    topics = json.loads(run("inspect", path, "--json").out)["topics"]
    assert HOSTILE in {topic["name"] for topic in topics}


def test_errors_show_names_as_they_are(run, monkeypatch, tmp_path: Path) -> None:
    def fail(*_: object, **__: object) -> None:
        raise LogError(f"{HOSTILE} is no log.")

    monkeypatch.setattr("objstate.logs.inspect_log", fail)
    outcome = run("inspect", tmp_path / "a")
    assert (outcome.code, outcome.err) == (1, f"error: {SHOWN} is no log.\n")


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (180.0, 2, "180"), (99.96, 2, "100"), (0.05, 2, "0.05"), (1.84, 2, "1.8"), (12345.6, 4, "12346"),
        (0.0, 2, "0"), (-250.0, 2, "-250"), (10.0, 2, "10"), (0.00012, 2, "0.00012"),
        (float("inf"), 2, "inf"), (float("nan"), 2, "nan"), (3.4e38, 2, "3.4e+38"),
    ],
)  # fmt: skip
def test_figures_have_no_exponent(value: float, digits: int, shown: str) -> None:
    assert significant(value, digits) == shown
