"""A building learnt from drives, against a known truth, and as a user types it."""

from __future__ import annotations

import json
import math
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from objstate.building import load_building
from objstate.building.model import Building
from objstate.building.outline import outline
from objstate.calibration import read_calibration
from objstate.discovery import refine_building
from objstate.editing.rows import Edits
from objstate.editing.saving import save
from objstate.editing.subject import subject_of
from objstate.simulation import simulate
from tests.cli.conftest import Run, run

__all__ = ["run"]

HALL = """
<robot name="hall">
  <link name="map">
    <collision><origin xyz="3 2 1"/><geometry><box size="12 0.1 2"/></geometry></collision>
    <collision><origin xyz="3 -2 1"/><geometry><box size="12 0.1 2"/></geometry></collision>
    <collision><origin xyz="9 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
    <collision><origin xyz="-3 0 1"/><geometry><box size="0.1 4 2"/></geometry></collision>
  </link>
  {doors}
</robot>
"""
PIECE = """
  <link name="body_{name}">
    <collision><origin xyz="0 0 0.5"/><geometry><box size="0.6 0.4 1"/></geometry></collision>
  </link>
  <joint name="{name}" type="planar">
    <parent link="map"/><child link="body_{name}"/>
    <origin xyz="{x} {y} 0" rpy="0 0 0"/><axis xyz="0 0 1"/>
  </joint>
"""
DOOR = """
  <link name="leaf_{name}">
    <collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></collision>
  </link>
  <joint name="{name}" type="revolute">
    <parent link="map"/><child link="leaf_{name}"/>
    <origin xyz="{x} {y} 0" rpy="0 0 {yaw}"/><axis xyz="0 0 {axis}"/>
    <limit lower="0" upper="1.5" effort="0" velocity="0"/>
  </joint>
"""
RAIL = """
  <link name="leaf_{name}">
    <collision><origin xyz="0.45 0 1"/><geometry><box size="0.9 0.04 2"/></geometry></collision>
  </link>
  <joint name="{name}" type="prismatic">
    <parent link="map"/><child link="leaf_{name}"/>
    <origin xyz="{x} {y} 0" rpy="0 0 0"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="0.85" effort="0" velocity="0"/>
  </joint>
"""
ROUTE = {"waypoints": [{"x": -0.5, "y": 0.0}, {"x": 5.5, "y": 0.0}]}
# by door: place, yaw, axis; how far the model is off (m, m, rad)
TRUTH = {"north": (1.0, 0.9, 0.0, 1), "south": (3.5, -0.9, 0.0, -1), "far": (4.8, 0.9, 0.0, 1)}
OFF = {"north": (0.02, -0.02, 0.035), "south": (-0.02, 0.01, -0.035), "far": (0.01, 0.02, 0.03)}
# where furniture stands each day; the model has it at the origin of these
PLACES = {"cabinet": (7.4, -1.2), "desk": (7.0, 1.1)}
STOOD = {
    "cabinet": [(0.04, -0.03, 0.05)] * 3,
    "desk": [(0.1, 0.0, 0.1), (-0.1, 0.1, 0.0), (0.0, -0.1, -0.2)],
}
ROOT = Path(__file__).parents[2]
LEARN = ("building", "learn")
DAYS = (
    {"north": 0.0, "south": 0.0, "far": 0.9},
    {"north": 0.7, "south": 0.0, "far": 0.0},
    {"north": 0.0, "south": 0.5, "far": 0.0},
    {"north": 0.0, "south": 0.0, "far": 0.0},
)


def urdf(off: dict[str, tuple[float, float, float]] | None = None) -> str:
    doors = ""
    for name, (x, y, yaw, axis) in TRUTH.items():
        dx, dy, turn = (off or {}).get(name, (0.0, 0.0, 0.0))
        doors += DOOR.format(name=name, x=x + dx, y=y + dy, yaw=yaw + turn, axis=axis)
    return HALL.format(doors=doors)


@pytest.fixture(scope="module")
def drives(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Path]]:
    """A wrong model of a hall, and logs of drives through the true one on several days."""
    folder = tmp_path_factory.mktemp("hall")
    (folder / "true.urdf").write_text(urdf())
    (folder / "hall.urdf").write_text(urdf(OFF))
    logs = []
    for day, angles in enumerate(DAYS):
        objects = [{"name": name, "initial": angle} for name, angle in angles.items()]
        scene = {"building": "true.urdf", "seed": day, "route": ROUTE, "objects": objects}
        (folder / f"day{day}.yaml").write_text(yaml.safe_dump(scene))
        logs.append(simulate(folder / f"day{day}.yaml", folder / f"day{day}").log)
    return folder / "hall.urdf", logs


def test_doors_are_found_where_they_hang(
    run: Run,
    drives: tuple[Path, list[Path]],
    tmp_path: Path,
) -> None:
    model, logs = drives
    done = run(*LEARN, *logs, "--building", model, "--out", tmp_path / "better", "--jobs", 1)
    assert done.code == 0, done.err
    assert all(name in done.out for name in TRUTH)
    better = load_building(tmp_path / "better" / "hall.urdf")
    for name, (x, y, yaw, _) in TRUTH.items():
        item = better.objects[name]
        assert item.hinge == pytest.approx([x, y], abs=0.01)  # known to 0.5 to 0.8 cm
        turned = math.atan2(item.origin[1, 0], item.origin[0, 0])
        assert math.degrees(turned) == pytest.approx(math.degrees(yaw), abs=0.3)
    assert better.error is not None
    assert better.error.doors["north"].bearing_std_deg < 0.5


def test_rails_are_found_across_and_where_doors_were_at_a_limit_along(tmp_path: Path) -> None:
    true = {"often": (1.0, 0.9), "never": (4.5, 0.9)}
    off = {"often": (0.02, -0.02), "never": (0.02, 0.02)}
    states = [(0.0, 0.5), (0.4, 0.3), (0.0, 0.6), (0.85, 0.2)]  # m, of both each day
    for name, moved in (("true", {}), ("hall", off)):
        rails = ""
        for door, place in true.items():
            x, y = np.add(place, moved.get(door, (0.0, 0.0)))
            rails += RAIL.format(name=door, x=x, y=y)
        (tmp_path / f"{name}.urdf").write_text(HALL.format(doors=rails))
    logs = []
    for day, state in enumerate(states):
        objects = [{"name": name, "initial": at} for name, at in zip(true, state, strict=True)]
        scene = {"building": "true.urdf", "seed": day, "route": ROUTE, "objects": objects}
        (tmp_path / f"day{day}.yaml").write_text(yaml.safe_dump(scene))
        logs.append(simulate(tmp_path / f"day{day}.yaml", tmp_path / f"day{day}").log)
    refined = refine_building(logs, tmp_path / "hall.urdf", tmp_path / "better", jobs=1)
    for door in refined.doors:
        missing = door.hinge + off[door.name]
        along, across = np.sqrt(np.diag(door.covariance)[:2])
        assert abs(missing[1]) < 0.003
        assert across < 0.004
        assert abs(missing[0]) < 2.0 * along
        assert (along < 0.012) == (door.name == "often")


def test_furniture_that_never_moves_is_put_where_it_stands(run: Run, tmp_path: Path) -> None:
    pieces = "".join(PIECE.format(name=name, x=x, y=y) for name, (x, y) in PLACES.items())
    model, logs = tmp_path / "hall.urdf", []
    model.write_text(HALL.format(doors=pieces))
    for day in range(3):
        objects = []
        for name, (x, y) in PLACES.items():
            dx, dy, yaw = STOOD[name][day]
            objects.append({"name": name, "initial": {"x": x + dx, "y": y + dy, "yaw": yaw}})
        scene = {"building": "hall.urdf", "seed": day, "route": ROUTE, "objects": objects}
        (tmp_path / f"day{day}.yaml").write_text(yaml.safe_dump(scene))
        logs.append(simulate(tmp_path / f"day{day}.yaml", tmp_path / f"day{day}").log)
    done = run(*LEARN, *logs, "--building", model, "--out", tmp_path / "better", "--jobs", 1)
    assert "Furniture" in done.out
    told = json.loads((tmp_path / "better" / "learn.json").read_text())["furniture"]
    pieces = {each["piece"]: each for each in told}
    better = load_building(tmp_path / "better" / "hall.urdf").objects
    assert pieces["cabinet"]["p_fixed"] > 0.9
    off = better["cabinet"].home - np.array([*PLACES["cabinet"], 0.0])
    assert off == pytest.approx(STOOD["cabinet"][0], abs=0.02)
    assert pieces["desk"]["p_fixed"] < 0.1
    assert better["desk"].home == pytest.approx([*PLACES["desk"], 0.0])


def test_it_goes_on_from_what_it_knows(
    run: Run, drives: tuple[Path, list[Path]], tmp_path: Path
) -> None:
    model, logs = drives
    together, by_turns = tmp_path / "together", tmp_path / "by_turns"
    run(*LEARN, *logs[:3], "--building", model, "--out", together, "--jobs", 1)
    run(*LEARN, *logs[:2], "--building", model, "--out", by_turns, "--jobs", 1)
    known = (by_turns / "learn.json").read_bytes()
    own = run(*LEARN, logs[2], "--building", by_turns, "--out", by_turns, "--overwrite")
    assert own.code == 1
    assert "hall.urdf lies in" in own.err
    (by_turns / "notes.txt").write_text("mine")
    refused = run(*LEARN, logs[2], "--building", model, "--out", by_turns)
    assert "objstate didn't write" in refused.err
    (by_turns / "notes.txt").unlink()
    assert (by_turns / "learn.json").read_bytes() == known
    run(*LEARN, logs[2], logs[0], "--building", model, "--out", by_turns)  # one it knows already
    words = [json.loads((each / "learn.json").read_text()) for each in (together, by_turns)]
    assert len(words[1]["drives"]) == 3
    for one, other in zip(words[0]["doors"], words[1]["doors"], strict=True):
        # drives that saw a leaf at few angles tell where it is, and less of its hinge
        assert one["hinge_m"] == pytest.approx(other["hinge_m"], abs=one["hinge_std_m"])
        closed = [np.add(each["hinge_m"], each["leaf_m"]) for each in (one, other)]
        assert closed[0] == pytest.approx(closed[1], abs=0.004)
        assert one["bearing_deg"] == pytest.approx(
            other["bearing_deg"], abs=0.5 * one["bearing_std_deg"]
        )
    assert words[0]["walls"] == words[1]["walls"]
    assert words[0]["lasers"] == words[1]["lasers"]


def test_decisions_and_drives_of_an_edited_folder_last_by_the_cure_that_is_told(
    run: Run, drives: tuple[Path, list[Path]], tmp_path: Path
) -> None:
    model, logs = drives
    better, edited = tmp_path / "better", tmp_path / "edited"
    learn = (*LEARN, "--building", model, "--out", better)
    run(*learn, logs[0])
    subject = subject_of(better)
    north, south, far = sorted(subject.rows, key=lambda row: row.x)
    moved = north.model_copy(update={"x": north.x + 0.1, "decision": "accepted"})
    rejected = far.model_copy(update={"decision": "rejected"})
    save(subject, Edits(doors=[moved, south, rejected]))
    before = (better / "decisions.json").read_bytes()
    refused = run(*learn, logs[1])
    assert refused.code == 1
    told = " ".join(refused.err.split())
    assert f"copy the folder {better} to EDITED, remove {better}/decisions.json" in told
    assert f"'objstate building edit {better} --out EDITED'" in told
    assert (better / "decisions.json").read_bytes() == before
    shutil.copytree(better, edited)
    (better / "decisions.json").unlink()
    assert run(*learn, logs[1]).code == 0
    assert len(json.loads((better / "learn.json").read_text())["drives"]) == 2
    again = subject_of(better, edited)
    save(again, Edits(doors=again.rows))
    doors = load_building(edited / "hall.urdf").objects
    assert set(doors) == {"north", "south"}
    assert doors["north"].hinge == pytest.approx([moved.x, moved.y], abs=1e-4)
    learnt = load_building(better / "hall.urdf")["south"]
    assert doors["south"].hinge == pytest.approx(learnt.hinge, abs=1e-6)


def test_a_drive_that_was_lost_is_left_out_by_name(
    run: Run, drives: tuple[Path, list[Path]], tmp_path: Path
) -> None:
    model, logs = drives
    simulate(ROOT / "benchmarks" / "scenes" / "room.scene.yaml", tmp_path / "room", seed=3)
    lost = tmp_path / "room" / "log.mcap"
    alone = run(*LEARN, lost, "--building", model, "--out", tmp_path / "alone")
    assert alone.code == 1
    assert re.search(r"room/log\.mcap: The robot was probably lost for \d+ %", alone.err)
    assert not (tmp_path / "alone").exists()
    copied = tmp_path / "copy.mcap"
    shutil.copy(logs[0], copied)
    both = run(*LEARN, logs[0], lost, copied, "--building", model, "--out", tmp_path / "both")
    assert both.code == 0, both.err
    assert re.search(r"room/log\.mcap: The robot was probably lost .* It is left out\.", both.err)
    assert f"{copied} holds the same as {logs[0]}" in both.err
    run(*LEARN, logs[0], "--building", model, "--out", tmp_path / "one")
    one, other = (
        json.loads((tmp_path / out / "learn.json").read_text()) for out in ("one", "both")
    )
    assert one == other


def test_walls_are_found_where_they_stand(
    run: Run, drives: tuple[Path, list[Path]], tmp_path: Path
) -> None:
    """A piece of wall that stands in; and the same bytes with one job and with two."""
    _, logs = drives
    whole = (
        '<collision><origin xyz="3 2 1"/><geometry><box size="12 0.1 2"/></geometry></collision>'
    )
    pieces = "".join(
        f'<collision><origin xyz="{x} {y} 1"/><geometry><box size="4 0.1 2"/></geometry></collision>'
        for x, y in ((-1.0, 2.0), (3.0, 1.98), (7.0, 2.0))
    )
    assert whole in urdf()
    (tmp_path / "hall.urdf").write_text(urdf().replace(whole, pieces))
    for jobs in (1, 2):
        out = tmp_path / f"by_{jobs}"
        done = run(
            *LEARN, *logs[:2], "--building", tmp_path / "hall.urdf", "--out", out, "--jobs", jobs
        )
        assert done.code == 0, done.err
    one, two = (sorted((tmp_path / f"by_{jobs}").iterdir()) for jobs in (1, 2))
    assert [file.name for file in one] == [file.name for file in two]
    assert all(a.read_bytes() == b.read_bytes() for a, b in zip(one, two, strict=True))
    assert stands_in(load_building(tmp_path / "hall.urdf")) == pytest.approx(0.02)
    assert stands_in(load_building(tmp_path / "by_1" / "hall.urdf")) == pytest.approx(
        0.0, abs=0.004
    )
    mounts, _ = read_calibration(tmp_path / "by_1" / "calibration.yaml")
    assert mounts
    assert "Walls before" in (tmp_path / "by_1" / "report.html").read_text()


def stands_in(hall: Building) -> float:
    """How far the north wall's middle piece stands before the one east of it, m."""
    west, east = (
        min(
            float(np.interp(x, *segment[np.argsort(segment[:, 0])].T))
            for segment in outline(hall.walls, 0.3)
            if segment[:, 0].min() < x < segment[:, 0].max() and segment[:, 1].min() > 1.5
        )
        for x in (4.5, 5.5)
    )
    return float(east - west)


def test_it_says_what_is_wrong(run: Run, drives: tuple[Path, list[Path]], tmp_path: Path) -> None:
    model, logs = drives
    out = tmp_path / "out"
    neither = run(*LEARN, logs[0], "--out", out)
    assert (neither.code, out.exists()) == (1, False)
    assert "Give --map" in neither.err
    both = run(*LEARN, logs[0], "--out", out, "--map", "map.yaml", "--building", model)
    assert both.code == 1
    assert "leave one of them out" in both.err
    into = run(*LEARN, logs[0], "--building", model, "--out", model.parent, "--overwrite")
    assert into.code == 1
    assert "won't be overwritten" in into.err
    out.mkdir()
    (out / "learn.json").write_text("{nothing")
    damaged = run(*LEARN, logs[0], "--building", model, "--out", out)
    assert damaged.code == 1
    assert "can't be gone on from" in damaged.err
    assert (out / "learn.json").read_text() == "{nothing"
