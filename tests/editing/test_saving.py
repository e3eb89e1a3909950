"""What a person decided is what the building has, and stays decided."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from objstate.building import inspect_building, load_building
from objstate.building.door_table import read_doors
from objstate.building.model import Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.building.sidecar import read_sidecar
from objstate.building.writing import CALIBRATION, LEARN_FILE, REPORT_FILE, write_buildings
from objstate.building.written import list_files
from objstate.editing.rows import DoorRow, Edits, leaf_of, row_of
from objstate.editing.saving import save
from objstate.editing.subject import subject_of
from objstate.errors import BuildingError
from objstate.geometry import transform, transform_from_pose

HEADER = "door,hinge_x,hinge_y,closed_bearing_deg,opens,width_m,upper_limit_deg"


def added(name: str = "new", **changes: object) -> DoorRow:
    values = {
        "name": name, "x": 1.0, "y": 4.0, "bearing": 180.0, "width": 0.8, "upper": 90.0, "sense": 1,
        "decision": "accepted",
    }  # fmt: skip
    return DoorRow.model_validate(values | changes)


def test_a_door_becomes_a_row_and_is_the_same_leaf_again(folder: Path) -> None:
    building = load_building(folder / "room.urdf")
    row = row_of(building["left"])
    assert row == DoorRow(name="left", x=2, y=0, bearing=0, width=1, upper=100, sense=1)
    assert leaf_of(row, building["left"]) is building["left"]
    assert [row_of(building[name]) for name in ("drawer", "desk")] == [None, None]


@pytest.mark.parametrize("lower", [-1.5, 0.0])
def test_a_row_states_the_same_swing_as_the_door(folder: Path, lower: float) -> None:
    door = load_building(folder / "room.urdf")["left"]
    other = DoorRow(name="left", x=1, y=2, bearing=30, width=0.7, upper=80, sense=1)
    leaf = leaf_of(other, door)
    assert row_of(leaf) == other
    # the same motion told the other way round: the axis turned over, and the limits with it
    over = replace(leaf, axis=-leaf.axis, lower=-leaf.upper, upper=0.0)
    assert row_of(over) == other
    assert row_of(replace(leaf, lower=lower - 0.1)) is None  # closed is no limit of it


def with_handle(leaf: MovableObject) -> MovableObject:
    """The same leaf with a handle that stands out on one side, near its free edge."""
    handle = Box((0.1, 0.06, 0.02)).mesh().moved(transform(np.eye(3), (0.9, 0.05, 1.0)))
    return replace(leaf, mesh=Mesh.joined([leaf.mesh, handle]))


def learnt(folder: Path) -> MovableObject:
    """The door of a building that was learnt: its leaf lies beside its hinge, with a deviation."""
    building = load_building(folder / "room.urdf")
    origin = transform_from_pose(np.array([2.0, 0.0, math.radians(1.23456)]))
    aside = transform(np.eye(3), (0.01, -0.03, 0.0))
    leaf = with_handle(building["left"])
    leaf = replace(leaf, origin=origin, mesh=leaf.mesh.moved(aside))
    sidecar = (
        "building_error:\n  doors:\n    left: {hinge_std_m: 0.004, bearing_std_deg: 0.2}\n"
        "    drawer: {hinge_std_m: 0.003, bearing_std_deg: 0.1}\n"
    )
    write_buildings(folder, {".": building.with_object(leaf)}, {".": sidecar})
    return load_building(folder / "room.urdf")["left"]


@pytest.mark.parametrize("bearing", [0.0, 1.23456, 90.0, -123.0])
def test_the_bearing_is_that_of_the_leaf_whatever_its_offset_and_handle(bearing: float) -> None:
    row = DoorRow(name="a", x=1, y=2, bearing=bearing, width=0.97, upper=80, sense=1)
    leaf = with_handle(leaf_of(row, None))
    aside = transform(np.eye(3), (0.02, 0.04, 0.0))
    for item in (leaf, replace(leaf, mesh=leaf.mesh.moved(aside))):
        back = row_of(item)
        assert back is not None
        assert back.bearing == pytest.approx(bearing, abs=1e-3)


@pytest.mark.parametrize("changes", [{"name": "kitchen"}, {"upper": 85.0}])
def test_another_name_or_limit_keeps_the_leaf_and_its_deviations(
    folder: Path, changes: dict[str, Any]
) -> None:
    before, subject = learnt(folder), subject_of(folder)
    save(subject, Edits(doors=[subject.rows[0].model_copy(update=changes)]))
    name = changes.get("name", "left")
    after = load_building(folder / "room.urdf")[name]
    assert after.origin == pytest.approx(before.origin, abs=1e-9)
    assert after.mesh.vertices == pytest.approx(before.mesh.vertices, abs=1e-6)
    assert math.degrees(after.upper) == pytest.approx(changes.get("upper", 100.0))
    known = read_sidecar(folder / "room.urdf").doors
    assert {each: own.hinge_std_m for each, own in known.items()} == {name: 0.004, "drawer": 0.003}


def test_a_door_keeps_its_leaf_where_another_is_edited(folder: Path) -> None:
    before, subject = learnt(folder), subject_of(folder)
    save(subject, Edits(doors=[*subject.rows, added()]))
    after = load_building(folder / "room.urdf")["left"]
    assert after.mesh.vertices == pytest.approx(before.mesh.vertices, abs=1e-6)
    assert "left" in read_sidecar(folder / "room.urdf").doors


def test_a_door_that_is_shut_for_good_is_not_edited(folder: Path) -> None:
    door = load_building(folder / "room.urdf")["left"]
    assert row_of(replace(door, lower=0.0, upper=0.0)) is None


@given(st.floats(-3.0, 3.0), st.floats(-180.0, 180.0), st.floats(0.3, 2.0), st.floats(0.1, 2.0))
def test_a_door_that_slides_is_the_same_row_again(
    x: float, bearing: float, width: float, travel: float
) -> None:
    row = DoorRow(name="a", x=x, y=1.0, bearing=bearing, width=width, upper=travel, sense=0)
    leaf = leaf_of(row, None)
    back = row_of(leaf)
    assert back is not None
    assert leaf_of(back, leaf) is leaf
    turn = (back.bearing - bearing + 180.0) % 360.0 - 180.0
    assert (back.sense, turn) == (0, pytest.approx(0.0, abs=2e-3))
    found = [back.x, back.y, back.width, back.upper]
    assert found == pytest.approx([x, 1.0, width, travel], abs=2e-4)
    over = replace(leaf, axis=-leaf.axis, lower=-leaf.upper, upper=0.0)
    assert row_of(over) == back  # the same motion told the other way round


def test_saving_unchanged_doors_keeps_the_building(folder: Path) -> None:
    before = (folder / "room.urdf").read_text()
    subject = subject_of(folder)
    assert [row.name for row in subject.rows] == ["left"]
    assert save(subject, Edits(doors=subject.rows)).urdf == folder / "room.urdf"
    assert (folder / "room.urdf").read_text() == before
    assert (folder / "room.building.yaml").read_text() == "building_error: {}\n"
    assert (folder / "doors.csv").read_text() == f"{HEADER}\nleft,2.0,0.0,0.0,ccw,1.0,100.0\n"


def test_moved_added_and_rejected_doors_are_saved_and_decided_for_good(folder: Path) -> None:
    subject = subject_of(folder)
    moved = subject.rows[0].model_copy(update={"x": 2.05, "decision": "accepted"})
    wrong = added("wrong", decision="rejected")
    save(subject, Edits(doors=[moved, added(), wrong]))
    building = load_building(folder / "room.urdf")
    assert list(building.objects) == ["left", "new", "drawer", "desk"]
    assert building["left"].hinge == pytest.approx([2.05, 0])
    assert building["new"].kind is Kind.HINGED
    again = subject_of(folder)
    assert {row.name: row.decision for row in again.rows} == {
        "left": "accepted",
        "new": "accepted",
        "wrong": "rejected",
    }
    save(again, Edits(doors=again.rows))
    assert list(load_building(folder / "room.urdf").objects) == list(building.objects)


def test_deviations_of_doors_that_were_put_elsewhere_are_left_out(folder: Path) -> None:
    (folder / "room.building.yaml").write_text(
        "building_error:\n  wall_std_m: 0.01\n  doors:\n"
        "    left: {hinge_std_m: 0.004, bearing_std_deg: 0.2}\n"
        "    drawer: {hinge_std_m: 0.003, bearing_std_deg: 0.1}\n"
    )
    subject = subject_of(folder)
    save(subject, Edits(doors=subject.rows))
    assert set(read_sidecar(folder / "room.urdf").doors) == {"left", "drawer"}
    again = subject_of(folder)
    save(again, Edits(doors=[again.rows[0].model_copy(update={"x": 2.05})]))
    error = read_sidecar(folder / "room.urdf")
    assert set(error.doors) == {"drawer"}
    assert error.wall_std_m == 0.01


def test_candidates_are_taken_by_their_probability_until_somebody_decides(folder: Path) -> None:
    table = folder.parent / "found.csv"
    rows = [
        "sure,1,4,180,ccw,0.8,90,0.9",
        "found,2.1,0,0,ccw,1,90,0.2",
        "unsure,5,4,0,ccw,0.8,90,0.2",
    ]
    table.write_text(f"{HEADER},probability\n" + "\n".join(rows) + "\n")
    subject = subject_of(folder, candidates=table)
    opened = {row.name: (row.decision, row.probability) for row in subject.rows}
    # the building's door in the place of a candidate keeps its name
    assert opened == {"left": ("open", 0.2), "sure": ("open", 0.9), "unsure": ("open", 0.2)}
    save(subject, Edits(doors=subject.rows))
    assert list(load_building(folder / "room.urdf").objects) == ["sure", "drawer", "desk"]
    assert {row.name: row.probability for row in subject_of(folder).rows} == {
        "left": 0.2,
        "sure": 0.9,
        "unsure": 0.2,
    }


def test_candidates_that_lie_in_the_folder_are_found(folder: Path) -> None:
    (folder / "doors.csv").write_text(f"{HEADER},probability\nfound,1,4,180,ccw,0.8,90,0.7\n")
    list_files(folder)  # as written by `building learn`
    assert {row.name: row.decision for row in subject_of(folder).rows} == {
        "left": "kept",
        "found": "open",
    }


def test_what_is_not_edited_stays_in_the_folder(folder: Path) -> None:
    kept = {name: f"{name}\r\n".encode() for name in (CALIBRATION, LEARN_FILE, REPORT_FILE)}
    for name, content in kept.items():
        (folder / name).write_bytes(content)
    list_files(folder)
    subject = subject_of(folder / "room.urdf")
    save(subject, Edits(doors=[*subject.rows, added()]))
    assert {name: (folder / name).read_bytes() for name in kept} == kept


def test_the_table_keeps_candidates_and_what_drives_told_of_doors(folder: Path) -> None:
    header = f"{HEADER},probability,side_probability,hinge_std_m,bearing_std_deg,width_std_m,type"
    (folder / "doors.csv").write_text(
        f"{header}\nleft,2,0,0,ccw,1,100,0.9,0.8,0.01,0.2,0.03,hinged\n"
        "sure,1,4,180,ccw,0.8,90,0.7,0.5,0.02,0.3,0.04,hinged\n"
        "unsure,5,4,180,ccw,0.8,90,0.2,0.5,0.03,0.4,0.05,hinged\n"
    )
    list_files(folder)
    subject = subject_of(folder)
    left, sure, unsure = subject.rows
    accepted = {"decision": "accepted"}
    doors = [
        left.model_copy(update=accepted),
        sure.model_copy(update={"x": 1.2, **accepted}),
        unsure,
    ]
    save(subject, Edits(doors=doors))
    assert (folder / "doors.csv").read_text() == (
        f"{header.removesuffix(',type')}\nleft,2.0,0.0,0.0,ccw,1.0,100.0,,0.8,0.01,0.2,0.03\n"
        "sure,1.2,4.0,180.0,ccw,0.8,90.0,,,,,\n"
        "unsure,5.0,4.0,180.0,ccw,0.8,90.0,0.2,0.5,0.03,0.4,0.05\n"
    )
    assert list(load_building(folder / "room.urdf").objects) == ["left", "sure", "drawer", "desk"]
    again = subject_of(folder)
    assert again.rows == doors
    before = (folder / "doors.csv").read_text()
    save(again, Edits(doors=doors))
    assert (folder / "doors.csv").read_text() == before


def candidates(folder: Path, *rows: str) -> Path:
    """A table of candidates beside a building's folder."""
    table = folder.parent / "found.csv"
    table.write_text(f"{HEADER},probability\n" + "".join(f"{row}\n" for row in rows))
    return table


@pytest.mark.parametrize("decision", ["accepted", "rejected"])
@pytest.mark.parametrize("x", [2.0, 2.6, 3.1])
def test_what_was_decided_outweighs_candidates_in_its_place(
    folder: Path, decision: str, x: float
) -> None:
    subject = subject_of(folder)
    decided = subject.rows[0].model_copy(update={"x": x, "decision": decision})
    save(subject, Edits(doors=[decided]))
    table = candidates(folder, "door_01,2.1,0.05,0,ccw,0.9,90,0.99")
    assert subject_of(folder, candidates=table).rows == [decided]


@pytest.mark.parametrize("decision", ["kept", "accepted", "rejected"])
def test_a_candidate_elsewhere_with_the_name_of_another_door_gets_a_free_one(
    folder: Path, decision: str
) -> None:
    subject = subject_of(folder)
    save(subject, Edits(doors=[subject.rows[0].model_copy(update={"decision": decision})]))
    table = candidates(
        folder, "left,1,4,0,ccw,0.8,90,0.99", "desk,3,4,0,ccw,0.8,90,0.4",
        "door_01,5,4,0,ccw,0.8,90,0.3",
    )  # fmt: skip
    rows = subject_of(folder, candidates=table).rows
    assert {row.name: (row.decision, row.x) for row in rows} == {
        "left": (decision, 2.0),
        "door_02": ("open", 1.0),
        "door_03": ("open", 3.0),
        "door_01": ("open", 5.0),
    }


def test_decisions_of_another_run_stay_at_their_places(folder: Path) -> None:
    out = folder.parent / "out"
    wrong = added("door_01", x=1.0, decision="rejected")
    subject = subject_of(folder, out)
    save(subject, Edits(doors=[*subject.rows, wrong]))
    table = candidates(folder, "door_01,5,4,0,ccw,0.8,90,0.9", "door_02,1,4,180,ccw,0.8,90,0.8")
    rows = subject_of(folder, out, table).rows
    assert {row.name: (row.decision, row.x) for row in rows} == {
        "left": ("kept", 2.0),
        "door_01": ("rejected", 1.0),
        "door_02": ("open", 5.0),
    }


def test_a_renamed_door_stays_one_door(folder: Path) -> None:
    out = folder.parent / "out"
    subject = subject_of(folder, out)
    renamed = subject.rows[0].model_copy(update={"name": "kitchen", "decision": "accepted"})
    save(subject, Edits(doors=[renamed]))
    assert subject_of(folder, out).rows == [renamed]


def test_two_leaves_that_close_one_way_are_two_doors(folder: Path) -> None:
    subject = subject_of(folder)
    second = added("second", x=2.0, y=0.1, bearing=0.0, width=1.0)
    save(subject, Edits(doors=[*subject.rows, second]))
    assert {row.name: row.decision for row in subject_of(folder).rows} == {
        "left": "kept",
        "second": "accepted",
    }


def test_a_map_becomes_a_building_with_the_doors_that_were_added(tmp_path: Path) -> None:
    pixels = np.full((60, 120), 254, dtype=np.uint8)
    pixels[[10, 50], :] = 0
    pixels[10, 40:60] = 254
    Image.fromarray(pixels).save(tmp_path / "plan.pgm")
    (tmp_path / "plan.yaml").write_text("image: plan.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    subject = subject_of(tmp_path / "plan.yaml", tmp_path / "out")
    assert subject.rows == []
    door = added("way", x=2.0, y=2.475, bearing=0.0, width=1.0)
    urdf = save(subject, Edits(doors=[door])).urdf
    assert inspect_building(urdf).problems == []
    assert [each.name for each in read_doors(tmp_path / "out" / "doors.csv")] == ["way"]
    again = subject_of(tmp_path / "out").rows[0]
    assert again == door.model_copy(update={"found_at": (2.5, 2.475)})
    assert "wall_std_m" in (tmp_path / "out" / "plan.building.yaml").read_text()


def test_a_building_of_others_is_not_changed_where_it_lies(folder: Path, tmp_path: Path) -> None:
    (folder / "notes.txt").write_text("mine")
    with pytest.raises(BuildingError, match="say with --out"):
        subject_of(folder / "room.urdf")
    subject = subject_of(folder / "room.urdf", tmp_path / "out")
    save(subject, Edits(doors=[]))
    assert list(load_building(tmp_path / "out" / "room.urdf").objects) == ["drawer", "desk"]
    assert "left" in load_building(folder / "room.urdf").objects
    with pytest.raises(BuildingError, match=r"objstate didn't write .*notes\.txt"):
        subject_of(tmp_path / "out", folder)


@pytest.mark.parametrize("name", ["nowhere", "nowhere.urdf", "nowhere.yaml"])
def test_a_source_that_does_not_exist_is_told(tmp_path: Path, name: str) -> None:
    with pytest.raises(BuildingError, match=f"{name} doesn't exist"):
        subject_of(tmp_path / name)


@pytest.mark.parametrize(
    ("doors", "message"),
    [
        ([added(), added()], "'new' stands in doors.csv a second time"),
        ([added(width=7.0)], "no leaf is wider"),
        ([added("desk")], "'desk' is furniture already"),
        ([added("")], "names no door"),
    ],
)
def test_doors_that_cannot_be_are_refused_and_nothing_is_written(
    folder: Path, doors: list[DoorRow], message: str
) -> None:
    before = sorted(path.name for path in folder.iterdir())
    with pytest.raises(BuildingError, match=message):
        save(subject_of(folder), Edits(doors=doors))
    assert sorted(path.name for path in folder.iterdir()) == before


def test_a_name_that_a_urdf_cannot_hold_is_refused() -> None:
    with pytest.raises(ValueError, match="String should match pattern"):
        added("a\x01b")


def test_decisions_that_cannot_be_read_are_told(folder: Path) -> None:
    save(subject_of(folder), Edits(doors=[added()]))
    text = json.dumps({"doors": [{"name": "x"}]})
    (folder / "decisions.json").write_text(text)
    with pytest.raises(BuildingError, match=r"decisions\.json can't be read"):
        subject_of(folder)
