"""Where embreex has no wheel, as on Linux on Arm, level lasers give the same results."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from objstate.cli import main
from tests.cli.conftest import Outcome, Run, run

__all__ = ["run"]

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
route: {{waypoints: [{{x: 0.0, y: 0.0}}, {{x: 0.9, y: 0.0}}]}}
lasers: [{{mount: {{z: 0.3, pitch: {pitch}}}}}]
objects: [{{name: door, initial: 0.9}}]
"""


def hall(folder: Path, pitch: float) -> Path:
    """A scene in a hall with one door, and a laser with some pitch in rad."""
    (folder / "hall.urdf").write_text(BUILDING)
    scene = folder / "hall.scene.yaml"
    scene.write_text(SCENE.format(pitch=pitch))
    return scene


def without_embree(*arguments: object) -> Outcome:
    """The command line in a process that finds no embreex."""
    done = subprocess.run(
        [sys.executable, ROOT / "tests" / "without_embree.py", *map(str, arguments)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    return Outcome(done.returncode, done.stdout, done.stderr)


@pytest.fixture(scope="module")
def level(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the hall and a drive of a level laser, which can also be simulated without."""
    folder = tmp_path_factory.mktemp("level")
    scene = hall(folder, pitch=0.0)
    assert main(["simulate", str(scene), "--out", str(folder / "drive")]) == 0
    simulated = without_embree("simulate", scene, "--out", folder / "without")
    assert simulated.code == 0, simulated.err
    return folder


@pytest.mark.parametrize("start", [[], ["--global"]])
def test_a_level_laser_gives_the_same_estimates(
    run: Run, level: Path, tmp_path: Path, start: list[str]
) -> None:
    tables = []
    for name, estimate in (("with", run), ("without", without_embree)):
        common = ["--building", level / "hall.urdf", "--out", tmp_path / name, "--mcap", *start]
        done = estimate("estimate", level / "drive" / "log.mcap", *common)
        assert done.code == 0, done.err
        tables.append((tmp_path / name / "estimates.parquet").read_bytes())
    assert tables[0] == tables[1]


def test_a_tilted_laser_is_an_error_that_names_the_cure(run: Run, tmp_path: Path) -> None:
    drive = tmp_path / "drive"
    scene = hall(tmp_path, pitch=0.1)
    assert run("simulate", scene, "--out", drive).code == 0
    common = ["estimate", drive / "log.mcap", "--building", tmp_path / "hall.urdf"]
    assert run(*common, "--out", tmp_path / "with").code == 0
    done = without_embree(*common, "--out", tmp_path / "without")
    assert done.code == 1
    assert "laser 'laser' aren't level" in done.err
    assert "build it from source" in done.err
    assert not (tmp_path / "without").exists()
