"""``objstate report`` as a user types it."""

from __future__ import annotations

import webbrowser
from pathlib import Path

import pytest

from tests.report.pages import make_result


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_result(tmp_path_factory.mktemp("shown"))


def test_a_report_is_written_beside_the_result_and_shown(
    run, result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    shown: list[str] = []
    monkeypatch.setattr(webbrowser, "open", shown.append)
    outcome = run("report", result)
    assert (outcome.code, shown) == (0, [])
    assert outcome.out == f"Written: {result / 'report.html'}\n"
    again = run("report", result, "--open", "--out", result.parent / "page.html")
    assert again.code == 0
    assert shown == [(result.parent / "page.html").as_uri()]


def test_what_is_no_result_is_refused(run, tmp_path: Path) -> None:
    outcome = run("report", tmp_path)
    assert outcome.code == 1
    assert "is" in outcome.err
    assert "objstate estimate" in outcome.err
    assert list(tmp_path.iterdir()) == []


def test_a_truth_of_another_building_shows_no_errors(run, result: Path, tmp_path: Path) -> None:
    truth = tmp_path / "truth.csv"
    truth.write_text("stamp,object,coordinate,value\n0,garage,angle,0\n")
    outcome = run("report", result, "--truth", truth, "--out", tmp_path / "page.html")
    assert outcome.code == 0
    assert "Calibration" not in (tmp_path / "page.html").read_text()


def test_options_that_mean_nothing_for_a_result_are_refused(run, result: Path) -> None:
    outcome = run("report", result, "--each")
    assert outcome.code == 1
    assert "--each has no meaning here" in outcome.err


@pytest.mark.parametrize("radius", ["0", "-1", "25", "nan"])
def test_a_radius_that_is_no_robots_is_refused(run, result: Path, radius: str) -> None:
    outcome = run("report", result, "--robot-radius", radius)
    assert outcome.code == 1
    assert "give metres, as in 0.25" in outcome.err


def test_dates_are_told_by_the_clock_that_is_asked_for(run, result: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    assert run("report", result, "--timezone", "Asia/Tokyo", "--out", page).code == 0
    assert " JST" in page.read_text(encoding="utf-8")
    outcome = run("report", result, "--timezone", "Atlantis")
    assert outcome.code == 1
    assert "--timezone 'Atlantis' is not known" in outcome.err
