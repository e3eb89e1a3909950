"""Nothing is lost where an edited building goes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from objstate.building import load_building
from objstate.building.written import list_files
from objstate.editing.rows import Edits
from objstate.editing.saving import save
from objstate.editing.subject import subject_of
from objstate.errors import BuildingError
from objstate.interchange import export_building, import_building


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


@pytest.mark.parametrize("out", [None, "building"])
def test_a_sidecar_and_a_calibration_of_the_user_stay_in_place(
    folder: Path, out: str | None
) -> None:
    (folder / "room.building.yaml").unlink()
    list_files(folder)
    own = {"room.building.yaml": "building_error: {wall_std_m: 0.03}  # by tape\n"}
    own |= {"calibration.yaml": "lasers: {}\n"}
    for name, text in own.items():
        (folder / name).write_text(text)
    target = None if out is None else folder.parent / out
    for _ in range(2):
        subject = subject_of(folder, target)
        save(subject, Edits(doors=subject.rows))
        assert {name: (folder / name).read_text() for name in own} == own
    (folder / "other.building.yaml").write_text("mine")
    with pytest.raises(BuildingError, match=r"as objstate didn't write .*other\.building\.yaml"):
        subject_of(folder, target)


def test_a_sidecar_of_the_user_is_never_overwritten(folder: Path) -> None:
    urdf = folder / "room.urdf"
    out = folder.parent / "out"
    export_building(urdf, out, "sdf")
    import_building(out / "room.sdf", out.parent / "again")
    sidecar = out.parent / "again" / "room.building.yaml"
    sidecar.write_text("building_error: {wall_std_m: 0.03}\n")
    with pytest.raises(BuildingError, match=r"objstate didn't write .*room\.building\.yaml"):
        import_building(out / "room.sdf", out.parent / "again", overwrite=True)
    assert sidecar.exists()


@pytest.mark.parametrize("source", ["link", "link/room.urdf"])
@pytest.mark.parametrize("out", [None, "link"])
def test_a_link_to_a_folder_is_edited_where_it_leads(
    folder: Path, source: str, out: str | None
) -> None:
    (folder / "calibration.yaml").write_text("lasers: {}\n")
    link = folder.parent / "link"
    link.symlink_to(folder)
    subject = subject_of(folder.parent / source, None if out is None else folder.parent / out)
    assert save(subject, Edits(doors=[])).urdf == folder / "room.urdf"
    assert link.is_symlink()
    assert "left" not in load_building(folder / "room.urdf").objects
    assert (folder / "calibration.yaml").is_file()


@pytest.mark.parametrize("out", [None, "out"])
def test_a_building_within_the_folder_is_not_lost(folder: Path, out: str | None) -> None:
    target = folder if out is None else folder.parent / out
    subject = subject_of(folder, target)
    save(subject, Edits(doors=subject.rows))
    export_building(folder / "room.urdf", target / "world", "sdf")
    for edit in (lambda: subject_of(folder, target), lambda: save(subject, Edits(doors=[]))):
        with pytest.raises(BuildingError, match=r"world would be lost"):
            edit()
    assert (target / "world" / "room.sdf").is_file()
