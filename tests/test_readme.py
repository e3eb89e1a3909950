"""The README's example runs, and prints what the README says."""

from pathlib import Path

import pytest

from tests.printing import run_examples

ROOT = Path(__file__).parents[1]


def test_the_example_prints_what_stands_there(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    assert run_examples(ROOT / "README.md") == 1
