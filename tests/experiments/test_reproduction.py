"""An experiment of two short drives, run whole."""

from __future__ import annotations

import csv
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from benchmarks.altered import Altered
from objstate.building import load_building
from objstate.config import Settings
from objstate.errors import BuildingError, ResultError, SettingsError
from objstate.experiments import Experiment, Table, reproduce, reproduction
from objstate.experiments.plans import draw_leaf, draw_object, draw_plan, new_figure
from objstate.experiments.trial import Run, Trial
from objstate.simulation.scene import Scene
from tests.bound.conftest import ROOM

DRIVE = {
    "route": {"waypoints": [{"x": -1.0, "y": -0.5}, {"x": 0.0, "y": -0.5}]},
    "objects": [{"name": "door", "initial": "random"}],
}

Make = Callable[..., Path]


def trial(building: Path, seed: int) -> Trial:
    scene = Scene.model_validate(DRIVE | {"building": building, "seed": seed})
    coarse = Altered(changes={"resolution_deg": 10.0})
    return Trial(scene, {"default": Settings(), "coarse": coarse})


def tables(runs: Sequence[Run]) -> tuple[Table, ...]:
    errors = [f"{final.error:.9f}" for run in runs for final in run.finals]
    return (Table("Errors", tuple(errors), (tuple(run.setting for run in runs),)),)


def draw(trial: Trial, runs: Sequence[Run]):
    figure, building = new_figure(4, 3), load_building(trial.scene.building)
    axes = figure.add_subplot()
    draw_plan(axes, building, runs[0].path)
    draw_object(axes, building["table"], np.zeros(3), "red", 1.0)
    draw_leaf(axes, building["door"], 0.5, "red", 1.0)
    return figure


@pytest.fixture
def make(tmp_path: Path) -> Make:
    """Run the experiment into a folder of a name."""
    room = tmp_path / "room.urdf"
    room.write_text(ROOM)

    def run(name: str, **options) -> Path:
        experiments = {"short": Experiment(partial(trial, room), tables, draw, "short.png")}
        return reproduce(experiments, "Short drives", tmp_path / name, [1, 2], **options).folder

    return run


def test_the_same_bytes_come_of_any_number_of_workers(make: Make) -> None:
    shares: list[float] = []
    one = make("one", workers=1, on_progress=lambda share, _: shares.append(share))
    two = make("two", workers=2)
    assert shares == [0.5, 1.0]
    names = {path.name for path in one.iterdir()}
    assert names == {"tables.md", "finals.csv", "short.png", ".objstate"}
    assert {path.name: path.read_bytes() for path in one.iterdir()} == {
        path.name: path.read_bytes() for path in two.iterdir()
    }
    assert (one / "short.png").read_bytes().startswith(b"\x89PNG")
    text = (one / "tables.md").read_text()
    assert text.startswith("# Short drives\n\n## Errors\n")
    assert "![short](short.png)" in text
    with (one / "finals.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    doors = [row for row in rows if row["object"] == "door"]
    assert [(row["setting"], row["seed"]) for row in doors] == [
        ("default", "1"), ("coarse", "1"), ("default", "2"), ("coarse", "2"),
    ]  # fmt: skip
    assert {row["experiment"] for row in rows} == {"short"}
    assert float(doors[0]["truth"]) != float(doors[2]["truth"])  # another seed, another state
    assert all(0.0 < float(row["bound"]) < 0.1 for row in doors)


def test_what_exists_is_refused_before_anything_is_driven(make: Make, tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "mine.txt").write_text("mine")
    for overwrite in (False, True):
        with pytest.raises(ResultError, match="kept"):
            make("kept", overwrite=overwrite, on_progress=pytest.fail)
    assert (tmp_path / "kept" / "mine.txt").read_text() == "mine"


def test_a_failure_leaves_nothing_behind(make: Make, tmp_path: Path) -> None:
    (tmp_path / "room.urdf").write_text("<robot/>")
    with pytest.raises(BuildingError, match="room"):
        make("half", workers=1)
    assert [path.name for path in tmp_path.iterdir()] == ["room.urdf"]


def test_missing_matplotlib_is_told_with_its_cure(
    make: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(reproduction, "find_spec", lambda name: None)
    with pytest.raises(SettingsError, match=r"matplotlib.*objstate\[docs\]"):
        make("out", on_progress=pytest.fail)
    assert not (tmp_path / "out").exists()
