"""Nobody is better than the bound on average; who has the true model is not far above it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest

from objstate.bound import Bounds, compare_with_bounds, evaluate_bound
from objstate.bound.comparison import bound_errors
from objstate.errors import SettingsError, TruthError
from objstate.records import TrueState
from objstate.run import estimate_log
from objstate.simulation import simulate

SECOND = 10**9
SCENE = """
building: room.urdf
route: {speed: 0.7, waypoints: [{x: -1.5, y: -0.5}, {x: 1.5, y: -0.5}, {x: 0.5, y: 0.2}]}
lasers: [{beams: 181, rate: 5.0, sigma: 0.03, false_share: 0.02}]
objects: [{name: door, initial: random}, {name: table, initial: random, spread_xy: 0.1, spread_yaw: 0.1}]
"""


@pytest.fixture
def scene(room: Path) -> Path:
    path = room.with_name("room.scene.yaml")
    path.write_text(SCENE)
    return path


def test_errors_stay_near_the_bound_and_do_not_fall_below_it(scene: Path) -> None:
    parts: dict[str, list[np.ndarray]] = {}
    for seed in range(6):
        drive = simulate(scene, scene.with_name(f"drive_{seed}"), seed=seed)
        result = estimate_log([drive.log], scene.with_name("room.urdf"), drive.folder / "result")
        for entry in evaluate_bound(result.folder, drive.folder / "truth.csv").objects:
            pair = np.array([[entry.error, entry.bound]])
            parts.setdefault(entry.coordinate, []).append(pair)
    summary = {kind: bound_errors(None, kind, pairs) for kind, pairs in parts.items()}
    assert summary.keys() == {"angle", "x", "y", "yaw"}
    together = np.sqrt(np.mean([each.ratio**2 for each in summary.values()]))
    assert 0.8 < together < 6.0


def test_only_final_errors_count_each_with_its_own_bound() -> None:
    stamps = [1 * SECOND, 2 * SECOND, 4 * SECOND, 5 * SECOND]
    medians = [0.9, 0.1, 0.5, 0.56]
    estimates = pl.DataFrame(
        {
            "stamp": stamps,
            "object": ["door"] * 4,
            "coordinate": ["angle"] * 4,
            "median": medians,
            "lower": medians,
            "upper": medians,
            "observed": [True] * 4,
        }
    )
    truth = [TrueState(0, "door", "angle", 0.0), TrueState(3 * SECOND, "door", "angle", 0.5)]
    limits = np.array([0.4, 0.05, 0.3, 0.02])
    bounds = Bounds(np.array(stamps), {("door", "angle"): limits}, np.zeros((4, 3)))
    (entry,) = compare_with_bounds(estimates, truth, bounds).objects
    assert entry.count == 2
    assert entry.error == pytest.approx(np.sqrt((0.1**2 + 0.06**2) / 2))
    assert entry.bound == pytest.approx(np.sqrt((0.05**2 + 0.02**2) / 2))
    assert entry.ratio == pytest.approx(entry.error / entry.bound)
    assert entry.typical_ratio == pytest.approx((2.0 + 3.0) / 2 / 0.67449)


def test_errors_as_the_bound_has_them_have_ratios_of_one() -> None:
    rng = np.random.default_rng(3)
    bounds = rng.uniform(0.01, 0.1, 4000)
    errors = bounds * rng.standard_normal(4000)
    fair = bound_errors(None, "angle", [np.column_stack([errors, bounds])])
    assert (fair.ratio, fair.typical_ratio) == pytest.approx((1.0, 1.0), abs=0.06)
    errors[0] = 100.0  # one that is altogether wrong
    spoilt = bound_errors(None, "angle", [np.column_stack([errors, bounds])])
    assert spoilt.ratio > 10.0
    assert spoilt.typical_ratio == pytest.approx(fair.typical_ratio, rel=0.01)


def test_a_truth_without_its_scene_has_no_bound(tmp_path: Path) -> None:
    (tmp_path / "truth.csv").write_text("stamp,object,coordinate,value\n0,door,angle,0.1\n")
    with pytest.raises(TruthError, match=r"no scene.yaml beside .*simulate"):
        evaluate_bound(tmp_path, tmp_path / "truth.csv")


def test_a_scene_of_another_drive_is_refused(scene: Path) -> None:
    drive = simulate(scene, scene.with_name("drive"), seed=1)
    text = (drive.folder / "scene.yaml").read_text()
    (drive.folder / "scene.yaml").write_text(text.replace("seed: 1", "seed: 2"))
    with pytest.raises(TruthError, match=r"isn't what .*scene.yaml makes"):
        evaluate_bound(scene.parent, drive.folder / "truth.csv")


def test_a_scene_without_noise_is_refused(scene: Path) -> None:
    scene.write_text(SCENE.replace("sigma: 0.03", "sigma: 0, quantization: 0"))
    drive = simulate(scene, scene.with_name("drive"))
    with pytest.raises(SettingsError, match="no noise"):
        evaluate_bound(scene.parent, drive.folder / "truth.csv")
