"""``objstate evaluate --bound``"""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from objstate.cli import main
from tests.bound.conftest import ROOM

SCENE = """
building: room.urdf
route: {waypoints: [{x: 0.0, y: 0.0}, {x: 1.0, y: 0.0}]}
objects: [{name: door, initial: 0.5}]
"""


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a simulated drive, ``log``, and its ``result``."""
    folder = tmp_path_factory.mktemp("bound")
    (folder / "room.urdf").write_text(ROOM)
    (folder / "room.scene.yaml").write_text(SCENE)
    log, result = folder / "log", folder / "result"
    assert main(["simulate", str(folder / "room.scene.yaml"), "--out", str(log)]) == 0
    building = ["--building", str(folder / "room.urdf")]
    assert main(["estimate", str(log / "log.mcap"), *building, "--out", str(result)]) == 0
    return folder


def test_the_bound_stands_beside_the_errors(run, drive: Path) -> None:
    figures = drive / "errors.json"
    outcome = run(
        "evaluate", drive / "result", "--truth", drive / "log" / "truth.csv", "--bound",
        "--json", figures,
    )  # fmt: skip
    assert outcome.code == 0
    table = outcome.out.partition("Cramér-Rao bound")[2]
    (door,) = (line.split() for line in table.splitlines() if line.split()[:1] == ["door"])
    name, state, unit, count, error, bound, ratio = door
    assert (name, state, unit, count) == ("door", "angle", "(deg)", "1")
    assert 0.0 < float(bound) < 2.0
    assert float(error) < 5.0
    written = json.loads(figures.read_text())["bound"]
    (angle,) = (each for each in written["objects"] if each["object"] == "door")
    assert f"{angle['ratio']:.1f}" == ratio
    assert {each["coordinate"] for each in written["overall"]} == {
        "angle"
    }  # it never sees the table


def test_without_being_asked_there_is_none(run, drive: Path) -> None:
    figures = drive / "plain.json"
    truth = drive / "log" / "truth.csv"
    outcome = run("evaluate", drive / "result", "--truth", truth, "--json", figures)
    assert "bound" not in outcome.out
    assert "bound" not in json.loads(figures.read_text())
    printed = run("evaluate", drive / "result", "--truth", truth, "--json", "-")
    assert json.loads(printed.out) == json.loads(figures.read_text())


def test_a_drive_that_was_not_simulated_has_none(run, drive: Path) -> None:
    alone = drive / "alone.csv"
    alone.write_bytes((drive / "log" / "truth.csv").read_bytes())
    outcome = run("evaluate", drive / "result", "--truth", alone, "--bound")
    assert (outcome.code, outcome.out) == (1, "")
    assert "scene.yaml" in outcome.err
    assert "objstate simulate" in outcome.err
