"""The examples in the documentation run, and print what stands there."""

from pathlib import Path

import pytest

from tests.printing import run_examples

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("page", "printing"), [("maintenance.md", 3), ("planning.md", 9), ("world.md", 0)]
)
def test_the_examples_print_what_stands_there(
    page: str, printing: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("models", "logs"):
        (tmp_path / folder).symlink_to(ROOT / folder)
    monkeypatch.chdir(tmp_path)
    assert run_examples(ROOT / "docs" / page) == printing
