"""``objstate reproduce``"""

from __future__ import annotations

from pathlib import Path

import pytest
import yaml

from objstate.experiments.schulz2001 import desks


@pytest.fixture
def left_office(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only the first seconds of the drive past the desks."""
    whole = yaml.safe_load(desks.SCENE.read_text())
    whole["building"] = str(desks.SCENE.with_name(whole["building"]))
    whole["route"]["waypoints"] = whole["route"]["waypoints"][:2]
    (tmp_path / "left.scene.yaml").write_text(yaml.safe_dump(whole))
    monkeypatch.setattr(desks, "SCENE", tmp_path / "left.scene.yaml")


@pytest.mark.usefixtures("left_office")
def test_desks_are_found_and_shown_beside_the_paper(run, tmp_path: Path) -> None:
    out = tmp_path / "desks"
    arguments = ("reproduce", "schulz2001", "--only", "desks", "--seeds", 1, "--out", out)
    outcome = run(*arguments)
    assert (outcome.code, outcome.err) == (0, "")
    rows = {words[0]: words[1:] for line in outcome.out.splitlines() if (words := line.split())}
    papers = {name: rows[name][0] for name in ("desk_1", "desk_2", "desk_3", "desk_4", "table")}
    assert papers == {
        "desk_1": "right", "desk_2": "right", "desk_3": "wrong", "desk_4": "right", "table": "wrong",
    }  # fmt: skip
    for name in ("desk_1", "desk_2"):
        count, error, turned = (float(word) for word in rows[name][1:4])
        assert count == 1
        assert error < 20.0  # cm; the model is wrong by as much
        assert turned < 10.0
    assert rows["desk_4"][1:3] == ["0", "-"]  # in the other office
    assert str(out) in outcome.out
    names = {path.name for path in out.iterdir()}
    assert names == {"tables.md", "finals.csv", "fig8_desks.png", ".objstate"}
    again = run(*arguments)
    assert again.code == 1
    assert "--overwrite" in again.err


def test_an_unknown_experiment_is_refused(run, tmp_path: Path) -> None:
    outcome = run("reproduce", "schulz2001", "--only", "windows", "--out", tmp_path / "out")
    assert outcome.code == 1
    assert "desks" in outcome.err
    assert not (tmp_path / "out").exists()


def test_papers_are_listed(run) -> None:
    outcome = run("reproduce")
    assert outcome.code == 0
    assert "schulz2001" in outcome.out
