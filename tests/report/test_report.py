"""A report stands alone, and shows what the result says."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from objstate.errors import ResultError
from objstate.recording.tables import read_estimates
from objstate.report import write_report
from tests.report.pages import data_of, read


@pytest.fixture(scope="module")
def page(result: Path) -> str:
    return write_report(result).read_text(encoding="utf-8")


@pytest.fixture
def moved(result: Path, tmp_path: Path) -> Path:
    """The whole drive, in another place."""
    shutil.copytree(result.parent, tmp_path / "drive")
    return tmp_path / "drive" / "out"


def test_it_needs_nothing_else(page: str) -> None:
    reader = read(page)
    assert reader.references
    assert all(each.startswith("data:image/png;base64,") for each in reader.references)
    assert "url(" not in page
    assert "//" not in page.partition("<script>")[0].replace("base64,", "").split("</style>")[0]


def test_it_says_what_a_reader_wants_to_know(page: str) -> None:
    text = " ".join(read(page).words)
    assert "office_door" in text
    assert "The robot never had far <door> in view" in text
    assert "sigma_hit" in text
    assert "log.mcap" in text
    assert "Beside the truth" in text
    assert "Calibration of angles" in text
    assert "Calibration of lengths" in text
    assert "The robot itself" in text


def test_the_plan_moves_by_the_estimates(result: Path, page: str) -> None:
    data = data_of(page)
    begin = json.loads((result / "run.json").read_text())["begin_ns"]
    by_name = {each["name"]: each for each in data["objects"]}
    assert by_name["far <door>"]["t"] == []
    door = by_name["office_door"]
    rows = read_estimates(result).filter(pl.col("object") == "office_door")
    stamps = np.round((rows["stamp"].to_numpy() - begin) / 1e8).astype(int).tolist()
    means = dict(zip(stamps, np.round(np.degrees(rows["mean"].to_numpy()) * 10), strict=True))
    assert set(door["t"]) <= set(stamps)
    assert door["mean"][0] == [means[t] for t in door["t"]]
    assert all(low <= high for low, high in zip(door["lower"][0], door["upper"][0], strict=True))
    assert door["truth"]["angle"]["v"] == [344]  # 0.6 rad in tenths of a degree
    assert door["motion"] == {
        "kind": "turn", "pivot": [2.0, 2.0], "sense": -1, "reach": 0.9, "bearing": 0.0,
    }  # fmt: skip
    assert [by_name["chest"][key] for key in ("coordinates", "motion")] == [
        ["x", "y", "yaw"], {"kind": "free"},
    ]  # fmt: skip
    assert data["robot"]["x"][0] == pytest.approx(50, abs=30)  # cm; the start is told to 20 cm


def test_the_same_result_gives_the_same_page(result: Path, page: str, tmp_path: Path) -> None:
    assert write_report(result, tmp_path / "again.html").read_text(encoding="utf-8") == page


def test_it_finds_its_inputs_where_they_were_moved_together(moved: Path, page: str) -> None:
    assert data_of(write_report(moved).read_text(encoding="utf-8")) == data_of(page)


def test_a_building_that_is_gone_is_named_with_the_cure(moved: Path) -> None:
    summary = json.loads((moved / "run.json").read_text())
    summary["inputs"]["building"]["path"] = "nowhere/room.urdf"
    (moved / "run.json").write_text(json.dumps(summary))
    urdf = (moved.parent / "room.urdf").rename(moved.parent / "hidden.urdf")
    with pytest.raises(ResultError, match=r"nowhere/room.urdf, is gone .* --building"):
        write_report(moved)
    assert write_report(moved, building=urdf).is_file()


def test_the_building_of_another_result_is_refused(moved: Path, tmp_path: Path) -> None:
    (tmp_path / "bare.urdf").write_text('<robot name="bare"><link name="map"/></robot>')
    with pytest.raises(ResultError, match="lacks chest, far <door>, office_door"):
        write_report(moved, building=tmp_path / "bare.urdf")


def test_a_building_that_changed_is_doubted(moved: Path) -> None:
    urdf = moved.parent / "room.urdf"
    urdf.write_text(urdf.read_text().replace('xyz="2 2 0"', 'xyz="2.2 2 0"'))
    assert "has changed since the run" in write_report(moved).read_text(encoding="utf-8")


def test_a_truth_that_is_gone_is_told_and_the_rest_shown(moved: Path) -> None:
    summary = json.loads((moved / "run.json").read_text())
    for role in ("truth", "true_path"):
        summary["inputs"][role]["path"] = f"gone/{role}"
        summary["inputs"][role]["from_result"] = f"gone/{role}"
    (moved / "run.json").write_text(json.dumps(summary))
    text = " ".join(read(write_report(moved).read_text(encoding="utf-8")).words)
    assert "gone/truth, which held the truth, is gone" in text
    assert "Calibration" not in text


def test_a_folder_without_posteriors_is_refused(moved: Path) -> None:
    (moved / "posteriors.parquet").unlink()
    with pytest.raises(ResultError, match=r"posteriors\.parquet"):
        write_report(moved)
