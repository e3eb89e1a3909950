"""A result is there whole or not at all, and nothing that isn't one is ever lost."""

from __future__ import annotations

from pathlib import Path

import pytest

from objstate.errors import ResultError
from objstate.recording.results import result_folder


def make(path: Path, text: str, *, overwrite: bool = False) -> None:
    with result_folder(path, overwrite=overwrite) as folder:
        (folder / "run.json").write_text(text)


def test_folder_stands_only_after_the_block(tmp_path: Path) -> None:
    with result_folder(tmp_path / "deep" / "out") as folder:
        (folder / "run.json").write_text("{}")
        assert not (tmp_path / "deep" / "out").exists()
    assert (tmp_path / "deep" / "out" / "run.json").read_text() == "{}"
    assert [item.name for item in (tmp_path / "deep").iterdir()] == ["out"]


@pytest.mark.parametrize("stop", [RuntimeError, KeyboardInterrupt])
def test_nothing_remains_of_a_run_that_stops(tmp_path: Path, stop: type[BaseException]) -> None:
    def interrupted() -> None:
        with result_folder(tmp_path / "out") as folder:
            (folder / "half").write_text("...")
            raise stop

    with pytest.raises(stop):
        interrupted()
    assert list(tmp_path.iterdir()) == []


def test_existing_result_is_refused_and_then_replaced(tmp_path: Path) -> None:
    make(tmp_path / "out", "old")
    with pytest.raises(ResultError, match="--overwrite"):
        make(tmp_path / "out", "new")
    assert (tmp_path / "out" / "run.json").read_text() == "old"
    make(tmp_path / "out", "new", overwrite=True)
    assert (tmp_path / "out" / "run.json").read_text() == "new"
    assert [item.name for item in tmp_path.iterdir()] == ["out"]


def test_old_result_outlives_a_run_that_fails(tmp_path: Path) -> None:
    make(tmp_path / "out", "old")

    def failing() -> None:
        with result_folder(tmp_path / "out", overwrite=True):
            raise RuntimeError

    with pytest.raises(RuntimeError):
        failing()
    assert (tmp_path / "out" / "run.json").read_text() == "old"


def test_folders_of_somebody_else_are_never_overwritten(tmp_path: Path) -> None:
    own = tmp_path / "thesis"
    own.mkdir()
    (own / "chapter.tex").write_text("years of work")
    with pytest.raises(ResultError, match="not a result"):
        make(own, "new", overwrite=True)
    assert (own / "chapter.tex").read_text() == "years of work"


def test_files_and_links_are_never_replaced_by_a_folder(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    make(tmp_path / "real", "old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    for name in ("file", "link"):
        with pytest.raises(ResultError, match="not a result"):
            make(tmp_path / name, "new", overwrite=True)
    assert (tmp_path / "real" / "run.json").read_text() == "old"


def test_unwritable_place_is_an_error_with_a_cure(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(ResultError, match="choose another place"):
        make(tmp_path / "file" / "out", "new")
