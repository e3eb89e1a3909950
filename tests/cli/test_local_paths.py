"""URLs are refused by every command that takes files, before anything is done."""

from pathlib import Path

import pytest

URL = "s3://bucket/x"


@pytest.mark.parametrize(
    "words",
    [
        ("estimate", URL, "--building", "b.urdf", "--out", "out"),
        ("estimate", "a.mcap", "--building", URL, "--out", "out"),
        ("estimate", "a.mcap", "--building", "b.urdf", "--out", URL),
        ("estimate", "a.mcap", "--building", "b.urdf", "--out", "out", "--truth", URL),
        ("simulate", "a.scene.yaml", "--out", URL),
        ("convert", URL, "a.mcap"),
        ("convert", "a.mcap", URL),
        ("calibrate", "a.mcap", "--building", "b.urdf", "--out", URL),
        ("inspect", URL),
        ("report", "out", "--out", URL),
        ("evaluate", "out", "--truth", "t.csv", "--json", URL),
        ("building", "from-map", URL, "--out", "out"),
        ("world", "show", URL),
    ],
)
def test_a_url_is_refused_also_where_nothing_else_is_told(
    run, words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("a.mcap", "b.urdf", "t.csv"):
        (tmp_path / name).touch()
    quiet = ["--quiet"] if words[0] in {"estimate", "batch", "simulate", "convert"} else []
    outcome = run(*words, *quiet)
    assert outcome.code == 1
    assert "s3://bucket/x" in outcome.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.mcap", "b.urdf", "t.csv"]
