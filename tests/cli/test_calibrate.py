"""Calibrating, and estimating with what was found, as a user types it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from objstate.cli import main
from tests.cli.test_commands import ROOM

SCENE = """
building: room.urdf
route:
  waypoints:
    - {x: 0.0, y: 0.0}
    - {x: 2.5, y: 0.8}
    - {x: 1.5, y: -0.8}
    - {x: 0.2, y: 0.3}
lasers: [{frame: laser, rate: 5.0, range_max: 10.0, sigma: 0.01}]
objects: [{name: office_door, initial: 0.6}]
model_error: {laser_yaw_sigma: 0.03, clock_offset: 0.03}
seed: 2
"""


@pytest.fixture(scope="module")
def drive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a building and a drive whose laser is askew."""
    folder = tmp_path_factory.mktemp("drive")
    (folder / "room.urdf").write_text(ROOM)
    (folder / "room.scene.yaml").write_text(SCENE)
    assert main(["simulate", str(folder / "room.scene.yaml"), "--out", str(folder / "log")]) == 0
    return folder


@pytest.fixture(scope="module")
def calibrated(drive: Path) -> Path:
    """The file that ``calibrate`` writes."""
    out = drive / "calibration.yaml"
    log, building = drive / "log" / "log.mcap", drive / "room.urdf"
    assert main(["calibrate", str(log), "--building", str(building), "--out", str(out)]) == 0
    return out


def test_the_file_holds_what_was_found_and_how_surely(calibrated: Path) -> None:
    laser = yaml.safe_load(calibrated.read_text())["lasers"]["laser"]
    assert laser["std"]["yaw_deg"] < 0.5
    assert "yaw_deg" not in laser["not_told"]
    assert laser["mount"]["yaw_deg"] == pytest.approx(laser["correction"]["yaw_deg"])


def test_an_existing_file_is_refused(run, drive: Path, calibrated: Path) -> None:
    before = calibrated.read_bytes()
    outcome = run(
        "calibrate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", calibrated,
    )  # fmt: skip
    assert outcome.code != 0
    assert "--overwrite" in outcome.err
    assert calibrated.read_bytes() == before


def test_estimate_applies_the_file(run, drive: Path, calibrated: Path) -> None:
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "applied", "--calibration", calibrated, "--learn-dynamics",
    )  # fmt: skip
    assert outcome.code == 0
    options = json.loads((drive / "applied" / "run.json").read_text())["options"]
    laser = yaml.safe_load(calibrated.read_text())["lasers"]["laser"]
    assert options["clock_offsets"] == {"laser": laser["clock_offset"]}
    assert options["mounts"]["laser"][0][3] == pytest.approx(laser["mount"]["x"])
    assert "moves an hour" in outcome.out
    learnt = drive / "applied" / "dynamics.yaml"
    assert str(learnt) in outcome.out
    again = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "learnt", "--config", learnt, "--to", "2",
    )  # fmt: skip
    assert again.code == 0


def test_estimate_calibrates_by_itself(run, drive: Path, calibrated: Path) -> None:
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "own", "--calibrate",
    )  # fmt: skip
    assert outcome.code == 0
    assert "yaw" in outcome.out
    assert (drive / "own" / "calibration.yaml").read_text() == calibrated.read_text()


def test_both_at_once_are_refused(run, drive: Path, calibrated: Path) -> None:
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "both", "--calibrate", "--calibration", calibrated,
    )  # fmt: skip
    assert outcome.code != 0
    assert "exclude each other" in outcome.err
    assert not (drive / "both").exists()


@pytest.mark.parametrize(
    ("value", "told"),
    [("laser", "not an offset"), ("laser=soon", "not an offset"), ("=0.1", "names no frame")],
)
def test_offsets_that_are_none_are_refused(run, drive: Path, value: str, told: str) -> None:
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "none", "--clock-offset", value,
    )  # fmt: skip
    assert outcome.code != 0
    assert told in outcome.err


def test_an_offset_that_the_recording_times_contradict_is_told(run, drive: Path) -> None:
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "far", "--clock-offset", "laser=3",
    )  # fmt: skip
    assert "--clock-offset laser=" in outcome.err


def test_an_offset_for_a_laser_that_is_not_there_is_told(run, drive: Path) -> None:
    outcome = run(
        "estimate", drive / "log" / "log.mcap", "--building", drive / "room.urdf",
        "--out", drive / "other", "--clock-offset", "rear=0.1", "--to", "1",
    )  # fmt: skip
    assert outcome.code == 0
    assert "--clock-offset names 'rear'" in outcome.err


def test_inspect_calibrates_in_a_building(run, drive: Path) -> None:
    log, building = drive / "log" / "log.mcap", drive / "room.urdf"
    outcome = run("inspect", log, "--building", building, "--json")
    assert outcome.code == 0
    (laser,) = json.loads(outcome.out)["calibration"]["lasers"]
    assert laser["frame"] == "laser"
    assert len(laser["std"]) == 4
