"""The experiments of the Darmstadt Dribblers' thesis, in small."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from objstate.experiments.darmstadt import accuracy, coverage, reproduce
from objstate.experiments.darmstadt.behaviours import bearing_of
from objstate.experiments.darmstadt.camera import NO_OBSTACLE, Aim, lines, shows, take
from objstate.experiments.darmstadt.coverage import ACTIVE, SWEEP, TRACKING, staring, way
from objstate.experiments.darmstadt.sectors import Sectors
from objstate.experiments.darmstadt.setting import BOX, POLE_RADIUS, Scene

POSE = np.array([0.2, -0.3, 0.4])
AIM = Aim(0.0, math.radians(20.0))
NO_POLES = np.empty((0, 2))


def ahead(metres: float, left: float = 0.0) -> np.ndarray:
    cos, sin = math.cos(POSE[2]), math.sin(POSE[2])
    return POSE[:2] + np.array([cos * metres - sin * left, sin * metres + cos * left])


@pytest.mark.parametrize("metres", [1.0, 1.8])
def test_a_pole_is_seen_where_it_meets_the_floor(metres: float) -> None:
    scene = Scene(ahead(metres)[None])
    seen = lines(take(scene, POSE, AIM), AIM, 4.0)
    points = seen.ends[seen.obstacle]
    assert len(points) >= 2
    assert points[:, 0].min() == pytest.approx(metres - POLE_RADIUS, abs=0.04)
    assert points[:, 1] == pytest.approx(0.0, abs=2.0 * POLE_RADIUS)


def test_a_box_is_seen_where_it_meets_the_floor() -> None:
    pose = np.zeros(3)
    seen = lines(take(Scene(NO_POLES, np.array([[1.5, 0.0]])), pose, AIM), AIM, 4.0)
    points = seen.ends[seen.obstacle]
    assert points[:, 0] == pytest.approx(1.5 - BOX[0] / 2.0, abs=0.03)
    assert np.ptp(points[:, 1]) == pytest.approx(BOX[1], abs=0.06)


def test_a_camera_that_is_rolled_finds_phantoms_behind_a_pole() -> None:
    scene = Scene(ahead(1.5)[None])
    rolled = lines(take(scene, POSE, Aim(0.0, AIM.tilt, math.radians(4.0))), AIM, 4.0)
    points = rolled.ends[rolled.obstacle]
    assert (points[:, 0] > 1.9).any()
    kept = rolled.percepts(POSE, 0.005, 0.005)
    off = scene.distances(kept.ends[kept.obstacle])
    assert off.max() < 0.4  # the rule leaves the far ones out


def test_an_obstacle_whose_base_is_not_in_the_picture_has_no_place() -> None:
    rows = take(Scene(ahead(0.35)[None]), POSE, AIM)
    assert (rows == 0).any()
    seen = lines(rows, AIM, 4.0)
    assert seen.obstacle.sum() <= (rows > 0).sum()
    assert (~seen.obstacle).sum() == (rows == NO_OBSTACLE).sum()


def test_what_stands_before_a_place_hides_it() -> None:
    place = ahead(2.0)
    assert shows(POSE, AIM, place, Scene(NO_POLES), 4.0)
    assert not shows(POSE, AIM, place, Scene(ahead(1.0)[None]), 4.0)
    assert not shows(POSE, AIM, ahead(-2.0), Scene(NO_POLES), 4.0)
    pan, tilt, away = bearing_of(place, POSE)
    assert (pan, tilt, away) == pytest.approx((0.0, math.atan2(0.52, 2.0), 2.0))


def test_sectors_forget_five_times_as_fast_in_view() -> None:
    seen = lines(take(Scene(ahead(1.5, 0.05)[None]), POSE, AIM), AIM, 4.0)
    none = lines(take(Scene(NO_POLES), POSE, AIM), AIM, 4.0)
    held = {}
    for pan in (0.0, math.pi):
        sectors = Sectors()
        sectors.update(seen, 0.0, 0.03)
        assert sectors.confidence.max() == 1.0
        sectors.update(none, pan, 1.0)
        held[pan] = sectors.confidence.max()
    assert 1.0 - held[0.0] == pytest.approx(5.0 * (1.0 - held[math.pi]))


def test_distances_are_those_to_outlines() -> None:
    scene = Scene(np.array([[1.0, 0.0]]), np.array([[-1.0, 0.0]]))
    points = np.array([[1.2, 0.0], [1.0, 0.0], [-1.0, 0.3], [-1.0, 0.0]])
    expected = [0.2 - POLE_RADIUS, -POLE_RADIUS, 0.3 - BOX[1] / 2.0, -BOX[1] / 2.0]
    assert scene.distances(points) == pytest.approx(expected)


def test_the_grid_knows_poles_better_than_sectors_do() -> None:
    found = list(accuracy.measure([0], 15.0, 1))
    assert [one.place for one in found] == [0, 1, 2]
    for one in found:
        assert one.occupied < 0.2
        assert one.free < 0.05
    assert sum(one.occupied for one in found) < sum(one.sector for one in found)


def test_staring_is_the_share_of_time_at_the_same_place() -> None:
    still, turning = np.zeros((200, 2)), np.zeros((200, 2))
    turning[:, 0] = np.linspace(0.0, 3.0, 200)
    assert staring(still) == 1.0
    assert staring(turning) == 0.0


def test_the_way_round_the_ball_has_no_jumps() -> None:
    poses = np.array([way(each) for each in np.arange(0.0, 90.0, 0.1)])
    steps = np.abs(np.diff(poses[:, :2], axis=0)).max()
    assert steps == pytest.approx(coverage.SPEED * 0.1)
    assert np.abs(poses[:, 0]).max() <= 1.5
    assert np.abs(poses[:, 1]).max() <= 1.0


def test_the_orderings_of_the_thesis_come_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(coverage, "SECONDS", 20.0)
    monkeypatch.setattr(coverage, "STANDS", (ACTIVE, SWEEP, TRACKING))
    found = {each.behaviour: each for each in coverage.cover(False, [1], 1)}
    active, sweep, tracking = (found[name] for name in (ACTIVE, SWEEP, TRACKING))
    assert sweep.observed > active.observed > tracking.observed
    assert tracking.ball > max(active.ball, sweep.ball)
    assert min(active.front, sweep.front) > tracking.front
    assert tracking.staring > max(active.staring, sweep.staring)


def test_same_seeds_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from objstate.experiments.darmstadt import reproduction

    monkeypatch.setattr(reproduction, "ACCURACY_S", 5.6)
    for name in "ab":
        reproduce([0], out=tmp_path / name, only=["accuracy"])
    for name in ("tables.md", "fig7_2_models.png"):
        one, other = ((tmp_path / each / name).read_bytes() for each in "ab")
        assert one == other
    assert "table 7.5" in (tmp_path / "a" / "tables.md").read_text()
