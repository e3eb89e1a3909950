"""Conversion passes on every message that both formats hold, and names the others."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from objstate.conversion import convert
from objstate.errors import LogError
from objstate.logs import open_messages
from objstate.logs.ordering import UNSORTED
from tests.logs.conftest import Drive

DATA = Path(__file__).parents[2] / "shared" / "data"
WEAN = DATA / "wean-hall" / "run1.mcap"
NEATO = DATA / "olin-ac109-neato" / "ac109_1_demo.bag"


def need(path: Path) -> Path:
    if not path.exists():
        pytest.skip(f"{path} is not here; it is real data that can't be given away")
    return path


def contents(path: Path) -> list[tuple[str, str, int, bytes]]:
    return [(m.topic, m.type, m.recorded_ns, m.cdr()) for m in open_messages(path)]


def test_there_and_back_again_changes_nothing(tmp_path: Path) -> None:
    source = need(WEAN)
    convert(source, tmp_path / "a.bag")
    convert(tmp_path / "a.bag", tmp_path / "b")
    result = convert(tmp_path / "b", tmp_path / "c.mcap")
    assert result.warnings == ()
    assert contents(tmp_path / "c.mcap") == contents(source)


def test_custom_types_of_a_ros1_bag_come_over(tmp_path: Path) -> None:
    result = convert(need(NEATO), tmp_path / "neato.mcap")
    assert result.warnings == ()
    assert result.counts["/bump"] == 1565
    assert Counter(m.topic for m in open_messages(tmp_path / "neato.mcap")) == result.counts


def test_carmen_takes_scans_and_odometry_and_names_the_rest(tmp_path: Path) -> None:
    result = convert(need(WEAN), tmp_path / "run1.log")
    assert set(result.counts) == {"/odom", "/scan"}
    assert any("/initialpose" in warning for warning in result.warnings)
    scans = [m for m in open_messages(tmp_path / "run1.log") if m.topic == "/scan"]
    assert len(scans) == result.counts["/scan"]
    left_out = sum(int(w.split()[0]) for w in result.warnings if "scans" in w)
    before = sum(message.topic == "/scan" for message in open_messages(WEAN))
    assert len(scans) + left_out == before


def test_carmen_without_a_topic_of_odometry_says_why_it_holds_no_scan(tmp_path: Path) -> None:
    drive = Drive().tf(0.0, "base_link", "laser", (0.2, 0.0, 0.3)).scan(0.0).scan(0.1)
    drive.tf(0.1, "odom", "base_link", topic="/tf")
    result = convert(drive.mcap(tmp_path / "drive.mcap"), tmp_path / "drive.log")
    assert any("2 scans, as no topic holds odometry" in warning for warning in result.warnings)


def test_lasers_whose_scans_have_no_frame_are_called_by_their_topics(tmp_path: Path) -> None:
    drive = Drive().tf(-0.1, "base_link", "front", (0.2, 0.0, 0.3)).straight(1.0)
    drive.odometry(1.1).scan(1.1, topic="/robot/rear", frame="").scan(1.1, topic="/front", frame="")
    drive.messages = [each for each in drive.messages if each[0] != "/scan"]
    result = convert(drive.mcap(tmp_path / "drive.mcap"), tmp_path / "drive.log")
    assert result.counts["/front"] == 1
    assert "1 scans of 'robot/rear', whose mounting is not known by then: left out." in (
        result.warnings
    )


@pytest.mark.parametrize("ending", [".mcap", ".bag", "", ".log"])
def test_topics_written_one_after_the_other_are_written_in_recorded_order(
    ending: str, tmp_path: Path
) -> None:
    whole = Drive().tf(-0.1, "base_link", "laser", (0.2, 0.0, 0.3)).straight(10.0)
    apart = Drive(sorted(whole.messages, key=lambda each: each[0]))
    for name, drive in (("whole", whole), ("apart", apart)):
        drive.mcap(tmp_path / f"{name}.mcap")
    expected, merged = (
        convert(tmp_path / f"{name}.mcap", tmp_path / f"{name}-new{ending}")
        for name in ("whole", "apart")
    )
    assert merged.counts == expected.counts
    assert merged.warnings == (UNSORTED, *expected.warnings)
    files = [tmp_path / f"{name}-new{ending}" for name in ("whole", "apart")]
    assert sorted(contents(files[0])) == sorted(contents(files[1]))
    stamps = [recorded_ns for _, _, recorded_ns, _ in contents(files[1])]
    assert stamps == sorted(stamps)


@pytest.mark.parametrize("ending", [".mcap", ".bag", "", ".log"])
def test_the_list_is_what_the_new_log_holds(ending: str, tmp_path: Path) -> None:
    drive = Drive().scan(0.0).tf(0.0, "base_link", "laser", (0.2, 0.0, 0.3))
    drive.tf(0.0, "a", "b").tf(0.0, "b", "a").scan(0.05, frame="a")  # frames that lead in a circle
    drive.scan(0.06, recorded=0.06).odometry(0.1).odometry(0.2, x=float("nan")).odometry(0.3, x=0.3)
    drive.scan(0.2).scan(0.25, angle_min=float("nan")).scan(0.25, range_max=float("inf"))
    drive.scan(0.3, ()).scan(-1.8e9, recorded=0.3).scan(0.4).scan(0.5)  # no odometry after these
    result = convert(drive.mcap(tmp_path / "a.mcap"), tmp_path / f"b{ending}")
    held = Counter(message.topic for message in open_messages(tmp_path / f"b{ending}"))
    if ending == ".log":
        assert result.counts == {"/odom": held["/wheel_odom"], "/scan": held["/scan"]}
        assert result.counts == {"/odom": 2, "/scan": 2}
        assert any("2 scans after the last odometry" in warning for warning in result.warnings)
    else:
        assert result.counts == held


@pytest.mark.parametrize("with_wheels", [False, True])
def test_odometry_beside_that_of_wheels_counts_where_lines_hold_it(
    with_wheels: bool, tmp_path: Path
) -> None:
    drive = Drive().tf(0.0, "base_link", "laser")
    for step in range(6):
        if with_wheels:
            drive.odometry(0.1 * step, topic="/wheel_odom")
        drive.odometry(0.1 * step)
        if step % 2 == 0:
            drive.scan(0.1 * step)
    result = convert(drive.mcap(tmp_path / "a.mcap"), tmp_path / "b.log")
    held = Counter(message.topic for message in open_messages(tmp_path / "b.log"))
    assert held == {"/tf_static": 1, "/scan": 3, "/odom": 3, "/wheel_odom": 6}
    assert result.counts["/odom"] == (3 if with_wheels else 6)
    told = any("3 messages of /odom between scans" in warning for warning in result.warnings)
    assert told == with_wheels


def test_what_is_no_log_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "rubbish").write_bytes(b"rubbish")
    with pytest.raises(LogError):
        convert(tmp_path / "rubbish", tmp_path / "out.mcap")
    assert [item.name for item in tmp_path.iterdir()] == ["rubbish"]
