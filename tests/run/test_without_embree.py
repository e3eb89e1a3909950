"""Where embreex has no wheel, as on Linux on Arm, level lasers give the same results."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BUILDING = """
<robot name="hall">
  <link name="map">
    <collision><origin xyz="2 2 1"/><geometry><box size="8 0.1 2"/></geometry></collision>
    <collision><origin xyz="2 -2 1"/><geometry><box size="8 0.1 2"/></geometry></collision>
    <collision><origin xyz="6 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
    <collision><origin xyz="-2 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
  </link>
  <link name="leaf">
    <collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></collision>
  </link>
  <joint name="door" type="revolute">
    <parent link="map"/><child link="leaf"/>
    <origin xyz="3 -0.5 0"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="1.5" effort="0" velocity="0"/>
  </joint>
</robot>
"""
SCENE = """
building: hall.urdf
route: {{waypoints: [{{x: 0.0, y: 0.0}}, {{x: 0.6, y: 0.0}}]}}
lasers: [{{mount: {{z: 0.3, pitch: {pitch}}}}}]
objects: [{{name: door, initial: 0.9}}]
"""


def hall(folder: Path, pitch: float) -> Path:
    """A scene in a hall with one door, and a laser with some pitch in rad."""
    (folder / "hall.urdf").write_text(BUILDING)
    scene = folder / "hall.scene.yaml"
    scene.write_text(SCENE.format(pitch=pitch))
    return scene


def objstate(*arguments: object, embree: bool) -> subprocess.CompletedProcess[str]:
    start = ROOT / "cli.py" if embree else ROOT / "tests" / "without_embree.py"
    return subprocess.run(
        [sys.executable, start, *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("start", [[], ["--global"]])
def test_a_level_laser_gives_the_same_estimates(tmp_path: Path, start: list[str]) -> None:
    scene = hall(tmp_path, pitch=0.0)
    tables = []
    for embree in (True, False):
        drive, out = tmp_path / f"drive{embree}", tmp_path / f"out{embree}"
        simulated = objstate("simulate", scene, "--out", drive, embree=embree)
        assert simulated.returncode == 0, simulated.stderr
        log = tmp_path / "driveTrue" / "log.mcap"
        common = ["--building", tmp_path / "hall.urdf", "--out", out, "--mcap", *start]
        done = objstate("estimate", log, *common, embree=embree)
        assert done.returncode == 0, done.stderr
        tables.append((out / "estimates.parquet").read_bytes())
    assert tables[0] == tables[1]


def test_a_tilted_laser_is_an_error_that_names_the_cure(tmp_path: Path) -> None:
    drive = tmp_path / "drive"
    scene = hall(tmp_path, pitch=0.1)
    assert objstate("simulate", scene, "--out", drive, embree=True).returncode == 0
    common = ["estimate", drive / "log.mcap", "--building", tmp_path / "hall.urdf"]
    assert objstate(*common, "--out", tmp_path / "with", embree=True).returncode == 0
    done = objstate(*common, "--out", tmp_path / "without", embree=False)
    assert done.returncode == 1
    assert "laser 'laser' aren't level" in done.stderr
    assert "build it from source" in done.stderr
    assert not (tmp_path / "without").exists()
