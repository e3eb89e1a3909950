"""What makes a run no success, and how its doubts are grouped."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from objstate.building import load_building
from objstate.config import BuildingErrorSettings, DoorErrorSettings, Settings
from objstate.estimator import Estimator
from objstate.estimator.width import Limit, TooWide
from objstate.localization import PoseBelief
from objstate.recording.tum import read_tum
from objstate.records import Rays, Scan
from objstate.run import RunOptions, estimate_log
from objstate.run.doubts import MOST_THROUGH, doubts, failures, lost_share
from objstate.run.drive import Drive
from objstate.world.store import open_store

ROOT = Path(__file__).resolve().parents[2]
SECOND = 10**9


def drive(seconds: float = 100.0) -> Drive:
    gone = Drive(begin_ns=SECOND, end_ns=SECOND + round(seconds * SECOND), scans=5)
    gone.stamps_ns.extend([SECOND])
    gone.poses.extend([0.0, 0.0, 0.0])
    return gone


def estimator(*lost: tuple[float, float], is_lost: bool = False) -> Any:
    """What of an estimator says when it was lost, in seconds of the drive."""
    stretches = tuple(
        (SECOND + round(since * SECOND), SECOND + round(found * SECOND)) for since, found in lost
    )
    return SimpleNamespace(
        settings=Settings(),
        lost=stretches,
        lost_probabilities=(0.97,) * len(stretches),
        is_lost=is_lost,
        building=load_building(ROOT / "models" / "office" / "office.urdf"),
        scans_without_pose=0,
        corrections=1,
        objects={},
        hung_elsewhere={},
        too_wide=TooWide(),
    )


ANYWHERE = RunOptions(global_start=True)


@pytest.mark.parametrize(
    ("seconds", "believed", "options", "share", "message"),
    [
        (100, estimator(), RunOptions(), 0.0, None),
        (100, estimator((10, 55)), RunOptions(), 0.45, None),
        (100, estimator((0, 40), (50, 98)), RunOptions(), 0.88, "lost for 88 % of the log"),
        (100, estimator((20, 100), is_lost=True), RunOptions(), 0.8, "lost for 80 %"),
        (100, estimator((0, 60)), ANYWHERE, 0.0, None),
        (100, estimator((0, 10), (20, 80)), ANYWHERE, 0.6, "lost for 60 %"),
        (100, estimator((0, 100), is_lost=True), ANYWHERE, 1.0, "was not found"),
        (0, estimator(), RunOptions(), 0.0, r"no duration: .*\(5 scans\)"),
    ],
)
def test_a_run_fails_by_the_time_that_it_is_lost(
    seconds: float, believed: Estimator, options: RunOptions, share: float, message: str | None
) -> None:
    told = failures(drive(seconds), believed, options)
    assert lost_share(drive(seconds), believed, options) == pytest.approx(share)
    assert len(told) == (message is not None)
    assert message is None or re.search(message, told[0])


def test_many_stretches_are_one_warning(tmp_path: Path) -> None:
    stretches = [(10 * k, 10 * k + 2) for k in range(1, 9)]
    told: Sequence[str] = doubts(drive(), estimator(*stretches), RunOptions())
    (lost,) = [warning for warning in told if "probably lost" in warning]
    assert "10.0 s to 12.0 s (p = 0.97)" in lost
    assert "(8 times, 16 s)" in lost


def test_doors_that_hang_elsewhere_are_one_warning() -> None:
    believed = estimator()
    believed.hung_elsewhere = {f"door_{k}": (0.1, 0.0) for k in range(4)}
    (hung,) = [text for text in doubts(drive(), believed, RunOptions()) if "hinges" in text]
    assert hung.startswith("The hinges of 4 doors seem to be elsewhere: 'door_0' 0.10 m east")
    assert hung.endswith("less exactly than 0.01 m, state it (building_error.hinge_std_m).")


@pytest.mark.parametrize("reading", [np.nan, np.inf, 2.0])
def test_a_laser_without_any_return_is_named(reading: float) -> None:
    gone, believed = drive(), estimator()
    believed.robot, believed.p_localized = None, 1.0
    for range_ in (np.nan, reading):
        rays = Rays(np.full((1, 3), 0.3), np.array([[1.0, 0.0, 0.0]]))
        scan = Scan(SECOND, "front", np.array([range_]), rays, 0.1, 8.0, np.zeros(3))
        gone.note(scan, believed, [])
    told = doubts(gone, believed, RunOptions())
    is_blind = any("'front' has no return in any scan" in text for text in told)
    assert is_blind == (not np.isfinite(reading))
    assert any("No scan was near an object" in text for text in told) != is_blind


def test_a_mounting_with_the_slash_of_ros_1_is_that_of_its_laser() -> None:
    gone = drive()
    gone.heights["front"] = 0.3
    options = RunOptions(mounts={"/front": np.eye(4)}, clock_offsets={"/front": 0.1})
    assert not [text for text in doubts(gone, estimator(), options) if "no scan of it" in text]


TIGHT, NARROW = Limit(0.12, np.radians(2.5)), Limit(0.5)


def with_wide_belief(seconds: int, limit: Limit) -> Any:
    """An estimator whose recorded robot belief was too wide from 10 s of the clock on."""
    believed = estimator()
    for second in range(10, 10 + seconds):
        robot = PoseBelief.whitened(np.zeros(3), np.diag([0.6, 0.6, 0.03]) ** 2, np.eye(3))
        believed.too_wide.note(second * SECOND, robot, limit)
    believed.too_wide.end((10 + seconds) * SECOND)
    return believed


@pytest.mark.parametrize(
    ("seconds", "estimates", "is_told"), [(20, 0, True), (20, 50, True), (1, 50, False)]
)
def test_a_recorded_belief_that_is_too_wide_for_objects_is_named(
    seconds: int, estimates: int, is_told: bool
) -> None:
    believed = with_wide_belief(seconds, TIGHT)
    gone = replace(drive(), estimates=estimates, observed=estimates)
    told = doubts(gone, believed, RunOptions(belief="recorded"))
    expected = f"in {seconds}.0 s of the log, between 9.0 and {8 + seconds}.0 s, although some were"
    assert any(expected in text for text in told) == is_told
    assert not any("No scan was near an object" in text for text in told)


@pytest.mark.parametrize(
    ("limit", "expected"),
    [
        (TIGHT, "up to 0.60 m and 1.7°, and objects need 0.12 m and 2.5° at most"),
        (NARROW, "up to 0.60 m, and objects need 0.5 m at most"),
    ],
)
def test_the_limit_that_a_wide_belief_exceeded_is_named(limit: Limit, expected: str) -> None:
    told = doubts(drive(), with_wide_belief(2, limit), RunOptions(belief="recorded"))
    assert any(expected in text for text in told)


def test_a_single_scan_of_a_wide_belief_has_no_duration() -> None:
    believed = estimator()
    robot = PoseBelief.whitened(np.zeros(3), np.diag([0.6, 0.6, 0.03]) ** 2, np.eye(3))
    believed.too_wide.note(10 * SECOND, robot, TIGHT)
    (told,) = [each for each in doubts(drive(), believed, RunOptions()) if "belief had" in each]
    assert told.startswith("No object was updated at 9.0 s of the log, although")


def test_errors_of_doors_that_the_building_lacks_are_named_with_their_file() -> None:
    error = BuildingErrorSettings(
        doors={"gone": DoorErrorSettings(hinge_std_m=0.1, bearing_std_deg=1.0)}
    )
    believed = estimator()
    believed.building = replace(believed.building, error=error)
    options = RunOptions(settings=Settings(building_error=error))
    told = [each for each in doubts(drive(), believed, options) if "'gone'" in each]
    assert re.search("of the settings names", told[0])
    assert re.search(r"of .*office\.building\.yaml names", told[1])


@pytest.mark.parametrize(("through", "is_told"), [(14, False), (16, True)])
def test_readings_that_pass_through_walls_are_told(through: int, is_told: bool) -> None:
    gone = drive()
    gone.returned, gone.through = 100, through
    told = [each for each in doubts(gone, estimator(), RunOptions()) if "pass through" in each]
    assert len(told) == is_told
    assert all(each.startswith("16 % of the readings") for each in told)


def test_leaves_that_no_beam_met_are_named() -> None:
    believed = estimator()
    items = believed.building.objects
    there = {"door_west": 0.02, "door_east": 0.6, "desk_1": 0.01}
    believed.objects = {
        name: SimpleNamespace(item=items[name], presence=presence)
        for name, presence in there.items()
    }
    told = [each for each in doubts(drive(), believed, RunOptions()) if "No beam met" in each]
    assert len(told) == 1
    assert re.search(r"leaf of door_west where .*p = 0\.98", told[0])


def test_a_log_of_another_building_is_no_success(tmp_path: Path) -> None:
    told = RunOptions(initial_pose=np.array([2.0, 0.0, 1.0]), end=40.0)
    result = estimate_log(
        [ROOT / "logs" / "corridor.mcap"],
        ROOT / "models" / "hotel" / "hotel.urdf",
        tmp_path / "out",
        told,
        world=tmp_path / "world.db",
    )
    assert result.warnings[0] == result.failures[0]
    assert "is it a log of this building" in result.failures[0]
    summary = json.loads((tmp_path / "out" / "run.json").read_text())
    assert summary["success"] is False
    assert summary["failures"] == list(result.failures)
    assert summary["lost_share"] == result.lost_share > 0.5
    assert summary["share_through"] == result.share_through > MOST_THROUGH
    assert (summary["world"]["added"], summary["world"]["unreliable"]) == (0, True)
    store = open_store(tmp_path / "world.db")
    assert (store.drives(), store.statics(), store.surveys()) == ([], {}, [])


@pytest.mark.parametrize("x", [5.0, 30.0])
def test_a_start_elsewhere_in_a_corridor_that_looks_alike_is_told(tmp_path: Path, x: float) -> None:
    options = RunOptions(initial_pose=np.array([x, 0.0, 0.0]), end=8.0)  # it stands at x = 1.5
    log, urdf = ROOT / "logs/corridor.mcap", ROOT / "models/corridor/corridor.urdf"
    result = estimate_log(log, urdf, tmp_path / "out", options)
    assert any("was probably lost from 0.0 s" in each for each in result.warnings)
    path = read_tum(tmp_path / "out" / "trajectory.tum")
    true = read_tum(ROOT / "logs/corridor.path.tum")
    now = np.searchsorted(true.stamps_ns, path.stamps_ns[-1])
    assert np.hypot(*(path.poses[-1] - true.poses[now])[:2]) < 0.1
