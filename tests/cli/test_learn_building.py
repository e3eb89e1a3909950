"""``objstate estimate --learn-building``: from a map and one log to a building and its doors' states."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from benchmarks.floors import Drives, make_drives
from objstate.building import load_building
from objstate.recording.tables import read_estimates
from tests.discovery.test_finding import floor


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> Drives:
    """A map, and a drive on which all doors stand differently."""
    return make_drives(floor(), tmp_path_factory.mktemp("floor"), seed=5, count=1, moved=1.0)


def test_doors_are_found_adjusted_and_estimated_in_one_go(run, drives: Drives) -> None:
    out = drives.map.parent / "out"
    outcome = run(
        "estimate", drives.logs[0], "--building", drives.map, "--learn-building", "--out", out, "--quiet"
    )  # fmt: skip
    assert outcome.code == 0, outcome.err
    urdf = out / "building" / "adjusted" / "building.urdf"
    assert str(urdf) in outcome.out
    assert (out / "building" / "found" / "doors.csv").exists()
    assert json.loads((out / "run.json").read_text())["inputs"]["building"]["path"] == str(urdf)
    learnt = load_building(urdf).objects
    estimates = read_estimates(out)
    right = 0
    for door in floor().doors:
        near = [n for n, item in learnt.items() if np.hypot(*(item.hinge[:2] - door.hinge)) < 0.3]
        for name in near:
            last = estimates.filter(estimates["object"] == name)["mean"][-1]
            right += bool(abs(last - drives.states[1][door.name]) < np.radians(5.0))
    assert right >= 2


def test_a_log_that_is_given_twice_counts_once_whatever_the_number_of_processes(
    run, drives: Drives, tmp_path: Path
) -> None:
    copied = tmp_path / "copy.mcap"
    shutil.copy(drives.logs[0], copied)
    learn, out, alone = ("building", "learn", drives.logs[0]), tmp_path / "out", tmp_path / "alone"
    twice = run(*learn, copied, "--map", drives.map, "--out", out, "--jobs", 2)
    assert twice.code == 0
    once = run(*learn, "--map", drives.map, "--out", alone, "--jobs", 1)
    assert once.code == 0
    for name in ("doors.csv", "learn.json", "building.urdf"):
        assert (out / name).read_bytes() == (alone / name).read_bytes()
    assert f"{copied} holds the same as {drives.logs[0]}" in twice.err
    (drive,) = json.loads((out / "learn.json").read_text())["drives"]
    assert drive["log"] == str(drives.logs[0])


def test_a_drive_whose_start_is_unknown_is_named_with_the_cure(
    run, drives: Drives, tmp_path: Path
) -> None:
    given = ("--map", drives.map, "--out", tmp_path / "out", "--topics", "/scan,/odom,/tf_static")
    outcome = run("building", "learn", drives.logs[0], *given, "--quiet")
    assert outcome.code == 1
    for part in (drives.logs[0].name, "hold no /initialpose", "give --initial-pose"):
        assert part in outcome.err.replace("\n", " ")
    assert not (tmp_path / "out").exists()


def test_what_excludes_it_is_said(run, drives: Drives, tmp_path: Path) -> None:
    log = drives.logs[0]
    given = ("--building", drives.map, "--learn-building", "--out", tmp_path / "out")
    twice = run("estimate", log, log, *given)
    assert twice.code == 1
    assert "one log file alone" in twice.err
    both = run("estimate", log, *given, "--calibrate")
    assert both.code == 1
    assert "leave --calibrate out" in both.err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("first", ["--learn-building", "--calibrate"])
def test_an_existing_folder_is_refused_before_anything_is_learnt(
    run, tmp_path: Path, first: str
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "thesis.txt").write_text("whole")
    given = ("--building", tmp_path / "none.yaml", "--out", out)  # learning would end with this one
    refused = run("estimate", tmp_path / "none.mcap", *given, first)
    assert (refused.code, "exists already" in refused.err) == (1, True)
