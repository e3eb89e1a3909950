"""The walls of a folder that was learnt in a map are made anew from it."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from objstate.building import building_from_map, load_building
from objstate.building.door_table import door_rows
from objstate.building.from_map import building_of_map
from objstate.building.occupancy import read_map
from objstate.building.writing import DOORS_FILE, LEARN_FILE, write_buildings
from objstate.editing import edit_page
from objstate.editing.rows import DoorRow, Edits
from objstate.editing.saving import save
from objstate.editing.subject import Subject, subject_of

DOOR = DoorRow(name="door_01", x=2.0, y=2.475, bearing=0.0, width=1.0, upper=95.0, sense=1)
OTHER = DoorRow(name="door_02", x=4.0, y=2.475, bearing=0.0, width=0.9, upper=95.0, sense=1)


def write_map(path: Path, wall: int = 10) -> None:
    """A corridor of 6 m by 2 m, without an opening in the wall of a row of pixels."""
    pixels = np.full((60, 120), 254, dtype=np.uint8)
    pixels[[wall, 50], :] = 0
    Image.fromarray(pixels).save(path.with_suffix(".pgm"))
    path.write_text(f"image: {path.stem}.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")


@pytest.fixture
def found(tmp_path: Path) -> Path:
    """A folder as ``learn --map plan.yaml --out found`` writes it, with one probable door."""
    plan = tmp_path / "plan.yaml"
    write_map(plan)
    building = replace(building_of_map(read_map(plan), [DOOR.door]), name="building")
    beside = {LEARN_FILE: json.dumps({"map": "plan.yaml", "drives": [], "doors": []})}
    return write_buildings(tmp_path / "found", {".": building}, {}, beside)[0].parent


def save_with(subject: Subject, decision: str, *more: DoorRow) -> None:
    rows = [row.model_copy(update={"decision": decision}) for row in subject.rows]
    save(subject, Edits(doors=[*rows, *more]))


@pytest.mark.parametrize("decision", ["kept", "accepted", "rejected"])
@pytest.mark.parametrize("more", [(), (OTHER,)])
def test_walls_are_those_of_the_map_with_the_same_table(
    found: Path, decision: str, more: tuple[DoorRow, ...]
) -> None:
    subject = subject_of(found)
    assert subject.warnings == ()
    save_with(subject, decision, *more)
    made = building_from_map(found.parent / "plan.yaml", found / DOORS_FILE, found.parent / "made")
    expected, walls = load_building(made), load_building(found / "building.urdf")
    assert walls.walls.vertices == pytest.approx(expected.walls.vertices, abs=1e-5)
    assert np.array_equal(walls.walls.faces, expected.walls.faces)
    assert walls.objects.keys() == expected.objects.keys()
    for name, leaf in walls.objects.items():
        assert leaf.origin == pytest.approx(expected[name].origin, abs=1e-9)
        assert leaf.mesh.vertices == pytest.approx(expected[name].mesh.vertices, abs=1e-9)
    again = subject_of(found)
    assert again.warnings == ()
    assert again.plan is not None


def test_what_stands_within_a_leafs_swing_stays_where_the_map_shows_the_leaf_elsewhere(
    tmp_path: Path,
) -> None:
    """The map shows the leaf open by 80 degrees, and a cupboard 0.3 m behind the opening."""
    plan, door = tmp_path / "plan.yaml", DOOR.model_copy(update={"in_map": 80.0})
    write_map(plan)
    picture = plan.with_suffix(".pgm")
    pixels = np.array(Image.open(picture))
    pixels[2:5, 50:56] = 0
    Image.fromarray(pixels).save(picture)
    building = replace(building_of_map(read_map(plan), [door.door]), name="building")
    assert (building.walls.vertices[:, 1] > 2.7).any()
    beside = {
        LEARN_FILE: json.dumps({"map": "plan.yaml", "drives": [], "doors": []}),
        DOORS_FILE: door_rows([door.door]),
    }
    found = write_buildings(tmp_path / "found", {".": building}, {}, beside)[0].parent
    subject = subject_of(found)
    assert subject.warnings == ()
    save_with(subject, "rejected")
    walls = load_building(found / "building.urdf").walls
    assert walls.vertices == pytest.approx(building_of_map(read_map(plan)).walls.vertices, abs=1e-5)


@pytest.mark.parametrize("other", [None, 12])
def test_walls_stay_where_the_map_is_gone_or_another(
    found: Path, monkeypatch: pytest.MonkeyPatch, other: int | None
) -> None:
    monkeypatch.chdir(found)
    plan = found.parent / "plan.yaml"
    plan.unlink()
    if other is not None:
        write_map(plan, other)
    before = (found / "walls.stl").read_bytes()
    subject = subject_of(found)
    (told,) = subject.warnings
    assert f"The walls of {found} stay as they are" in told
    assert "plan.yaml" in told
    assert f"The walls of {found} stay" in edit_page(subject, np.zeros((0, 2)))
    save_with(subject, "rejected")
    assert (found / "walls.stl").read_bytes() == before


@pytest.mark.parametrize("name", ["pipe", "plan\0.yaml", "\ud800.yaml", "m" * 300, "."])
def test_a_map_that_is_no_regular_file_is_told(found: Path, name: str) -> None:
    os.mkfifo(found.parent / "pipe")
    (found / LEARN_FILE).write_text(json.dumps({"map": name}))
    subject = subject_of(found)
    assert subject.plan is None
    (told,) = subject.warnings
    assert f"There is no file {name!r}, which learn.json names as the map" in told


def test_a_map_is_found_from_any_working_directory(
    found: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    elsewhere = found.parent / "elsewhere"
    elsewhere.mkdir()
    (elsewhere / "link").symlink_to(found)
    monkeypatch.chdir(elsewhere)
    assert subject_of(found).plan is not None
    assert subject_of("link").plan is not None
    monkeypatch.chdir(found)
    assert subject_of(Path()).plan is not None
    learn = found / LEARN_FILE
    learn.write_text(json.dumps({"map": "maps/plan.yaml"}))
    (elsewhere / "maps").mkdir()
    for name in ("plan.yaml", "plan.pgm"):
        (found.parent / name).rename(elsewhere / "maps" / name)
    monkeypatch.chdir(elsewhere)
    assert subject_of(found).plan is not None
