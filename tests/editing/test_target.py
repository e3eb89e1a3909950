"""Nothing is lost where an edited building goes."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

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
