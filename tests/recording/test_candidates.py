"""``candidates.json``"""

from __future__ import annotations

from pathlib import Path

import pytest

from objstate.errors import ResultError
from objstate.recording.candidates import CANDIDATES, Found, read_candidates, write_candidates

BOX = Found(
    "unknown_1", 0.9, 7, 1.0, 2.0, 0.1, 0.5, 0.3, 10, 20, ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))
)


def test_candidates_come_back_as_they_were_written(tmp_path: Path) -> None:
    write_candidates(tmp_path, [BOX])
    assert read_candidates(tmp_path) == [BOX]


def test_a_result_without_a_grid_has_none(tmp_path: Path) -> None:
    assert read_candidates(tmp_path) == []


@pytest.mark.parametrize("text", ["{", "[1]", '[{"name": "x"}]', '{"a": 1}'])
def test_a_damaged_file_is_told_of(tmp_path: Path, text: str) -> None:
    (tmp_path / CANDIDATES).write_text(text)
    with pytest.raises(ResultError, match=r"candidates\.json is damaged"):
        read_candidates(tmp_path)
