"""The sample building and log are what their makers make, and agree with each other."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest

from objstate.building import load_building
from objstate.building.model import Building, Kind, Mesh
from objstate.geometry import compose, transform_from_pose
from objstate.logs import open_messages
from objstate.recording.tables import read_truth
from objstate.recording.tum import read_tum
from objstate.records import Rays
from objstate.sensing.embree import EmbreeCaster
from objstate.sensing.expected import cast_from
from objstate.simulation import simulate

ROOT = Path(__file__).parents[2]
MODELS, LOGS = ROOT / "models", ROOT / "logs"
LASERS = {"front": np.array([0.22, 0.0, 0.0]), "rear": np.array([-0.22, 0.0, np.pi])}
HEIGHT = 0.3  # m, of both


@pytest.mark.parametrize("name", ["corridor", "office"])
def test_models_are_what_their_script_writes(name: str, tmp_path: Path) -> None:
    runpy.run_path(str(MODELS / "make.py"))[name]().write(tmp_path / "made.urdf")
    assert (tmp_path / "made.urdf").read_bytes() == (MODELS / name / f"{name}.urdf").read_bytes()


def test_corridor_has_doors_of_every_kind() -> None:
    building = load_building(MODELS / "corridor" / "corridor.urdf")
    doors = [item for item in building.objects.values() if item.kind is Kind.HINGED]
    assert len(doors) == 14
    for door in doors:  # the leaf opens through 0.9 m, free of the walls
        tips = door.transforms(np.array([[0.0], [door.upper]])) @ [0.9, 0.0, 1.0, 1.0]
        assert np.hypot(*(tips[1] - tips[0])[:2]) > 1.2
    assert {np.sign(door.axis[2]) for door in doors} == {-1.0, 1.0}


def test_office_has_desks_that_a_low_laser_sees_by_their_legs() -> None:
    building = load_building(MODELS / "office" / "office.urdf")
    desks = [item for name, item in building.objects.items() if name.startswith("desk")]
    assert len(desks) == 4
    for desk in desks:
        around = np.linspace(0.0, 2 * np.pi, 3600, endpoint=False)
        ahead = np.column_stack([np.cos(around), np.sin(around), np.zeros(3600)])
        origins = np.tile([0.0, 0.0, HEIGHT], (3600, 1))
        hit = np.isfinite(EmbreeCaster(desk.mesh).distances(origins, ahead))
        assert np.count_nonzero(np.diff(hit.astype(int)) == 1) == 4
        assert hit.mean() < 0.15


def test_log_is_small_and_repeats(tmp_path: Path) -> None:
    result = simulate(MODELS / "corridor" / "corridor.scene.yaml", tmp_path / "out")
    made, kept = open_messages(result.log), open_messages(LOGS / "corridor.mcap")
    for a, b in zip(made, kept, strict=True):
        assert (a.topic, a.recorded_ns) == (b.topic, b.recorded_ns)
        if a.topic.startswith("/scan"):  # Embree's last digit may differ from machine to machine
            same = np.isclose(a.decode().ranges, b.decode().ranges, rtol=0.0, atol=0.0015)
            assert same.mean() > 0.98
    assert (LOGS / "corridor.mcap").stat().st_size < 2e6
    assert read_truth(result.folder / "truth.csv") == read_truth(LOGS / "corridor.truth.csv")


def test_readings_lie_about_the_truth_as_the_scene_says() -> None:
    building = load_building(MODELS / "corridor" / "corridor.urdf")
    world = EmbreeCaster(_as_it_was(building))
    path = read_tum(LOGS / "corridor.path.tum")
    poses = dict(zip(path.stamps_ns.tolist(), path.poses, strict=True))
    off = []
    for message in list(open_messages(LOGS / "corridor.mcap", ["/scan_front", "/scan_rear"]))[::7]:
        scan = message.decode()
        stamp = scan.header.stamp.sec * 10**9 + scan.header.stamp.nanosec
        laser = compose(poses[stamp], LASERS[scan.header.frame_id])
        bearings = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        ahead = np.column_stack([np.cos(bearings), np.sin(bearings), np.zeros(len(bearings))])
        rays = Rays(np.tile([0.0, 0.0, HEIGHT], (len(bearings), 1)), ahead)
        expected = world.distances(*cast_from(transform_from_pose(laser), rays))
        seen = np.isfinite(scan.ranges) & (expected < scan.range_max)
        off.append(scan.ranges[seen] - expected[seen])
    errors = np.concatenate(off)
    good = np.abs(errors) < 0.15
    assert 1.0 - good.mean() == pytest.approx(0.02, abs=0.004)
    assert errors[good].std() == pytest.approx(0.03, abs=0.002)
    assert errors[good].mean() == pytest.approx(0.0, abs=0.001)


def _as_it_was(building: Building) -> Mesh:
    """Walls and doors at their true angles, in one mesh."""
    parts = [building.walls]
    for row in read_truth(LOGS / "corridor.truth.csv"):
        door = building[row.object]
        parts.append(door.mesh.moved(door.transforms(np.array([[row.value]]))[0]))
    return Mesh.joined(parts)
