"""Whole simulated drives: the log, the truth and the path agree, and can be repeated."""

from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from objstate.errors import ResultError, SettingsError
from objstate.geometry import rotation_from_quaternion
from objstate.logs import open_messages
from objstate.recording.logs import FORMATS
from objstate.recording.tables import read_truth
from objstate.recording.tum import read_tum
from objstate.simulation import simulate

NOISELESS = "lasers: [{sigma: 0.0, quantization: 0.0, range_max: 30.0}]\n"


def decoded(log: Path) -> dict[str, list[Any]]:
    by_topic: dict[str, list[Any]] = defaultdict(list)
    for message in open_messages(log):
        by_topic[message.topic].append((message.recorded_ns, message.decode()))
    return by_topic


def stamp(message: Any) -> int:
    return int(message.header.stamp.sec) * 10**9 + int(message.header.stamp.nanosec)


def add(scene: Path, text: str) -> Path:
    scene.write_text(scene.read_text() + text)
    return scene


def files(folder: Path) -> dict[str, bytes]:
    return {str(f.relative_to(folder)): f.read_bytes() for f in folder.rglob("*") if f.is_file()}


def test_a_bare_scene_makes_all_that_is_needed(scene: Path, tmp_path: Path) -> None:
    result = simulate(scene, tmp_path / "out")
    assert result.log == tmp_path / "out" / "log.mcap"
    assert {f.name for f in result.folder.iterdir()} >= {
        "log.mcap", "truth.csv", "path.tum", "scene.yaml",
    }  # fmt: skip
    topics = decoded(result.log)
    assert {topic: len(found) for topic, found in topics.items()} == result.counts
    assert set(topics) == {"/scan", "/odom", "/tf_static", "/initialpose"}
    assert [stamp(m) for _, m in topics["/scan"]] == read_tum(
        result.folder / "path.tum"
    ).stamps_ns.tolist()
    first = topics["/odom"][0][1].pose.pose.position
    assert (first.x, first.y) == (0.0, 0.0)
    assert {row.object for row in read_truth(result.folder / "truth.csv")} == {
        "door", "slider", "table",
    }  # fmt: skip


def test_noiseless_ranges_end_on_the_walls(scene: Path, tmp_path: Path) -> None:
    result = simulate(add(scene, NOISELESS), tmp_path / "out")
    path = read_tum(result.folder / "path.tum")
    for pose, (_, scan) in zip(path.poses, decoded(result.log)["/scan"], strict=True):
        bearings = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges)) + pose[2]
        straight = np.argmin(np.abs(bearings))
        assert scan.ranges[straight] == pytest.approx(5.0 - pose[0], abs=1e-4)
        down = np.argmin(np.abs(bearings + np.pi / 2))
        assert scan.ranges[down] == pytest.approx(3.0 + pose[1], abs=1e-4)


@pytest.mark.parametrize("kind", FORMATS)
def test_same_scene_and_seed_are_the_same_bytes(scene: Path, tmp_path: Path, kind: str) -> None:
    add(scene, "objects: [{initial: random}]\npeople: [{count: 2, region: [-4, -2, 4, 2]}]\n")
    first = simulate(scene, tmp_path / "a", format=kind)
    simulate(scene, tmp_path / "b", format=kind)
    assert files(tmp_path / "a") == files(tmp_path / "b")
    assert first.log.exists()
    other = files(simulate(scene, tmp_path / "c", format=kind, seed=4).folder)
    assert other["truth.csv"] != files(tmp_path / "a")["truth.csv"]


def test_scene_copy_repeats_the_drive(scene: Path, tmp_path: Path) -> None:
    simulate(scene, tmp_path / "a", seed=9)
    simulate(tmp_path / "a" / "scene.yaml", tmp_path / "b")
    assert files(tmp_path / "a") == files(tmp_path / "b")


def test_lasers_have_topics_frames_and_mounts_of_their_own(scene: Path, tmp_path: Path) -> None:
    add(scene, "lasers:\n"
        "  - {frame: low, rate: 4, phase: 0.5, mount: {x: 0.1, z: 0.2, roll: 3.14159265}}\n"
        "  - {frame: high, rate: 2, mount: {z: 1.0, pitch: 0.3, yaw: 1.0}}\n")  # fmt: skip
    topics = decoded(simulate(scene, tmp_path / "out").log)
    low, high = (topics[f"/scan_{name}"] for name in ("low", "high"))
    assert stamp(low[0][1]) - stamp(high[0][1]) == 125_000_000
    assert low[0][1].header.frame_id == "low"
    (_, mounts) = topics["/tf_static"][0]
    by_frame = {t.child_frame_id: t.transform for t in mounts.transforms}
    assert by_frame["low"].translation.z == 0.2
    q = by_frame["low"].rotation
    down = rotation_from_quaternion(q.x, q.y, q.z, q.w)[:, 2]
    np.testing.assert_allclose(down, [0, 0, -1], atol=1e-6)


def test_clock_offset_shows_between_stamps_and_recording(scene: Path, tmp_path: Path) -> None:
    add(scene, "model_error: {clock_offset: 0.05}\n")
    topics = decoded(simulate(scene, tmp_path / "out").log)
    assert {stamp(m) - recorded for recorded, m in topics["/scan"]} == {50_000_000}
    assert {stamp(m) - recorded for recorded, m in topics["/odom"]} == {0}


def test_recorded_belief_surrounds_the_truth(scene: Path, tmp_path: Path) -> None:
    add(scene, "belief: {rate: 2, count: 50}\ninitial_pose: null\n")
    result = simulate(scene, tmp_path / "out")
    topics = decoded(result.log)
    assert "/initialpose" not in topics
    path = read_tum(result.folder / "path.tum")
    assert len(topics["/particlecloud"]) > 10
    for _, cloud in topics["/particlecloud"]:
        x = np.array([pose.position.x for pose in cloud.poses])
        truth = np.interp(stamp(cloud), path.stamps_ns, path.poses[:, 0])
        assert len(x) == 50
        assert x.mean() == pytest.approx(truth, abs=0.2)
        assert 0.02 < x.std() < 0.1


def test_boxes_and_people_are_seen_in_front_of_the_walls(scene: Path, tmp_path: Path) -> None:
    add(scene, NOISELESS)
    bare = decoded(simulate(scene, tmp_path / "bare").log)["/scan"]
    add(scene, "boxes: [{pose: {x: 4.0, y: 0.0}}]\n"
        "people: [{route: [[3.0, -1.5], [3.0, 1.5]], shape: body}]\n")  # fmt: skip
    full = decoded(simulate(scene, tmp_path / "full").log)["/scan"]
    for (_, without), (_, with_them) in zip(bare, full, strict=True):
        assert (with_them.ranges <= without.ranges).all()
        hidden = with_them.ranges < without.ranges - 0.5
        assert 3 < hidden.sum() < 60


def test_carmen_names_what_it_could_not_hold(scene: Path, tmp_path: Path) -> None:
    result = simulate(scene, tmp_path / "out", format="carmen")
    assert any("/initialpose" in warning for warning in result.warnings)
    assert "/initialpose" not in result.counts


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("seeed: 1\n", "'seed'"),
        ("lasers: [{sigmma: 0.1}]\n", r"lasers\[0\]\.sigmma.*'sigma'"),
        ("lasers: [{angle_min: -90, angle_max: 90}]\n", "whole turn.*write -1.571"),
        ("lasers: [{frame: a}, {frame: a}]\n", "frame of its own"),
        ("lasers: [{rate: 20, time_increment: 0.01}]\n", "sweep"),
        ("people: [{speed: 1.0}]\n", "route or a region"),
        ("boxes: [{count: 2}]\n", "pose or a region"),
        ("objects: [{name: gate}]\n", "matches no object"),
        ("objects: [{name: door, changes: [{at: 5, to: 1}, {at: 4, to: 0}]}]\n", "in order"),
    ],
)
def test_faulty_scenes_name_place_and_cure(
    scene: Path, tmp_path: Path, text: str, message: str
) -> None:
    with pytest.raises(SettingsError, match=message):
        simulate(add(scene, text), tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_start_in_degrees_is_refused(scene: Path, tmp_path: Path) -> None:
    scene.write_text("building: room.urdf\nroute: {waypoints: [{x: 0, y: 0}], start_yaw: 90}\n")
    with pytest.raises(SettingsError, match=r"start_yaw.*write 1\.571"):
        simulate(scene, tmp_path / "out")


def test_routes_through_walls_are_refused(scene: Path, tmp_path: Path) -> None:
    scene.write_text(
        "building: room.urdf\nroute: {waypoints: [{x: 0, y: 0}, {x: 3, y: 0}, {x: 9, y: 0}]}\n"
    )
    with pytest.raises(SettingsError, match=r"waypoints\.2: .* after 2\.00 m of 6\.00 m"):
        simulate(scene, tmp_path / "out")


def test_existing_results_are_refused(scene: Path, tmp_path: Path) -> None:
    simulate(scene, tmp_path / "out")
    with pytest.raises(ResultError, match="--overwrite"):
        simulate(scene, tmp_path / "out")
    simulate(scene, tmp_path / "out", overwrite=True)
