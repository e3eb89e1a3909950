"""``objstate reproduce``"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from objstate.experiments import office_day
from objstate.experiments.office_day import Trial, Worth
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


def test_strategies_are_compared_and_what_is_saved_is_said(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def compared(hours: float, days: int, processes: int) -> list[Worth]:
        assert (hours, days, processes) == (0.5, 1, 1)
        path = np.array([[2.0, 5.0, 0.0], [20.0, 5.0, 0.0]])
        points = [("coordinator", 1.0, 120.0, -10.0, 0.8), ("greedy nearest", 2.0, 100.0, -5.0, 0.7),
                  ("greedy nearest", 1.0, 300.0, -15.0, 0.9)]  # fmt: skip
        return [
            Worth(
                Trial(name, knob, 1, hours), way, entropy, right, 9.0, 8.0, 1, {"moved": 1}, 0, path
            )
            for name, knob, way, entropy, right in points
        ]

    monkeypatch.setattr(office_day, "compare", compared)
    out = tmp_path / "out"
    given = (
        "reproduce",
        "maintenance",
        "--hours",
        0.5,
        "--days",
        1,
        "--processes",
        1,
        "--out",
        out,
    )
    outcome = run(*given)
    assert (outcome.code, outcome.err) == (0, "")
    rows = [line.split() for line in outcome.out.splitlines() if line.startswith(" total entropy")]
    assert rows == [["total", "entropy", "greedy", "nearest", "1", "120", "200", "40"]]
    assert (out / "trials.csv").is_file()


def test_the_grid_of_the_dribblers_is_shown_beside_the_thesis(
    run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from objstate.experiments.darmstadt import reproduction

    monkeypatch.setattr(reproduction, "ACCURACY_S", 5.6)
    out = tmp_path / "out"
    asked = ("reproduce", "darmstadt", "--only", "accuracy", "--seeds", 1, "--processes", 1)
    done = run(*asked, "--out", out)
    assert (done.code, done.err) == (0, "")
    assert "383" in done.out  # the thesis' sector model, third place
    assert {path.name for path in out.iterdir()} == {
        "tables.md", "fig7_2_models.png", ".objstate",
    }  # fmt: skip
    refused = run("reproduce", "darmstadt", "--only", "tea", "--out", tmp_path / "none")
    assert refused.code == 1
    assert "accuracy" in refused.err
    assert not (tmp_path / "none").exists()
