"""Nothing is lost where an edited building goes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from objstate.building.written import list_files
from objstate.editing.rows import Edits
from objstate.editing.saving import save
from objstate.editing.subject import subject_of
from objstate.errors import BuildingError
from objstate.interchange import export_building


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_a_source_that_lies_where_the_building_goes_is_refused(folder: Path) -> None:
    out = folder.parent / "map"
    export_building(folder / "room.urdf", out, "map")
    with pytest.raises(BuildingError, match=r"room\.yaml lies in .*give another --out"):
        subject_of(out / "room.yaml", out)
    apart = folder.parent / "apart.yaml"
    header = (out / "room.yaml").read_text()
    (image,) = (path.name for path in out.iterdir() if path.suffix in (".pgm", ".png"))
    apart.write_text(header.replace(image, f"map/{image}"))
    with pytest.raises(BuildingError, match=rf"{image} lies in .*give another --out"):
        subject_of(apart, out)
    assert subject_of(apart, folder.parent / "out").rows == []
    (folder.parent / "floors").mkdir()
    shutil.copytree(folder, folder.parent / "floors" / "first")
    with pytest.raises(BuildingError, match=r"first lies in .*give another --out"):
        subject_of(folder.parent / "floors" / "first", folder.parent / "floors")


@pytest.mark.parametrize("name", ["learn.json", "calibration.yaml", "world.sdf", "room.urdf"])
def test_a_folder_that_was_not_edited_before_is_not_replaced(folder: Path, name: str) -> None:
    out = folder.parent / "out"
    out.mkdir()
    (out / name).write_text("{}")
    list_files(out)
    before = contents(out)
    with pytest.raises(BuildingError, match=r"out has no decisions\.json .*new or empty"):
        subject_of(folder, out)
    assert contents(out) == before


def test_a_folder_that_came_to_be_meanwhile_is_not_replaced(folder: Path) -> None:
    out = folder.parent / "out"
    subject = subject_of(folder, out)
    export_building(folder / "room.urdf", out, "sdf")
    before = contents(out)
    with pytest.raises(BuildingError, match=r"no decisions\.json"):
        save(subject, Edits(doors=subject.rows))
    assert contents(out) == before


def test_an_empty_folder_and_one_that_was_edited_before_are_replaced(folder: Path) -> None:
    out = folder.parent / "out"
    out.mkdir()
    for _ in range(2):
        subject = subject_of(folder, out)
        save(subject, Edits(doors=subject.rows))
    assert (out / "room.urdf").is_file()
