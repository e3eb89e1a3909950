"""Paths survive being written: stamps to the nanosecond, poses to a micrometre."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from objstate.errors import TruthError
from objstate.geometry import wrap
from objstate.recording.tum import read_tum, write_tum
from objstate.records import Path as RobotPath

POSES = st.tuples(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3), st.floats(-3.14, 3.14))


@settings(max_examples=25)
@given(st.lists(st.tuples(st.integers(-(10**18), 2 * 10**18), POSES), min_size=1, max_size=5))
def test_path_round_trips(
    tmp_path_factory: pytest.TempPathFactory, rows: list[tuple[int, tuple[float, float, float]]]
) -> None:
    path = tmp_path_factory.mktemp("path") / "path.tum"
    stamps = np.array(sorted(stamp for stamp, _ in rows), dtype=np.int64)
    poses = np.array([pose for _, pose in rows])
    write_tum(path, RobotPath(stamps, poses))
    back = read_tum(path)
    assert back.stamps_ns.tolist() == stamps.tolist()
    np.testing.assert_allclose(back.poses[:, :2], poses[:, :2], atol=1e-6)
    np.testing.assert_allclose(wrap(back.poses[:, 2] - poses[:, 2]), 0.0, atol=1e-6)


def test_scientific_notation_and_comments_are_read(tmp_path: Path) -> None:
    path = tmp_path / "path.tum"
    path.write_text("# a comment\n\n1.305031102175304123e+09 1 2 3 0 0 1 0\n")
    back = read_tum(path)
    assert back.stamps_ns.tolist() == [1305031102175304123]
    np.testing.assert_allclose(np.abs(back.poses), [[1, 2, np.pi]])


@pytest.mark.parametrize("unit", ["000", "000000", "000000000"])
def test_stamps_of_another_unit_are_told(tmp_path: Path, unit: str) -> None:
    path = tmp_path / "path.tum"
    path.write_text(f"1600000000{unit} 0 0 0 0 0 0 1\n")
    with pytest.raises(TruthError, match="seconds are meant, write 1600000000,"):
        read_tum(path)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "no poses"),
        ("1 2 3\n", "line 1 has 3 fields"),
        ("1 0 0 0 0 0 0 0\n", "not a pose"),
        ("one 0 0 0 0 0 0 1\n", "not a pose"),
        ("nan 0 0 0 0 0 0 1\n", "not a pose"),
        ("1 nan 0 0 0 0 0 1\n", "not finite"),
        ("2 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n", "go back"),
    ],
)
def test_faulty_path_names_place_and_cure(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "path.tum"
    path.write_text(text)
    with pytest.raises(TruthError, match=message):
        read_tum(path)
