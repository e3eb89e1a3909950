"""A report stands alone, and shows what the result says."""

from __future__ import annotations

import base64
import hashlib
import json
import re
import shutil
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from objstate.errors import ResultError
from objstate.recording.candidates import Found, write_candidates
from objstate.recording.events import Event, write_events
from objstate.recording.grids import Clutter, ClutterWriter
from objstate.recording.tables import read_states
from objstate.report import write_report
from tests.report.pages import data_of, policy_of, program_of, read, renamed, rows_of


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
    head = re.sub("'sha256-[^']*'", "", page.split("</style>", maxsplit=1)[0])
    assert "//" not in head


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


@pytest.mark.parametrize("filtered", [False, True])
def test_the_plan_moves_by_the_estimates(result: Path, tmp_path: Path, filtered: bool) -> None:
    page = write_report(result, tmp_path / "page.html", filtered=filtered)
    data = data_of(page.read_text(encoding="utf-8"))
    begin = json.loads((result / "run.json").read_text())["begin_ns"]
    by_name = {each["name"]: each for each in data["objects"]}
    assert by_name["far <door>"]["t"] == []
    door = by_name["office_door"]
    states = read_states(result, filtered=filtered)
    rows = states.filter(pl.col("object") == "office_door")
    stamps = np.round((rows["stamp"].to_numpy() - begin) / 1e8).astype(int).tolist()
    medians = dict(zip(stamps, np.round(np.degrees(rows["median"].to_numpy()) * 10), strict=True))
    assert set(door["t"]) <= set(stamps)
    assert door["median"][0] == [medians[t] for t in door["t"]]
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


def test_no_script_but_the_page_s_own_may_run(page: str) -> None:
    digest = base64.b64encode(hashlib.sha256(program_of(page).encode()).digest()).decode()
    policy = policy_of(page)
    assert f"script-src 'sha256-{digest}';" in policy
    assert policy.startswith("default-src 'none';")


def test_names_from_outside_stay_text(moved: Path) -> None:
    nasty = "</script><img src=x onerror=alert(1)>&quot;"
    renamed(moved, "chest", nasty)
    page = write_report(moved).read_text(encoding="utf-8")
    assert "<img" not in page
    assert nasty in " ".join(read(page).words)
    assert nasty in [each["name"] for each in data_of(page)["objects"]]


def test_the_scans_lie_on_the_walls(page: str) -> None:
    scans = data_of(page)["scans"]
    ends = np.frombuffer(base64.b64decode(scans["ends"]), dtype="<i2").reshape(-1, 2) / 100
    x, y, yaw = (np.repeat(each, scans["count"]) for each in scans["pose"])
    turn = yaw * np.pi / 1800
    east = x / 100 + np.cos(turn) * ends[:, 0] - np.sin(turn) * ends[:, 1]
    north = y / 100 + np.sin(turn) * ends[:, 0] + np.cos(turn) * ends[:, 1]
    walls = [np.abs(east + 1.95), np.abs(east - 5.95), np.abs(north + 1.95), np.abs(north - 1.95)]
    assert len(ends) > 100
    assert np.median(np.min(walls, axis=0)) < 0.05


def test_a_result_from_before_scans_were_kept_still_reports(moved: Path) -> None:
    (moved / "scans.parquet").unlink()
    page = write_report(moved).read_text(encoding="utf-8")
    assert "scans" not in data_of(page)
    assert 'class="scan"></i>' not in page


def test_what_the_building_doesnt_know_is_drawn_where_the_result_has_it(moved: Path) -> None:
    page = write_report(moved).read_text(encoding="utf-8")
    assert "clutter" not in data_of(page)
    assert 'class="clutter"></i>' not in page
    begin = json.loads((moved / "run.json").read_text())["begin_ns"]
    with ClutterWriter(moved) as writer:
        places = np.array([[1.25, -0.5], [1.3, -0.5]])
        writer.write([Clutter(begin + 10**9, places, np.array([80, 60], dtype=np.uint8))])
    page = write_report(moved).read_text(encoding="utf-8")
    assert data_of(page)["clutter"] == {"t": [10], "places": [[125, -50, 130, -50]]}
    assert 'data-layer="clutter"' in page
    assert 'class="clutter"></i>' in page


def test_candidates_are_listed_and_outlined_on_the_plan(moved: Path) -> None:
    assert "Not in the building" not in write_report(moved).read_text(encoding="utf-8")
    begin = json.loads((moved / "run.json").read_text())["begin_ns"]
    corners = ((1.0, 0.0), (1.5, 0.0), (1.5, 0.3), (1.0, 0.3))
    box = Found("unknown_1", 0.87, 9, 1.25, 0.15, 0.0, 0.5, 0.3, begin, begin + 10**9, corners)
    write_candidates(moved, [box])
    page = write_report(moved).read_text(encoding="utf-8")
    assert "Not in the building" in page
    assert "0.50 × 0.30" in page
    assert 'd="M1.00,0.00 1.50,0.00 1.50,0.30 1.00,0.30Z" class="candidate"' in page


def test_the_share_of_time_localized_heads_the_page(moved: Path) -> None:
    assert "100% of the time localized" in " ".join(
        read(write_report(moved).read_text(encoding="utf-8")).words
    ).replace("  ", " ")
    summary = json.loads((moved / "run.json").read_text())
    half = int(summary["timings"]["log_seconds"] * 1e9 / 2)
    summary["lost_ns"] = [[summary["begin_ns"], summary["begin_ns"] + half]]
    (moved / "run.json").write_text(json.dumps(summary))
    page = write_report(moved).read_text(encoding="utf-8")
    assert '<div class="wrong"><b>50%</b>of the time localized</div>' in page
    assert 'class="way lost"' in page
    assert data_of(page)["lost"] == [[0, round(half / 1e8)]]


def test_what_is_wrong_stands_first_and_is_marked(moved: Path, tmp_path: Path) -> None:
    truth = tmp_path / "truth.csv"
    truth.write_text("stamp,object,coordinate,value\n0,office_door,angle,1.2\n0,chest,x,4.0\n")
    page = write_report(moved, truth=truth).read_text(encoding="utf-8")
    rows = rows_of(page)
    assert rows[0][:2] == ("office_door", "wrong")
    assert "angle off at worst, office_door; 1 wrong" in page
    assert "The last state of office_door is wrong" in page


def test_the_last_states_are_those_of_the_plan_s_last_moment(page: str) -> None:
    door = next(each for each in data_of(page)["objects"] if each["name"] == "office_door")
    row = re.search(r'<th scope="row">office_door</th>(.*?)</tr>', page)
    assert row
    assert f" {door['median'][0][-1] / 10:.1f}°<" in row[1]
    assert f">{door['t'][-1] / 10:.1f} s<" in row[1]


def test_how_probably_a_door_is_closed_is_said_first(moved: Path) -> None:
    rows = pl.read_parquet(moved / "smoothed.parquet")
    rows.with_columns(p_closed=pl.lit(0.02)).write_parquet(moved / "smoothed.parquet")
    page = write_report(moved).read_text(encoding="utf-8")
    assert re.search(r'class="median" data-value="[\d.]+">open 98 %, \d+\.\d°<', page)
    assert set(
        next(o for o in data_of(page)["objects"] if o["name"] == "office_door")["closed"]
    ) == {2}


def test_what_was_moved_is_told_where_the_result_tells_it(moved: Path) -> None:
    begin = json.loads((moved / "run.json").read_text())["begin_ns"]
    times, states = (begin + 10**9, begin + 2 * 10**9), (0.0, 0.01, 0.6, 0.01)
    came = Event("chest", "came", "x", *times, None, None, 2.0, 0.01, 0.8)
    write_events(moved, [Event("office_door", "moved", "angle", *times, *states, 0.93), came])
    page = write_report(moved).read_text(encoding="utf-8")
    assert "What was moved" in page
    assert "1.0 to 2.0" in page
    assert re.search(r"34\.4°.*93%", page)
    assert re.search(r"came.*–.*2\.000 m.*80%", page)
    assert 'class="moved"' in page


def test_the_robot_is_drawn_at_its_size_where_that_is_known(moved: Path) -> None:
    assert 'class="body"' not in write_report(moved).read_text(encoding="utf-8")
    page = write_report(moved, robot_radius=0.28).read_text(encoding="utf-8")
    assert page.count('<circle r="0.280" class="body">') == 2  # of the estimated, and the true one


def test_a_true_path_given_by_hand_is_drawn(moved: Path, result: Path) -> None:
    summary = json.loads((moved / "run.json").read_text())
    del summary["inputs"]["true_path"]
    (moved / "run.json").write_text(json.dumps(summary))
    assert 'class="true-way"' not in write_report(moved).read_text(encoding="utf-8")
    path = result.parent / "log" / "path.tum"
    page = write_report(moved, true_path=path).read_text(encoding="utf-8")
    assert 'class="true-way"' in page
    assert data_of(page)["trueRobot"]["x"]


def test_objects_stand_in_the_order_that_people_expect(moved: Path) -> None:
    renamed(moved, "chest", "thing_10")
    renamed(moved, "office_door", "thing_2")
    page = write_report(moved, truth=None).read_text(encoding="utf-8")
    assert re.findall(r"<h3><span>(.*?)</span>", page) == ["thing_2", "thing_10"]


def test_events_that_cannot_be_read_are_a_doubt(moved: Path) -> None:
    (moved / "events.parquet").write_bytes(b"rubbish")
    page = write_report(moved).read_text(encoding="utf-8")
    assert "events.parquet is not a Parquet file that can be read" in page
    assert "What was moved" not in page
