"""Conversion passes on every message that both formats hold, and names the others."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest

from objstate.conversion import convert
from objstate.errors import LogError
from objstate.logs import open_messages

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


def test_what_is_no_log_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "rubbish").write_bytes(b"rubbish")
    with pytest.raises(LogError):
        convert(tmp_path / "rubbish", tmp_path / "out.mcap")
    assert [item.name for item in tmp_path.iterdir()] == ["rubbish"]
