"""Tables read as Markdown, and figures of nothing are a dash."""

from __future__ import annotations

import pytest

from objstate.experiments.tables import Table, figure, mean, percent, rms


def test_a_table_is_markdown_under_its_title() -> None:
    table = Table("Doors", ("door", "error"), (("a", "1"), ("b", "2")), "Of two.")
    assert table.markdown() == (
        "## Doors\n\n| door | error |\n| --- | --- |\n| a | 1 |\n| b | 2 |\n\nOf two.\n"
    )


def test_means_and_shares() -> None:
    assert mean([1.0, 2.0, 6.0]) == 3.0
    assert rms([3.0, -4.0, 0.0, 0.0]) == pytest.approx(2.5)
    assert percent([True, True, False]) == "67 %"
    assert figure(-0.001) == "0.00"
    assert figure(2.345, 1) == "2.3"


def test_of_nothing_there_is_no_figure() -> None:
    assert (figure(mean([])), figure(rms([])), percent([])) == ("-", "-", "-")
