"""run.json is deterministic and free of what JSON can't say."""

from __future__ import annotations

from pathlib import Path

import pytest

from objstate.errors import ResultError
from objstate.recording.summary import read_summary, write_summary


def test_order_of_keys_does_not_matter(tmp_path: Path) -> None:
    contents = []
    for summary in ({"a": 1, "b": {"x": [1.5], "y": None}}, {"b": {"y": None, "x": [1.5]}, "a": 1}):
        write_summary(tmp_path, summary)
        contents.append((tmp_path / "run.json").read_bytes())
        assert read_summary(tmp_path) == summary
    assert contents[0] == contents[1]


def test_numbers_that_are_none_are_refused_with_their_place(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"timings\.walls\[1\]"):
        write_summary(tmp_path, {"timings": {"walls": [1.0, float("nan")]}})
    assert not (tmp_path / "run.json").exists()


@pytest.mark.parametrize("text", ["{", "[]"])
def test_strange_summaries_are_named(tmp_path: Path, text: str) -> None:
    with pytest.raises(ResultError, match="Can't read"):
        read_summary(tmp_path)
    (tmp_path / "run.json").write_text(text)
    with pytest.raises(ResultError, match="make the result anew"):
        read_summary(tmp_path)
