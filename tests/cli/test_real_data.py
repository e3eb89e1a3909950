"""From a recorded map and log to estimates, on a robot's own data."""

import json
from pathlib import Path

import numpy as np
import pytest

from objstate.recording.tum import read_tum

WEAN = Path(__file__).parents[2] / ".." / "shared" / "data" / "wean-hall"


@pytest.mark.skipif(not WEAN.is_dir(), reason=f"recorded data is missing: {WEAN}")
def test_a_recorded_drive_from_map_and_log_to_a_path(run, tmp_path: Path) -> None:
    made = run(
        "building", "from-map", WEAN / "wean.yaml", "--doors", WEAN / "doors.csv",
        "--out", tmp_path / "wean",
    )  # fmt: skip
    assert made.code == 0
    urdf = tmp_path / "wean" / "wean.urdf"
    shown = json.loads(run("inspect", urdf, "--json").out)
    assert [door["name"] for door in shown["objects"]] == ["WL1", "WL2", "WU1"]

    outcome = run(
        "estimate", WEAN / "run2.mcap", "--building", urdf, "--out", tmp_path / "out",
        "--to", "10",
    )  # fmt: skip
    assert outcome.code == 0
    assert "Never in view: WL1, WL2, WU1" in outcome.out  # they are reached later
    path = read_tum(tmp_path / "out" / "trajectory.tum")
    steps = np.hypot(*np.diff(path.poses[:, :2], axis=0).T)
    assert len(path.poses) > 50
    assert steps.max() < 0.5  # a robot doesn't jump
