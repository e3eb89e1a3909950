"""``objstate building import``, ``export`` and ``edit``: what they print, write and refuse."""

from __future__ import annotations

from pathlib import Path

import pytest

from objstate.simulation import simulate
from tests.cli.conftest import Run
from tests.interchange.rmf_files import door, room, save
from tests.report.pages import ROOM, SCENE

MODEL = Path(__file__).parents[2] / "models" / "office" / "office.urdf"
COMMANDS = ("import", "export", "edit")


def test_an_import_lists_what_was_taken_left_and_doubted(run: Run, tmp_path: Path) -> None:
    path = save(tmp_path, {"L1": room([door(4, 5, "d", "hinged"), door(4, 5, "e", "odd")])})
    made = run("building", "import", path, "--out", tmp_path / "out")
    assert made.code == 0
    taken, left, rest = made.out.partition("Not taken:")
    assert "Taken:\n- Level 'L1': a pixel is 20.00 mm" in taken
    assert "door 'e', as its type 'odd'" in rest
    assert "No problems found." in rest
    urdf = tmp_path / "out" / "office.urdf"
    assert f"Written: {urdf}" in rest
    assert left
    exported = run("building", "export", urdf, "--to", "rmf", "--out", tmp_path / "rmf")
    assert exported.code == 0
    assert "- 1 door." in exported.out
    assert (tmp_path / "rmf" / "office.building.yaml").is_file()


def test_a_page_is_written_without_a_server(run: Run, tmp_path: Path) -> None:
    path = save(tmp_path, {"L1": room([door(4, 5, "entrance", "hinged")])})
    run("building", "import", path, "--out", tmp_path / "out")
    page = tmp_path / "page.html"
    made = run("building", "edit", tmp_path / "out", "--static", page, "--quiet")
    assert (made.code, made.out) == (0, f"Written: {page}\n")
    assert '"name":"entrance"' in page.read_text()


def test_a_drive_whose_log_holds_no_start_is_shown_from_a_given_one(
    run: Run, tmp_path: Path
) -> None:
    (tmp_path / "room.urdf").write_text(ROOM)
    (tmp_path / "room.scene.yaml").write_text(f"{SCENE}initial_pose: null\n")
    log = simulate(tmp_path / "room.scene.yaml", tmp_path / "log").log
    page = tmp_path / "page.html"
    edit = (
        "building", "edit", tmp_path / "room.urdf", "--drive", log, "--out", tmp_path / "out",
        "--static", page, "--quiet",
    )  # fmt: skip
    unknown = run(*edit)
    assert unknown.code != 0
    assert f"{log}: The robot's start is unknown" in unknown.err
    assert "give --initial-pose X,Y,YAW, or --global." in unknown.err
    assert run(*edit, "--initial-pose", "0.5,0,0").code == 0
    assert ", 0 scan points" not in page.read_text()


@pytest.mark.parametrize(
    ("to", "option"),
    [
        ("sdf", ("--height", 1)),
        ("sdf", ("--resolution", 0.1)),
        ("sdf", ("--objects",)),
        ("rmf", ("--objects",)),
    ],
)
def test_options_of_another_format_are_refused(
    run: Run, tmp_path: Path, to: str, option: tuple[object, ...]
) -> None:
    made = run("building", "export", MODEL, "--to", to, *option, "--out", tmp_path / "out")
    assert made.code == 1
    assert f"{option[0]} has no meaning with --to {to}" in made.err
    assert not (tmp_path / "out").exists()


def test_options_of_sdf_worlds_are_refused_with_other_files(run: Run, tmp_path: Path) -> None:
    path = save(tmp_path, {"L1": room([])})
    made = run("building", "import", path, "--movable", "chair*", "--out", tmp_path / "out")
    assert made.code == 1
    assert "--movable are for SDF worlds" in made.err


@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_missing_is_an_error(run: Run, tmp_path: Path, command: str) -> None:
    extra = ("--to", "sdf") if command == "export" else ()
    made = run("building", command, tmp_path / "gone.yaml", "--out", tmp_path / "out", *extra)
    assert made.code != 0
    assert "gone.yaml" in made.err
    assert not (tmp_path / "out").exists()
